// Tasks in processes of their own: each takes the next task from the parent over a pipe and sends a
// result of fixed size back. A child that dies or takes too long loses its task, not the others.
#ifndef PLIANT_STUDY_POOL_H
#define PLIANT_STUDY_POOL_H

#include "base/status.h"

#include <stddef.h>

// What `why` says of a task whose process was ended for taking too long.
#define POOL_TOO_LONG "took too long"

typedef struct Pool {
    int task_count;
    int jobs; // processes at a time; 1: everything in this process
    size_t result_bytes;
    double timeout_s; // of a task, real time; 0: none. Not with one job
    void *user;
    // Makes the result of a task; in a child. `result` is zeroed.
    void (*run)(void *user, int task, void *result);
    // A task is done, in the parent, in the order in which they end. result NULL: lost, `why`.
    void (*done)(void *user, int task, const void *result, const char *why);
} Pool;

bool pool_run(const Pool *pool, Status *status);

#endif
