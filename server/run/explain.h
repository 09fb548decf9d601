// Describes a scene and its cost as text, for --check, --explain and the answer to DESCRIBE. Main
// thread, before the first tick.
#ifndef PLIANT_RUN_EXPLAIN_H
#define PLIANT_RUN_EXPLAIN_H

#include "run/exchange.h"

#include <stdio.h>

// Prints bodies, tools and publishing of a valid scene.
void explain_summary(World *world, const Scene *scene, FILE *out);
// Prints pipeline stages, kernel variants, the bytes of every array, and each feature: enabled or
// disabled, and the key or option that enables it. `asked`: of the live run that was reserved;
// NULL: offline.
void explain_plan(World *world, const Scene *scene, const ExchangeOptions *asked, FILE *out);
// Returns the summary with units and capacities, for clients; the caller frees it.
char *explain_describe(World *world, const Scene *scene);

#endif
