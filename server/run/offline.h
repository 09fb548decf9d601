// The simulation without network and pacing: as fast as possible, inputs from a log. One thread,
// the caller's.
#ifndef PLIANT_RUN_OFFLINE_H
#define PLIANT_RUN_OFFLINE_H

#include "base/histogram.h"
#include "files/scene.h"
#include "run/input_log.h"

#include <signal.h>

typedef struct OfflineOptions {
    double seconds;              // simulated; a log of applied inputs may end earlier
    InputLogReader *input;       // opened, or NULL
    const char *checkpoint_path; // or NULL
    double checkpoint_s;         // simulated time between checkpoints; 0: only at the end
    const char *record_path; // or NULL; written in step with the run, so that nothing is dropped
    sigset_t signals;        // blocked: SIGINT, SIGTERM end the run, SIGUSR1 writes a checkpoint
} OfflineOptions;

typedef struct OfflineResult {
    int64_t ticks;
    int64_t applied, rejected; // inputs of the log
    int64_t recorded;          // frames
    Histogram step;
} OfflineResult;

// False with `status` when a file could not be read or written whole.
bool offline_run(World *world, const Scene *scene, const OfflineOptions *options,
                 OfflineResult *result, Status *status);

#endif
