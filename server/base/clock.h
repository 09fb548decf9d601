// The two clocks: monotonic for the loop, real time for time stamps in messages.
#ifndef PLIANT_BASE_CLOCK_H
#define PLIANT_BASE_CLOCK_H

#include <stdint.h>
#include <time.h>

// Returns CLOCK_MONOTONIC [ns].
static inline int64_t clock_now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
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

#endif
