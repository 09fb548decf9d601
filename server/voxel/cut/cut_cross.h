// SPDX-License-Identifier: MIT
// Where a blade met a link: what a smooth cut wall keeps of each broken face. Step thread.
#ifndef PLIANT_VOXEL_CUT_CUT_CROSS_H
#define PLIANT_VOXEL_CUT_CUT_CROSS_H

#include "body/cut_exact.h"
#include "voxel/cut/cut_centre.h"

#include <stdint.h>

// Of one broken face; plain data, part of the state.
typedef struct CutCrossing {
    uint16_t along; // from the centre of the cell to the one beyond, 0 to 2^16
    int16_t
        normal[3]; // of what the blade swept, in the lattice's axes at rest, unit times 2^15 - 1
} CutCrossing;

enum { CROSSING_ALONG = 1 << 16, CROSSING_UNIT = 32767 };

// Deformations of the leaves that were last asked for; many links share one. Begins with no leaf.
enum { CROSS_GRADIENTS = 64 };
typedef struct CrossGradients {
    int leaf[CROSS_GRADIENTS];            // plus 1; 0: none
    double column[CROSS_GRADIENTS][3][3]; // by axis at rest, in the rows' axes; up to a factor
} CrossGradients;

// Returns the crossing in the middle of a link, along the face: of tears.
CutCrossing cut_crossing_middle(int axis);
// Finds where an edge met a link in a sub-tick in which both moved; `link` from the cell to the one
// beyond. The centres give the cells' present deformation.
CutCrossing cut_crossing_find(const CellCentres *centres, CrossGradients *gradients,
                              const CutPath edge[2], const CutPath link[2], int cell, int axis);

// Returns the crossing at a share of a link, with this normal in the world.
CutCrossing cut_crossing_at(const CellCentres *centres, CrossGradients *gradients, double along,
                            Vec3 n, int cell, int axis);

#endif
