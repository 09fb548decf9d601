// SPDX-License-Identifier: MIT
// Where a tool is between poses.
#include "random.h"
#include "test.h"
#include "sim/tool.h"

static const double TICK = 1e-3;
static const double PI = 3.14159265358979323846;

// Without a filter: the target's way.
static const ToolOptions TOOL = {.kind = TOOL_PROBE, .fastest = 1e9};
static const ToolOptions HAND = {.kind = TOOL_PROBE, .lag = 0.005, .fastest = 10.0};

static ToolPose pose_at(double x)
{
    return (ToolPose){
        .position = {x, 0.0, 0.0}, .orientation = {1.0, 0.0, 0.0, 0.0}, .active = true};
}

// A tool whose ticks follow each other.
typedef struct Moved {
    ToolMotion motion;
    const ToolOptions *tool;
    int64_t step;
} Moved;

static Moved moved(const ToolOptions *tool)
{
    Moved moved = {.tool = tool};
    tool_motion_init(&moved.motion);
    return moved;
}

// A pose at the present tick, of the time that it has there.
static PoseVerdict send(Moved *moved, ToolPose pose)
{
    pose.utime = llround(1e6 * (double)moved->step * TICK);
    return tool_motion_apply(&moved->motion, moved->tool, &pose, moved->step, TICK, false);
}

static void tick(Moved *moved, int count)
{
    for (int k = 0; k < count; k++)
        tool_motion_step(&moved->motion, moved->tool->lag, moved->step++, TICK);
}

static Moved begun_at(double x, const ToolOptions *tool)
{
    Moved at = moved(tool);
    send(&at, pose_at(x));
    return at;
}

// Position along x at the end of the last tick.
static double place(const Moved *moved)
{
    return moved->motion.end_position.x;
}

TEST(first_pose_is_taken_at_once)
{
    Moved at = moved(&HAND);
    assert_false(at.motion.active);
    send(&at, pose_at(0.3));
    assert_true(at.motion.active);
    expect_near(place(&at), 0.3, 0.0);
    tick(&at, 5000);
    expect_near(place(&at), 0.3, 0.0);
}

TEST(target_moves_over_one_measured_period_and_no_further)
{
    Moved at = begun_at(0.0, &TOOL);
    tick(&at, 10);
    send(&at, pose_at(0.1)); // 10 ms later
    for (int k = 1; k <= 10; k++) {
        tick(&at, 1);
        expect_near(place(&at), 0.01 * k, 1e-15); // rounding
    }
    Vec3 middle;
    Quat orientation;
    tool_motion_at(&at.motion, 0.5, &middle, &orientation);
    expect_near(middle.x, 0.095, 1e-15);
    tick(&at, 1000);
    expect_near(place(&at), 0.1, 1e-16);
}

TEST(tool_does_not_jump_when_a_pose_comes_early_or_late)
{
    static const int arrivals[] = {0, 10, 20, 27, 45, 46, 47, 100, 110};
    Moved at = moved(&TOOL);
    for (int k = 0; k < 9; k++) {
        while (at.step < arrivals[k])
            tick(&at, 1);
        const double before = place(&at);
        send(&at, pose_at(0.01 * k));
        expect_near(place(&at), before, 0.0);
    }
    tick(&at, 200);
    expect_near(place(&at), 0.08, 1e-15);
}

TEST(period_follows_the_sender)
{
    Moved at = begun_at(0.0, &TOOL);
    for (int k = 0; k < 50; k++) {
        tick(&at, 10);
        send(&at, pose_at(0.0));
    }
    expect_near(at.motion.period, 0.010, 1e-15);
    for (int k = 0; k < 50; k++) { // slowly: a quarter of the way a pose
        tick(&at, 12);
        send(&at, pose_at(0.0));
    }
    expect_near(at.motion.period, 0.012, 1e-8); // 0.75^50 of 2 ms is left
    tick(&at, 100);
    send(&at, pose_at(0.0)); // at once
    expect_near(at.motion.period, 0.100, 1e-15);
}

TEST(several_poses_in_one_tick_end_at_the_newest)
{
    Moved at = begun_at(0.0, &TOOL);
    tick(&at, 5);
    for (int k = 1; k <= 3; k++)
        send(&at, pose_at(0.1 * k));
    assert_true(at.motion.period > 0.0);
    tick(&at, 5);
    expect_near(place(&at), 0.3, 1e-16);
}

// The target goes to where the pose will be when it arrives there.
TEST(valid_twist_carries_the_tool_for_one_period)
{
    Moved at = begun_at(0.0, &TOOL);
    tick(&at, 20);
    ToolPose pose = pose_at(0.1);
    pose.twist_valid = true;
    pose.linear = vec3(2.0, 0.0, 0.0);
    pose.angular = vec3(0.0, 0.0, 0.5 * PI / 0.02); // a quarter turn in 20 ms
    send(&at, pose);
    tick(&at, 10);
    expect_near(place(&at), 0.07, 1e-15);
    tick(&at, 10);
    expect_near(place(&at), 0.14, 1e-15);
    const Vec3 turned = quat_rotate(at.motion.end_orientation, vec3(1.0, 0.0, 0.0));
    expect_near(turned.x, 0.0, 1e-14);
    expect_near(turned.y, 1.0, 1e-14);
    tick(&at, 900);
    expect_near(place(&at), 0.14, 1e-15); // never further
}

