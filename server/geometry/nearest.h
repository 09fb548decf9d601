// SPDX-License-Identifier: MIT
// Exact distances in a grid of cells: the nearest marked cell of each.
#ifndef PLIANT_GEOMETRY_NEAREST_H
#define PLIANT_GEOMETRY_NEAREST_H

#include <stdbool.h>

// Writes for each cell the index of the marked cell whose centre is nearest, of several any but
// always the same one; -1: none is marked. Cells are indexed x fastest. Linear in their number
// (Felzenszwalb and Huttenlocher, "Distance transforms of sampled functions", 2012). Load time.
void nearest_marked(const int count[3], const bool *marked, int *nearest);

#endif
