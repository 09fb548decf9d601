// SPDX-License-Identifier: MIT
// The figures of a certificate of touch: one row each, with its unit and bar, and what computes
// them from the curves of a trial. Pure functions; any thread.
#ifndef PLIANT_TOUCH_FIGURES_H
#define PLIANT_TOUCH_FIGURES_H

#include "base/vec.h"

#include <stdbool.h>

// In the order of the table.
typedef enum FigureId {
    FIGURE_FORCE,
    FIGURE_STIFFNESS,
    FIGURE_FREE,
    FIGURE_PRESS_TICK,
    FIGURE_PRESS_WAY,
    FIGURE_PRESS_FALL,
    FIGURE_PRESS_ENERGY,
    FIGURE_HOLD_PEAK,
    FIGURE_HOLD_RMS,
    FIGURE_HOLD_SHARE,
    FIGURE_RISE,
    FIGURE_TOLD,
    FIGURE_LIFT_FORCE,
    FIGURE_LIFT_SHAPE,
    FIGURE_SLIDE_RATIO,
    FIGURE_SLIDE_ERROR,
    FIGURE_DRAG_PEAK,
    FIGURE_DRAG_TICK,
    FIGURE_DRAG_ENERGY,
    FIGURE_DRAG_FORCE,
    FIGURE_STREAM_NOISE,
    FIGURE_STREAM_TICK,
    FIGURE_LOOP_ENERGY,
    FIGURE_LOOP_TICK,
    FIGURE_BARE_ENERGY,
    FIGURE_BARE_TICK,
    FIGURE_WIDTH_1,
    FIGURE_WIDTH_4,
    FIGURE_WIDTH_10,
    FIGURE_WIDTH_GUARD,
    FIGURE_GRASP_LAG,
    FIGURE_COUNT,
} FigureId;

typedef struct Figure {
    const char *name, *unit;
    double low, high; // the bar, in the unit; infinite: none
    const char *meaning;
} Figure;

extern const Figure FIGURES[FIGURE_COUNT];

// --- curves, sampled evenly ---

// Returns the rms of what a signal has between two frequencies [Hz], without the straight line
// between its ends; sets its largest size. What has a whole number of periods is exact.
double figure_band(const double *x, int count, double rate, double low, double high, double *peak);
// Returns after how many samples a signal has first gone 90 % of the way from its first value to
// the mean of its last `settled` samples; NAN: these are no higher than the first.
double figure_rise(const double *x, int count, int settled);
// Returns the largest change over `distance` of a way that only grows.
double figure_change(const double *way, const double *x, int count, double distance);
// Returns how far a signal falls at most below what it reached before.
double figure_fall(const double *x, int count);
double figure_mean(const double *x, int count);
// Returns the largest change of a force from sample to sample, and the largest force.
double figure_tick(const Vec3 *force, int count);
double figure_largest(const Vec3 *force, int count);
// Returns the most that a hand had got from a force on it beyond what it had given [J]. `held`: the
// force stays until the next sample; else it changes evenly.
double figure_energy(const Vec3 *hand, const Vec3 *force, int count, bool held);

#endif
