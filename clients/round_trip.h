// Round trips of poses: from the moment a pose was sent to the arrival of the first contact that
// the daemon computed with it. One thread; all memory inside the struct.
#ifndef PLIANT_CLIENTS_ROUND_TRIP_H
#define PLIANT_CLIENTS_ROUND_TRIP_H

#include <stdbool.h>
#include <stdint.h>

enum {
    ROUND_TRIP_SENT = 4096,   // poses under way at most
    ROUND_TRIP_BINS = 100000, // of 1 us; longer trips share the last one
};

typedef struct RoundTrips {
    int64_t sent[ROUND_TRIP_SENT]; // utime of poses not yet answered; 0: none
    int64_t at[ROUND_TRIP_SENT];   // when they were sent
    unsigned next;
    uint32_t bin[ROUND_TRIP_BINS];
    int64_t count;
} RoundTrips;

// Starts zeroed. `utime` is that of the pose, above all before it [us]. `now` [us] here and below
// is of a clock that nobody sets.
void round_trip_sent(RoundTrips *trips, int64_t utime, int64_t now);
// A contact with this pose_utime came at `now`. True for a pose of ours; `*us` is its trip, or
// -1 when it was measured before.
bool round_trip_received(RoundTrips *trips, int64_t pose_utime, int64_t now, int64_t *us);
// The trip that `fraction` of all do not exceed [us]; 0: the shortest. -1 when none was measured.
int64_t round_trip_quantile(const RoundTrips *trips, double fraction);

#endif
