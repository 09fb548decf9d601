// SPDX-License-Identifier: MIT
// Makes a scene's bodies, tools and loads, and answers questions about them; step.c runs them,
// inputs.c changes them.
#include "base/check.h"
#include "sim/sim_data.h"
#include "sim/hold/tie.h"
#include "sim/ahead.h"
#include "sim/cutting.h"
#include "sim/removing.h"
#include "sim/guard/guard.h"
#include "sim/time_step.h"
#include "sim/error.h"
#include "sim/estimate.h"
#include "sim/events.h"
#include "sim/step.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Allocates for what the scene has, if that is known.
static void create_arrays(Sim *sim)
{
    // Without counts there is space for the largest scene.
    const SimCounts most = {SIM_BODIES, SIM_TOOLS, SIM_SCENE_LOADS, SIM_ATTACHMENTS, SIM_TOUCHES};
    const SimCounts capacity = sim->capacity =
        sim->options.counts.bodies > 0 ? sim->options.counts : most;
    Arena *arena = sim->arena;
    // No array for what the scene has none of.
    sim->body =
        arena_allocate(arena, ARENA_STEP, (size_t)capacity.bodies, sizeof *sim->body, "sim/bodies");
    if (capacity.tools > 0)
        sim->tool = arena_allocate(arena, ARENA_STEP, (size_t)capacity.tools, sizeof *sim->tool,
                                   "sim/tools");
    if (capacity.loads > 0)
        sim->scene_load = arena_allocate(arena, ARENA_STEP, (size_t)capacity.loads,
                                         sizeof *sim->scene_load, "sim/loads");
    sim->group = arena_allocate(arena, ARENA_STEP, (size_t)capacity.bodies, sizeof *sim->group,
                                "sim/groups");
    // Indices by body are always there: with nothing of a body they are all 0.
    sim->contact_start = arena_allocate(arena, ARENA_STEP, (size_t)capacity.bodies + 1,
                                        sizeof *sim->contact_start, "sim/contact starts");
    sim->attachment_start = arena_allocate(arena, ARENA_STEP, (size_t)capacity.bodies + 1,
                                           sizeof *sim->attachment_start, "sim/holding starts");
    if (capacity.attachments + sim->options.max_ties > 0)
        sim->joint = arena_allocate(arena, ARENA_CONTACT,
                                    (size_t)(capacity.attachments + sim->options.max_ties),
                                    sizeof *sim->joint, "sim/joints");
    if (capacity.attachments > 0)
        sim->scene_attachment = arena_allocate(arena, ARENA_CONTACT, (size_t)capacity.attachments,
                                               sizeof *sim->scene_attachment, "sim/attachments");
    if (capacity.touches > 0)
        sim->touch = arena_allocate(arena, ARENA_CONTACT, (size_t)capacity.touches,
                                    sizeof *sim->touch, "sim/touches");
}

Sim *sim_create(const SimOptions *options, Arena *arena, StateList *state)
{
    Sim *sim = arena_allocate(arena, ARENA_STEP, 1, sizeof *sim, "sim");
    sim->options = *options;
    sim->arena = arena;
    sim->state = state;
    sim->tick = 1.0 / options->rate_hz;
    // Arrays, and what every scene has.
    create_arrays(sim);
    sim->clock = arena_allocate(arena, ARENA_STEP, 1, sizeof *sim->clock, "sim/clock");
    state_add(state, sim->clock, sizeof *sim->clock, "sim/clock");
    sim->events = arena_allocate(arena, ARENA_OUTPUT, 1, sizeof *sim->events, "sim/events");
    return sim;
}

