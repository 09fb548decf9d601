// SPDX-License-Identifier: MIT
// Runs tasks in child processes: each gets its next task from the parent over a pipe and returns a
// result of fixed size. A child that dies or takes too long loses its own task only.
#ifndef PLIANT_STUDY_POOL_H
#define PLIANT_STUDY_POOL_H

#include "base/check.h"

#include <stddef.h>

// Value of `why` for a task that was ended for taking too long.
#define POOL_TOO_LONG "took too long"

typedef struct Pool {
    int task_count;
    int jobs; // processes at a time; 1: everything in this process
    size_t result_bytes;
    double timeout_s; // real time per task; 0: unlimited. Not with one job
    void *user;
    // Computes the result of a task, in a child. `result` is zeroed.
    void (*run)(void *user, int task, void *result);
    // Receives a result in the parent, in order of completion. result NULL: lost, with reason
    // `why`.
    void (*done)(void *user, int task, const void *result, const char *why);
} Pool;

bool pool_run(const Pool *pool, Status *status);

#endif
