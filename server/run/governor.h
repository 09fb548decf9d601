// SPDX-License-Identifier: MIT
// Keeps ticks within their time budget in scenes whose bodies adapt their level of detail. When
// ticks end late, it lowers the detail in steps until they end in time; when time is left, it
// raises it again. A pure function of the measured times: the caller carries out the decision.
#ifndef PLIANT_RUN_GOVERNOR_H
#define PLIANT_RUN_GOVERNOR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum GovernorAct {
    GOVERNOR_RESTS,
    GOVERNOR_LOWERS, // one reduction more: less detail
    GOVERNOR_RAISES, // one reduction less: more detail
    GOVERNOR_SPENT,  // ticks end late, and no reduction is left; reported once
} GovernorAct;

typedef struct Governor {
    // constant
    int64_t period_ns, window_ns; // a decision per window, by the clock
    int64_t busy_ns, spare_ns;

    int64_t begin_ns;       // of the window
    int ticks, busy, tight; // in it so far: all, longer than busy_ns, than spare_ns
    int counted;            // ticks of the last whole window
    int reduction;          // 0: full detail
    int top_level;          // finest level in use when levels began to be lowered
    int calm;               // consecutive windows with time left
    int patience;           // such windows needed before one reduction less
    int returned;           // windows since there was last one less
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
// Takes when a tick began and its duration [ns], and the finest level that any body uses now;
// returns the decision.
GovernorAct governor_tick(Governor *governor, int64_t begin_ns, int64_t ns, int finest_level);
GovernorSetting governor_setting(const Governor *governor);
// Writes one sentence on what the governor did and why.
void governor_describe(const Governor *governor, GovernorAct act, char *text, size_t size);

#endif
