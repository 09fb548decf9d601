// SPDX-License-Identifier: MIT
// Tools: their description in a scene, and their positions at any time of a tick.
#ifndef PLIANT_SIM_TOOL_H
#define PLIANT_SIM_TOOL_H

#include "base/vec.h"

#include <stdbool.h>
#include <stdint.h>

enum { TOOL_SHAPES = 8 };

typedef enum ToolKind {
    TOOL_PROBE,   // moved by poses; spheres and capsules
    TOOL_STATIC,  // never moves; planes and capsules in the world frame
    TOOL_BLADE,   // moved by poses; cuts along its edge; its capsules (the back), if any, push
    TOOL_GRASPER, // moved by poses; grasps the nodes in its capsules when it closes
    TOOL_KIND_COUNT,
} ToolKind;

typedef struct Capsule {
    Vec3 from, to; // axis in the tool frame [m]; a sphere when equal
    double radius; // [m] > 0
} Capsule;

typedef struct Plane {
    Vec3 point;  // [m]
    Vec3 normal; // unit, towards the free side
} Plane;

// A tool as in the scene; constant.
typedef struct ToolOptions {
    int id; // unique in the scene; tool_pose_t.tool
    ToolKind kind;
    int capsule_count;
    Capsule capsule[TOOL_SHAPES];
    bool has_plane; // static tools only
    Plane plane;
    Vec3 edge[2];     // of blades: the ends, in the tool frame [m]
    double max_force; // [N], of tools moved by poses: the proxy yields beyond it; > 0
    bool has_friction;
    double friction;       // mu, if the tool has its own; else that of the body
    double grip_stiffness; // of graspers: g, relative to the body's own stiffness (attachment.h)
    double grip_damping;   // of graspers: damping ratio
} ToolOptions;

// One accepted tool_pose_t.
typedef struct ToolPose {
    int64_t utime; // of the sender [us]
    Vec3 position; // world [m]
    Quat orientation;
    Vec3 linear, angular; // twist, world [m/s], [rad/s]
    bool twist_valid;
    bool active;
    double grip;
} ToolPose;

// A rigid motion at one instant.
typedef struct ToolPlacement {
    Vec3 position;
    Quat orientation;
    Vec3 linear, angular; // [m/s], [rad/s] about `position`
} ToolPlacement;

// Position and motion of a tool. Between two poses it moves over one measured pose period (towards
// the newest pose, or along its twist from it), never further. Plain data, part of the state.
typedef struct ToolMotion {
    int64_t active;       // 0 or 1 (whole words: no padding in the state)
    int64_t pose_utime;   // of the newest pose
    int64_t pose_step;    // tick at which it was applied
    int64_t follow_twist; // 0 or 1
    double period;        // measured time between poses [s]; 0: take effect at once
    double from_grip;     // when the newest pose arrived: 0 open, 1 closed
    double to_grip;       // of the newest pose
    Vec3 from_position;   // the tool's position when the newest pose arrived
    Quat from_orientation;
    Vec3 to_position; // the newest pose
    Quat to_orientation;
    Vec3 linear, angular;
} ToolMotion;

void tool_motion_init(ToolMotion *motion);
// True if the state read from a checkpoint is consistent before tick `step`.
bool tool_motion_check(const ToolMotion *motion, int64_t step);
// Applies a pose at the start of tick `step`; tick length [s]. `hold`: lockstep, the pose takes
// effect at once. An inactive pose withdraws the tool.
void tool_motion_apply(ToolMotion *motion, const ToolPose *pose, int64_t step, double tick,
                       bool hold);
// Computes the tool's pose `time` seconds after the start of the tick in which the newest pose was
// applied.
void tool_motion_at(const ToolMotion *motion, double time, Vec3 *position, Quat *orientation);
// Returns its grip: that of a pose takes effect when the tool has reached the pose.
double tool_motion_grip(const ToolMotion *motion, double time);
// The same as tool_motion_at with the mean velocity over the substep [begin, begin + h] in which
// `time` lies.
ToolPlacement tool_motion_within(const ToolMotion *motion, double begin, double time, double h);

#endif
