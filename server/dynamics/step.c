// One tick of a scene, from the tools' poses to the wrenches on them: read sim_step first.
// Step thread. No allocation, no lock, no log, no system call but the clock.
#include "dynamics/sim_data.h"

#include "base/clock.h"

static void place_tools(Sim *sim);
static void start_and_end_loads(Sim *sim);
static void adapt_bodies(Sim *sim);
static void find_contacts(Sim *sim);
static void advance_bodies(Sim *sim);
static void take_wrenches(Sim *sim);
static void check_numbers(Sim *sim);
static void estimate_stiffness(Sim *sim);

typedef void StageFunction(Sim *sim);

// A scene's list of stages holds only what the scene has (sim_seal). Contact forces are part of the
// substeps and timed there; inputs and snapshots belong to the runner, before and after the tick.
static StageFunction *const stage_function[STAGE_COUNT] = {
    [STAGE_TOOLS] = place_tools,
    [STAGE_LOADS] = start_and_end_loads,
    [STAGE_CUT] = cutting_stage,
    [STAGE_RECONSTRUCT] = reconstruct_stage,
    [STAGE_ADAPT] = adapt_bodies,
    [STAGE_GRASP] = holding_stage,
    [STAGE_FIND_CONTACTS] = find_contacts,
    [STAGE_FORCES] = advance_bodies,
    [STAGE_WRENCHES] = take_wrenches,
    [STAGE_CHECK] = check_numbers,
    [STAGE_STIFFNESS] = estimate_stiffness,
};

void sim_step(Sim *sim)
{
    int64_t begin = clock_now_ns();
    for (int i = 0; i < sim->stage_count; i++) {
        StageFunction *run = stage_function[sim->stage[i]];
        if (run == NULL)
            continue;
        run(sim);
        int64_t end = clock_now_ns();
        sim->stage_ns[sim->stage[i]] += end - begin;
        begin = end;
    }
    sim->clock->step++;
}

// Stale tools are withdrawn: no force from a hand that went silent.
static void place_tools(Sim *sim)
{
    if (sim->clock->lockstep || sim->settling)
        return;
    for (int t = 0; t < sim->tool_count; t++) {
        ToolMotion *motion = &sim->motion[t];
        if (sim->tool[t].kind != TOOL_STATIC && motion->active &&
            sim_pose_age(sim, motion) > sim->options.tool_timeout_s)
            tool_motion_init(motion);
    }
}

static void start_and_end_loads(Sim *sim)
{
    if (sim->settling)
        return;
    loads_expire(&sim->loads, sim->body, sim->body_count, sim->clock->step);
    while (sim->clock->next_load < sim->scene_load_count) {
        const LoadOptions *load = &sim->scene_load[sim->clock->next_load];
        if (load->start > ((double)sim->clock->step + 0.5) * sim->tick)
            break;
        char why[128];
        sim->clock->next_load++;
        if (!sim_apply_load(sim, load, why, sizeof why))
            sim->lost_loads++; // nothing was inside any more when its time came
    }
}

static bool adapt(Sim *sim, int b, void *context, TopologyChange *change)
{
    (void)context;
    Body *body = &sim->body[b];
    return body->ops->adapt(body, sim->clock->step, sim->tick, change);
}

// Bodies refine and coarsen.
static void adapt_bodies(Sim *sim)
{
    for (int b = 0; b < sim->body_count; b++)
        if (sim->body[b].ops->adapt != NULL)
            change_body(sim, b, adapt, NULL);
}

// Candidates for the whole tick: what the tool can reach from where its proxy is.
static void find_contacts(Sim *sim)
{
    for (int k = 0, b = 0; k < sim->contact_count; k++) {
        const ToolMotion *motion = &sim->motion[sim->contact_tool[k]];
        Contact *contact = sim->contact[k];
        while (k >= sim->contact_start[b + 1])
            b++;
        if (!motion->active ||
            (sim->attachment_count > 0 && holding_mutes(sim, b, sim->contact_tool[k]))) {
            contact_clear(contact);
            continue;
        }
        Vec3 begin, end;
        Quat orientation;
        double age = sim_pose_age(sim, motion);
        tool_motion_at(motion, age + sim->tick, &end, &orientation);
        tool_motion_at(motion, age, &begin, &orientation);
        contact_begin_tick(contact, begin, end, orientation, sim->tick);
    }
}

