// SPDX-License-Identifier: MIT
// Motion of a tool between poses. Step thread; pure arithmetic on plain data.
#include "sim/tool.h"

#include <string.h>

// How much of the time since the last pose the time to reach the newest one shrinks by. After a gap
// the tool is behind; with a half it catches up at twice the hand's speed at most.
static const double SHRINKS = 0.5;
// A sender that was silent for longer, since its hand rested, is followed as if for so long [s].
static const double LONGEST_PERIOD = 0.2;
// Time constant of the velocity that dampers feel [s]. With a lag of 5 ms, noise of 20 um in 1 kHz
// poses is 0.4 mm/s of speed instead of 28.
static const double CALM_TIME = 0.015;
static const double FASTEST_TURN = 100.0; // [rad/s] beyond which a pose is doubted

void tool_motion_init(ToolMotion *motion)
{
    const Quat none = {1.0, 0.0, 0.0, 0.0};
    memset(motion, 0, sizeof *motion);
    motion->from_orientation = motion->to_orientation = none;
    motion->begin_orientation = motion->end_orientation = none;
    motion->pose_orientation = motion->doubted_orientation = none;
}

static bool is_turn(Quat q)
{
    return fabs(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z - 1.0) < 1e-3;
}

// True within far more than poses may contain.
static bool is_near(Vec3 v)
{
    return vec3_length(v) < 1e9;
}

static bool is_one_of_two(int64_t flag)
{
    return flag == 0 || flag == 1;
}

static bool is_grip(double grip)
{
    return grip >= 0.0 && grip <= 1.0;
}

static bool is_time(double time)
{
    return time >= 0.0 && time < 1e9;
}

bool tool_motion_check(const ToolMotion *motion, int64_t step)
{
    return is_one_of_two(motion->active) && is_one_of_two(motion->held) &&
           is_one_of_two(motion->doubted) && motion->pose_step >= 0 && motion->pose_step <= step &&
           motion->told_step >= 0 && motion->told_step <= step + 1 && is_time(motion->period) &&
           is_time(motion->reach) && is_grip(motion->from_grip) && is_grip(motion->to_grip) &&
           is_near(motion->from_position) && is_turn(motion->from_orientation) &&
           is_near(motion->to_position) && is_turn(motion->to_orientation) &&
           is_near(motion->begin_position) && is_turn(motion->begin_orientation) &&
           is_near(motion->end_position) && is_turn(motion->end_orientation) &&
           is_near(motion->linear) && is_near(motion->angular) && is_near(motion->calm_linear) &&
           is_near(motion->calm_angular) && is_near(motion->pose_position) &&
           is_turn(motion->pose_orientation) && is_near(motion->doubted_position) &&
           is_turn(motion->doubted_orientation);
}

// The rotation that leads from one orientation to another, the shorter way.
static Vec3 turn_between(Quat from, Quat to)
{
    return quat_to_rotation(quat_multiply(to, quat_conjugate(from)));
}

static Quat turned(Quat from, Vec3 rotation)
{
    return quat_unit(quat_multiply(quat_from_rotation(rotation), from));
}

// ---------------------------------------------------------------------------------------------
// Poses

// Measures the period, which follows slow changes of the sender's rate and jumps with sudden ones.
// Arrivals are counted in ticks, so that a logged run repeats exactly.
static double measured_period(double period, double since, double tick)
{
    since = fmin(since, LONGEST_PERIOD);
    if (since < tick)
        return period > tick ? period : tick; // several poses in one tick
    if (period > 0.0 && since > 0.5 * period && since < 2.0 * period)
        return period + 0.25 * (since - period);
    return since;
}

// True if a hand can have gone from one place to another between the two times of their sender; at
// least a tick has passed, whatever the sender's clock says.
static bool can_go(const ToolOptions *tool, Vec3 from, Quat turn, int64_t utime, const ToolPose *to,
                   double tick)
{
    if (tool->fastest == 0.0)
        return true;
    const double time = fmax(tick, 1e-6 * ((double)to->utime - (double)utime));
    return vec3_length(vec3_sub(to->position, from)) <= tool->fastest * time &&
           vec3_length(turn_between(turn, to->orientation)) <= FASTEST_TURN * time;
}

// Finds out whether to believe a pose of an active tool.
static PoseVerdict judge(ToolMotion *motion, const ToolOptions *tool, const ToolPose *pose,
                         double tick)
{
    const bool doubted = motion->doubted != 0;
    motion->doubted = 0;
    if (can_go(tool, motion->pose_position, motion->pose_orientation, motion->pose_utime, pose,
               tick))
        return doubted ? POSE_ALONE : POSE_TAKEN;
    if (doubted && can_go(tool, motion->doubted_position, motion->doubted_orientation,
                          motion->doubted_utime, pose, tick))
        return POSE_JUMPED;
    motion->doubted = 1;
    motion->doubted_utime = pose->utime;
    motion->doubted_position = pose->position;
    motion->doubted_orientation = pose->orientation;
    return POSE_DOUBTED;
}

// Where the target is, so long after the newest pose.
static void target_at(const ToolMotion *motion, double since, Vec3 *position, Quat *orientation)
{
    const double s = since < motion->reach ? since / motion->reach : 1.0;
    const Vec3 turn = turn_between(motion->from_orientation, motion->to_orientation);
    *position =
        vec3_madd(motion->from_position, s, vec3_sub(motion->to_position, motion->from_position));
    *orientation = turned(motion->from_orientation, vec3_scale(s, turn));
}

