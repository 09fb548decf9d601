// The step thread: one tick of the simulation at each deadline, or on command. Allocates nothing,
// locks nothing, logs nothing; its only system calls are the clock, the sleep and one eventfd write
// a tick. Ticks that come late are skipped and counted, never replayed in a burst.
#ifndef PLIANT_RUN_LOOP_H
#define PLIANT_RUN_LOOP_H

#include "base/histogram.h"
#include "files/scene.h"
#include "run/exchange.h"
#include "run/governor.h"

#include <pthread.h>

typedef struct LoopOptions {
    double rate_hz;
    ScenePublish publish;
    bool start_paused;
    bool estimate_error;
    double tool_timeout_s; // a stop for longer lets go of the tools
    double duration_s;     // simulated plus skipped time after which the loop ends; 0: never
    double checkpoint_s;   // simulated time between checkpoints; 0: none
} LoopOptions;

typedef struct Loop {
    // constant while the thread runs
    LoopOptions options;
    World *world;
    Sim *sim;
    Exchange *exchange;
    int64_t duration_ticks, checkpoint_ticks;
    int done_fd;    // written once when the loop ends
    bool governs;   // some body adapts its level of detail
    bool estimates; // the scene asks for the error of its steps

    // the thread's own
    RunState state;
    int64_t epoch_ns, slot; // deadline of slot k: epoch_ns + k / rate
    Input stepping;         // the STEP being executed
    int64_t stepped;        // its ticks so far
    int64_t away_ns; // by how much the last deadline was missed, when the tools are to be let go of
    int64_t beats;   // turns so far
    bool handed_over;                   // something waits for the bus
    Answer asked[EXCHANGE_CHECKPOINTS]; // who waits for the next checkpoint
    int asked_count;
    int64_t try_ns;        // the longest that a body's try has taken
    int64_t recorded_step; // newest frame handed to the recording
    Governor governor;

    // results, valid after loop_join (the windows only inside the thread)
    int64_t ticks, late_ticks;
    Histogram step_total, wake_total, step_window, wake_window;
    int64_t window_start_ns, window_start_step;
    int64_t window_stage_ns[STAGE_COUNT];
    pthread_t thread;
} Loop;

// Load time. `done_fd` is an eventfd that the caller polls; everything outlives the loop.
void loop_init(Loop *loop, World *world, Exchange *exchange, const LoopOptions *options,
               int done_fd);
// Starts the thread "pliant-step"; it ends after `exchange->stop`, STOP or the duration.
bool loop_start(Loop *loop, Status *status);
void loop_join(Loop *loop);

// Whether something that happens hz times a simulated second is due at the end of tick `step`.
// Integer arithmetic on millihertz: the same ticks in every run.
bool loop_due(int64_t step, double hz, double rate_hz);
// Whole ticks of a time; at least one for any time but 0.
int64_t loop_ticks(double seconds, double rate_hz);
// The step thread's own: hands the figures since the last status to the bus.
void loop_push_status(Loop *loop);
// "running", "paused", "lockstep".
const char *loop_state_name(RunState state);

#endif
