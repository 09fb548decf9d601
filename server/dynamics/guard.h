// The guard: no number leaves the simulation unchecked. At the end of each tick, a body whose
// numbers are not finite or out of bounds gets the last good state back; the cause is found,
// counted and reported; a tool or load that is the cause repeatedly is withdrawn. The body's
// kernels record the checks in the tick's last pass (BodyOps.commit), so that a good tick costs
// next to nothing here.
#ifndef PLIANT_DYNAMICS_GUARD_H
#define PLIANT_DYNAMICS_GUARD_H

#include <stdint.h>

enum {
    // Bad ticks caused by one tool or load within GUARD_WINDOW before it is withdrawn.
    GUARD_MOST_BLAME = 3,
    // Bad ticks of a body, consecutive or within GUARD_WINDOW, before it returns to its rest shape.
    GUARD_BAD_TICKS = 10,
};
#define GUARD_WINDOW 1.0 // [s] simulated; also the least time between two reports about one body

// Cause of a body's bad tick: the strongest of the tools and loads that acted on it or on bodies
// joined with it; else the last SET, if within GUARD_WINDOW; else an unsafe time step that the
// scene requires; else the strongest load that has ended, as long as the body has energy of it;
// else tools that gave it energy since the last check of energies.
typedef enum GuardCause {
    GUARD_TOOL, // touches or grasps
    GUARD_LOAD,
    GUARD_SET,
    GUARD_TIME_STEP, // unsafe_time_step
    GUARD_UNKNOWN,   // nothing acted
    GUARD_ENERGY,    // good numbers, but energy without a source
    GUARD_CAUSE_COUNT,
} GuardCause;

// Counts since the start; a RESET of the scene does not change them.
typedef struct GuardCounts {
    int64_t restored[GUARD_CAUSE_COUNT]; // bodies, each counted; sim_resets() is the sum
    int64_t rest_shapes;                 // of these, those that returned to their rest shape
    int64_t tools, loads;                // withdrawn
    int64_t wrenches;                    // withheld, because not fit to be published
    int64_t figures;                     // of measurements, withheld
} GuardCounts;

// All counts in order with their names, as in status_t: "restored_tool", "restored_load",
// "restored_set", "restored_time_step", "restored_unknown", "restored_energy", "rest_shapes",
// "withdrawn_tools", "withdrawn_loads", "wrenches_withheld", "figures_withheld".
enum { GUARD_REASONS = GUARD_CAUSE_COUNT + 5 };
int64_t guard_reason(const GuardCounts *counts, int index, const char **name);

#endif
