// SPDX-License-Identifier: MIT
// The step thread: one tick of the simulation at each deadline, or on command. It allocates, locks
// and logs nothing; its only system calls are the clock, the sleep and one eventfd write per tick.
// Late ticks are skipped and counted, never replayed in a burst (README.md, "A tick at its
// deadline").
#ifndef PLIANT_RUN_LOOP_H
#define PLIANT_RUN_LOOP_H

#include "base/clock.h"
#include "sim/sim.h"
#include "run/exchange.h"
#include "run/governor.h"
#include "run/ledger.h"
#include "scene/scene.h"

#include <pthread.h>
#include <stdio.h>

// What of a run the scene does not say.
typedef struct LoopOptions {
    // Simulated plus skipped time after which the loop ends; 0: by a signal or STOP.
    double duration_s;
    double record_tools_hz; // 0: tools are recorded with the nodes
    double checkpoint_s;    // simulated time between checkpoints; 0: at the end and on request
} LoopOptions;

typedef struct Loop {
    // constant while the thread runs
    LoopOptions options;
    const Scene *scene;
    World *world;
    Sim *sim;
    Exchange *exchange;
    int64_t duration_ticks, checkpoint_ticks;
    int done_fd;    // written once when the loop ends
    bool governs;   // some body adapts its level of detail
    bool estimates; // the scene enables the error estimate of the time steps

    // the thread's own
    RunState state;
    int64_t epoch_ns, slot;  // deadline of slot k: epoch_ns + k / rate
    Input stepping;          // the STEP being executed
    int64_t stepped;         // its ticks so far
    int64_t away_ns;         // how late the last deadline was, if tools must be released; else 0
    int64_t back_ns;         // when tools were released last
    int64_t beats;           // iterations and requests so far
    int64_t requests_due_ns; // earliest time for the next requests, by their share of the clock
    int64_t pause_arrival;   // of the newest PAUSE or STOP: earlier STEPs and RESUMEs are overtaken
    bool resumed;            // in this iteration: its first deadline is yet to come
    int64_t reset_step;      // when bodies were last reset, if untouched since; -1: none
    bool handed_over;        // data for the bus is waiting
    Answer asked[EXCHANGE_CHECKPOINTS]; // requests that the next checkpoint answers
    int asked_count;
    int64_t try_ns;        // longest time that a body's try has taken
    int64_t recorded_step; // newest frame handed to the recording
    LedgerClock ledger;
    int error_cycles;   // of the bodies' rounds, when errors were handed over last,
    int64_t error_step; // and the tick
    Governor governor;

    // results, valid after loop_join (the windows only inside the thread)
    int64_t ticks, late_ticks;
    Histogram step_total, wake_total, step_window, wake_window;
    int64_t window_start_ns, window_start_step;
    int64_t window_stage_ns[STAGE_COUNT];
    pthread_t thread;
} Loop;

// Initialises the loop at load time. The caller polls the eventfd `done_fd`. All arguments outlive
// the loop.
void loop_init(Loop *loop, World *world, const Scene *scene, Exchange *exchange,
               const LoopOptions *options, int done_fd);
// Starts the thread "pliant-step"; it ends after `exchange->stop`, STOP or the duration.
bool loop_start(Loop *loop, Status *status);
void loop_join(Loop *loop);

// True if something that happens `hz` times per simulated second is due at the end of tick `step`.
// Uses integer arithmetic in millihertz, so every run gives the same ticks.
bool loop_due(int64_t step, double hz, double rate_hz);
// Returns the whole ticks in a time; at least one for any time but 0.
int64_t loop_ticks(double seconds, double rate_hz);
// True if the loop must end; checked before each tick and each request.
bool loop_is_over(const Loop *loop);
// Step thread only: count an iteration, as the sign of life that other threads watch; hand the
// figures since the last status to the bus.
void loop_beat(Loop *loop);
void loop_push_status(Loop *loop);
// Returns "running", "paused" or "lockstep".
const char *loop_state_name(RunState state);

// The kind and text of the event that a grasper has grasped or released nodes.
enum { GRASP_TEXT = 64 };

static inline const char *grasp_kind(const GraspEvent *event)
{
    return event->nodes > 0 ? "grasp" : event->slipped ? "slipped" : "release";
}

static inline void grasp_text(const Sim *sim, const GraspEvent *event, char text[GRASP_TEXT])
{
    int id = sim_tool(sim, event->tool)->id;
    if (event->nodes == 0)
        snprintf(text, GRASP_TEXT, "tool %d %s", id,
                 event->slipped ? "lost what it held" : "released");
    else
        snprintf(text, GRASP_TEXT, "tool %d grasped %d %s", id, event->nodes,
                 event->points ? "points of faces" : "nodes");
}

#endif
