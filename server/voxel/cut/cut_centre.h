// SPDX-License-Identifier: MIT
// The centres of finest cells: the mean of a cell's 8 corners; inside a larger element, of the
// corners that dividing it would create, so that a division moves no centre. Step thread.
#ifndef PLIANT_VOXEL_CUT_CUT_CENTRE_H
#define PLIANT_VOXEL_CUT_CUT_CENTRE_H

#include "body/rows.h"
#include "geometry/box.h"
#include "voxel/cut/cut_lattice.h"

// A view of one state of the rows.
typedef struct CellCentres {
    const CutLattice *lattice;
    const Rows *rows;
    const void *row;
    double turn[3][3], shift[3]; // from the rows' coordinates to the world
    // Points of the element of each level that was last used, x + 3 y + 9 z; -1: none.
    int element[VOXEL_LEVELS_MAX + 1];
    Vec3 point[VOXEL_LEVELS_MAX + 1][27];
} CellCentres;

// Fills in absent middles of an element's points, x + 3 y + 9 z: of an edge, between its ends; of a
// face, between those of its edges; the centre, between the corners, which must be there. `there`:
// one bit per present point.
void cut_fill_middles(Vec3 point[27], unsigned there);

void cut_centres_begin(CellCentres *centres, const CutLattice *lattice, const Rows *rows,
                       const void *row);
// Returns a cell's centre in the world frame [m].
Vec3 cut_centre(CellCentres *centres, int cell);
Vec3 cut_centres_vertex(const CellCentres *centres, int vertex); // likewise
// Extends a box in the rows' coordinates by the vertices of the leaf that covers a cell; if the
// cell is that leaf, by those of the given corners (one bit each).
void cut_centres_grow(const CellCentres *centres, int cell, unsigned corners, Box *box);

#endif
