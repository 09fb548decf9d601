// Makes and changes a scene's bodies, tools and loads; step.c runs them.
#include "dynamics/sim_data.h"

#include "base/check.h"
#include "dynamics/stability.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const stage_names[STAGE_COUNT] = {
    "inputs",  "tools",    "loads", "find contacts", "forces",
    "contact", "wrenches", "check", "snapshot",
};

const char *stage_name(StageId stage)
{
    return stage_names[stage];
}

Sim *sim_create(const SimOptions *options, Arena *arena, StateList *state)
{
    Sim *sim = arena_allocate(arena, ARENA_STEP, 1, sizeof *sim, "sim");
    sim->options = *options;
    sim->arena = arena;
    sim->state = state;
    sim->tick = 1.0 / options->rate_hz;
    sim->clock = arena_allocate(arena, ARENA_STEP, 1, sizeof *sim->clock, "sim/clock");
    state_add(state, sim->clock, sizeof *sim->clock, "sim/clock");
    return sim;
}

Body *sim_add_body(Sim *sim, const Body *body)
{
    ASSERT(sim->body_count < SIM_BODIES);
    sim->body[sim->body_count] = *body;
    return &sim->body[sim->body_count++];
}

void sim_add_tool(Sim *sim, const ToolOptions *options)
{
    ASSERT(sim->tool_count < SIM_TOOLS);
    sim->tool[sim->tool_count++] = *options;
}

void sim_add_load(Sim *sim, const LoadOptions *options)
{
    ASSERT(sim->scene_load_count < SIM_SCENE_LOADS);
    int at = sim->scene_load_count++; // kept sorted by start; equal starts in the order given
    for (; at > 0 && sim->scene_load[at - 1].start > options->start; at--)
        sim->scene_load[at] = sim->scene_load[at - 1];
    sim->scene_load[at] = *options;
}

// ---------------------------------------------------------------------------------------------
// Sealing

// Bounds of a body with every tool that may touch it.
static void total_bounds(const Sim *sim, const Body *body, double stiffness_scale,
                         double damping_scale, double *lambda, double *damping)
{
    *lambda = body->lambda * fmax(1.0, stiffness_scale);
    *damping = body->damping * fmax(1.0, stiffness_scale * damping_scale);
    for (int t = 0; t < sim->tool_count; t++) {
        double more_lambda, more_damping;
        contact_bounds(body, &sim->tool[t], &more_lambda, &more_damping);
        *lambda += more_lambda;
        *damping += more_damping;
    }
}

static bool choose_time_step(Sim *sim, Body *body, Status *status)
{
    enum { MOST_SUBSTEPS = 100000 };
    double lambda, damping;
    total_bounds(sim, body, 1.0, 1.0, &lambda, &damping);
    body->time_step_limit = stability_time_step(body->integrator, lambda, damping);
    double wanted = body->time_step_wanted > 0.0 ? body->time_step_wanted : body->time_step_limit;
    if (!(sim->tick / wanted <= MOST_SUBSTEPS))
        return status_fail(
            status, STATUS_INVALID,
            "body %s: a time step of %.3g s needs more than %d substeps a tick of %g s", body->name,
            wanted, MOST_SUBSTEPS, sim->tick);
    body->substeps = stability_substeps(sim->tick, wanted);
    body->h = sim->tick / body->substeps;
    if (body->h > body->time_step_limit * (1.0 + 1e-9) && !body->unsafe_time_step)
        return status_fail(
            status, STATUS_INVALID,
            "body %s: time_step %.6g s is above the stability bound %.6g s of %s; take "
            "at most that, or set unsafe_time_step = true",
            body->name, body->h, body->time_step_limit, integrator_name(body->integrator));
    return true;
}

