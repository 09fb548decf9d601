// Histogram of durations with fixed bins and an overflow bin, for percentiles of step and wake-up
// times. Does not allocate: safe on the step thread.
#ifndef PLIANT_BASE_HISTOGRAM_H
#define PLIANT_BASE_HISTOGRAM_H

#include <stdint.h>

enum {
    HISTOGRAM_FINE = 1000,   // bins of 1 us below 1 ms
    HISTOGRAM_COARSE = 1000, // bins of 100 us from 1 ms to 101 ms
    HISTOGRAM_BINS = HISTOGRAM_FINE + HISTOGRAM_COARSE + 1,
};

typedef struct Histogram {
    uint32_t bin[HISTOGRAM_BINS]; // the last one is the overflow
    uint64_t count;
    int64_t max_ns;
} Histogram;

// Counts one duration; negative ones count as 0.
void histogram_add(Histogram *histogram, int64_t ns);
// Writes p50, p99, p99.9 (upper edges of their bins) and the exact maximum [us]; zeros when empty.
void histogram_summarize(const Histogram *histogram, double us[4]);
void histogram_clear(Histogram *histogram);

#endif
