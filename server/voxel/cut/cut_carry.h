// SPDX-License-Identifier: MIT
// Carried vertices of a body that adapts: those that are shown for ever (cut_lattice.h) while no
// element has them. Each is where the element around it takes it: trilinear between the vertices of
// an octant, absent ones by the template's rule, by which divisions place new vertices too. So a
// division moves none of them.
//
// Their own rows are zero. Where they are is computed element by element where somebody asks, once
// between two changes of what they follow from, into rows of their own (cut_carry_rows): a body has
// tens of thousands of them, of which a tick needs a few hundred. Everything that reads the row of
// a kept vertex is one of these:
// - nodes of contacts, holds and loads: cut_body_read, within a tick by weights;
// - searches for nodes: cut_faces_find_nodes, of elements that the region meets;
// - places before a change, of what comes back and of fades: cut_carry_before;
// - fades: cut_fit_fade.c, of the cells around a point;
// - what is shown and recorded: all of them, cut_carry_snapshot;
// - the potential of loads: find_loaded in voxel.c, of those with a load;
// - fibres of a tension: cut_carry_update_some, of their elements.
// Elements, blades, tears, heat, removers, adaptation, estimates and masses read vertices of
// elements. Bounds of motion need no others, since carried vertices are between these. Hashes and
// checkpoints hold zeros.
//
// Step thread, except cut_carry_create.
#ifndef PLIANT_VOXEL_CUT_CUT_CARRY_H
#define PLIANT_VOXEL_CUT_CUT_CARRY_H

#include "body/vertices.h"
#include "voxel/cut/cut_lattice.h"

enum { CARRY_SHARES = 16 }; // of an octant's edge: elements are of level 5 at most

// Where a vertex is in its element: between the points around it in an octant, along up to three
// axes, those along which it is between points first.
typedef struct CarrySite {
    signed char at[4];   // low corner, the next point along the first axis, along the second, along
                         // both; x + 3 y + 9 z. -1: it is not carried
    signed char above;   // steps to those above along the third; 0: it is not between points there
    unsigned char third; // share of the way to there, in parts of the octant's edge
    unsigned char shares;  // along the first, and CARRY_SHARES times that along the second
    unsigned char cell[3]; // from the low corner of the element
} CarrySite;

// Where a kept vertex was before a merge moved it: displacement in the rows' axes [m].
typedef struct CarryMove {
    int vertex;
    double from[3];
} CarryMove;

typedef struct CutCarry {
    const struct CutMasses *masses; // know rest positions
    const CutLattice *lattice;
    Vertices *vertices;
    // --- constant ---
    // Kept vertices, those of one element one after the other: a vertex belongs to the elements
    // around its lowest cell at load.
    int vertex_count, *vertex; // [vertex_count], and more that are fetched ahead in vain
    int *cell;                 // [vertex_count]
    int *rank;                 // [kept_end] its place in `vertex`; -1: it is not kept
    int *first, *end;          // [element - level_first[1]] its part of these
    // --- derived from the lattice ---
    int *leaf_of;       // [kept_end] the element; -1: not carried
    CarrySite *site;    // [vertex_count] where it is carried
    float (*weight)[4]; // [shares] constant: of the four points of a site; exact
    unsigned *need;     // [cut_lattice_row] bit m: its vertices follow from middle m
    int *place;         // [cut_lattice_row] in `leaf`; -1: it is not there
    int *leaf;          // leaves with carried vertices, in no order that matters
    int leaf_count;
    // --- derived from the rows of elements' vertices ---
    void *row;            // Real [kept_end][ROW] where carried vertices are (rows.h)
    unsigned *known, now; // [cut_lattice_row] of its carried vertices that is so: now
    // --- of the current change ---
    CarryMove *move; // [kept_end] NULL: nobody wants to know
    int *moved;      // [kept_end] 1 + its place in `move`; 0: it is not there
    int move_count;
    // --- scratch ---
    unsigned *seen, stamp; // [cut_lattice_row]; the stamp goes round in days
} CutCarry;