static void create_contacts(Sim *sim)
{
    int most = 2 * sim->body_count * sim->tool_count; // a tool with a plane and capsules has two
    sim->motion = arena_allocate(sim->arena, ARENA_STEP, (size_t)sim->tool_count,
                                 sizeof *sim->motion, "tools/motion");
    sim->wrench = arena_allocate(sim->arena, ARENA_STEP, (size_t)sim->tool_count,
                                 sizeof *sim->wrench, "tools/wrench");
    if (sim->tool_count == 0)
        return;
    sim->contact =
        arena_allocate(sim->arena, ARENA_CONTACT, (size_t)most, sizeof *sim->contact, "contacts");
    sim->contact_tool = arena_allocate(sim->arena, ARENA_CONTACT, (size_t)most,
                                       sizeof *sim->contact_tool, "contacts/tool");
    sim->contact_start = arena_allocate(sim->arena, ARENA_CONTACT, (size_t)sim->body_count + 1,
                                        sizeof *sim->contact_start, "contacts/start");
    for (int t = 0; t < sim->tool_count; t++) {
        tool_motion_init(&sim->motion[t]);
        sim->motion[t].active = sim->tool[t].kind == TOOL_STATIC;
    }
    state_add(sim->state, sim->motion, (size_t)sim->tool_count * sizeof *sim->motion,
              "tools/motion");
    for (int b = 0; b < sim->body_count; b++) {
        int pushed = 0; // nodes, in one evaluation
        for (int k = 0; k < 2 * sim->tool_count; k++) {
            const ToolOptions *tool = &sim->tool[k / 2];
            bool plane = k % 2 == 1;
            if (plane ? !tool->has_plane : tool->capsule_count == 0)
                continue;
            char name[48];
            snprintf(name, sizeof name, "%.31s/tool%d%s", sim->body[b].name, k / 2,
                     plane ? "p" : "");
            Contact *contact =
                contact_create(name, tool, plane, &sim->body[b], sim->arena, sim->state);
            pushed += contact_node_capacity(contact);
            sim->contact_tool[sim->contact_count] = k / 2;
            sim->contact[sim->contact_count++] = contact;
        }
        Body *body = &sim->body[b];
        body->ops->reserve_forces(body->model, body->name, pushed, sim->arena);
        sim->contact_start[b + 1] = sim->contact_count;
    }
}

static void list_stages(Sim *sim)
{
    bool tools = sim->tool_count > 0, probes = false;
    for (int t = 0; t < sim->tool_count; t++)
        probes |= sim->tool[t].kind != TOOL_STATIC;
    const bool wanted[STAGE_COUNT] = {
        [STAGE_INPUTS] = sim->options.may_load,
        [STAGE_TOOLS] = probes,
        [STAGE_LOADS] = sim->options.may_load || sim->scene_load_count > 0,
        [STAGE_FIND_CONTACTS] = tools,
        [STAGE_FORCES] = true,
        [STAGE_CONTACT] = tools,
        [STAGE_WRENCHES] = tools,
        [STAGE_CHECK] = true,
        [STAGE_SNAPSHOT] = sim->options.may_load,
    };
    for (int s = 0; s < STAGE_COUNT; s++)
        if (wanted[s])
            sim->stage[sim->stage_count++] = (StageId)s;
}

bool sim_seal(Sim *sim, double settle_s, Status *status)
{
    int nodes = 0;
    for (int b = 0; b < sim->body_count; b++) {
        contact_set_stiffness(&sim->body[b]);
        if (!choose_time_step(sim, &sim->body[b], status))
            return false;
        nodes += sim->body[b].surface.node_count;
        state_add(sim->state, &sim->body[b].tuning, sizeof sim->body[b].tuning, "%s/tuning",
                  sim->body[b].name);
    }
    list_stages(sim);
    create_contacts(sim);
    if (sim->options.may_load || sim->scene_load_count > 0)
        loads_create(&sim->loads, nodes, sim->arena, sim->state);

    sim->settling = true;
    int64_t ticks = (int64_t)llround(settle_s / sim->tick);
    for (int64_t i = 0; i < ticks; i++)
        sim_step(sim);
    sim->settling = false;
    sim->clock->step = 0;
    if (sim->resets > 0)
        return status_fail(
            status, STATUS_INVALID,
            "settle_s: settling gave numbers out of bounds %lld times; take a smaller "
            "time_step",
            (long long)sim->resets);
    memset(sim->stage_ns, 0, sizeof sim->stage_ns);
    sim->start_state =
        arena_allocate(sim->arena, ARENA_OUTPUT, state_bytes(sim->state), 1, "state at the start");
    state_copy_out(sim->state, sim->start_state);
    return true;
}

// ---------------------------------------------------------------------------------------------
// Inputs

void sim_apply_pose(Sim *sim, int tool, const ToolPose *pose, bool hold)
{
    tool_motion_apply(&sim->motion[tool], pose, sim->clock->step, sim->tick, hold);
}

bool sim_apply_load(Sim *sim, const LoadOptions *options, char *why, size_t why_size)
{
    double ticks = fmax(1.0, floor(options->duration / sim->tick + 0.5));
    int64_t end = sim->clock->step + (int64_t)fmin(ticks, 1e15);
    return loads_start(&sim->loads, sim->body, sim->body_count, options->body, options->center,
                       options->radius, options->force, end, why, why_size);
}

// stiffness_scale and damping_scale of one body: only within the stability bound of its step.
static bool set_scale(Sim *sim, Body *body, BodyParameter parameter, double value, char *why,
                      size_t why_size)
{
    double *scale = parameter == BODY_STIFFNESS_SCALE ? &body->tuning.stiffness_scale
                                                      : &body->tuning.damping_scale;
    double before = *scale, lambda, damping;
    *scale = value;
    total_bounds(sim, body, body->tuning.stiffness_scale, body->tuning.damping_scale, &lambda,
                 &damping);
    double limit = stability_time_step(body->integrator, lambda, damping);
    if (body->h > limit * (1.0 + 1e-9) && !body->unsafe_time_step) {
        *scale = before;
        snprintf(why, why_size,
                 "%g needs a time step of at most %.4g s, and body %s runs at %.4g s", value, limit,
                 body->name, body->h);
        return false;
    }
    if (!body->ops->set(body->model, parameter, value)) {
        *scale = before;
        snprintf(why, why_size, "body %s has no such parameter", body->name);
        return false;
    }
    return true;
}

