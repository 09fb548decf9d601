// What a scene is and what it costs, as text: --check, --explain and the answer to DESCRIBE. Before
// the first tick, main thread.
#ifndef PLIANT_RUN_EXPLAIN_H
#define PLIANT_RUN_EXPLAIN_H

#include "run/exchange.h"

#include <stdio.h>

// Bodies, tools and publishing of a valid scene.
void explain_summary(World *world, const Scene *scene, FILE *out);
// Stages, kernel variants, bytes of every array, and each feature, on or left out, with the key or
// option that switches it on. `asked`: of the live run that was reserved; NULL: off line.
void explain_plan(World *world, const Scene *scene, const ExchangeOptions *asked, FILE *out);
// The summary with units and capacities, for clients. malloc'ed for the caller.
char *explain_describe(World *world, const Scene *scene);

#endif
