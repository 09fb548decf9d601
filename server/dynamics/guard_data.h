// Private to the dynamics module: the guard's memory.
#ifndef PLIANT_DYNAMICS_GUARD_DATA_H
#define PLIANT_DYNAMICS_GUARD_DATA_H

#include "base/vec.h"
#include "dynamics/guard.h"
#include "dynamics/load.h"

// Ticks count from 1 here, so that 0 means never. All plain data, part of the state, and 0 until a
// tick is bad or a SET comes.
typedef struct GuardBody {
    Blame bad;          // bad ticks of the current window
    int64_t told;       // tick of the newest report about it
    int64_t unreported; // restores since that report
    int64_t set;        // tick of the newest SET
    int64_t set_key;    // key of that SET
    Blame energy;       // restores because of energy without a source
    int64_t cause;      // GuardCause of the newest restore, during consecutive bad ticks
    int64_t loaded; // tick in which a load ended that left it excess energy, until that is gone; of
                    // several loads the strongest
    Vec3 load_force; // of that load [N]
} GuardBody;

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

// Counts one more bad tick; returns true if there are too many within the window.
bool guard_count(Blame *blame, int64_t tick, int64_t window, int most);

// Returns the name of a key of SET, by GuardBody.set_key.
const char *guard_key(int64_t key);
enum { GUARD_KEYS = 8 };

#endif
