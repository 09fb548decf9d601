// SPDX-License-Identifier: MIT
// A few threads that share the loops of a step: the caller and its workers each begin with their
// own share of the items, and a thread that has finished takes pieces of other shares that are not
// begun yet. So a worker that does not run (its processor is taken away) costs little: the caller
// does its work. Which thread computes an item does not change its result, so that results are the
// same for any number of threads, as long as items are independent.
//
// The caller neither locks nor allocates. Its only system call wakes a worker that was without work
// for TEAM_SPIN_NS and sleeps.
#ifndef PLIANT_BASE_TEAM_H
#define PLIANT_BASE_TEAM_H

#include "base/check.h"

#include <pthread.h>
#include <stddef.h>
#include <stdint.h>

enum {
    TEAM_THREADS_MOST = 8,  // the caller included
    TEAM_SPIN_NS = 100000,  // how long a worker spins for the next loop before it sleeps
    TEAM_LATE_NS = 200000,  // how long the caller waits for a piece that a worker has begun...
    TEAM_ALONE_MOST = 4000, // ...before it runs a loop without help; twice as many, up to this,
    TEAM_SOON_LOOPS = 128   // each time a worker is late again so soon
};

typedef struct Team Team;

// Processes items first to last - 1. Called by several threads at a time, for disjoint items.
typedef void TeamWork(void *context, int first, int last);
// Called for each new worker, numbered from 1, to set its processor and priority.
typedef void TeamPin(pthread_t thread, int worker);

// Creates a team for up to `threads` threads, at first without workers: the caller does all the
// work. Load time; NULL when out of memory.
Team *team_create(int threads);
// Stops and joins the workers. `team` may be NULL.
void team_destroy(Team *team);
// Starts workers until `threads` in all share the loops, at most the number of team_create. They
// inherit the floating-point modes of the calling thread. Not while team_run runs. False with
// `status` if a worker did not start.
bool team_start(Team *team, int threads, TeamPin *pin, Status *status);
// Returns the number of threads given to team_create, the caller included.
int team_threads(const Team *team);
// Returns the memory of any team in bytes, without the workers' stacks.
size_t team_bytes(void);

// Wakes workers that sleep, if there was a loop since the last call: the next ones will come within
// TEAM_SPIN_NS. `team` may be NULL.
void team_wake(Team *team);
// Runs `work` over `count` items and returns when all are done.
void team_run(Team *team, TeamWork *work, void *context, int count);
// Returns how often the caller waited for a worker longer than TEAM_LATE_NS.
int64_t team_late(const Team *team);

#endif
