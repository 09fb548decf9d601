// SPDX-License-Identifier: MIT
// What the cases of the guard share.
#ifndef PLIANT_TESTS_BENCH_BENCH_GUARD_H
#define PLIANT_TESTS_BENCH_BENCH_GUARD_H

#include "bench.h"
#include "sim/sim.h"

// Least time of a tick [us], of many short runs by turns; 0: none yet.
typedef struct GuardTimes {
    double with, without; // the look at every number
} GuardTimes;

// Runs so many ticks and keeps the mean time of one if it is the least so far.
void bench_guard_time(Sim *sim, int ticks, double *least);
// The rows of one body; `stage_us`: the stage of the check, of the mean tick.
void bench_guard_rows(Bench *bench, const char *name, int size, const GuardTimes *times,
                      double stage_us);

#endif