TEST(orientation_turns_evenly_along_the_shorter_way)
{
    for (int sign = -1; sign <= 1; sign += 2) { // q and -q are the same rotation
        Moved at = begun_at(0.0, &TOOL);
        tick(&at, 10);
        ToolPose pose = pose_at(0.0);
        Quat q = quat_from_rotation(vec3(0.0, 0.0, 0.6));
        pose.orientation = (Quat){sign * q.w, sign * q.x, sign * q.y, sign * q.z};
        send(&at, pose);
        for (int k = 1; k <= 10; k++) {
            tick(&at, 1);
            const Vec3 turned = quat_rotate(at.motion.end_orientation, vec3(1.0, 0.0, 0.0));
            expect_near(atan2(turned.y, turned.x), 0.06 * k, 1e-14); // a few roundings
            expect_near(turned.z, 0.0, 1e-14);
        }
    }
}

TEST(held_pose_is_taken_at_once_without_its_twist)
{
    Moved at = begun_at(0.0, &HAND);
    tick(&at, 10);
    ToolPose pose = pose_at(90.0); // nor is it doubted
    pose.twist_valid = true;
    pose.linear = vec3(2.0, 0.0, 0.0);
    assert_int_equal(tool_motion_apply(&at.motion, at.tool, &pose, at.step, TICK, true),
                     POSE_TAKEN);
    expect_near(place(&at), 90.0, 0.0);
    tick(&at, 10);
    expect_near(place(&at), 90.0, 0.0);
}

TEST(inactive_pose_withdraws_the_tool_and_the_next_is_a_first_one)
{
    Moved at = begun_at(0.1, &HAND);
    tick(&at, 10);
    ToolPose pose = pose_at(0.1);
    pose.active = false;
    send(&at, pose);
    assert_false(at.motion.active);
    tick(&at, 10);
    send(&at, pose_at(0.7));
    assert_true(at.motion.active);
    expect_near(place(&at), 0.7, 0.0); // does not sweep from where it was
}

// --- the filter ----------------------------------------------------------------------------------

// Where a critically damped filter of rate w is after the time t, of a target that began to move at
// the velocity v, from rest: the textbook's ramp response.
static double ramp_response(double v, double w, double t)
{
    return v * (t - 2.0 / w + (2.0 / w + t) * exp(-w * t));
}

// Poses of a hand that turns as well, at 1 kHz.
TEST(tool_follows_a_ramp_by_the_closed_form)
{
    const double v = 0.3, turn = 2.0, w = 2.0 / HAND.lag;
    Moved at = begun_at(0.0, &HAND);
    for (int k = 1; k <= 60; k++) {
        tick(&at, 1);
        ToolPose pose = pose_at(v * k * TICK);
        pose.orientation = quat_from_rotation(vec3(0.0, turn * k * TICK, 0.0));
        send(&at, pose);
        // The target begins with the first pose after the one at rest, and is there a tick later.
        const double t = (k - 1) * TICK;
        expect_near(place(&at), ramp_response(v, w, t), 1e-15);
        const Vec3 turned = quat_to_rotation(at.motion.end_orientation);
        expect_near(turned.y, ramp_response(turn, w, t), 1e-14);
    }
    // In the end it is behind by its lag, but for exp(-w t) w t of 60 ms: 1e-9; and by a tick.
    expect_near(v * 60 * TICK - place(&at), v * (HAND.lag + TICK), 1e-11);
}

// What one pose of 1 among poses of 0 does to the place at the end of the k-th tick after it: the
// target goes there and back in a tick each.
static double weight_of(int k, double w)
{
    double sum = 0.0;
    for (int i = 0; i < 3; i++)
        if (k > i)
            sum += (i == 1 ? -2.0 : 1.0) * ramp_response(1.0 / TICK, w, (k - i) * TICK);
    return sum;
}

// Independent poses add up by the squares of their weights.
TEST(noise_of_poses_is_filtered)
{
    enum { COUNT = 200000, LONG = 400 };
    const double sigma = 20e-6, w = 2.0 / HAND.lag, part = 1.0 - exp(-TICK / 0.015);
    double expected[3] = {0.0}, low = 0.0, before = 0.0;
    for (int k = 1; k < LONG; k++) {
        const double now = weight_of(k, w), speed = (now - before) / TICK;
        low += part * (speed - low);
        expected[0] += now * now;
        expected[1] += speed * speed;
        expected[2] += low * low;
        before = now;
    }
    uint64_t random = 5;
    Moved at = begun_at(0.0, &HAND);
    double seen[3] = {0.0};
    for (int k = 0; k < COUNT; k++) {
        tick(&at, 1);
        const double speed = (place(&at) - at.motion.begin_position.x) / TICK,
                     calm = at.motion.calm_linear.x;
        seen[0] += place(&at) * place(&at);
        seen[1] += speed * speed;
        seen[2] += calm * calm;
        // Even noise of that deviation.
        send(&at, pose_at(random_between(&random, -1.0, 1.0) * sqrt(3.0) * sigma));
    }
    // Some 20000 independent values, of which a mean square is known to 1 % and its root to half of
    // that; four times as much.
    for (int i = 0; i < 3; i++)
        expect_near(sqrt(seen[i] / COUNT / expected[i]) / sigma, 1.0, 0.02);
    // Dampers feel a sixtieth of what raw poses would show, sqrt(2) sigma a tick.
    expect_at_most(sqrt(seen[2] / COUNT), sqrt(2.0) * sigma / TICK / 60.0);
}

