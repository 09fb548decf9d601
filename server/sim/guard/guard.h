// SPDX-License-Identifier: MIT
// Private to the module sim: the memory of the guard, and what calls it.
#ifndef PLIANT_SIM_GUARD_H
#define PLIANT_SIM_GUARD_H

#include "sim/load.h"
#include "sim/sim_data.h"

// Ticks count from 1 here, so that 0 means never. All plain data, part of the state, and 0 until a
// tick is bad or a SET comes.
typedef struct GuardBody {
    Blame bad;          // bad ticks of the current window
    int64_t told;       // tick of the newest report about it
    int64_t unreported; // restores since that report
    int64_t set;        // tick of the newest SET
    int64_t set_key;    // number of its key (setting_name)
    Blame energy;       // restores because of energy without a source
    int64_t cause;      // GuardCause of the newest restore, during consecutive bad ticks
    int64_t loaded; // tick in which a load ended that left it excess energy, until that is gone; of
                    // several loads the strongest
    Vec3 load_force; // of that load [N]
} GuardBody;

// What a body's repeated returns to its rest shape led to. Plain data, part of the state.
typedef struct GuardFreeze {
    Blame shapes;  // returns of the current window
    int64_t since; // tick since which it has been frozen
} GuardFreeze;

// Limits of a body's energy: plain data, part of the state, though no motion depends on it unless
// it is exceeded.
typedef struct EnergyAccount {
    double had;    // at the last check, or less if that was explained [J]
    double outer;  // BodyMeasure.outer at that time [J]
    double given;  // by tools since then, at most [J]
    double touch;  // by contacts since then: work of tools and energy of their springs [J]
    double held;   // by contacts at that time, at most [J]
    int64_t known; // 0: unknown yet, or changed by something that is no work; else 1
} EnergyAccount;

typedef enum EnergyVerdict {
    ENERGY_RIGHT,
    ENERGY_WRONG_TOUCH,  // contacts gave more than they had
    ENERGY_WRONG_MOTION, // too much kinetic energy: velocities are set to zero
    ENERGY_WRONG_SHAPE,  // springs alone store too much
} EnergyVerdict;

typedef struct GuardTool {
    int64_t withdrawn; // 0 or 1
    int64_t pose;      // tick of the newest refused pose at that time
    Blame blame;
} GuardTool;

typedef struct Guard {
    GuardBody *body;       // [body_count]
    GuardFreeze *freeze;   // [body_count]
    GuardTool *tool;       // [tool_count]
    EnergyAccount *energy; // [body_count]
    int64_t window;        // ticks

    GuardCounts counts;
} Guard;

// A possible cause of a body's bad numbers.
typedef struct Suspect {
    GuardCause cause;
    int index;    // of the tool or load
    bool stays;   // cannot be withdrawn
    double force; // largest force of it [N]
    Vec3 point;   // its location; of tools
    bool holds;   // a tool that grasps the body
} Suspect;

// --- guard.c ---

// Load time, when all bodies and tools exist.
void guard_create(Sim *sim);
// True if the body as loaded can be simulated.
bool guard_can_be(const Body *body, Status *status);
// Keeps each body's result of the tick, or restores its last good state. Returns true if any was
// restored; its effect on tools is then discarded.
bool guard_bodies(Sim *sim);
// True for a body that takes no part in ticks until RESET.
static inline bool guard_is_frozen(const Sim *sim, int body)
{
    return sim->guard->freeze[body].since > 0;
}
// Sets a wrench that is not fit to be published to zero.
void guard_wrenches(Sim *sim);
// True if a pose may move its tool: not after a withdrawal, until its sender has released the tool.
bool guard_admits(Sim *sim, int tool, const ToolPose *pose);
// Records a SET by the number of its key. `body` -1: all.
void guard_note_set(Sim *sim, int body, int key);
// True if the state read from a checkpoint is consistent.
bool guard_check(const Sim *sim);

// --- settings.c ---

// Returns the name of a key of SET by its number, as GuardBody.set_key has it.
const char *setting_name(int64_t number);
// True for a number that a state may have.
bool setting_is_numbered(int64_t number);
// True if SET could have made all that it changes what it is.
bool settings_check(const Sim *sim);

// --- guard_energy.c ---

// Remembers loads that leave energy behind; call before they end.
void guard_note_loads(Sim *sim);
// True if contacts have given the body excess energy since the last check.
bool guard_was_pushed(const Sim *sim, int body);
// Returns the number of ticks between two checks of a body's energy.
int64_t guard_energy_ticks(const Body *body);
// Checks a body's energy after a good tick; sets what it has and the most that was there or given
// [J].
EnergyVerdict guard_energy(Sim *sim, int body, double *has, double *most);
// Restarts the account of a body, or (-1) of all, after a change that is no work.
void guard_renew(Sim *sim, int body);

// --- guard_blame.c ---

// Finds the cause of a body's bad numbers and describes it in `text`.
GuardCause guard_find_cause(const Sim *sim, int body, Suspect *suspect, char *text, size_t size);
// Counts one more bad tick; returns true if there are too many within the window.
bool guard_count(Blame *blame, int64_t tick, int64_t window, int most);
// Counts a bad tick for its cause and withdraws it if there are too many. Returns true if it was
// withdrawn.
bool guard_blame(Sim *sim, int body, const Suspect *suspect);

#endif
