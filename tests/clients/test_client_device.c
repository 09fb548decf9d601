// SPDX-License-Identifier: MIT
// What --device makes of an ideal stream of poses: spreads, counts, delays and order of what
// arrives.
#include "test.h"
#include "device.h"

enum { TICKS = 20000 }; // of 1 ms

// What a run has brought, of a tool that moves along x.
static Device device;
static DevicePose came[2 * TICKS];
static int count;

static PliantPose ideal_at(double time)
{
    return (PliantPose){.position = {0.02 * time, -0.3, 7.0},
                        .orientation = {cos(0.5 * time), 0.0, 0.0, sin(0.5 * time)},
                        .linear = {0.02, 0.0, 0.0},
                        .angular = {0.0, 0.0, 1.0},
                        .moving = true,
                        .active = true};
}

// Every millisecond an ideal pose, and what has arrived; at the end all that is still to come.
static void stream(const char *items, int ticks)
{
    Status why = {0};
    DeviceOptions options;
    if (!device_parse(items, &options, &why))
        fail_msg("'%s' %s", items, why.text);
    device_begin(&device, &options);
    count = 0;
    for (int i = 0; i < ticks; i++) {
        const PliantPose ideal = ideal_at(1e-3 * i);
        device_send(&device, 1e-3 * i, &ideal);
        while (device_take(&device, 1e-3 * i, &came[count])) {
            expect_at_most(came[count].arrives, 1e-3 * i + 1e-8); // a rounding of the device's
            count++;
        }
    }
    while (device_take(&device, (double)INFINITY, &came[count]))
        count++;
    assert_int_equal(device.arrived, count);
}

static double off(const DevicePose *pose, int axis)
{
    return pose->pose.position[axis] - ideal_at(pose->time).position[axis];
}

// A pose has bytes between its members, so it is not compared as a whole.
static void expect_same(const PliantPose *a, const PliantPose *b)
{
    assert_memory_equal(a->position, b->position, sizeof a->position);
    assert_memory_equal(a->orientation, b->orientation, sizeof a->orientation);
    assert_memory_equal(a->linear, b->linear, sizeof a->linear);
    assert_memory_equal(a->angular, b->angular, sizeof a->angular);
    assert_true(a->tool == b->tool && a->moving == b->moving && a->active == b->active);
}

static double delay(const DevicePose *pose)
{
    return pose->arrives - pose->time;
}

TEST(an_ideal_device_changes_nothing)
{
    stream("seed=3", TICKS);
    assert_int_equal(count, TICKS);
    for (int i = 0; i < count; i++) {
        const PliantPose ideal = ideal_at(1e-3 * i);
        expect_same(&came[i].pose, &ideal);
        assert_int_equal(came[i].number, i);
        expect_near(came[i].arrives, 1e-3 * i, 0.0);
    }
}

TEST(noise_is_normal_on_each_coordinate)
{
    const double s = 20e-6, n = TICKS;
    stream("noise=20e-6", TICKS);
    for (int axis = 0; axis < 3; axis++) {
        double sum = 0.0, squares = 0.0, fourths = 0.0, lag = 0.0, cross = 0.0;
        for (int i = 0; i < count; i++) {
            const double x = off(&came[i], axis) / s;
            sum += x;
            squares += x * x;
            fourths += x * x * x * x;
            cross += x * off(&came[i], (axis + 1) % 3) / s;
            lag += i > 0 ? x * off(&came[i - 1], axis) / s : 0.0;
        }
        // Five standard deviations of the mean, of the variance (2), of the fourth moment (96), and
        // of the products of neighbours and of coordinates.
        expect_near(sum / n, 0.0, 5.0 / sqrt(n));
        expect_near(squares / n, 1.0, 5.0 * sqrt(2.0 / n));
        expect_near(fourths / n, 3.0, 5.0 * sqrt(96.0 / n));
        expect_near(lag / n, 0.0, 5.0 / sqrt(n));
        expect_near(cross / n, 0.0, 5.0 / sqrt(n));
    }
}

TEST(an_encoder_reads_the_nearest_step)
{
    stream("quantum=50e-6", TICKS);
    for (int i = 0; i < count; i++) {
        for (int axis = 0; axis < 3; axis++) {
            const double steps = came[i].pose.position[axis] / 50e-6;
            expect_near(steps, round(steps), 1e-9); // roundings of 140,000 steps
            expect_near(off(&came[i], axis), 0.0, 25e-6 + 1e-14);
        }
    }
}

