// Functions shared by explain*.c alone.
#ifndef PLIANT_RUN_EXPLAIN_PARTS_H
#define PLIANT_RUN_EXPLAIN_PARTS_H

#include "run/modes.h"

// Prints the arrays and their bytes; `nodes`: the sum over all bodies.
void explain_arrays(World *world, int nodes, FILE *out);
// Prints every feature of the scene and of each body: whether it is enabled, and the key or option
// that enables it. `asked`: of a live run; NULL: offline.
void explain_features(World *world, const Scene *scene, const ExchangeOptions *asked, FILE *out);

#endif
