// SPDX-License-Identifier: MIT
#include "base/clock.h"

#include <string.h>

void histogram_add(Histogram *histogram, int64_t ns)
{
    if (ns < 0)
        ns = 0;
    // Fine bins below a millisecond, coarse ones above, and one for all that is longer.
    int64_t us = ns / 1000;
    int64_t bin = us < HISTOGRAM_FINE ? us : HISTOGRAM_FINE + (us - HISTOGRAM_FINE) / 100;
    if (bin >= HISTOGRAM_BINS)
        bin = HISTOGRAM_BINS - 1;
    histogram->bin[bin]++;
    histogram->count++;
    if (ns > histogram->max_ns)
        histogram->max_ns = ns;
}

// The upper edge of a bin [us]; the overflow bin has only the maximum.
static double upper_edge(const Histogram *histogram, int bin)
{
    double max_us = (double)histogram->max_ns * 1e-3;
    if (bin == HISTOGRAM_BINS - 1)
        return max_us;
    double edge =
        bin < HISTOGRAM_FINE ? bin + 1.0 : HISTOGRAM_FINE + (bin - HISTOGRAM_FINE + 1) * 100.0;
    return edge < max_us ? edge : max_us;
}

void histogram_summarize(const Histogram *histogram, double us[4])
{
    static const double part[3] = {0.5, 0.99, 0.999};
    memset(us, 0, 4 * sizeof *us);
    if (histogram->count == 0)
        return;
    // Walk the bins once; each percentile is the first bin that reaches its share of the count.
    uint64_t below = 0;
    int wanted = 0;
    for (int bin = 0; bin < HISTOGRAM_BINS && wanted < 3; bin++) {
        below += histogram->bin[bin];
        while (wanted < 3 && (double)below >= part[wanted] * (double)histogram->count)
            us[wanted++] = upper_edge(histogram, bin);
    }
    us[3] = (double)histogram->max_ns * 1e-3;
}

void histogram_clear(Histogram *histogram)
{
    memset(histogram, 0, sizeof *histogram);
}
