// SPDX-License-Identifier: MIT
// Extremes of sampled curves, by which tests measure swings. Pure functions.
#ifndef PLIANT_TESTS_EXTREME_H
#define PLIANT_TESTS_EXTREME_H

#include <math.h>
#include <stdbool.h>

// Finds the extreme near the middle of three samples in a row, by the parabola through them: its
// place, in samples from the middle, and its value. Returns false if there is none.
static inline bool find_extreme(const double y[3], double *place, double *value)
{
    if ((y[1] - y[0]) * (y[2] - y[1]) >= 0.0)
        return false;
    const double slope = 0.5 * (y[2] - y[0]), bend = y[2] - 2.0 * y[1] + y[0];
    *place = -slope / bend;
    *value = y[1] - 0.5 * slope * slope / bend;
    return true;
}

// The extremes of a curve that is sampled in turn, from the third sample on.
enum { EXTREMES_MOST = 8 };
typedef struct Extremes {
    int samples, count;
    double last[3];
    double at[EXTREMES_MOST], size[EXTREMES_MOST]; // [samples], from 1; absolute
} Extremes;

// Returns true until there are EXTREMES_MOST.
static inline bool add_sample(Extremes *to, double y)
{
    double place, value;
    to->last[0] = to->last[1], to->last[1] = to->last[2], to->last[2] = y;
    if (++to->samples >= 3 && to->count < EXTREMES_MOST && find_extreme(to->last, &place, &value)) {
        to->at[to->count] = to->samples - 1.0 + place;
        to->size[to->count++] = fabs(value);
    }
    return to->count < EXTREMES_MOST;
}

// Returns the time from extreme to extreme without the first, in samples, and sets the logarithm of
// the ratio of two in a row: of all that there may be.
static inline double half_swing(const Extremes *of, double *decrement)
{
    const int halves = EXTREMES_MOST - 2;
    *decrement = log(of->size[1] / of->size[halves + 1]) / halves;
    return (of->at[halves + 1] - of->at[1]) / halves;
}

#endif