static bool set_body(Sim *sim, Body *body, const char *key, double value, char *why,
                     size_t why_size)
{
    bool stiffness = strcmp(key, "stiffness_scale") == 0;
    if (stiffness || strcmp(key, "damping_scale") == 0) {
        if (!(value >= 0.0 && value <= 1e6)) {
            snprintf(why, why_size, "%s %g outside [0, 1e6]", key, value);
            return false;
        }
        return set_scale(sim, body, stiffness ? BODY_STIFFNESS_SCALE : BODY_DAMPING_SCALE, value,
                         why, why_size);
    }
    if (strcmp(key, "friction") == 0) {
        if (!(value >= 0.0 && value <= 10.0)) {
            snprintf(why, why_size, "friction %g outside [0, 10]", value);
            return false;
        }
        body->tuning.friction = value;
        return true;
    }
    snprintf(why, why_size, "unknown key %s; of a body: stiffness_scale, damping_scale, friction",
             key);
    return false;
}

// A key without a body's name changes every body, or none when one refuses.
static bool set_every_body(Sim *sim, const char *key, double value, char *why, size_t why_size)
{
    BodyTuning before[SIM_BODIES];
    for (int b = 0; b < sim->body_count; b++) {
        before[b] = sim->body[b].tuning;
        if (set_body(sim, &sim->body[b], key, value, why, why_size))
            continue;
        for (int k = 0; k < b; k++) {
            Body *body = &sim->body[k];
            body->tuning = before[k];
            body->ops->set(body->model, BODY_STIFFNESS_SCALE, before[k].stiffness_scale);
            body->ops->set(body->model, BODY_DAMPING_SCALE, before[k].damping_scale);
        }
        return false;
    }
    return true;
}

bool sim_apply_gravity(Sim *sim, Vec3 gravity, char *why, size_t why_size)
{
    if (!(vec3_length(gravity) <= 1e4)) {
        snprintf(why, why_size, "gravity (%g, %g, %g) is longer than 1e4", gravity.x, gravity.y,
                 gravity.z);
        return false;
    }
    const double part[3] = {gravity.x, gravity.y, gravity.z};
    for (int b = 0; b < sim->body_count; b++)
        for (int axis = 0; axis < 3; axis++)
            sim->body[b].ops->set(sim->body[b].model, (BodyParameter)(BODY_GRAVITY_X + axis),
                                  part[axis]);
    return true;
}

bool sim_apply_set(Sim *sim, const char *key, double value, char *why, size_t why_size)
{
    static const char *const axes[3] = {"gravity_x", "gravity_y", "gravity_z"};
    for (int axis = 0; axis < 3; axis++) {
        if (strcmp(key, axes[axis]) != 0)
            continue;
        if (!(fabs(value) <= 1e4)) {
            snprintf(why, why_size, "%s %g outside [-1e4, 1e4]", key, value);
            return false;
        }
        for (int b = 0; b < sim->body_count; b++)
            sim->body[b].ops->set(sim->body[b].model, (BodyParameter)(BODY_GRAVITY_X + axis),
                                  value);
        return true;
    }
    for (int b = 0; b < sim->body_count; b++) {
        size_t length = strlen(sim->body[b].name);
        if (strncmp(key, sim->body[b].name, length) == 0 && key[length] == '.')
            return set_body(sim, &sim->body[b], key + length + 1, value, why, why_size);
    }
    static const char *const common[3] = {"stiffness_scale", "damping_scale", "friction"};
    for (int k = 0; k < 3; k++)
        if (strcmp(key, common[k]) == 0)
            return set_every_body(sim, key, value, why, why_size);
    snprintf(
        why, why_size,
        "unknown key %.80s; known: gravity, gravity_x, gravity_y, gravity_z, and for all bodies "
        "or as <body>.key: stiffness_scale, damping_scale, friction",
        key);
    return false;
}

void sim_reset(Sim *sim)
{
    SimClock clock = *sim->clock;
    state_copy_in(sim->state, sim->start_state);
    *sim->clock = clock;
}

void sim_set_lockstep(Sim *sim, bool lockstep)
{
    sim->clock->lockstep = lockstep;
}

// ---------------------------------------------------------------------------------------------
// What others ask

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

const Body *sim_find_body(const Sim *sim, const char *name)
{
    for (int b = 0; b < sim->body_count; b++)
        if (strcmp(sim->body[b].name, name) == 0)
            return &sim->body[b];
    return NULL;
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
