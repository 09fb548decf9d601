// SPDX-License-Identifier: MIT
// The connected pieces of a cuttable voxel body: cells that are connected through unbroken faces. A
// function of the broken bits alone, for any elements. A piece is identified by its smallest cell,
// which it keeps as long as it is intact; pieces are numbered in the order of their appearance.
#ifndef PLIANT_VOXEL_CUT_CUT_PIECES_H
#define PLIANT_VOXEL_CUT_CUT_PIECES_H

#include "voxel/cut/cut_lattice.h"
#include "voxel/lattice_mesh.h"

enum { PIECE_SMALL = 4 }; // a piece of fewer cells is small

// A cell that searches of a call have seen, and the label of the first of them.
typedef struct SeenCell {
    int cell, label;
} SeenCell;

typedef struct CutPieces {
    const CutLattice *lattice;
    int cell_count; // elements of level 0
    int most;       // pieces: each of them has a cell and, in a body that adapts, a vertex

    // --- part of the state ---
    int *first;     // [most] smallest cell of a piece, by its number; -1: all of it is gone
    int64_t *count; // number of pieces

    // --- derived from the state ---
    int *label;      // [cell] ~number of its piece: see cut_pieces_of
    int *size;       // [most] cells of a piece
    int small_count; // pieces of fewer than PIECE_SMALL cells
    int gone_count;  // numbers of pieces of which all cells are gone

    // --- scratch ---
    SeenCell *seen;            // [seen_mask + 1] by hash; of an earlier call: free
    int seen_mask, seen_shift; // every cell has a place of its own if that is 0
    int seen_count;            // in this call
    int *set;                  // [label - first_label] link towards the set of its search
    int *left;                 // [left_count] pieces that were found whole in this call,
    int *rest;                 // and of each a cell of the other piece
    int left_count;
    int came;             // pieces in this call, numbered after the others until it ends
    int *queue[2];        // cells found by the searches of a call
    unsigned char *going; // [cell] within a removal; NULL: cells cannot go
    int (*link)[2];       // [link_count] what cells that go connect
    int link_count;
    int first_label, labels; // of this call
    int64_t visited;         // number of cells visited by all searches
} CutPieces;

// Load time. Numbers the pieces of an uncut lattice as the mesh of `making` does.
void cut_pieces_create(CutPieces *pieces, const CutLattice *lattice, const VoxelMaking *making,
                       Arena *arena, StateList *state);
// Updates the pieces after cut_lattice_break with the newly broken faces {cell, axis}. True if a
// new piece appeared.
bool cut_pieces_follow(CutPieces *pieces, const int (*face)[2], int count);
// Returns the number of a cell's piece; -1: the cell is gone.
static inline int cut_pieces_of(const CutPieces *pieces, int cell)
{
    return ~pieces->label[cell];
}
// Returns the smallest cell of a cell's piece; of one that is gone itself.
static inline int cut_pieces_first(const CutPieces *pieces, int cell)
{
    const int number = cut_pieces_of(pieces, cell);
    return number < 0 ? cell : pieces->first[number];
}
// True if as many links may break, or cells go.
static inline bool cut_pieces_have_room(const CutPieces *pieces, int links)
{
    return pieces->most == pieces->cell_count || *pieces->count + links <= pieces->most;
}
// Cells that go: notes what is connected through them, before cut_lattice_remove, and updates the
// pieces after it. True if the number of any piece changed.
void cut_pieces_expect(CutPieces *pieces, const int *cell, int count);
bool cut_pieces_remove(CutPieces *pieces, const int *cell, int count);
// Returns how many pieces there are: numbers of which something is left.
static inline int cut_pieces_count(const CutPieces *pieces)
{
    return (int)*pieces->count - pieces->gone_count;
}
// Derives everything that follows from the state. False: impossible numbers (from a checkpoint);
// pieces are then numbered again.
bool cut_pieces_derive(CutPieces *pieces);

#endif
