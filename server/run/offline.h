// Runs a simulation without network or pacing: as fast as possible, with inputs from a log. One
// thread, the caller's.
#ifndef PLIANT_RUN_OFFLINE_H
#define PLIANT_RUN_OFFLINE_H

#include "base/clock.h"
#include "scene/scene.h"
#include "run/input_log.h"

#include <signal.h>

typedef struct OfflineOptions {
    double seconds;              // simulated time; a log of applied inputs may end earlier
    bool to_log_end;             // run to the end of the input log instead
    InputLogReader *input;       // opened, or NULL
    const char *checkpoint_path; // or NULL
    double checkpoint_s;         // simulated time between checkpoints; 0: only at the end
    const char *record_path; // or NULL; written in step with the run, so that no frame is dropped
    double record_tools_hz;  // 0: with the nodes
    sigset_t signals;        // blocked: SIGINT, SIGTERM end the run, SIGUSR1 writes a checkpoint
} OfflineOptions;

typedef struct OfflineResult {
    int64_t ticks;
    int64_t applied, refused; // inputs of the log
    bool log_ended;           // the log was used up
    int64_t recorded;         // frames
    Histogram step;
} OfflineResult;

// Returns false with `status` if a file could not be read or completely written.
bool offline_run(World *world, const Scene *scene, const OfflineOptions *options,
                 OfflineResult *result, Status *status);

#endif
