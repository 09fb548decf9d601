// Prints the result of a run at its end, as "name: value" lines for people and scripts. Main
// thread.
#ifndef PLIANT_RUN_REPORT_H
#define PLIANT_RUN_REPORT_H

#include "run/live.h"
#include "run/offline.h"

void report_live(World *world, const LiveResult *result, FILE *out);
void report_offline(World *world, const OfflineResult *result, FILE *out);

#endif
