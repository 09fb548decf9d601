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
#include "scene/scene.h"

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

// --- the governor --------------------------------------------------------------------------------

// Keeps ticks within their time budget in scenes whose bodies adapt their level of detail. When
// ticks end late, it lowers the detail in steps until they end in time; when time is
// left, it raises it again. A pure function of the measured times: the caller carries out the
// decision.

typedef enum GovernorAct {
    GOVERNOR_RESTS,
    GOVERNOR_LOWERS, // one reduction more: less detail
    GOVERNOR_RAISES, // one reduction less: more detail
    GOVERNOR_SPENT,  // ticks end late, and no reduction is left; reported once
} GovernorAct;

typedef struct Governor {
    // constant
    int window; // ticks per decision
    int64_t busy_ns, spare_ns;

    int ticks, busy,
        tight;     // ticks of the window so far: all, longer than busy_ns, longer than spare_ns
    int reduction; // 0: full detail
    int top_level; // finest level in use when levels began to be lowered
    int calm;      // consecutive windows with time left
    int patience;  // such windows needed before one reduction less
    int returned;  // windows since there was last one less
    bool spent;
    int64_t actions; // changes since the start
} Governor;

// The meaning of a reduction: values of SET's adapt_scale and adapt_level.
typedef struct GovernorSetting {
    double scale; // factor on the thresholds of refinement
    int level;    // finest level allowed
} GovernorSetting;

void governor_init(Governor *governor, double rate_hz);
// Returns to reduction 0, as after a RESET of the scene.
void governor_restart(Governor *governor);
// Discards the current window, because the loop stood still.
void governor_forget(Governor *governor);
// Takes the duration of a tick [ns] and the finest level that any body uses now; returns the
// decision.
GovernorAct governor_tick(Governor *governor, int64_t ns, int finest_level);
GovernorSetting governor_setting(const Governor *governor);
// Writes one sentence on what the governor did and why.
void governor_describe(const Governor *governor, GovernorAct act, char *text, size_t size);

// --- the thread ----------------------------------------------------------------------------------

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
    bool estimates; // the scene enables the error estimate

    // the thread's own
    RunState state;
    int64_t epoch_ns, slot;  // deadline of slot k: epoch_ns + k / rate
    Input stepping;          // the STEP being executed
    int64_t stepped;         // its ticks so far
    int64_t away_ns;         // how late the last deadline was, if tools must be released; else 0
    int64_t beats;           // iterations and requests so far
    int64_t requests_due_ns; // earliest time for the next requests, by their share of the clock
    int64_t reset_step;      // when bodies were last reset, if untouched since; -1: none
    bool handed_over;        // data for the bus is waiting
    Answer asked[EXCHANGE_CHECKPOINTS]; // requests that the next checkpoint answers
    int asked_count;
    int64_t try_ns;        // longest time that a body's try has taken
    int64_t recorded_step; // newest frame handed to the recording
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

// --- requests ------------------------------------------------------------------------------------

// Executes the requests of other programs on a running scene. Called by the step thread between two
// ticks; offline runs call requests_execute too. Allocates nothing.

// Executes the waiting requests in order and answers each, within their share of the clock: ticks
// with a rate to keep get at least half of it, and the other requests stay in the ring. Returns
// true if the next request is a STEP: the caller runs its ticks, then calls requests_finish_step.
bool requests_take(Loop *loop);
void requests_finish_step(Loop *loop);

// Takes a checkpoint image if one is due and the last one has been written.
void requests_checkpoint(Loop *loop);
// Waits for the last image to be written and takes the final one; called at the end of the loop.
void requests_last_checkpoint(Loop *loop);

// Records an input as applied at the current tick, for --log-inputs.
void requests_log(Loop *loop, const Input *input);
// The governor of the time budget, in scenes with adaptive bodies. requests_govern runs at the end
// of each real-time tick, which took `tick_ns`; requests_release restores full detail when no time
// is measured. Their changes are SETs, logged like a client's.
void requests_govern(Loop *loop, int64_t tick_ns);
void requests_release(Loop *loop);
// Sends the bus an event; body -1: none in particular.
void requests_event(Loop *loop, int body, const char *kind, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

// Sends the bus the events of the simulation itself: strokes, tears, pieces.
void requests_report(Loop *loop);

// True for what requests_execute knows: cuts, loads, ties, SET and RESET. Other commands are the
// loop's.
bool requests_change_scene(const Input *input);
// Executes a cut, load, RESET or SET on the scene, live or offline. Sets `ok`, `text` and the
// counts of a cut in the answer; returns `ok`. If false, nothing was changed and `text` says why;
// else `text` says what was done.
bool requests_execute(Sim *sim, const Input *input, Answer *answer);

// --- events of graspers --------------------------------------------------------------------------

// The kind and text of the event that a grasper has grasped or released nodes.

enum { GRASP_TEXT = 64 };

static inline const char *grasp_kind(const GraspEvent *event)
{
    return event->nodes > 0 ? "grasp" : "release";
}

static inline void grasp_text(const Sim *sim, const GraspEvent *event, char text[GRASP_TEXT])
{
    int id = sim_tool(sim, event->tool)->id;
    if (event->nodes == 0)
        snprintf(text, GRASP_TEXT, "tool %d released", id);
    else
        snprintf(text, GRASP_TEXT, "tool %d grasped %d %s", id, event->nodes,
                 event->points ? "points of faces" : "nodes");
}

#endif
