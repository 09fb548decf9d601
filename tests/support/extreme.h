// Extremes of sampled curves, by which tests measure swings. Pure functions.
#ifndef PLIANT_TESTS_EXTREME_H
#define PLIANT_TESTS_EXTREME_H

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

#endif