// The tool is at a pose, and at rest.
static void begin_at(ToolMotion *motion, const ToolPose *pose)
{
    const int64_t told = motion->told_step;
    tool_motion_init(motion);
    motion->told_step = told;
    motion->active = 1;
    motion->from_grip = pose->grip;
    motion->from_position = motion->begin_position = motion->end_position = pose->position;
    motion->from_orientation = motion->begin_orientation = motion->end_orientation =
        pose->orientation;
}

// The target moves on from where it is.
static void go_on(ToolMotion *motion, int64_t step, double tick)
{
    const double since = (double)(step - motion->pose_step) * tick;
    Vec3 position;
    Quat orientation;
    target_at(motion, since, &position, &orientation);
    motion->from_position = position;
    motion->from_orientation = orientation;
    motion->from_grip = tool_motion_grip(motion, step, tick);
    motion->period = measured_period(motion->period, since, tick);
    motion->reach = fmax(motion->period, motion->reach - SHRINKS * since);
}

PoseVerdict tool_motion_apply(ToolMotion *motion, const ToolOptions *tool, const ToolPose *pose,
                              int64_t step, double tick, bool hold)
{
    if (!pose->active) {
        tool_motion_init(motion);
        return POSE_TAKEN;
    }
    PoseVerdict verdict = POSE_TAKEN;
    if (motion->active && !hold && !motion->held)
        verdict = judge(motion, tool, pose, tick);
    if (verdict == POSE_DOUBTED)
        return verdict;
    if (!motion->active || hold || verdict == POSE_JUMPED)
        begin_at(motion, pose);
    else
        go_on(motion, step, tick);
    motion->held = hold;
    motion->pose_utime = pose->utime;
    motion->pose_step = step;
    motion->to_grip = pose->grip;
    motion->pose_position = motion->to_position = pose->position;
    motion->pose_orientation = motion->to_orientation = pose->orientation;
    if (pose->twist_valid && !hold && motion->reach > 0.0) {
        motion->to_position = vec3_madd(pose->position, motion->reach, pose->linear);
        motion->to_orientation =
            turned(pose->orientation, vec3_scale(motion->reach, pose->angular));
    }
    return verdict;
}

// ---------------------------------------------------------------------------------------------
// A tick

// A critically damped filter of rate w [1/s] that follows a target which leaves 0 at the velocity
// `target`: x'' = w^2 (target t - x) - 2 w x'. Its exact solution after the time t: where it is,
// and its velocity.
static void follow(double w, double t, Vec3 target, Vec3 *x, Vec3 *v)
{
    // It ends 2 / w behind the target; `off` is what it is away from there.
    const Vec3 off = vec3_madd(*x, 2.0 / w, target), rate = vec3_sub(*v, target);
    const Vec3 slope = vec3_madd(rate, w, off);
    const double left = exp(-w * t);
    const Vec3 now = vec3_scale(left, vec3_madd(off, t, slope));
    *x = vec3_madd(now, t - 2.0 / w, target);
    *v = vec3_add(target, vec3_madd(vec3_scale(left, slope), -w, now));
}

void tool_motion_step(ToolMotion *motion, double lag, int64_t step, double tick)
{
    motion->begin_position = motion->end_position;
    motion->begin_orientation = motion->end_orientation;
    const double since = (double)(step - motion->pose_step) * tick;
    Vec3 before, after;
    Quat turn_before, turn_after;
    target_at(motion, since, &before, &turn_before);
    target_at(motion, since + tick, &after, &turn_after);
    // Seen from where the target is as the tick begins.
    const Vec3 target = vec3_scale(1.0 / tick, vec3_sub(after, before)),
               turning = vec3_scale(1.0 / tick, turn_between(turn_before, turn_after));
    if (lag > 1e-9) {
        Vec3 x = vec3_sub(motion->begin_position, before),
             turn = turn_between(turn_before, motion->begin_orientation);
        follow(2.0 / lag, tick, target, &x, &motion->linear);
        follow(2.0 / lag, tick, turning, &turn, &motion->angular);
        motion->end_position = vec3_add(before, x);
        motion->end_orientation = turned(turn_before, turn);
    } else {
        motion->linear = target;
        motion->angular = turning;
        motion->end_position = after;
        motion->end_orientation = turn_after;
    }
    const ToolPlacement now = tool_motion_within(motion, 0.0, tick);
    const double part = 1.0 - exp(-tick / CALM_TIME);
    motion->calm_linear =
        vec3_madd(motion->calm_linear, part, vec3_sub(now.linear, motion->calm_linear));
    motion->calm_angular =
        vec3_madd(motion->calm_angular, part, vec3_sub(now.angular, motion->calm_angular));
}

void tool_motion_at(const ToolMotion *motion, double fraction, Vec3 *position, Quat *orientation)
{
    const Vec3 turn = turn_between(motion->begin_orientation, motion->end_orientation);
    *position = vec3_madd(motion->begin_position, fraction,
                          vec3_sub(motion->end_position, motion->begin_position));
    *orientation = turned(motion->begin_orientation, vec3_scale(fraction, turn));
}

ToolPlacement tool_motion_within(const ToolMotion *motion, double fraction, double tick)
{
    ToolPlacement at;
    tool_motion_at(motion, fraction, &at.position, &at.orientation);
    at.linear = vec3_scale(1.0 / tick, vec3_sub(motion->end_position, motion->begin_position));
    at.angular =
        vec3_scale(1.0 / tick, turn_between(motion->begin_orientation, motion->end_orientation));
    return at;
}

double tool_motion_grip(const ToolMotion *motion, int64_t step, double tick)
{
    const double since = (double)(step - motion->pose_step) * tick;
    return since + 0.5 * tick >= motion->reach ? motion->to_grip : motion->from_grip;
}
