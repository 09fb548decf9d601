// SPDX-License-Identifier: MIT
// Round trips of poses: from the sending of a pose to the arrival of the first contact that the
// daemon computed with it. One thread; all memory inside the struct.
#ifndef PLIANT_CLIENTS_ROUND_TRIP_H
#define PLIANT_CLIENTS_ROUND_TRIP_H

#include <stdbool.h>
#include <stdint.h>

enum {
    ROUND_TRIP_SENT = 4096,   // poses in transit at most
    ROUND_TRIP_BINS = 100000, // of 1 us; longer trips share the last one
};

typedef struct RoundTrips {
    int64_t sent[ROUND_TRIP_SENT]; // utime of poses not yet answered; 0: none
    int64_t at[ROUND_TRIP_SENT];   // when they were sent
    unsigned next;
    uint32_t bin[ROUND_TRIP_BINS];
    int64_t count;
} RoundTrips;

// Records a sent pose. `utime`, its time stamp [us], is above all earlier ones. `now` [us] here and
// below is of a monotonic clock. The struct starts zeroed.
void round_trip_sent(RoundTrips *trips, int64_t utime, int64_t now);
// Records that a contact with this pose_utime arrived at `now`. Returns true for a pose of ours;
// `*us` is its round trip, or -1 if it was measured before.
bool round_trip_received(RoundTrips *trips, int64_t pose_utime, int64_t now, int64_t *us);
// Returns the time that `fraction` of all round trips do not exceed [us]; 0: the shortest. -1
// without any.
int64_t round_trip_quantile(const RoundTrips *trips, double fraction);

#endif
