// SPDX-License-Identifier: MIT
// Smoothness of a movement: the spectral arc length of its speed profile (SCORE.md, "Smoothness").
// S. Balasubramanian, A. Melendez-Calderon, A. Roby-Brami, E. Burdet, "On the analysis of movement
// smoothness", J. NeuroEng. Rehabil. 12:112 (2015): the spectrum is scaled by its value at 0 Hz and
// cut off at 10 Hz, or where it stays below 0.05.
#include "score_parts.h"

#include "base/check.h"

#include <stdlib.h>

static const double CUT_OFF_HZ = 10.0, LEAST_SHARE = 0.05;
enum { PADDING = 16 }; // factor of zeros, so that the curve is resolved

// In place, radix 2; n is a power of two.
static void transform(double (*z)[2], size_t n)
{
    // Bit-reversed order first.
    for (size_t i = 1, j = 0; i < n; i++) {
        size_t bit = n / 2;
        for (; (j & bit) != 0; bit /= 2)
            j ^= bit;
        j |= bit;
        if (i < j)
            for (int k = 0; k < 2; k++) {
                const double swapped = z[i][k];
                z[i][k] = z[j][k];
                z[j][k] = swapped;
            }
    }
    // Then pairs of transforms of half the length.
    for (size_t half = 1; half < n; half *= 2)
        for (size_t k = 0; k < half; k++) {
            const double angle = -M_PI * (double)k / (double)half, c = cos(angle), s = sin(angle);
            for (size_t i = k; i < n; i += 2 * half) {
                double *a = z[i], *b = z[i + half];
                const double re = c * b[0] - s * b[1], im = s * b[0] + c * b[1];
                b[0] = a[0] - re;
                b[1] = a[1] - im;
                a[0] += re;
                a[1] += im;
            }
        }
}

// Length of the curve of magnitudes [0, last], scaled to 1 in both directions.
static double arc_length(const double (*z)[2], size_t last)
{
    const double whole = hypot(z[0][0], z[0][1]);
    double length = 0.0, before = 1.0;
    for (size_t i = 1; i <= last; i++) {
        const double here = hypot(z[i][0], z[i][1]) / whole;
        length += hypot(1.0 / (double)last, here - before);
        before = here;
    }
    return length;
}

double score_spectral_arc_length(const double *speed, int count, double rate)
{
    size_t n = 1;
    double sum = 0.0;
    for (int i = 0; i < count; i++)
        sum += speed[i];
    if (count < 4 || !(sum > 0.0) || !(rate >= 2.0 * CUT_OFF_HZ))
        return SCORE_UNKNOWN;
    while (n < (size_t)count)
        n *= 2;
    n *= PADDING;
    double(*z)[2] = calloc(n, sizeof *z);
    ASSERT(z != NULL);
    for (int i = 0; i < count; i++)
        z[i][0] = speed[i];
    transform(z, n);
    // The last frequency below the cut-off whose share is not small.
    const double step = rate / (double)n;
    size_t last = (size_t)fmin(floor(CUT_OFF_HZ / step), (double)(n / 2));
    while (last > 1 && hypot(z[last][0], z[last][1]) < LEAST_SHARE * sum)
        last--;
    const double length = arc_length((const double(*)[2])z, last);
    free(z);
    return -length;
}
