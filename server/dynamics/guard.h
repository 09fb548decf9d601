// The guard: no number leaves the simulation unchecked. At the end of each tick a body whose
// numbers are not finite or out of bounds gets the last good state back, whose cause is found,
// counted and told; a tool or load that keeps being the cause is withdrawn. What a body's numbers
// are checked for is noted by its kernels in the tick's last pass (BodyOps.commit), so that a good
// tick costs next to nothing here.
#ifndef PLIANT_DYNAMICS_GUARD_H
#define PLIANT_DYNAMICS_GUARD_H

#include <stdint.h>

enum {
    // Bad ticks within GUARD_WINDOW that one tool or load is to blame for, before it is withdrawn.
    GUARD_MOST_BLAME = 3,
    // Bad ticks of a body, in a row or within GUARD_WINDOW, before it returns to its rest shape.
    GUARD_BAD_TICKS = 10,
};
#define GUARD_WINDOW 1.0 // [s] simulated; also between two words about one body

// Whom a bad tick of a body is put down to: the strongest of the tools and loads that acted on it
// or on what it is joined with; else what was SET last, if that was within GUARD_WINDOW; else a
// time step beyond its bound, which the scene called for.
typedef enum GuardCause {
    GUARD_TOOL, // touches or holds
    GUARD_LOAD,
    GUARD_SET,
    GUARD_TIME_STEP, // unsafe_time_step
    GUARD_UNKNOWN,   // nothing acted
    GUARD_CAUSE_COUNT,
} GuardCause;

// Since the start; a RESET of the scene changes nothing here.
typedef struct GuardCounts {
    int64_t restored[GUARD_CAUSE_COUNT]; // bodies, one after the other: sim_resets() is the sum
    int64_t rest_shapes;                 // of these, those that went back to their rest shape
    int64_t tools, loads;                // withdrawn
    int64_t wrenches;                    // withheld, since not fit to be felt
    int64_t figures;                     // of measurements, withheld
} GuardCounts;

// All counts one after the other, each with its name, as status_t has them: "restored_tool",
// "restored_load", "restored_set", "restored_time_step", "restored_unknown", "rest_shapes",
// "withdrawn_tools", "withdrawn_loads", "wrenches_withheld", "figures_withheld".
enum { GUARD_REASONS = GUARD_CAUSE_COUNT + 5 };
int64_t guard_reason(const GuardCounts *counts, int index, const char **name);

#endif
