// Private to explain*.c.
#ifndef PLIANT_RUN_EXPLAIN_PARTS_H
#define PLIANT_RUN_EXPLAIN_PARTS_H

#include "run/explain.h"

// `nodes` of all bodies.
void explain_arrays(World *world, int nodes, FILE *out);
// Every feature of the scene and of each body, whether it is on, and the key or option that
// switches it on. `asked`: of a live run; NULL: off line.
void explain_features(World *world, const Scene *scene, const ExchangeOptions *asked, FILE *out);

#endif
