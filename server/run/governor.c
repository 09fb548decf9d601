// SPDX-License-Identifier: MIT
#include "run/governor.h"

#include "geometry/levels.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

// Thresholds come first, since they remove detail where it matters least; then whole levels.
static const double scales[] = {1.0, 2.0, 4.0, 8.0};
enum { LAST_SCALE = sizeof scales / sizeof *scales - 1 };

// One decision per window, so that the effect of a reduction shows in the times.
// By the clock: ticks that are much too long would take as many times longer to be counted.
static const double WINDOW = 0.25; // [s]
enum { LEAST_PERIODS = 20, LEAST_TICKS = 2 };
// Share of ticks that may be longer: the limits apply to the 95th percentile. One may always be.
static const double LATE = 0.05;
static const double BUSY = 0.9; // of the period: above, ticks end late
// Below, time is left. Far from BUSY, since taking one back may add half of the cost or more.
static const double SPARE = 0.5;
// Windows with time left before one is taken back; doubled each time that this was
// reversed at once, up to half a minute.
enum { PATIENCE = 8, MOST_PATIENCE = 128 };

void governor_init(Governor *governor, double rate_hz)
{
    memset(governor, 0, sizeof *governor);
    governor->period_ns = (int64_t)(1e9 / rate_hz);
    governor->window_ns = (int64_t)(1e9 * fmax(WINDOW, LEAST_PERIODS / rate_hz));
    governor->busy_ns = (int64_t)(BUSY * 1e9 / rate_hz);
    governor->spare_ns = (int64_t)(SPARE * 1e9 / rate_hz);
    governor_restart(governor);
}

void governor_forget(Governor *governor)
{
    governor->ticks = governor->busy = governor->tight = 0;
}

void governor_restart(Governor *governor)
{
    governor_forget(governor);
    governor->reduction = governor->calm = 0;
    governor->patience = PATIENCE;
    governor->returned = MOST_PATIENCE;
    governor->spent = false;
}

GovernorSetting governor_setting(const Governor *governor)
{
    int lowered = governor->reduction - LAST_SCALE;
    if (lowered <= 0)
        return (GovernorSetting){.scale = scales[governor->reduction], .level = LEVELS_MAX};
    return (GovernorSetting){.scale = scales[LAST_SCALE], .level = governor->top_level - lowered};
}

static GovernorAct lower(Governor *governor, int finest_level)
{
    governor->calm = 0;
    // Detail that came back too early is tried less often.
    if (governor->returned <= PATIENCE && governor->patience < MOST_PATIENCE)
        governor->patience *= 2;
    governor->returned = MOST_PATIENCE;
    // From here on levels go, one by one; when only the coarsest is left nothing more helps.
    if (governor->reduction == LAST_SCALE)
        governor->top_level = finest_level;
    if (governor->reduction >= LAST_SCALE &&
        governor->reduction - LAST_SCALE == governor->top_level) { // only level 0 is left
        bool again = governor->spent;
        governor->spent = true;
        return again ? GOVERNOR_RESTS : GOVERNOR_SPENT;
    }
    governor->reduction++;
    governor->actions++;
    return GOVERNOR_LOWERS;
}

static GovernorAct raise(Governor *governor)
{
    governor->calm = 0;
    governor->returned = 0;
    governor->spent = false;
    governor->reduction--;
    governor->actions++;
    return GOVERNOR_RAISES;
}

GovernorAct governor_tick(Governor *governor, int64_t begin_ns, int64_t ns, int finest_level)
{
    // Count until the window is full; a tick takes its period at least.
    const int64_t end_ns = begin_ns + (ns > governor->period_ns ? ns : governor->period_ns);
    if (governor->ticks == 0)
        governor->begin_ns = begin_ns;
    governor->ticks++;
    governor->busy += ns > governor->busy_ns;
    governor->tight += ns > governor->spare_ns;
    if (end_ns - governor->begin_ns < governor->window_ns - governor->period_ns / 2 ||
        governor->ticks < LEAST_TICKS)
        return GOVERNOR_RESTS;
    // Some late ticks are no sign: the machine has other things to do.
    governor->counted = governor->ticks;
    int may_be_late = (int)fmax(1.0, LATE * governor->ticks);
    bool busy = governor->busy > may_be_late, spare = governor->tight <= may_be_late;
    governor_forget(governor);

    if (governor->returned < MOST_PATIENCE && ++governor->returned == MOST_PATIENCE)
        governor->patience = PATIENCE; // taking it back lasted
    if (busy)
        return lower(governor, finest_level);
    // More detail after several calm windows in a row.
    governor->calm = spare ? governor->calm + 1 : 0;
    return governor->reduction > 0 && governor->calm >= governor->patience ? raise(governor)
                                                                           : GOVERNOR_RESTS;
}

void governor_describe(const Governor *governor, GovernorAct act, char *text, size_t size)
{
    GovernorSetting setting = governor_setting(governor);
    double limit = 1e-6 * (double)(act == GOVERNOR_RAISES ? governor->spare_ns : governor->busy_ns);
    const char *relation = act == GOVERNOR_RAISES ? "within" : "over";
    char what[64];
    // By the keys of SET. Levels are lowered last, so a limited level is the newest change.
    if (act == GOVERNOR_SPENT)
        snprintf(what, sizeof what, "nothing is left to lower");
    else if (setting.level < LEVELS_MAX)
        snprintf(what, sizeof what, "adapt_level %d", setting.level);
    else
        snprintf(what, sizeof what, "adapt_scale %g", setting.scale);
    snprintf(text, size, "p95 of %d ticks %s %.3g ms: %s", governor->counted, relation, limit,
             what);
}
