// SPDX-License-Identifier: MIT
// What a program does with a scene: describes it, runs it live or offline, and reports the result.
// Main thread.
#ifndef PLIANT_RUN_MODES_H
#define PLIANT_RUN_MODES_H

#include "base/clock.h"
#include "run/bus.h"
#include "run/exchange.h"
#include "run/input_log.h"
#include "run/loop.h"
#include "run/realtime.h"
#include "scene/scene.h"

#include <signal.h>
#include <stdio.h>

// --- describing ----------------------------------------------------------------------------------

// Describes a scene and its cost as text, for --check, --explain and the answer to DESCRIBE. Main
// thread, before the first tick.

// Prints bodies, tools and publishing of a valid scene.
void explain_summary(World *world, const Scene *scene, FILE *out);
// Measures ticks: at rest, pressed by the scene's tools, of each body alone, with all faces of
// adaptive bodies at their finest level, and after cuts; prints medians with a verdict against the
// tick, and what to do about a scene that does not fit. Steps the world, which is of no use
// afterwards, and builds others with `options`; two seconds at most, or eight ticks of each.
// Returns false with `status` if a thread of the step did not start.
bool explain_time(World *world, const Scene *scene, const BuildOptions *options, FILE *out,
                  Status *status);
// Prints pipeline stages, kernel variants, the bytes of every array, and each feature: enabled or
// disabled, and the key or option that enables it. `asked`: of the live run that was reserved;
// NULL: offline.
void explain_plan(World *world, const Scene *scene, const ExchangeOptions *asked, FILE *out);
// Returns the number of nodes of all bodies.
int explain_nodes(World *world);
// Returns the summary with units and capacities, for clients; the caller frees it.
char *explain_describe(World *world, const Scene *scene);

// --- live ----------------------------------------------------------------------------------------

// The live daemon: starts and ends the step, bus and files threads and handles signals. Main
// thread.

typedef struct LiveOptions {
    const char *lcm_url; // or NULL: the scene's, else LCM's default
    const char *isa;     // instruction-set level of the kernels in use
    LoopOptions loop;
    const char *checkpoint_path; // or NULL
    const char *input_log_path;  // or NULL
    const char *record_path;     // or NULL
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
    Quota quota;
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

// --- offline -------------------------------------------------------------------------------------

// Runs a simulation without network or pacing: as fast as possible, with inputs from a log. One
// thread, the caller's.

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

// --- reporting -----------------------------------------------------------------------------------

// Prints the result of a run at its end, as "name: value" lines for people and scripts. Main
// thread.

void report_live(World *world, const LiveResult *result, FILE *out);
void report_offline(World *world, const OfflineResult *result, FILE *out);

#endif