// Contact forces of one evaluation. `begins`: the proxy moves first, towards the tool's pose at the
// time of the substep's (last) evaluation.
static void add_contacts(Sim *sim, int b, const Stage *stage, double substep_time, double h,
                         bool begins)
{
    int64_t begin = clock_now_ns();
    const Integrator *integrator = integrator_get(sim->body[b].integrator);
    double target_at = integrator->stage[integrator->stage_count - 1].at;
    double fraction = target_at > 0.0 ? stage->at / target_at : 1.0;
    for (int k = sim->contact_start[b]; k < sim->contact_start[b + 1]; k++) {
        Contact *contact = sim->contact[k];
        if (!contact_is_near(contact))
            continue;
        if (begins) {
            const ToolMotion *motion = &sim->motion[sim->contact_tool[k]];
            Vec3 target;
            Quat orientation;
            tool_motion_at(motion, sim_pose_age(sim, motion) + substep_time + target_at * h,
                           &target, &orientation);
            contact_begin_substep(contact, target, orientation, h);
        }
        contact_apply(contact, fraction, stage->weight, h);
    }
    int64_t spent = clock_now_ns() - begin;
    sim->stage_ns[STAGE_CONTACT] += spent;
    sim->stage_ns[STAGE_FORCES] -= spent;
}

// Forces from outside on a body at one stage.
static void add_outer_forces(Sim *sim, int b, const Stage *stage, int substep, bool begins)
{
    const Body *body = &sim->body[b];
    int first, end = holding_of(sim, b, &first);
    if (sim->contact_count > 0 && sim->contact_start[b] < sim->contact_start[b + 1])
        add_contacts(sim, b, stage, substep * body->h, body->h, begins);
    if (first < end)
        holding_add_forces(sim, b, stage, substep * body->h, body->h);
}

static void end_substep(Sim *sim, int b)
{
    for (int k = sim->contact_count > 0 ? sim->contact_start[b] : 0;
         sim->contact_count > 0 && k < sim->contact_start[b + 1]; k++)
        contact_end_substep(sim->contact[k]);
}

static void advance_body(Sim *sim, int b)
{
    Body *body = &sim->body[b];
    const Integrator *integrator = integrator_get(body->integrator);
    if (integrator->kicks)
        body->ops->drift(body->model, integrator->first_drift * body->h);
    for (int substep = 0; substep < body->substeps; substep++) {
        for (int s = 0; s < integrator->stage_count; s++) {
            Stage stage = integrator_stage(integrator, s, substep == body->substeps - 1);
            add_outer_forces(sim, b, &stage, substep, s == 0);
            body->ops->evaluate(body->model, &stage, body->h);
        }
        end_substep(sim, b);
    }
}

// Bodies that are joined, `group` the first of them: all forces of a stage are there before any
// body moves on.
static void advance_joined(Sim *sim, int group)
{
    const int substeps = sim->body[group].substeps, count = sim->body_count;
    const Integrator *integrator = integrator_get(sim->body[group].integrator);
    for (int b = group; b < count && integrator->kicks; b++)
        if (sim->joined[b] == group)
            sim->body[b].ops->drift(sim->body[b].model, integrator->first_drift * sim->body[b].h);
    for (int substep = 0; substep < substeps; substep++) {
        for (int s = 0; s < integrator->stage_count; s++) {
            Stage stage = integrator_stage(integrator, s, substep == substeps - 1);
            for (int b = group; b < count; b++)
                if (sim->joined[b] == group)
                    add_outer_forces(sim, b, &stage, substep, s == 0);
            for (int k = 0; k < sim->scene_attachment_count; k++) {
                Joint *joint = sim->scene_attachment[k].joint;
                if (joint != NULL && sim->joined[joint_options(joint)->body] == group)
                    joint_apply(joint);
            }
            for (int b = group; b < count; b++)
                if (sim->joined[b] == group)
                    sim->body[b].ops->evaluate(sim->body[b].model, &stage, sim->body[b].h);
        }
        for (int b = group; b < count; b++)
            if (sim->joined[b] == group)
                end_substep(sim, b);
    }
}

