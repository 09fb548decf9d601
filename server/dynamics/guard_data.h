// Private to the dynamics room: what the guard remembers.
#ifndef PLIANT_DYNAMICS_GUARD_DATA_H
#define PLIANT_DYNAMICS_GUARD_DATA_H

#include "base/vec.h"
#include "dynamics/guard.h"
#include "dynamics/load.h"

// Ticks are counted from 1 here, so that 0 says never. All plain data, part of the state, and all 0
// until something is bad or SET.
typedef struct GuardBody {
    Blame bad;       // bad ticks of the running window
    int64_t told;    // tick of the newest word about it
    int64_t untold;  // restores since
    int64_t set;     // tick of the newest SET
    int64_t set_key; // what it was about
} GuardBody;

typedef struct GuardTool {
    int64_t withdrawn; // 0 or 1
    int64_t pose;      // then: tick of the newest pose that was not admitted
    Blame blame;
} GuardTool;

typedef struct Guard {
    GuardBody *body; // [body_count]
    GuardTool *tool; // [tool_count]
    int64_t window;  // ticks

    GuardCounts counts;
} Guard;

// What may have made a body's numbers bad.
typedef struct Suspect {
    GuardCause cause;
    int index;    // of the tool or load
    bool stays;   // cannot be withdrawn
    double force; // what it can have pushed with [N]
    Vec3 point;   // where; of tools
    bool holds;   // a tool that holds the body
} Suspect;

// Counts one more bad tick; true: too many within the window.
bool guard_count(Blame *blame, int64_t tick, int64_t window, int most);

// What SET can be about, by GuardBody.set_key.
const char *guard_key(int64_t key);
enum { GUARD_KEYS = 8 };

#endif
