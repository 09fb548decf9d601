// SPDX-License-Identifier: MIT
// How thick a solid is, cell by cell, and which elements that leaves room for. Load time only.
#ifndef PLIANT_VOXEL_THICKNESS_H
#define PLIANT_VOXEL_THICKNESS_H

#include "geometry/lattice.h"

// Elements across the thickness: with fewer, lobes that bend are too stiff far from any tool.
enum { THICKNESS_ELEMENTS = 4 };

// Writes for each cell of the lattice the coarsest level, at most `levels`, of which
// THICKNESS_ELEMENTS elements fit across the solid there; 0 for void cells. The thickness at a cell
// is that of the largest ball of solid cells that holds it, within a cell. What reaches out of such
// a ball by less than an element, a sharp rim, counts as of the ball: it bends with it. A cell has
// the level of its block of 2^level cells if any cell of that does. O(cells) for each level.
void thickness_levels(const Lattice *lattice, int levels, unsigned char *level);

#endif