TEST(poses_at_a_rate_lie_between_the_ideal_ones)
{
    stream("rate=60", 1001);
    assert_int_equal(count, 61);
    for (int i = 0; i < count; i++) {
        const PliantPose ideal = ideal_at(i / 60.0), *pose = &came[i].pose;
        expect_near(came[i].time, i / 60.0, 1e-12);
        for (int k = 0; k < 3; k++)
            expect_near(pose->position[k], ideal.position[k], 1e-12); // roundings of 7 m
        for (int k = 0; k < 4; k++) // a chord of 1 mrad turns unevenly by 1e-3^3 / 100
            expect_near(pose->orientation[k], ideal.orientation[k], 1e-11);
    }
    // Also more often than there are ideal ones.
    stream("rate=2500", 1001);
    assert_int_equal(count, 2501);
    for (int i = 0; i < count; i++)
        expect_near(off(&came[i], 0), 0.0, 1e-12);
}

TEST(between_poses_a_tool_turns_the_short_way)
{
    // q and -q are the same orientation.
    PliantPose pose = ideal_at(0.0);
    device_begin(&device, &(DeviceOptions){.rate_hz = 2500.0});
    device_send(&device, 0.0, &pose);
    pose = ideal_at(1e-3);
    for (int k = 0; k < 4; k++)
        pose.orientation[k] *= -1.0;
    device_send(&device, 1e-3, &pose);
    for (count = 0; device_take(&device, 1.0, &came[count]); count++) {
        const double *q = came[count].pose.orientation;
        const PliantPose ideal = ideal_at(came[count].time);
        expect_near(fabs(q[0]), ideal.orientation[0], 1e-11); // as above
        expect_near(fabs(q[3]), ideal.orientation[3], 1e-11);
    }
    assert_int_equal(count, 3);
}

TEST(gaps_are_silent_for_their_length_only)
{
    stream("gap=0.06/0.25", 4000);
    assert_int_equal(device.silent, 16 * 60);
    assert_int_equal(count, 4000 - 16 * 60);
    for (int i = 0; i < count; i++)
        assert_in_range(came[i].number % 250, 60, 249);
}

TEST(each_delay_is_of_its_kind_and_arrivals_are_in_order)
{
    static const struct {
        const char *items;
        double least, mean, deviation; // of a delay [s]
    } kinds[] = {{"late=0.02", 0.02, 0.02, 0.0},
                 {"jitter=0.006", 0.0, 0.0047873, 0.0036168}, // S sqrt(2 / pi), S sqrt(1 - 2 / pi)
                 {"reorder=0.005", 0.0, 0.0025, 0.0014434},   // S / 2, S / sqrt(12)
                 {"late=0.1,reorder=0.005", 0.1, 0.1025, 0.0014434}};
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        static int seen[TICKS];
        double sum = 0.0, squares = 0.0;
        int behind = 0, newest = 0;
        memset(seen, 0, sizeof seen);
        stream(kinds[k].items, TICKS);
        for (int i = 0; i < count; i++) {
            const double more = delay(&came[i]) - kinds[k].mean;
            expect_at_least(delay(&came[i]), kinds[k].least - 1e-12);
            assert_true(i == 0 || came[i].arrives >= came[i - 1].arrives);
            seen[came[i].number]++;
            behind += came[i].number < newest;
            newest = came[i].number > newest ? came[i].number : newest;
            sum += more;
            squares += more * more;
        }
        for (int i = 0; i < TICKS; i++)
            assert_int_equal(seen[i], 1);
        // Five standard deviations of the mean and of the variance, which for |normal| (kurtosis
        // 3.87) is 1.2 times that of a normal one; and the last digit of the figures above.
        const double d = kinds[k].deviation;
        expect_near(sum / TICKS, 0.0, 5.0 * d / sqrt(TICKS) + 1e-7);
        expect_near(squares / TICKS, d * d, 5.0 * 1.2 * d * d * sqrt(2.0 / TICKS) + 1e-9);
        assert_int_equal(device.overtaken, behind);
        assert_true((behind > 0) == (d > 0.0));
    }
}

TEST(losses_and_repeats_are_of_their_share)
{
    stream("loss=0.3", TICKS);
    // Five standard deviations of the number of losses.
    expect_near((double)device.lost, 0.3 * TICKS, 5.0 * sqrt(TICKS * 0.3 * 0.7));
    assert_int_equal(device.lost + count, TICKS);
    stream("duplicate", TICKS);
    assert_int_equal(count, 2 * TICKS);
    for (int i = 0; i < count; i++) {
        assert_int_equal(came[i].number, i / 2);
        expect_near(delay(&came[i]), i % 2 * 3e-4, 1e-12);
    }
    // Each of the two is lost by itself: of 9 in 100 nothing is left.
    stream("duplicate,loss=0.3", TICKS);
    int left = 0;
    for (int i = 0; i < count; i++)
        left += i == 0 || came[i].number != came[i - 1].number;
    expect_near(left, 0.91 * TICKS, 5.0 * sqrt(TICKS * 0.91 * 0.09));
}

