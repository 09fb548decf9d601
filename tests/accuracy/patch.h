// SPDX-License-Identifier: MIT
// Refines chosen parts of an adaptive body by hand.
#ifndef PLIANT_TESTS_ACCURACY_PATCH_H
#define PLIANT_TESTS_ACCURACY_PATCH_H

#include "run.h"
#include "surface/detail/detail.h"

// The adaptive body of a world.
Body *patch_body(World *world);
const Detail *patch_detail(World *world);
// Divides the leaves around a node until all of them are of `level`.
void patch_refine_around(World *world, const int *node, int count, int level);
// Takes all back: the body is wholly of level 0 again.
void patch_clear(World *world);
int patch_node_count(World *world);
int patch_valence(World *world, int node); // faces of level 0 around it
// Divides two faces of level 0 around a node that have an edge in common: then three of the edges
// there are halves of level 1.
void patch_refine_two_faces(World *world, int node);
// Two adjacent nodes with six faces each, ten together (Table 1's patch); false: there are none.
bool patch_find_pair(World *world, int pair[2]);

#endif
