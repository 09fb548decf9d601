// SPDX-License-Identifier: MIT
// Motion of a tool between poses. Step thread; pure arithmetic on plain data.
#include "sim/tool.h"

#include <string.h>

void tool_motion_init(ToolMotion *motion)
{
    memset(motion, 0, sizeof *motion);
    motion->from_orientation = motion->to_orientation = (Quat){1.0, 0.0, 0.0, 0.0};
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

static bool is_grip(double grip)
{
    return grip >= 0.0 && grip <= 1.0;
}

bool tool_motion_check(const ToolMotion *motion, int64_t step)
{
    return (motion->active == 0 || motion->active == 1) &&
           (motion->follow_twist == 0 || motion->follow_twist == 1) && motion->pose_step >= 0 &&
           motion->pose_step <= step && motion->period >= 0.0 && motion->period < 1e9 &&
           is_grip(motion->from_grip) && is_grip(motion->to_grip) &&
           is_near(motion->from_position) && is_turn(motion->from_orientation) &&
           is_near(motion->to_position) && is_turn(motion->to_orientation) &&
           is_near(motion->linear) && is_near(motion->angular);
}

// Measures the period, which follows slow changes of the sender's rate and jumps with sudden ones.
// Arrivals are counted in ticks, so that a logged run repeats exactly.
static double measured_period(double period, double since, double tick)
{
    if (since < tick)
        return period > tick ? period : tick; // several poses in one tick
    if (period > 0.0 && since > 0.5 * period && since < 2.0 * period)
        return period + 0.25 * (since - period);
    return since;
}

void tool_motion_apply(ToolMotion *motion, const ToolPose *pose, int64_t step, double tick,
                       bool hold)
{
    // An inactive pose withdraws the tool.
    if (!pose->active) {
        tool_motion_init(motion);
        return;
    }
    // It moves on from where it is; the first pose and those of lockstep take effect at once.
    double since = (double)(step - motion->pose_step) * tick;
    if (motion->active && !hold) {
        tool_motion_at(motion, since, &motion->from_position, &motion->from_orientation);
        motion->from_grip = tool_motion_grip(motion, since);
        motion->period = measured_period(motion->period, since, tick);
    } else {
        motion->from_grip = pose->grip;
        motion->from_position = pose->position;
        motion->from_orientation = pose->orientation;
        motion->period = 0.0;
    }
    motion->active = 1;
    motion->pose_utime = pose->utime;
    motion->pose_step = step;
    motion->follow_twist = pose->twist_valid && !hold;
    motion->to_position = pose->position;
    motion->to_orientation = pose->orientation;
    motion->to_grip = pose->grip;
    motion->linear = pose->linear;
    motion->angular = pose->angular;
}

void tool_motion_at(const ToolMotion *motion, double time, Vec3 *position, Quat *orientation)
{
    // Along the twist, for one period at most.
    if (motion->follow_twist) {
        double t = time < motion->period ? time : motion->period;
        *position = vec3_madd(motion->to_position, t, motion->linear);
        *orientation = quat_unit(quat_multiply(quat_from_rotation(vec3_scale(t, motion->angular)),
                                               motion->to_orientation));
        return;
    }
    // Else from where it was to the newest pose, and no further.
    double s = time < motion->period ? time / motion->period : 1.0;
    *position =
        vec3_madd(motion->from_position, s, vec3_sub(motion->to_position, motion->from_position));
    Quat turn = quat_multiply(motion->to_orientation, quat_conjugate(motion->from_orientation));
    *orientation = quat_unit(quat_multiply(
        quat_from_rotation(vec3_scale(s, quat_to_rotation(turn))), motion->from_orientation));
}

double tool_motion_grip(const ToolMotion *motion, double time)
{
    return motion->follow_twist || time >= motion->period ? motion->to_grip : motion->from_grip;
}

ToolPlacement tool_motion_within(const ToolMotion *motion, double begin, double time, double h)
{
    ToolPlacement at;
    Vec3 from, to;
    // The mean velocity over the substep is what the proxy and dampers feel.
    Quat from_turn, to_turn;
    tool_motion_at(motion, begin, &from, &from_turn);
    tool_motion_at(motion, begin + h, &to, &to_turn);
    tool_motion_at(motion, time, &at.position, &at.orientation);
    Quat turn = quat_multiply(to_turn, quat_conjugate(from_turn));
    at.linear = vec3_scale(1.0 / h, vec3_sub(to, from));
    at.angular = vec3_scale(1.0 / h, quat_to_rotation(turn));
    return at;
}
