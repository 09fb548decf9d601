// A few threads that share one loop of the step, over and over: the caller and its workers each
// begin with their own share of the items, and whoever is done takes pieces of a share that nobody
// has begun. So a worker that does not come (its processor is taken away) costs little: the caller
// does all. Which thread computes an item does not change its result, so results are the same for
// any number of threads, as long as items are independent.
//
// The caller neither locks nor allocates. It makes a system call only to wake a worker that has had
// nothing to do for TEAM_SPIN_NS and went to sleep.
#ifndef PLIANT_BASE_TEAM_H
#define PLIANT_BASE_TEAM_H

#include "base/status.h"

#include <pthread.h>
#include <stddef.h>
#include <stdint.h>

enum {
    TEAM_THREADS_MOST = 8,  // the caller included
    TEAM_SPIN_NS = 100000,  // a worker waits so long for the next loop before it sleeps
    TEAM_LATE_NS = 200000,  // the caller's patience with a piece that a worker has begun...
    TEAM_ALONE_LOOPS = 4000 // ...after which it does so many loops without help
};

typedef struct Team Team;

// Items first to last - 1. Called by several threads at a time, for disjoint items.
typedef void TeamWork(void *context, int first, int last);
// Called for each new worker, numbered from 1: to set its processor and priority.
typedef void TeamPlace(pthread_t thread, int worker);

// A team without workers: the caller does all. Load time; NULL when out of memory.
Team *team_create(int threads);
// Ends the workers. `team` may be NULL.
void team_destroy(Team *team);
// Starts workers, so that `threads` in all (but no more than asked for) share the loops. They
// inherit the floating-point modes of the calling thread. Not while team_run runs. False with a
// sentence: some did not start.
bool team_start(Team *team, int threads, TeamPlace *place, Status *status);
// Asked for, the caller included.
int team_threads(const Team *team);
// Memory of any team; the workers' stacks are the system's.
size_t team_bytes(void);

// Runs `work` over `count` items and returns when all are done.
void team_run(Team *team, TeamWork *work, void *context, int count);
// How often the caller had to wait for a worker beyond its patience.
int64_t team_late(const Team *team);

#endif