// Load time.
void cut_carry_create(CutCarry *carry, const struct CutMasses *masses, const char *name,
                      Arena *arena);
// Lists again what is carried, after the lattice was derived.
void cut_carry_derive(CutCarry *carry);
// Load time. From now on lists, in `move`, the kept vertices that a merge moves, until
// cut_carry_forget_moves.
void cut_carry_want_moves(CutCarry *carry, const char *name, Arena *arena);
// Call it before the row of a vertex changes in a merge.
void cut_carry_note_move(CutCarry *carry, int vertex);
void cut_carry_forget_moves(CutCarry *carry);
// Finds out where the vertices are that an element, or its children, and the leaves around carry,
// before it is divided or they merge: some of them come back, and merges move some.
void cut_carry_before(CutCarry *carry, int element);
// Sets the row of a vertex that is no longer carried to where it was: one that was until the
// current change, or within it. False: that is unknown.
bool cut_carry_give_back(CutCarry *carry, int vertex);
// Updates the lists after changes of the lattice.
void cut_carry_follow(CutCarry *carry);
// Returns the number of carried vertices.
int cut_carry_count(const CutCarry *carry);
// Call it when rows of elements' vertices have changed.
static inline void cut_carry_forget(CutCarry *carry)
{
    carry->now++; // goes round in days
}
// Finds out where the vertices of a carrying element are, between ticks.
void cut_carry_find(CutCarry *carry, int leaf);
// Writes places [m] and, unless NULL, velocities of all carried vertices, between ticks, at
// to[vertex], as rows_snapshot does of others, and after that.
void cut_carry_snapshot(const CutCarry *carry, const int *to, float *position, float *velocity);
// Returns the rows that tell between ticks where a vertex is: `row`, unless it is carried.
static inline const void *cut_carry_rows(CutCarry *carry, const void *row, int vertex)
{
    if (carry == NULL || vertex >= carry->lattice->kept_end || carry->leaf_of[vertex] < 0)
        return row;
    const int leaf = carry->leaf_of[vertex];
    if (carry->known[cut_lattice_row(carry->lattice, leaf)] != carry->now)
        cut_carry_find(carry, leaf);
    return carry->row;
}

// Lists the elements of those of some vertices that are carried, each once, in leaf [count];
// returns their number. Computes where these elements' vertices are by `row`, also within a tick.
int cut_carry_list(CutCarry *carry, const int *vertex, int count, int *leaf);
void cut_carry_update_some(CutCarry *carry, const void *row, const int *leaf, int count);
// Moves the forces (Real [vertex][4]) on those of some vertices that are carried to what carries
// them.
void cut_carry_spread(const CutCarry *carry, void *force, const int *vertex, int count);

// Finds the vertices of a leaf of level 1 or more that a point of it, in cells, follows from, and
// their weights, which add up to 1. Returns their number, at most NODE_COUNT. Carried vertices do
// not matter.
int cut_carry_weights_at(const CutLattice *lattice, int leaf, const int point[3],
                         FitWeight weight[NODE_COUNT]);
// The same of a carried vertex.
static inline int cut_carry_weights(const CutCarry *carry, int vertex, FitWeight weight[NODE_COUNT])
{
    int point[3];
    cut_lattice_point(carry->lattice, vertex, point);
    return cut_carry_weights_at(carry->lattice, carry->leaf_of[vertex], point, weight);
}

// --- finest cells around a point, whatever the leaves ---
// Returns the slots of the finest cells around a point that hold together with the one in a slot,
// across faces that are not open; 0: it is void or gone. Finds the cells in all slots.
unsigned cut_carry_cells(const CutLattice *lattice, const int point[3], int slot, int cell[8]);
// Returns the vertex at a corner of a finest cell, also while a larger leaf covers the cell: it is
// carried then, unless it is a vertex of that leaf. -1: none, inside of the leaf.
int cut_carry_corner(const CutLattice *lattice, int cell, int corner);

#endif