// The hand goes on while its poses are lost, for 60 ms, at 1 kHz and at 60 Hz, with and without
// twist. The tool goes at most twice as fast as the hand, by the rule that shrinks the time left;
// and a little faster where the two steps to and from that speed meet within the filter: never, as
// its step response has no overshoot.
TEST(after_a_gap_the_tool_catches_up_at_twice_the_speed)
{
    const double v = 0.2;
    for (int way = 0; way < 4; way++) {
        const int period = way < 2 ? 1 : 17;
        Moved at = begun_at(0.0, &HAND);
        double fastest = 0.0;
        for (int k = 1; k < 1000; k++) {
            tick(&at, 1);
            fastest = fmax(fastest, (place(&at) - at.motion.begin_position.x) / TICK);
            if (k % period != 0 || (k > 300 && k < 360))
                continue;
            ToolPose pose = pose_at(v * k * TICK);
            pose.twist_valid = way % 2 != 0;
            pose.linear = vec3(v, 0.0, 0.0);
            send(&at, pose);
        }
        expect_at_most(fastest, 2.0 * v * (1.0 + 1e-9));
        // It has caught up: behind by its lag, and by a period of what has no twist.
        const double behind = v * 999 * TICK - place(&at), due = way % 2 ? 0.0 : period * TICK;
        expect_near(behind, v * (HAND.lag + due), v * TICK * 1.5); // ticks since the last pose
    }
}

// --- poses of no hand ----------------------------------------------------------------------------

TEST(a_single_pose_far_away_is_ignored)
{
    Moved at = begun_at(0.0, &HAND);
    tick(&at, 1);
    assert_int_equal(send(&at, pose_at(0.09)), POSE_DOUBTED);
    tick(&at, 1);
    assert_int_equal(send(&at, pose_at(0.001)), POSE_ALONE);
    tick(&at, 1);
    assert_int_equal(send(&at, pose_at(0.001)), POSE_TAKEN);
    for (int k = 0; k < 100; k++) {
        tick(&at, 1);
        assert_true(place(&at) <= 0.001);
    }
}

TEST(a_pose_far_away_that_is_confirmed_begins_anew)
{
    Moved at = begun_at(0.0, &HAND);
    tick(&at, 1);
    assert_int_equal(send(&at, pose_at(0.09)), POSE_DOUBTED);
    tick(&at, 1);
    expect_near(place(&at), 0.0, 0.0);
    assert_int_equal(send(&at, pose_at(0.0905)), POSE_JUMPED);
    expect_near(place(&at), 0.0905, 0.0);
    expect_near(at.motion.begin_position.x, 0.0905, 0.0); // nothing is swept
}

// Half a turn within a tick; the other sign of a quaternion is no turn.
TEST(a_flip_of_the_orientation_is_doubted)
{
    Moved at = begun_at(0.0, &HAND);
    ToolPose pose = pose_at(0.0);
    pose.orientation.w = -1.0;
    tick(&at, 1);
    assert_int_equal(send(&at, pose), POSE_TAKEN);
    pose.orientation = (Quat){0.0, 0.0, 1.0, 0.0};
    tick(&at, 1);
    assert_int_equal(send(&at, pose), POSE_DOUBTED);
}

// The hand may have gone far in a gap by the sender's clock; any clock is borne.
TEST(the_time_between_poses_is_the_senders)
{
    static const int64_t times[] = {INT64_MIN, -1, 0, 1, INT64_MAX};
    Moved at = begun_at(0.0, &HAND);
    tick(&at, 60);
    assert_int_equal(send(&at, pose_at(0.5)), POSE_TAKEN); // 8 m/s
    for (int k = 0; k < 5; k++) {
        ToolPose pose = pose_at(0.5);
        pose.utime = times[k];
        assert_int_equal(tool_motion_apply(&at.motion, at.tool, &pose, at.step, TICK, false),
                         k == 0 ? POSE_TAKEN : POSE_ALONE);
        pose.position.x = 0.6;
        const PoseVerdict verdict =
            tool_motion_apply(&at.motion, at.tool, &pose, at.step, TICK, false);
        assert_int_equal(verdict, POSE_DOUBTED);
        tick(&at, 1);
    }
}
