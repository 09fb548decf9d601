// Graspers and attachments in a tick. Step thread.
#include "dynamics/sim_data.h"

// Makes graspers grasp and release at the pose at the start of the tick.
void holding_stage(Sim *sim)
{
    for (int k = 0; k < sim->attachment_count; k++) {
        const int tool = attachment_options(sim->attachment[k])->tool;
        const ToolMotion *motion = tool >= 0 ? &sim->motion[tool] : NULL;
        Vec3 position = {0.0, 0.0, 0.0};
        Quat orientation = {1.0, 0.0, 0.0, 0.0};
        bool active = motion == NULL || motion->active;
        double grip = 0.0;
        if (motion != NULL && active) {
            tool_motion_at(motion, sim_pose_age(sim, motion), &position, &orientation);
            grip = tool_motion_grip(motion, sim_pose_age(sim, motion));
        }
        attachment_begin_tick(sim->attachment[k], active, grip, position, orientation);
    }
}

bool holding_mutes(const Sim *sim, int b, int tool)
{
    int k, end = holding_of(sim, b, &k);
    for (; k < end; k++)
        if (attachment_options(sim->attachment[k])->tool == tool &&
            attachment_mutes_contact(sim->attachment[k]))
            return true;
    return false;
}

// Adds the springs of attachments at one evaluation. All that a tool holds of a body together pulls
// with at most its max_force: beyond, it slips with that force.
void holding_add_forces(Sim *sim, int b, const Stage *stage, double substep_time, double h)
{
    int first, end = holding_of(sim, b, &first);
    Vec3 pull[SIM_TOOLS] = {{0.0, 0.0, 0.0}};
    for (int k = first; k < end; k++) {
        Attachment *attachment = sim->attachment[k];
        const int tool = attachment_options(attachment)->tool;
        if (!attachment_is_holding(attachment))
            continue;
        ToolPlacement at = {.orientation = {1.0, 0.0, 0.0, 0.0}};
        if (tool >= 0) {
            const ToolMotion *motion = &sim->motion[tool];
            double begin = sim_pose_age(sim, motion) + substep_time;
            at = tool_motion_within(motion, begin, begin + stage->at * h, h);
        }
        Vec3 force = attachment_evaluate(attachment, &at);
        if (tool >= 0)
            pull[tool] = vec3_add(pull[tool], force);
    }
    for (int k = first; k < end; k++) {
        const int tool = attachment_options(sim->attachment[k])->tool;
        double scale = 1.0;
        if (!attachment_is_holding(sim->attachment[k]))
            continue;
        if (tool >= 0 && sim->tool[tool].kind != TOOL_STATIC) {
            double size = vec3_length(pull[tool]), most = sim->tool[tool].max_force;
            scale = size > most ? most / size : 1.0;
        }
        attachment_apply(sim->attachment[k], scale, stage->weight * h);
    }
}
