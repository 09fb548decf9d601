// The connected pieces of a cuttable voxel body: cells that lead to one another through faces that
// are not broken. A function of the broken bits alone, whatever the elements. A piece is told by
// its smallest cell, which it keeps as long as it is whole; its number says in which order pieces
// came.
#ifndef PLIANT_VOXEL_CUT_CUT_PIECES_H
#define PLIANT_VOXEL_CUT_CUT_PIECES_H

#include "voxel/cut/cut_lattice.h"
#include "voxel/lattice_mesh.h"

enum { PIECE_SMALL = 4 }; // a piece of fewer cells is small

typedef struct CutPieces {
    const CutLattice *lattice;
    int cell_count; // elements of level 0

    // --- part of the state ---
    int *first;     // [cell_count] smallest cell of a piece, by its number; only ever appended
    int64_t *count; // of pieces

    // --- follows from it ---
    int *root;       // [cell] smallest cell of its piece
    int *number;     // [cell] of the piece of which it is the smallest, else -1
    int *size;       // [cell] cells of the piece of which it is the smallest
    int small_count; // pieces of fewer than PIECE_SMALL cells

    // --- scratch ---
    int *seen; // [cell] label of the search that found it; 0: none ever
    int *set;  // [label - first_label] towards the set that its search belongs to
    int *rest; // [cell] of a piece that has left another in this call, by its smallest cell: a cell
               // of the other; else -1
    int *left; // [left_count] such pieces
    int left_count;
    int *queue[2];           // [cell_count]
    int first_label, labels; // of this call
    int64_t visited;         // cells, by all searches so far
} CutPieces;

// Load time. Pieces of an uncut lattice are numbered as `mesh` numbers them.
void cut_pieces_create(CutPieces *pieces, const char *name, const CutLattice *lattice,
                       const LatticeMesh *mesh, const Layout *layout, Arena *arena,
                       StateList *state);
// After cut_lattice_break: the faces {cell, axis} that are newly broken. True when a piece came.
bool cut_pieces_follow(CutPieces *pieces, const int (*face)[2], int count);
static inline int cut_pieces_of(const CutPieces *pieces, int cell)
{
    return pieces->number[pieces->root[cell]];
}
// All that follows from the state, from scratch. False: numbers that cannot be (a checkpoint's);
// then pieces are numbered anew.
bool cut_pieces_derive(CutPieces *pieces);

#endif
