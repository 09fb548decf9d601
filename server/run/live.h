// The live daemon: starts and ends the step, bus and files threads and handles signals. Main
// thread.
#ifndef PLIANT_RUN_LIVE_H
#define PLIANT_RUN_LIVE_H

#include "scene/scene.h"
#include "run/bus.h"
#include "run/loop.h"

#include <signal.h>

typedef struct LiveOptions {
    const char *lcm_url;         // or NULL: the scene's, else LCM's default
    const char *isa;             // instruction-set level of the kernels in use
    double duration_s;           // 0: until a signal or STOP
    const char *checkpoint_path; // or NULL
    double checkpoint_s;         // 0: only at the end and on request
    const char *input_log_path;  // or NULL
    const char *record_path;     // or NULL
    double record_tools_hz;      // 0: with the nodes
    sigset_t signals;            // blocked before any thread started
} LiveOptions;

typedef struct LiveResult {
    int64_t ticks, late_ticks, resets;
    int64_t governor_actions, governor_stage;
    Histogram step, wake;
    BusCounts bus;
    unsigned requests_high, contacts_high, events_high, answers_high, applied_high;
    int64_t lost;
    int64_t checkpoints;
    int64_t recorded, recorded_lost; // frames
    unsigned recorded_high;
} LiveResult;

typedef struct Live Live;

// Allocates, from the world's arena, all memory that a live run needs beside the world's. All
// arguments outlive the run. Load time.
Live *live_reserve(World *world, const Scene *scene, const LiveOptions *options);
// Returns the exchange options that a scene and these options require.
ExchangeOptions live_exchange(const Scene *scene, const LiveOptions *options);
// Runs once, until a signal, STOP or the duration ends it. Returns false with `status` if something
// could not be started or written.
bool live_run(Live *live, LiveResult *result, Status *status);

#endif
