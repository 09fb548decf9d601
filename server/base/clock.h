// SPDX-License-Identifier: MIT
// Time: the clocks (boot time for the loop, real time for time stamps in messages) and histograms
// of the durations that they measure.
#ifndef PLIANT_BASE_CLOCK_H
#define PLIANT_BASE_CLOCK_H

#include <stdint.h>
#include <time.h>

// Never set, and goes on while the machine is suspended: hands move on, too.
#define CLOCK_RUN CLOCK_BOOTTIME

// Returns CLOCK_RUN [ns].
static inline int64_t clock_now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_RUN, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

// Returns CLOCK_REALTIME [us], the `utime` of every message.
static inline int64_t clock_utime(void)
{
    struct timespec t;
    clock_gettime(CLOCK_REALTIME, &t);
    return (int64_t)t.tv_sec * 1000000 + t.tv_nsec / 1000;
}

// Returns the CPU time of the calling thread [ns].
static inline int64_t clock_thread_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

// --- histogram ---
// Of durations, with fixed bins and an overflow bin, for percentiles of step and wake-up times.
// Does not allocate: safe on the step thread.

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
