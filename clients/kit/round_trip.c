// SPDX-License-Identifier: MIT
// Round trips of poses. One thread.
#include "round_trip.h"

#include <math.h>

void round_trip_sent(RoundTrips *trips, int64_t utime, int64_t now)
{
    trips->at[trips->next % ROUND_TRIP_SENT] = now;
    trips->sent[trips->next++ % ROUND_TRIP_SENT] = utime;
}

bool round_trip_received(RoundTrips *trips, int64_t pose_utime, int64_t now, int64_t *us)
{
    *us = -1;
    if (pose_utime == 0)
        return false; // no pose
    // The answered pose is nearly always among the newest.
    for (unsigned k = 1; k <= ROUND_TRIP_SENT; k++) {
        int64_t *sent = &trips->sent[(trips->next - k) % ROUND_TRIP_SENT];
        int64_t utime = *sent < 0 ? -*sent : *sent;
        if (utime == 0 || utime < pose_utime)
            return false; // earlier entries are even older
        if (utime != pose_utime)
            continue;
        if (*sent > 0) {
            const int64_t at = trips->at[(trips->next - k) % ROUND_TRIP_SENT];
            int64_t trip = now > at ? now - at : 0;
            trips->bin[trip < ROUND_TRIP_BINS ? trip : ROUND_TRIP_BINS - 1]++;
            trips->count++;
            *us = trip;
        }
        *sent = -pose_utime; // measured; still recognised as ours
        return true;
    }
    return false;
}

int64_t round_trip_quantile(const RoundTrips *trips, double fraction)
{
    int64_t wanted = (int64_t)ceil(fraction * (double)trips->count), below = 0;
    if (wanted < 1)
        wanted = 1;
    // Bins are in order: count up to the wanted share.
    for (int us = 0; us < ROUND_TRIP_BINS; us++) {
        below += trips->bin[us];
        if (below >= wanted)
            return us;
    }
    return -1;
}
