// Pacing of data that is too large for one datagram: the chunks and when each is due. They are
// spread over a period, because a receiver's kernel buffer holds a few chunks, not a burst
// (README.md, "Loss and pacing").
#ifndef PLIANT_RUN_PACE_H
#define PLIANT_RUN_PACE_H

#include <stdbool.h>
#include <stdint.h>

typedef struct Pace {
    int next, count; // next == count: nothing is under way
    int64_t start_ns, interval_ns;
} Pace;

// Chunks of at most `size` things each; one when there is nothing.
static inline int chunks_of(int count, int size)
{
    return count > 0 ? (count + size - 1) / size : 1;
}

// Where chunk `chunk` of `count` begins among `total` things.
static inline int chunk_begin(int total, int chunk, int count)
{
    return (int)((int64_t)total * chunk / count);
}

// Evenly over a period of 1/hz, or 10 ms a chunk, whichever is faster.
static inline void pace_start(Pace *pace, int count, double hz, int64_t now_ns)
{
    int64_t interval = 10000000;
    if (hz > 0.0 && 1e9 / hz / count < (double)interval)
        interval = (int64_t)(1e9 / hz / count);
    *pace = (Pace){.count = count, .start_ns = now_ns, .interval_ns = interval};
}

static inline bool pace_is_under_way(const Pace *pace)
{
    return pace->next < pace->count;
}

// INT64_MAX: nothing is under way.
static inline int64_t pace_next_ns(const Pace *pace)
{
    return pace_is_under_way(pace) ? pace->start_ns + pace->next * pace->interval_ns : INT64_MAX;
}

// When the last chunk is due; `now_ns` when nothing is under way.
static inline int64_t pace_end_ns(const Pace *pace, int64_t now_ns)
{
    return pace_is_under_way(pace) ? pace->start_ns + (pace->count - 1) * pace->interval_ns
                                   : now_ns;
}

static inline bool pace_is_due(const Pace *pace, int64_t now_ns)
{
    return pace_is_under_way(pace) && now_ns >= pace_next_ns(pace);
}

#endif
