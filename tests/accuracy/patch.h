// Refines chosen parts of an adaptive body by hand.
#ifndef PLIANT_TESTS_ACCURACY_PATCH_H
#define PLIANT_TESTS_ACCURACY_PATCH_H

#include "run.h"
#include "surface/detail/detail.h"

// The adaptive body of a run.
Body *patch_body(Run *run);
const Detail *patch_detail(Run *run);
// Divides the leaves around a node until all of them are of `level`.
void patch_refine_around(Run *run, const int *node, int count, int level);
// Takes all back: the body is wholly of level 0 again.
void patch_clear(Run *run);
int patch_node_count(Run *run);
// Two adjacent nodes with six faces each, ten together (Table 1's patch); false: there are none.
bool patch_find_pair(Run *run, int pair[2]);

#endif