static void advance_bodies(Sim *sim)
{
    for (int b = 0; b < sim->body_count; b++)
        if (sim->joint_count == 0)
            advance_body(sim, b);
        else if (sim->joined[b] == b)
            advance_joined(sim, b);
}

static void add_sums(ContactSums *sum, const ContactSums *part, Vec3 about)
{
    Vec3 arm = vec3_sub(part->about, about);
    sum->impulse = vec3_add(sum->impulse, part->impulse);
    sum->moment = vec3_add(sum->moment, vec3_add(part->moment, vec3_cross(arm, part->impulse)));
    sum->point = vec3_add(sum->point, part->point);
    sum->normal = vec3_add(sum->normal, part->normal);
    sum->weight += part->weight;
    sum->depth = fmax(sum->depth, part->depth);
}

// Of the contacts of the last tick, as far as it is known.
static void tell_stiffness(const Sim *sim, int contact, ToolWrench *wrench)
{
    const ContactStiffness *stiffness = stiffness_get(sim->stiffness, contact);
    if (stiffness == NULL)
        return;
    for (int i = 0; i < 6; i++)
        wrench->stiffness[i] += stiffness->k[i];
    wrench->damping += stiffness->damping;
}

// The wrench on a tool is the impulse of all bodies over the tick.
static void take_wrenches(Sim *sim)
{
    ContactSums sums[SIM_TOOLS];
    bool holds[SIM_TOOLS]; // also without force
    for (int t = 0; t < sim->tool_count; t++) {
        sums[t] = (ContactSums){0};
        holds[t] = false;
        Quat orientation;
        tool_motion_at(&sim->motion[t], sim_pose_age(sim, &sim->motion[t]) + sim->tick,
                       &sim->wrench[t].position, &orientation);
    }
    for (int k = 0; k < sim->contact_count; k++) {
        int t = sim->contact_tool[k];
        const ContactSums *part = contact_sums(sim->contact[k]);
        if (!contact_is_near(sim->contact[k]) || !(part->weight > 0.0))
            continue;
        Quat orientation;
        if (!(sums[t].weight > 0.0)) // of several bodies the first says where the tool is
            contact_proxy(sim->contact[k], &sim->wrench[t].position, &orientation);
        add_sums(&sums[t], part, sim->wrench[t].position);
    }
    for (int k = 0; k < sim->attachment_count; k++) {
        int t = attachment_options(sim->attachment[k])->tool;
        if (t < 0)
            continue;
        add_sums(&sums[t], attachment_sums(sim->attachment[k]), sim->wrench[t].position);
        holds[t] |= attachment_is_holding(sim->attachment[k]);
    }
    for (int t = 0; t < sim->tool_count; t++) {
        const ContactSums *sum = &sums[t];
        ToolWrench *wrench = &sim->wrench[t];
        bool felt = sum->weight > 0.0;
        *wrench = (ToolWrench){
            .contact = felt || holds[t],
            .position = wrench->position,
            .force = vec3_scale(1.0 / sim->tick, sum->impulse),
            .torque = vec3_scale(1.0 / sim->tick, sum->moment),
            .point = felt       ? vec3_scale(1.0 / sum->weight, sum->point)
                     : holds[t] ? wrench->position
                                : (Vec3){0.0, 0.0, 0.0},
            .normal = vec3_unit(sum->normal),
            .depth = sum->depth,
        };
    }
    for (int k = 0; k < sim->contact_count && sim->stiffness != NULL; k++)
        if (contact_is_near(sim->contact[k]) && contact_sums(sim->contact[k])->weight > 0.0)
            tell_stiffness(sim, k, &sim->wrench[sim->contact_tool[k]]);
}

// What leaves from here on is checked.
static void check_numbers(Sim *sim)
{
    if (guard_bodies(sim))
        take_wrenches(sim); // of what is left
    guard_wrenches(sim);
}

static void estimate_stiffness(Sim *sim)
{
    if (!sim->settling)
        stiffness_step(sim->stiffness, sim->clock->step);
}
