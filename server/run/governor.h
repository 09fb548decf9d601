// The time budget of a scene whose bodies adapt their level of detail: when ticks do not end in
// time, less detail, stage by stage, until they do; when there is room, back again. A pure function
// of the measured times: whoever calls it acts.
#ifndef PLIANT_RUN_GOVERNOR_H
#define PLIANT_RUN_GOVERNOR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum GovernorAct {
    GOVERNOR_RESTS,
    GOVERNOR_LOWERS, // a stage up: less detail
    GOVERNOR_RAISES, // a stage back
    GOVERNOR_SPENT,  // ticks do not end in time, and there is nothing left to lower; said once
} GovernorAct;

typedef struct Governor {
    // constant
    int window; // ticks to a decision
    int64_t busy_ns, room_ns;

    int ticks, busy, tight; // of the window so far: all, longer than busy_ns, longer than room_ns
    int stage;              // 0: all detail
    int top_level;          // finest in use when levels began to be lowered
    int calm;               // windows with room, in a row
    int patience;           // so many before a stage back
    int returned;           // windows since the last stage back
    bool spent;
    int64_t actions; // stages up and back, since the start
} Governor;

// What a stage means; SET's adapt_scale and adapt_level.
typedef struct GovernorSetting {
    double scale; // times the thresholds of refinement
    int level;    // finest that may be used
} GovernorSetting;

void governor_init(Governor *governor, double rate_hz);
// Back to stage 0, as after a RESET of the scene.
void governor_restart(Governor *governor);
// The loop stood still: what was measured of this window says nothing.
void governor_forget(Governor *governor);
// A tick took `ns`; the finest level that any body uses now.
GovernorAct governor_tick(Governor *governor, int64_t ns, int finest_level);
GovernorSetting governor_setting(const Governor *governor);
// What it has done and why, one sentence.
void governor_describe(const Governor *governor, GovernorAct act, char *text, size_t size);

#endif
