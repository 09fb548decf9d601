// SPDX-License-Identifier: MIT
// Round trips count each pose once, and only poses of ours.
#include "test.h"
#include "round_trip.h"

static RoundTrips *create(void)
{
    RoundTrips *trips = zeroed(1, sizeof *trips);
    return trips;
}

TEST(trip_of_each_pose_is_counted_once)
{
    FREED RoundTrips *trips = create();
    int64_t us;
    for (int k = 1; k <= 100; k++)
        round_trip_sent(trips, 1000 * k, 1000 * k);
    assert_true(round_trip_received(trips, 42000, 42150, &us));
    assert_int_equal(us, 150);
    assert_true(round_trip_received(trips, 42000, 43150, &us)); // the next tick with the same pose
    assert_int_equal(us, -1);
    assert_int_equal(trips->count, 1);
}

TEST(poses_of_others_are_not_ours)
{
    FREED RoundTrips *trips = create();
    int64_t us;
    assert_false(round_trip_received(trips, 0, 10, &us));
    assert_false(round_trip_received(trips, 77, 100, &us));
    for (int k = 1; k <= 3 * ROUND_TRIP_SENT; k++)
        round_trip_sent(trips, 10 * k, 10 * k);
    assert_false(round_trip_received(trips, 0, 10, &us));
    assert_false(round_trip_received(trips, 20 * ROUND_TRIP_SENT + 5, 10, &us));
    assert_false(round_trip_received(trips, 10, 100, &us)); // too old to be remembered
    assert_false(round_trip_received(trips, INT64_MAX, 10, &us));
    assert_int_equal(trips->count, 0);
}

// The clock that poses are stamped with may be set while they are under way.
TEST(a_clock_that_is_set_changes_no_trip)
{
    FREED RoundTrips *trips = create();
    int64_t us;
    round_trip_sent(trips, 5000000000, 100);
    round_trip_sent(trips, 5000000001, 1100); // set back by an hour: still above all before it
    assert_true(round_trip_received(trips, 5000000000, 400, &us));
    assert_int_equal(us, 300);
    assert_true(round_trip_received(trips, 5000000001, 1350, &us));
    assert_int_equal(us, 250);
}

TEST(quantiles_are_those_of_the_sorted_trips)
{
    FREED RoundTrips *trips = create();
    int64_t us;
    assert_int_equal(round_trip_quantile(trips, 0.5), -1);
    for (int k = 1; k <= 100; k++) { // trips of 1 .. 100 us
        round_trip_sent(trips, 1000 * k, 1000 * k);
        assert_true(round_trip_received(trips, 1000 * k, 1000 * k + k, &us));
    }
    assert_int_equal(round_trip_quantile(trips, 0.0), 1);
    assert_int_equal(round_trip_quantile(trips, 0.5), 50);
    assert_int_equal(round_trip_quantile(trips, 0.99), 99);
    assert_int_equal(round_trip_quantile(trips, 1.0), 100);
}
