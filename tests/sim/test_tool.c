// SPDX-License-Identifier: MIT
// Where a tool is between poses.
#include "test.h"
#include "sim/tool.h"

static const double TICK = 1e-3;
static const double PI = 3.14159265358979323846;

static ToolPose pose_at(double x)
{
    return (ToolPose){
        .position = {x, 0.0, 0.0}, .orientation = {1.0, 0.0, 0.0, 0.0}, .active = true};
}

static void go(ToolMotion *motion, double x, int64_t step)
{
    const ToolPose pose = pose_at(x);
    tool_motion_apply(motion, &pose, step, TICK, false);
}

static ToolMotion begun_at(double x, int64_t step)
{
    ToolMotion motion;
    tool_motion_init(&motion);
    go(&motion, x, step);
    return motion;
}

// Position along x at `time`.
static double place(const ToolMotion *motion, double time)
{
    Vec3 position;
    Quat orientation;
    tool_motion_at(motion, time, &position, &orientation);
    return position.x;
}

TEST(first_pose_is_taken_at_once)
{
    ToolMotion motion;
    tool_motion_init(&motion);
    assert_false(motion.active);
    go(&motion, 0.3, 100);
    assert_true(motion.active);
    expect_near(place(&motion, 0.0), 0.3, 0.0);
    expect_near(place(&motion, 5.0), 0.3, 0.0);
}

TEST(tool_moves_over_one_measured_period_and_no_further)
{
    ToolMotion motion = begun_at(0.0, 100);
    go(&motion, 0.1, 110); // 10 ms later
    expect_near(place(&motion, 0.0), 0.0, 0.0);
    for (int k = 0; k <= 10; k++)
        expect_near(place(&motion, k * TICK), 0.01 * k, 1e-15); // rounding
    expect_near(place(&motion, 1.0), 0.1, 1e-16);
}

TEST(tool_does_not_jump_when_a_pose_comes_early_or_late)
{
    static const int arrivals[] = {0, 10, 20, 27, 45, 46, 47, 100, 110};
    ToolMotion motion;
    tool_motion_init(&motion);
    for (int k = 0; k < 9; k++) {
        ToolPose pose = pose_at(0.01 * k);
        double before = k == 0 ? 0.0 : place(&motion, (arrivals[k] - arrivals[k - 1]) * TICK);
        tool_motion_apply(&motion, &pose, arrivals[k], TICK, false);
        expect_near(place(&motion, 0.0), before, 1e-15);
        expect_near(place(&motion, 1e3), 0.01 * k, 1e-15);
    }
}

TEST(period_follows_the_sender)
{
    ToolMotion motion;
    tool_motion_init(&motion);
    ToolPose pose = pose_at(0.0);
    int64_t step = 0;
    tool_motion_apply(&motion, &pose, step, TICK, false);
    for (int k = 0; k < 50; k++)
        tool_motion_apply(&motion, &pose, step += 10, TICK, false);
    expect_near(motion.period, 0.010, 1e-15);
    for (int k = 0; k < 50; k++) // slowly: a quarter of the way a pose
        tool_motion_apply(&motion, &pose, step += 12, TICK, false);
    expect_near(motion.period, 0.012, 1e-8);                     // 0.75^50 of 2 ms is left
    tool_motion_apply(&motion, &pose, step += 100, TICK, false); // at once
    expect_near(motion.period, 0.100, 1e-15);
}

TEST(several_poses_in_one_tick_end_at_the_newest)
{
    ToolMotion motion = begun_at(0.0, 5);
    for (int k = 1; k <= 3; k++) {
        go(&motion, 0.1 * k, 5);
    }
    expect_near(place(&motion, 0.0), 0.0, 0.0);
    expect_near(place(&motion, TICK), 0.3, 1e-16);
    assert_true(motion.period > 0.0);
}

TEST(valid_twist_carries_the_tool_for_one_period)
{
    ToolMotion motion = begun_at(0.0, 0);
    ToolPose pose = pose_at(0.1);
    pose.twist_valid = true;
    pose.linear = vec3(2.0, 0.0, 0.0);
    pose.angular = vec3(0.0, 0.0, 0.5 * PI / 0.02); // a quarter turn in 20 ms
    tool_motion_apply(&motion, &pose, 20, TICK, false);
    expect_near(place(&motion, 0.0), 0.1, 0.0);
    expect_near(place(&motion, 0.01), 0.12, 1e-15);
    expect_near(place(&motion, 0.02), 0.14, 1e-15);
    expect_near(place(&motion, 0.9), 0.14, 1e-15); // never further
    Vec3 position;
    Quat orientation;
    tool_motion_at(&motion, 0.02, &position, &orientation);
    Vec3 turned = quat_rotate(orientation, vec3(1.0, 0.0, 0.0));
    expect_near(turned.x, 0.0, 1e-14);
    expect_near(turned.y, 1.0, 1e-14);
}

TEST(orientation_turns_evenly_along_the_shorter_way)
{
    for (int sign = -1; sign <= 1; sign += 2) { // q and -q are the same rotation
        ToolMotion motion = begun_at(0.0, 0);
        ToolPose pose = pose_at(0.0);
        Quat q = quat_from_rotation(vec3(0.0, 0.0, 1.2));
        pose.orientation = (Quat){sign * q.w, sign * q.x, sign * q.y, sign * q.z};
        tool_motion_apply(&motion, &pose, 10, TICK, false);
        for (int k = 0; k <= 4; k++) {
            Vec3 position;
            Quat orientation;
            tool_motion_at(&motion, 0.0025 * k, &position, &orientation);
            Vec3 turned = quat_rotate(orientation, vec3(1.0, 0.0, 0.0));
            expect_near(atan2(turned.y, turned.x), 0.3 * k, 1e-14); // a few roundings
            expect_near(turned.z, 0.0, 1e-14);
        }
    }
}

TEST(held_pose_is_taken_at_once_without_its_twist)
{
    ToolMotion motion = begun_at(0.0, 0);
    ToolPose pose = pose_at(0.2);
    pose.twist_valid = true;
    pose.linear = vec3(2.0, 0.0, 0.0);
    tool_motion_apply(&motion, &pose, 10, TICK, true);
    expect_near(place(&motion, 0.0), 0.2, 0.0);
    expect_near(place(&motion, 0.01), 0.2, 0.0);
}

TEST(inactive_pose_withdraws_the_tool_and_the_next_is_a_first_one)
{
    ToolMotion motion = begun_at(0.1, 0);
    ToolPose pose = pose_at(0.1);
    pose.active = false;
    tool_motion_apply(&motion, &pose, 10, TICK, false);
    assert_false(motion.active);
    go(&motion, 0.7, 20);
    assert_true(motion.active);
    expect_near(place(&motion, 0.0), 0.7, 0.0); // does not sweep from where it was
}
