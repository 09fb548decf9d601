// SPDX-License-Identifier: MIT
// The elements of a voxel body: the gradational-resolution layout and the layered element look-up
// table (Miyazaki et al. 2004, sections 2.3 and 3.1). Small elements at the surface, larger ones
// inside; two elements that share at least a corner differ by at most one level. All of it is a
// pure function of the lattice's labels.
#ifndef PLIANT_VOXEL_LAYOUT_H
#define PLIANT_VOXEL_LAYOUT_H

#include "base/check.h"
#include "geometry/lattice.h"

enum { VOXEL_LEVELS_MAX = 5 };

// An element: an aligned cube of 2^level cells.
typedef struct Leaf {
    int cell[3]; // its lowest cell
    unsigned char level;
    unsigned char material; // of all its cells, from 1
} Leaf;

typedef struct Layout {
    int levels; // coarsest level allowed; lower than requested when the lattice is too narrow
    int lattice_count[3]; // cells of the lattice
    int count[3];         // the same rounded up to multiples of 2^levels
    int leaf_count;
    Leaf *leaf;                     // by level, then along z, y, x
    int *lut[VOXEL_LEVELS_MAX + 1]; // [level][block of 2^level cells, x fastest]: leaf or -1
} Layout;

// Creates the layout bottom up: a block becomes one leaf when all its children are leaves of the
// level below and of one material, and all blocks of its size around it are such leaves too (of any
// material). So all cells that touch void, even at a corner only, stay leaves of level 0. O(cells)
// per level. malloc'ed; free with layout_destroy. Cannot fail for a lattice made by the functions
// of lattice.h; aborts when out of memory.
void layout_create(Layout *layout, const Lattice *lattice, int levels);
void layout_destroy(Layout *layout);
// Returns the leaf that covers a cell; -1: void or outside.
int layout_leaf_at(const Layout *layout, int i, int j, int k);

#endif
