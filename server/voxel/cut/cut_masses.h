// SPDX-License-Identifier: MIT
// The vertices of a cut body: creation of new ones, masses from the elements around, and
// conservation of momentum in divisions (README.md, "Momentum"). Step thread, except
// cut_masses_create.
#ifndef PLIANT_VOXEL_CUT_CUT_MASSES_H
#define PLIANT_VOXEL_CUT_CUT_MASSES_H

#include "base/sym3.h"
#include "body/vertices.h"
#include "voxel/cut/cut_lattice.h"
#include "voxel/template.h"

// The best affine fit of rows to their points, in cells.
typedef struct AffineFit {
    int element, origin[3];
    double count, first[3]; // of the points; first: their mean, once solved
    Sym3 second;
    double sum[8], moment[3][8], gradient[3][8]; // of each number of a row; sum: the mean
} AffineFit;

enum { RUN_ROWS = 32 }; // a multiple of what a kernel advances together

typedef struct CutMasses {
    // --- constant ---
    const CutLattice *lattice;
    TemplateCache *templates;
    Vertices *vertices;
    struct CutCarry *carry; // of a body that adapts, or NULL
    VoxelLaw law;
    double size;        // of a cell [m]
    double middle[3];   // of the lattice, in cells: origin of the rows
    const double *mass; // [level * materials + material - 1] mass of an element [kg]
    int material_count;
    const unsigned char
        *held; // [lattice point] bit s: the part that contains the cell in slot s is fixed there

    // --- follows from the lattice ---
    double (*share)[NODE_COUNT]; // [cut_lattice_row] of larger leaves: the part of its mass at
                                 // each node's vertex [kg]

    double *node_mass; // [vertex_capacity] that contacts see: of the finest cells of a vertex's
                       // part, whatever the leaves. The vertices' own unless the body adapts

    // Of a body that adapts: how many of each RUN_ROWS rows belong to vertices with elements, and
    // the runs of rows that move (Vertices.run).
    int *busy, (*run)[2];
    int run_used; // rows in use when these were listed

    int *retired, retired_count; // vertices without elements; NULL: cells cannot go

    // --- within a change ---
    int *touched; // vertices
    int *group;   // [vertex] link towards the lowest vertex that shares a changed element with it;
                  // -1: not touched
    int *next, *last;    // [vertex] next of the group; last one of a group, by its lowest
    double *mass_before; // [vertex] of touched ones
    int touched_count;
    AffineFit fit; // of the element whose corner came last
} CutMasses;

// Returns a coordinate of a lattice point at rest, in the rows' axes [m].
static inline double cut_masses_rest(const CutMasses *masses, int axis, int point)
{
    return masses->size * (point - masses->middle[axis]);
}
// Allocates the other fields after the constant ones are set.
void cut_masses_create(CutMasses *masses, const char *name, Arena *arena);
// Updates rows, rest positions and masses after changes of the lattice. `divided`: with divisions
// or merges among them, after which linear and angular momentum of the vertices around are
// restored, for each group of connected elements.
void cut_masses_follow(CutMasses *masses, bool divided);
// Recomputes rest positions and masses of all vertices; rows stay.
void cut_masses_derive(CutMasses *masses);
// True if a vertex is fixed: a carried one, if its point is.
bool cut_masses_is_fixed(const CutMasses *masses, int vertex);
// Brings free rows back to zero, of a body whose drag gives velocity to all rows that move.
void cut_masses_clear_free(const CutMasses *masses);
// Returns the largest distance by which a merge of an element that can merge would move a vertex of
// its children, in cells: from where its own vertices take it.
double cut_masses_residual(const CutMasses *masses, int element);

#endif