TEST(one_pose_in_each_interval_is_wrong)
{
    // Also where the interval begins with a gap.
    static const char *const kinds[] = {"wrong=0.09/0.5", "wrong=0.09/0.5,gap=0.06/0.25"};
    for (int k = 0; k < 2; k++) {
        int wrong = 0;
        stream(kinds[k], 4000);
        for (int i = 0; i < count; i++) {
            const double way =
                sqrt(off(&came[i], 0) * off(&came[i], 0) + off(&came[i], 1) * off(&came[i], 1) +
                     off(&came[i], 2) * off(&came[i], 2));
            if (way == 0.0)
                continue;
            expect_near(way, 0.09, 1e-12); // roundings of 7 m
            wrong++;
            expect_near(came[i].time, 0.5 * wrong + (k == 1 ? 0.06 : 0.0), 1e-9);
        }
        assert_int_equal(wrong, 7);
    }
}

TEST(one_item_more_or_tick_less_changes_no_other_and_a_seed_changes_all)
{
    enum { SOME = 2000 };
    static DevicePose alone[SOME];
    stream("noise=20e-6,seed=5", SOME);
    memcpy(alone, came, sizeof alone);
    stream("seed=5,loss=0.2,reorder=0.005,duplicate,noise=20e-6,jitter=0.001", SOME);
    assert_true(count > SOME);
    for (int i = 0; i < count; i++)
        expect_same(&came[i].pose, &alone[came[i].number].pose);
    // Nor does a tick that was missed.
    device_begin(&device, &(DeviceOptions){.noise = 20e-6, .seed = 5.0});
    for (int i = 0; i < SOME; i += 3) {
        const PliantPose ideal = ideal_at(1e-3 * i);
        device_send(&device, 1e-3 * i, &ideal);
        assert_true(device_take(&device, 1e-3 * i, &came[0]));
        expect_same(&came[0].pose, &alone[i].pose);
    }
    stream("noise=20e-6,seed=6", SOME);
    for (int i = 0; i < count; i++)
        assert_true(came[i].pose.position[0] != alone[i].pose.position[0]);
}

TEST(more_in_transit_than_there_is_room_for_is_lost)
{
    stream("rate=10000,late=1", 1000);
    // All are under way when the last one leaves, 0.999 s after the first.
    assert_int_equal(device.samples, 9991);
    assert_int_equal(count, DEVICE_WAITING);
    assert_int_equal(device.lost, 9991 - DEVICE_WAITING);
    assert_int_equal(came[count - 1].number, DEVICE_WAITING - 1);
}

TEST(a_wrong_item_or_value_is_named)
{
    static const struct {
        const char *items, *says;
    } faults[] = {
        {"", "has ''"},
        {"noise=1e-6,", "has ''"},
        {"noise=1e-6,nois=1", "has 'nois=1', which is none of noise, quantum, rate"},
        {"seed=1,noise", "has 'noise': expected noise=S, a number in [0, 1]"},
        {"noise=x", "'noise=x'"},
        {"noise=1x", "'noise=1x'"},
        {"noise=nan", "'noise=nan'"},
        {"noise=-1e-6", "'noise=-1e-6'"},
        {"rate=0", "'rate=0': expected rate=HZ, a number in [1, 10000]"},
        {"late=1.1", "'late=1.1'"},
        {"loss=1", "'loss=1'"},
        {"gap=0.06", "expected gap=LENGTH/EVERY"},
        {"gap=0.06/0", "'gap=0.06/0'"},
        {"gap=0.06/0.25/1", "'gap=0.06/0.25/1'"},
        {"gap=0.25/0.25", "a gap of 0.25 s in every 0.25 s"},
        {"wrong=0.09/inf", "'wrong=0.09/inf'"},
        {"duplicate=1", "duplicate takes no value"},
        {"late=0.1,late=0.1", "late twice"},
        {"seed=1.5", "seed 1.5"},
        {"noise=0.00000000000000000000000000000000000000000000000000000000001", "too long"},
    };
    for (size_t k = 0; k < sizeof faults / sizeof *faults; k++) {
        DeviceOptions options;
        Status why = {0};
        if (device_parse(faults[k].items, &options, &why))
            fail_msg("'%s' was taken", faults[k].items);
        expect_in(why.text, faults[k].says);
    }
}