// Gives a mesh the columns that its model does not fill: rows of what a free slot has.
static void complete_mesh(BodyMesh *mesh, const char *body, Arena *arena)
{
    const size_t nodes = (size_t)mesh->node_capacity, triangles = (size_t)mesh->triangle_capacity;
#define COMPLETE(name, type, width, of, empty, ...)                                                \
    if (mesh->name == NULL && MESH_SLOTS_##of(nodes, triangles) > 0) {                             \
        const size_t count = MESH_SLOTS_##of(nodes, triangles);                                    \
        type(*rows)[width] =                                                                       \
            arena_allocate(arena, ARENA_OUTPUT, count, sizeof *rows, "%s/" #name, body);           \
        for (size_t k = 0; k < count * (width); k++)                                               \
            rows[k / (width)][k % (width)] = empty;                                                \
        mesh->name = (void *)rows;                                                                 \
    }
    MESH_COLUMNS(COMPLETE)
}

Body *sim_add_body(Sim *sim, const Body *body)
{
    ASSERT(sim->body_count < sim->capacity.bodies);
    sim->body[sim->body_count] = *body;
    complete_mesh(&sim->body[sim->body_count].mesh, body->name, sim->arena);
    sim->group[sim->body_count] = (GroupMember){.first = sim->body_count, .next = -1};
    return &sim->body[sim->body_count++];
}

void sim_add_tool(Sim *sim, const ToolOptions *options)
{
    ASSERT(sim->tool_count < sim->capacity.tools);
    sim->tool[sim->tool_count++] = *options;
}

void sim_add_load(Sim *sim, const LoadOptions *options)
{
    ASSERT(sim->scene_load_count < sim->capacity.loads);
    int at = sim->scene_load_count++; // kept sorted by start; equal starts in the given order
    for (; at > 0 && sim->scene_load[at - 1].start > options->start; at--)
        sim->scene_load[at] = sim->scene_load[at - 1];
    sim->scene_load[at] = *options;
}

bool sim_add_attachment(Sim *sim, const AttachmentOptions *options, Status *status)
{
    ASSERT(sim->scene_attachment_count < sim->capacity.attachments);
    Body *body = &sim->body[options->body], *other = NULL;
    char name[56];
    snprintf(name, sizeof name, "%.31s/attachment%d", body->name, sim->scene_attachment_count);
    // Joined bodies advance stage by stage, so they must have the same stages.
    if (options->to == ATTACH_BODY && body->integrator != sim->body[options->to_body].integrator)
        return status_fail(status, STATUS_INVALID,
                           "attachment %d: joined bodies %s (%s) and %s (%s) must have one "
                           "integrator",
                           sim->scene_attachment_count, body->name,
                           integrator_name(body->integrator), sim->body[options->to_body].name,
                           integrator_name(sim->body[options->to_body].integrator));
    // A tie joins two groups of bodies, anything else hangs on one body alone.
    if (options->to == ATTACH_BODY)
        other = &sim->body[options->to_body];
    const ToolOptions *tool = options->to == ATTACH_TOOL ? &sim->tool[options->tool] : NULL;
    Attachment *attachment =
        attachment_create(name, options, tool, body, other, sim->arena, sim->state, status);
    if (attachment == NULL)
        return false;
    sim->scene_attachment[sim->scene_attachment_count++] = attachment;
    if (other != NULL) {
        time_step_group(sim, options->body, options->to_body);
        sim->joint[sim->joint_count++] = attachment;
    }
    return true;
}

bool sim_add_touch(Sim *sim, const TouchOptions *options, Status *status)
{
    ASSERT(sim->touch_count < sim->capacity.touches);
    Body *first = &sim->body[options->body[0]], *second = &sim->body[options->body[1]];
    // Bodies that touch advance stage by stage, so they must have the same stages.
    if (first->integrator != second->integrator)
        return status_fail(status, STATUS_INVALID,
                           "bodies %s (%s) and %s (%s), which touch, must have one integrator",
                           first->name, integrator_name(first->integrator), second->name,
                           integrator_name(second->integrator));
    for (int k = 0; k < 2; k++)
        if (sim->body[options->body[k]].half_thickness > 0.0)
            return status_fail(status, STATUS_INVALID,
                               "body %s is a plane body: those do not touch others",
                               sim->body[options->body[k]].name);
    const double edge = fmin(first->surface.longest_edge, second->surface.longest_edge);
    if (options->thickness > edge)
        return status_fail(status, STATUS_INVALID,
                           "thickness %g m is more than the longest edge of body %s, %g m",
                           options->thickness,
                           edge < first->surface.longest_edge ? second->name : first->name, edge);
    char name[32];
    snprintf(name, sizeof name, "touch%d", sim->touch_count);
    sim->touch[sim->touch_count++] =
        touch_create(name, options, first, second, sim->tick, sim->arena, sim->state);
    time_step_group(sim, options->body[0], options->body[1]);
    return true;
}

// ---------------------------------------------------------------------------------------------
// Sealing

// Creates the attachment of a grasper to a body.
static Attachment *create_grasp(Sim *sim, int b, int t)
{
    const ToolOptions *tool = &sim->tool[t];
    const AttachmentOptions options = {.body = b,
                                       .to = ATTACH_GRASPER,
                                       .tool = t,
                                       .stiffness = tool->grip_stiffness,
                                       .damping_ratio = tool->grip_damping};
    // A grasper has no region that could be without nodes: this cannot fail.
    char name[56];
    Status status = {0};
    snprintf(name, sizeof name, "%.31s/grasp%d", sim->body[b].name, t);
    return attachment_create(name, &options, tool, &sim->body[b], NULL, sim->arena, sim->state,
                             &status);
}

static void create_attachments(Sim *sim)
{
    // Each grasper may grasp every body.
    int graspers = 0;
    for (int t = 0; t < sim->tool_count; t++)
        graspers += sim->tool[t].kind == TOOL_GRASPER;
    int most = sim->scene_attachment_count - sim->joint_count + graspers * sim->body_count;
    most += sim->options.max_ties;
    if (most == 0)
        return;
    // Those of a body are consecutive: attachment_start leads to them.
    sim->attachment = arena_allocate(sim->arena, ARENA_CONTACT, (size_t)most,
                                     sizeof *sim->attachment, "attachments");
    sim->told = arena_allocate(sim->arena, ARENA_CONTACT, (size_t)most, sizeof *sim->told,
                               "attachments/told");
    // For each body the scene's own attachments, then the graspers.
    for (int b = 0; b < sim->body_count; b++) {
        for (int k = 0; k < sim->scene_attachment_count; k++) {
            const AttachmentOptions *own = attachment_options(sim->scene_attachment[k]);
            if (own->to != ATTACH_BODY && own->body == b)
                sim->attachment[sim->attachment_count++] = sim->scene_attachment[k];
        }
        for (int t = 0; t < sim->tool_count; t++)
            if (sim->tool[t].kind == TOOL_GRASPER)
                sim->attachment[sim->attachment_count++] = create_grasp(sim, b, t);
        sim->attachment_start[b + 1] = sim->attachment_count;
    }
}

static void create_contacts(Sim *sim)
{
    int most = 2 * sim->body_count * sim->tool_count; // a tool with a plane and capsules has two
    // Every tool has a motion and a wrench.
    sim->motion = arena_allocate(sim->arena, ARENA_STEP, (size_t)sim->tool_count,
                                 sizeof *sim->motion, "tools/motion");
    sim->wrench = arena_allocate(sim->arena, ARENA_STEP, (size_t)sim->tool_count,
                                 sizeof *sim->wrench, "tools/wrench");
    if (sim->tool_count == 0)
        return;
    // Contacts of a body are consecutive: contact_start leads to them.
    sim->contact =
        arena_allocate(sim->arena, ARENA_CONTACT, (size_t)most, sizeof *sim->contact, "contacts");
    sim->contact_tool = arena_allocate(sim->arena, ARENA_CONTACT, (size_t)most,
                                       sizeof *sim->contact_tool, "contacts/tool");
    // Static tools are active from the start, others from their first pose.
    for (int t = 0; t < sim->tool_count; t++) {
        tool_motion_init(&sim->motion[t]);
        sim->motion[t].active = sim->tool[t].kind == TOOL_STATIC;
    }
    state_add(sim->state, sim->motion, (size_t)sim->tool_count * sizeof *sim->motion,
              "tools/motion");
    // A tool has one contact with a body by its capsules and one by its plane.
    for (int b = 0; b < sim->body_count; b++) {
        for (int k = 0; k < 2 * sim->tool_count; k++) {
            const ToolOptions *tool = &sim->tool[k / 2];
            bool plane = k % 2 == 1;
            if (plane ? !tool->has_plane : tool->capsule_count == 0) // nothing to touch with
                continue;
            char name[56];
            snprintf(name, sizeof name, "%.31s/tool%d%s", sim->body[b].name, k / 2,
                     plane ? "p" : "");
            Contact *contact =
                contact_create(name, tool, plane, &sim->body[b], sim->arena, sim->state);
            sim->contact_tool[sim->contact_count] = k / 2;
            sim->contact[sim->contact_count++] = contact;
        }
        sim->contact_start[b + 1] = sim->contact_count;
    }
}

// Reserves space for all nodes that contacts and attachments can push in one evaluation.
static void reserve_forces(Sim *sim)
{
    if (sim->contact_count == 0 && sim->attachment == NULL && sim->joint_count == 0 &&
        sim->ties == NULL && sim->touch_count == 0)
        return;
    // Sum up what may push at the same time.
    for (int b = 0; b < sim->body_count; b++) {
        Body *body = &sim->body[b];
        int pushed = 0;
        if (body->ops->reserve_forces == NULL)
            continue;
        for (int k = sim->contact_start[b]; k < sim->contact_start[b + 1]; k++)
            pushed += contact_node_capacity(sim->contact[k]);
        for (int k = sim->attachment_start[b]; k < sim->attachment_start[b + 1]; k++)
            pushed += attachment_node_capacity(sim->attachment[k], body);
        // Ties push at both ends.
        for (int k = 0; k < sim->joint_count; k++)
            pushed += attachment_node_capacity(sim->joint[k], body);
        if (sim->ties != NULL)
            pushed += ties_node_capacity(sim);
        for (int k = 0; k < sim->touch_count; k++)
            for (int which = 0; which < touch_bodies(touch_options(sim->touch[k])); which++)
                if (touch_options(sim->touch[k])->body[which] == b)
                    pushed += touch_node_capacity(sim->touch[k], which);
        // The body makes space for it.
        body->ops->reserve_forces(body->model, body->name, pushed, sim->arena);
    }
}

bool sim_seal(Sim *sim, double settle_s, Status *status)
{
    // Steps of each body by itself, with the contacts' share in them.
    for (int b = 0; b < sim->body_count; b++) {
        time_step_cap_contacts(sim, &sim->body[b]);
        contact_set_stiffness(&sim->body[b]);
        if (!time_step_choose(sim, &sim->body[b], status))
            return false;
        state_add(sim->state, &sim->body[b].tuning, sizeof sim->body[b].tuning, "%s/tuning",
                  sim->body[b].name);
    }
    // Joints and steps depend on the contacts' stiffness, contacts and attachments on the steps.
    for (int k = 0; k < sim->joint_count; k++)
        joint_stiffen(sim->joint[k]);
    // Everything else that the scene needs, each when its inputs are known.
    cutting_create(sim);
    removing_create(sim);
    time_step_join(sim);
    create_contacts(sim);
    create_attachments(sim);
    if (sim->options.max_ties > 0)
        ties_create(sim);
    ahead_create(sim);
    reserve_forces(sim);
    guard_create(sim);
    if (sim->options.contact_stiffness && sim->contact_count > 0)
        sim->stiffness = stiffness_create(sim->contact, sim->contact_count, sim->tick, sim->arena);
    pipeline_create(sim);
    if (sim->options.may_load || sim->scene_load_count > 0)
        loads_create(&sim->loads, sim->body, sim->body_count, sim->arena, sim->state);

    sim->settling = true;
    // Let the bodies settle without loads; the step counter and events start after it.
    int64_t ticks = (int64_t)llround(settle_s / sim->tick);
    for (int64_t i = 0; i < ticks; i++)
        sim_step(sim);
    for (int b = 0; b < sim->body_count; b++)
        if (sim->body[b].ops->range != NULL)
            sim->body[b].ops->set(sim->body[b].model, BODY_SUPPLY, 0.0);
    // The run starts at 0, with no event.
    sim->settling = false;
    sim->clock->step = 0;
    cutting_settled(sim);
    sim->events->count = 0;
    // A scene that is bad at rest is refused.
    if (sim->resets > 0)
        return status_fail(
            status, STATUS_INVALID,
            "settle_s: settling gave numbers out of bounds %lld times; take a smaller "
            "time_step",
            (long long)sim->resets);
    for (int b = 0; b < sim->body_count; b++)
        if (!guard_can_be(&sim->body[b], status))
            return false;
    // Settling costs no time in the statistics.
    memset(sim->stage_ns, 0, sizeof sim->stage_ns);
    const double error_hz = sim->options.error_hz;
    if (sim->options.estimate_error || error_hz > 0.0)
        sim->estimator = estimate_create(sim->body, sim->body_count, sim->state, sim->arena);
    errors_create(sim);
    // RESET returns to this state.
    sim->start_state = arena_allocate(sim->arena, ARENA_OUTPUT, state_pack(sim->state, NULL), 1,
                                      "state at the start");
    state_pack(sim->state, sim->start_state);
    return true;
}

// ---------------------------------------------------------------------------------------------
// Queries

int64_t sim_steps(const Sim *sim)
{
    return sim->clock->step;
}

double sim_time(const Sim *sim)
{
    return (double)sim->clock->step / sim->options.rate_hz;
}

double sim_tick(const Sim *sim)
{
    return sim->tick;
}

int sim_body_count(const Sim *sim)
{
    return sim->body_count;
}

Body *sim_body(Sim *sim, int index)
{
    return &sim->body[index];
}

int sim_tool_count(const Sim *sim)
{
    return sim->tool_count;
}

const ToolOptions *sim_tool(const Sim *sim, int index)
{
    return &sim->tool[index];
}

const ToolMotion *sim_tool_motion(const Sim *sim, int index)
{
    return &sim->motion[index];
}

const ToolWrench *sim_wrench(const Sim *sim, int index)
{
    return &sim->wrench[index];
}

int64_t sim_resets(const Sim *sim)
{
    return sim->resets;
}

int64_t sim_refused_faces(const Sim *sim)
{
    int64_t refused = 0;
    for (int k = 0; k < sim->contact_count; k++)
        refused += contact_refused(sim->contact[k]);
    return refused;
}

int64_t sim_refused_touches(const Sim *sim)
{
    int64_t refused = 0;
    for (int k = 0; k < sim->touch_count; k++)
        refused += touch_refused(sim->touch[k]);
    return refused;
}

int sim_attachment_nodes(const Sim *sim, int index)
{
    bool points;
    return attachment_held(sim->scene_attachment[index], &points);
}

int64_t sim_refused_holds(const Sim *sim)
{
    int64_t refused = 0;
    for (int k = 0; k < sim->attachment_count; k++)
        refused += attachment_refused(sim->attachment[k]);
    for (int k = 0; k < sim->joint_count; k++)
        refused += attachment_refused(sim->joint[k]);
    if (sim->ties != NULL)
        refused += ties_refused(sim);
    return refused;
}

bool sim_next_grasp(Sim *sim, GraspEvent *event)
{
    for (int k = 0, graspers = 0; k < sim->attachment_count; k++) {
        const AttachmentOptions *options = attachment_options(sim->attachment[k]);
        // Only graspers are told.
        if (options->to != ATTACH_GRASPER)
            continue;
        GraspEvent *told = &sim->told[graspers++];
        GraspEvent now = {.tool = options->tool,
                          .body = options->body,
                          .taken = attachment_taken(sim->attachment[k]),
                          .slips = attachment_slipped(sim->attachment[k]),
                          .step = sim->clock->step};
        // Has it grasped or released anything since?
        now.nodes = attachment_held(sim->attachment[k], &now.points);
        now.slipped = now.nodes == 0 && now.slips != told->slips;
        bool same = now.taken == told->taken || (now.nodes == 0 && told->nodes == 0);
        if ((now.nodes > 0) == (told->nodes > 0) && same)
            continue;
        // A trembling grip is told at most ten times a second.
        if (told->taken > 0 && now.step >= told->step &&
            (double)(now.step - told->step) * sim->tick < 0.1)
            continue;
        *event = *told = now;
        return true;
    }
    return false;
}

void sim_try_step(Sim *sim, int body)
{
    if (!guard_is_frozen(sim, body))
        estimate_try(sim, body);
}

void sim_step_alone(Sim *sim, int index)
{
    const Body *body = &sim->body[index];
    advance_alone(sim, index, body->substeps);
    if (body->ops->abandon != NULL)
        body->ops->abandon(body->model);
    else
        body->ops->commit(body->model);
}

double sim_take_error(Sim *sim, int body)
{
    return estimate_take(sim->estimator, body);
}

int sim_stage_count(const Sim *sim)
{
    return sim->stage_count;
}

StageId sim_stage(const Sim *sim, int index)
{
    return sim->stage[index];
}

int64_t sim_stage_ns(const Sim *sim, StageId stage)
{
    return sim->stage_ns[stage];
}

void sim_add_stage_ns(Sim *sim, StageId stage, int64_t ns)
{
    sim->stage_ns[stage] += ns;
}
