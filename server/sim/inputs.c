// SPDX-License-Identifier: MIT
// What comes from outside while a scene runs: poses, loads, and states that replace the present
// one. Step thread, between two ticks.
#include "body/body.h"
#include "sim/sim_data.h"
#include "sim/hold/tie.h"
#include "sim/ahead.h"
#include "sim/cutting.h"
#include "sim/error.h"
#include "sim/estimate.h"
#include "sim/events.h"
#include "sim/guard/guard.h"
#include "sim/removing.h"
#include "sim/time_step.h"

#include <limits.h>
#include <math.h>

// ---------------------------------------------------------------------------------------------
// Poses and loads

// Tells of poses that no hand can have reached, at most ten times a second. A blade does not cut on
// its way there.
static void report_jump(Sim *sim, int tool, PoseVerdict verdict)
{
    ToolMotion *motion = &sim->motion[tool];
    const int id = sim->tool[tool].id;
    const int64_t now = sim->clock->step + 1;
    if (verdict == POSE_JUMPED) {
        cutting_lift(sim, tool);
        guard_renew(sim, -1);
    } else if (verdict != POSE_ALONE) {
        return;
    }
    if (motion->told_step > 0 && (double)(now - motion->told_step) * sim->tick < 0.1)
        return;
    motion->told_step = now;
    if (verdict == POSE_JUMPED)
        sim_report(sim, -1, "jump", "tool %d begins anew at a pose: no hand goes there so fast",
                   id);
    else
        sim_report(sim, -1, "jump", "tool %d: ignored a pose %.3g m away: no hand is so fast", id,
                   vec3_length(vec3_sub(motion->doubted_position, motion->pose_position)));
}

void sim_apply_pose(Sim *sim, int tool, const ToolPose *pose, bool hold)
{
    if (!guard_admits(sim, tool, pose))
        return;
    if (!pose->active)
        cutting_lift(sim, tool);
    ToolMotion *motion = &sim->motion[tool];
    if (pose->active && !motion->active)
        guard_renew(sim, -1); // it may start inside tissue
    const PoseVerdict verdict =
        tool_motion_apply(motion, &sim->tool[tool], pose, sim->clock->step, sim->tick, hold);
    report_jump(sim, tool, verdict);
}

bool sim_apply_load(Sim *sim, const LoadOptions *options, char *why, size_t why_size)
{
    // At least one tick, and an end that the counter of ticks can reach.
    double ticks = fmax(1.0, floor(options->duration / sim->tick + 0.5));
    int64_t end = sim->clock->step + (int64_t)fmin(ticks, 1e15);
    if (!loads_start(&sim->loads, sim->body, sim->body_count, options->body, options->center,
                     options->radius, options->force, end, why, why_size))
        return false;
    // Remember who sent it, so that the sender can be blamed.
    LoadRecord *record = &sim->loads.record[*sim->loads.count - 1];
    guard_renew(sim, -1);
    record->sender = options->sender;
    record->id = options->id;
    return true;
}

// ---------------------------------------------------------------------------------------------
// States

bool sim_check(const Sim *sim)
{
    for (int k = 0; k < sim->attachment_count; k++)
        if (!attachment_check(sim->attachment[k]))
            return false;
    for (int k = 0; k < sim->joint_count; k++)
        if (!attachment_check(sim->joint[k]))
            return false;
    for (int k = 0; k < sim->touch_count; k++)
        if (!touch_check(sim->touch[k]))
            return false;
    for (int k = 0; k < sim->contact_count; k++)
        if (!contact_check(sim->contact[k]))
            return false;
    for (int t = 0; t < sim->tool_count; t++)
        if (!tool_motion_check(&sim->motion[t], sim->clock->step))
            return false;
    // The time, and the rest, each by its owner.
    return sim->clock->step >= 0 && sim->clock->step <= INT64_MAX / 4 && settings_check(sim) &&
           sim->clock->next_load >= 0 && sim->clock->next_load <= sim->scene_load_count &&
           loads_check(&sim->loads, sim->body, sim->body_count) && cutting_check(sim) &&
           removing_check(sim) && ahead_check(sim) && guard_check(sim) && errors_check(sim) &&
           (sim->ties == NULL || ties_check(sim));
}

// A mesh changes about once per tick at most: clients of another run have no number this high.
static int number_by_step(const Sim *sim, int before)
{
    const int64_t step = sim->clock->step;
    return step > before ? (int)(step % (INT_MAX / 2)) : before;
}

// Recomputes what depends on the state. Meshes get new numbers, unless a body's state has the
// number that it had in `another_run`, whose numbers count instead of this run's.
static void follow_state(Sim *sim, bool another_run)
{
    // Estimates belong to the motion before.
    if (sim->stiffness != NULL)
        stiffness_forget(sim->stiffness);
    if (sim->estimator != NULL)
        estimate_forget(sim->estimator, sim->body_count);
    if (sim->errors != NULL)
        errors_forget(sim->errors, sim->body_count);
    for (int b = 0; b < sim->body_count; b++) {
        Body *body = &sim->body[b];
        // The state of another run brings that run's number of the mesh.
        const int before = body->mesh.topology;
        if (another_run && body_changes(body))
            body->mesh.topology = 0;
        const int known = body->mesh.topology;
        // The body derives its own tables from the state.
        if (body->ops->restored != NULL)
            body->ops->restored(body);
        if (!body_changes(body))
            continue;
        // Clients must see a newer number, or they keep the mesh that they have.
        if (!topology_is_newer(body->mesh.topology, known))
            body->mesh.topology =
                topology_after(another_run ? number_by_step(sim, before) : before);
        time_step_follow(sim, body);
    }
    if (sim->ties != NULL)
        ties_follow(sim);
    for (int k = 0; k < sim->touch_count; k++)
        touch_restored(sim->touch[k], sim->clock->step);
}

void sim_restored(Sim *sim)
{
    follow_state(sim, true);
}

void sim_reset(Sim *sim)
{
    SimClock clock = *sim->clock;
    state_unpack(sim->state, sim->start_state);
    *sim->clock = clock;
    follow_state(sim, false);
}

void sim_set_lockstep(Sim *sim, bool lockstep)
{
    sim->clock->lockstep = lockstep;
}
