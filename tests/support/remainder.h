// SPDX-License-Identifier: MIT
// The other way to arrange elements, by Miyazaki et al. 2004, section 2.3: a larger element keeps
// what was not carved out of it as one element of that shape, and is not divided as a whole. Only
// counted here, for comparison with voxel/layout.h and plane/layout.h; such elements are not
// simulated in space.
#ifndef PLIANT_TESTS_REMAINDER_H
#define PLIANT_TESTS_REMAINDER_H

#include "geometry/lattice.h"

// Counts the elements of every level, count[levels + 1], with levels up to `levels`. dimensions 3,
// or 2: the layer k = 0 alone. A block is aligned and has 2^level cells a side; its children have
// half the side. A child is carved out of its block, as an element
// of its own,
//   - if it is a cell that has void or another material next to it: across a face, an edge or a
//     corner in space, across an edge in the plane;
//   - if it is larger and not whole itself, or has finer elements next to it across a face (an edge
//     in the plane).
// The rest must be connected through faces; otherwise all children are carved.
void layout_count_remainder(const Lattice *lattice, int dimensions, int levels, long *count);

#endif
