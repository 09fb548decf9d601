// A log of inputs applied to a simulation off line: messages of a plain log pass the same gate as
// live ones, those of an exact log have passed it. The thread that steps the simulation.
#ifndef PLIANT_RUN_REPLAY_H
#define PLIANT_RUN_REPLAY_H

#include "files/build.h"
#include "run/gate.h"
#include "run/input_log.h"

// What is an event in a live run; body -1: of none.
typedef void ReplayTell(void *user, int body, const char *kind, const char *text);

typedef struct ReplayOptions {
    InputLogReader *input; // opened, or NULL: there is no log
    bool any_rate;         // an exact log of another tick rate is taken too: what it says of time
    bool quiet;            // no warnings of what was refused or does not fit
    ReplayTell *tell;      // or NULL
    void *user;
} ReplayOptions;

typedef struct Replay {
    World *world;
    Sim *sim;
    double rate_hz;
    ReplayOptions options;
    Gate gate;
    bool lockstep; // poses hold at once
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

// `end_step`: where the run ends if the log does not. Of an exact log that began before the world's
// present step, what is behind that state is passed over. False with `status`: a log that does not
// belong to this run.
bool replay_begin(Replay *replay, World *world, const Scene *scene, int64_t end_step,
                  const ReplayOptions *options, Status *status);
// Applies all inputs due at the start of the next tick.
void replay_due(Replay *replay);
// Warns of what of the log was not used.
void replay_report(const Replay *replay);

#endif
