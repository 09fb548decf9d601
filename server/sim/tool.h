// SPDX-License-Identifier: MIT
// Tools: their description in a scene, and their positions at any time of a tick.
#ifndef PLIANT_SIM_TOOL_H
#define PLIANT_SIM_TOOL_H

#include "base/vec.h"
#include "body/remove.h"

#include <stdbool.h>
#include <stdint.h>

enum { TOOL_SHAPES = 8 };

typedef enum ToolKind {
    TOOL_PROBE,   // moved by poses; spheres and capsules
    TOOL_STATIC,  // never moves; planes and capsules in the world frame
    TOOL_BLADE,   // moved by poses; cuts along its edge; its capsules (the back), if any, push
    TOOL_GRASPER, // moved by poses; grasps the nodes in its capsules when it closes
    TOOL_REMOVER, // moved by poses; takes tissue away at its mouth while its pedal is down
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
    Vec3 edge[2]; // of blades: the ends, in the tool frame [m]
    RemoverKind removes;
    Capsule mouth;     // of removers: mouth, burr or electrode; a burr is also the last capsule
    double rate_mm3_s; // of suction and drills; 0: no limit
    double power;      // of diathermy [W]
    double max_force;  // [N], of tools moved by poses: the proxy yields beyond it; > 0
    bool has_friction;
    double friction;       // mu, if the tool has its own; else that of the body
    double grip_stiffness; // of graspers: g, relative to the body's own stiffness (attachment.h)
    double grip_damping;   // of graspers: damping ratio
    double lag;            // behind a steady hand [s] >= 0
    double fastest;        // speed beyond which a pose needs a second one [m/s]; 0: none
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

// Position and motion of a tool (server/sim/README.md, "Tools between poses"). A target goes to the
// newest pose in about one measured pose period, and the tool after it by a critically damped
// filter. All that happens in a tick is linear in it. Plain data, part of the state.
typedef struct ToolMotion {
    int64_t active;     // 0 or 1 (whole words: no padding in the state)
    int64_t pose_utime; // of the newest pose
    int64_t pose_step;  // tick at which it was applied
    int64_t held;       // 0 or 1: lockstep, the tool is at the pose at once
    double period;      // measured time between poses [s]; 0: none yet
    double reach;       // time from the newest pose until the target arrives [s]
    double from_grip;   // when the newest pose arrived: 0 open, 1 closed
    double to_grip;     // of the newest pose
    // The target: where it was when the newest pose arrived, and where it goes.
    Vec3 from_position;
    Quat from_orientation;
    Vec3 to_position;
    Quat to_orientation;
    // The tool at the begin and the end of the present tick; its velocity at the end.
    Vec3 begin_position;
    Quat begin_orientation;
    Vec3 end_position;
    Quat end_orientation;
    Vec3 linear, angular; // [m/s], [rad/s]
    // Its velocity without the noise of poses, which dampers feel.
    Vec3 calm_linear, calm_angular; // [m/s], [rad/s]
    // The newest pose that was believed, and one that waits for another to confirm it.
    Vec3 pose_position;
    Quat pose_orientation;
    int64_t told_step; // after the tick in which a jump was last told of; 0: never
    int64_t doubted;   // 0 or 1: there is one that waits
    int64_t doubted_utime;
    Vec3 doubted_position;
    Quat doubted_orientation;
} ToolMotion;

// What became of a pose.
typedef enum PoseVerdict {
    POSE_TAKEN,
    POSE_DOUBTED, // no hand moves so fast: kept back until another confirms it
    POSE_ALONE,   // taken; the one that was kept back before it stays alone
    POSE_JUMPED,  // taken: it confirms the one kept back, and the tool begins anew there
} PoseVerdict;

void tool_motion_init(ToolMotion *motion);
// True if the state read from a checkpoint is consistent before tick `step`.
bool tool_motion_check(const ToolMotion *motion, int64_t step);
// Applies a pose at the start of tick `step`, before tool_motion_step; tick length [s]. `hold`:
// lockstep, the pose takes effect at once, believed or not. An inactive pose withdraws the tool.
PoseVerdict tool_motion_apply(ToolMotion *motion, const ToolOptions *tool, const ToolPose *pose,
                              int64_t step, double tick, bool hold);
// Moves an active tool through tick `step`. Once per tick, before the functions below.
void tool_motion_step(ToolMotion *motion, double lag, int64_t step, double tick);
// Computes the tool's position at a fraction of the present tick; 1: its end.
void tool_motion_at(const ToolMotion *motion, double fraction, Vec3 *position, Quat *orientation);
// The same with the mean velocity over the tick.
ToolPlacement tool_motion_within(const ToolMotion *motion, double fraction, double tick);
// Returns the grip at the start of tick `step`: that of a pose takes effect when the target has
// reached the pose.
double tool_motion_grip(const ToolMotion *motion, int64_t step, double tick);

#endif
