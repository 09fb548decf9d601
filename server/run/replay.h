// Applies a log of inputs to a simulation offline. Messages of a plain log pass the same gate as
// live ones; those of an exact log passed it when they were recorded. Called by the thread that
// steps the simulation.
#ifndef PLIANT_RUN_REPLAY_H
#define PLIANT_RUN_REPLAY_H

#include "scene/build.h"
#include "run/gate.h"
#include "run/input_log.h"

// Receives what a live run would publish as an event; body -1: no body in particular.
typedef void ReplayReport(void *user, int body, const char *kind, const char *text);

typedef struct ReplayOptions {
    InputLogReader *input; // opened, or NULL: there is no log
    bool to_its_end;       // the run ends with the log, even if the log has no end mark
    bool any_rate;         // accept an exact log of another tick rate, by its times
    bool quiet;            // no warnings about inputs that were refused or do not fit
    ReplayReport *tell;    // or NULL
    void *user;
} ReplayOptions;

typedef struct Replay {
    World *world;
    Sim *sim;
    double rate_hz;
    ReplayOptions options;
    Gate gate;
    bool lockstep; // poses take effect at once
    bool stopped;  // by STOP
    bool ignored_pacing;
    int64_t first_step;
    int64_t end_step; // of the run; a log of applied inputs may bring it forward
    int64_t applied;
    // read ahead
    bool waiting;
    InputKind kind;
    int64_t waiting_step;
} Replay;

// Begins a replay. `end_step`: the end of the run if the log does not end it. Skips the part of an
// exact log that precedes the world's current step. Returns false with `status` if the log does not
// belong to this run.
bool replay_begin(Replay *replay, World *world, const Scene *scene, int64_t end_step,
                  const ReplayOptions *options, Status *status);
// Applies all inputs due at the start of the next tick.
void replay_due(Replay *replay);
// Warns about inputs of the log that were not used.
void replay_report(const Replay *replay);

#endif
