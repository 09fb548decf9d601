// SPDX-License-Identifier: MIT
// One tick of a scene, from the tools' poses to the wrenches on them: read sim_step first, which is
// last. Step thread. No allocation, no lock, no log, no system call but the clock.
#include "sim/step.h"

#include "base/clock.h"
#include "sim/hold/tie.h"
#include "sim/ahead.h"
#include "sim/cutting.h"
#include "sim/error.h"
#include "sim/events.h"
#include "sim/guard/guard.h"
#include "sim/follow.h"
#include "sim/removing.h"
#include "sim/time_step.h"

static bool always(const Sim *sim)
{
    (void)sim;
    return true;
}

// From messages, in a live run.
static bool has_inputs(const Sim *sim)
{
    return sim->options.may_load;
}

static bool has_probes(const Sim *sim)
{
    for (int t = 0; t < sim->tool_count; t++)
        if (sim->tool[t].kind != TOOL_STATIC)
            return true;
    return false;
}

// Moves tools. Withdraws stale ones: a hand that went silent exerts no force.
static void place_tools(Sim *sim)
{
    const int64_t step = sim->clock->step;
    for (int t = 0; t < sim->tool_count; t++) {
        ToolMotion *motion = &sim->motion[t];
        if (sim->tool[t].kind == TOOL_STATIC || !motion->active)
            continue;
        const bool waits = sim->clock->lockstep || sim->settling;
        if (!waits && (double)(step - motion->pose_step) * sim->tick > sim->options.tool_timeout_s)
            tool_motion_init(motion);
        else
            tool_motion_step(motion, sim->tool[t].lag, step, sim->tick);
    }
}

static bool has_loads(const Sim *sim)
{
    return sim->options.may_load || sim->scene_load_count > 0;
}

static void start_and_end_loads(Sim *sim)
{
    if (sim->settling)
        return;
    // Loads that end may leave energy behind, which the guard remembers.
    const int64_t loads = *sim->loads.count;
    guard_note_loads(sim);
    loads_expire(&sim->loads, sim->body, sim->body_count, sim->clock->step);
    if (*sim->loads.count != loads) // energies count anew
        guard_renew(sim, -1);
    // Loads of the scene whose time has come, within half a tick.
    while (sim->clock->next_load < sim->scene_load_count) {
        const LoadOptions *load = &sim->scene_load[sim->clock->next_load];
        if (load->start > ((double)sim->clock->step + 0.5) * sim->tick)
            break;
        char why[128];
        sim->clock->next_load++;
        if (!sim_apply_load(sim, load, why, sizeof why)) // no node was inside when it started
            sim_report(sim, load->body, "refused", "the scene's load: %s", why);
    }
}

static bool has_cuts(const Sim *sim)
{
    for (int b = 0; b < sim->body_count; b++)
        if ((sim->cutting != NULL && sim->cutting->stroke[b] != NULL) ||
            sim->body[b].ops->tear != NULL)
            return true;
    return false;
}

static bool has_removers(const Sim *sim)
{
    return sim->removing != NULL;
}

static bool has_levels_to_cut(const Sim *sim)
{
    for (int b = 0; b < sim->body_count; b++)
        if (sim->body[b].ops->reconstruct != NULL)
            return true;
    return false;
}

static bool has_heat(const Sim *sim)
{
    for (int b = 0; b < sim->body_count; b++)
        if (sim->body[b].ops->conduct != NULL)
            return true;
    return false;
}

// Lets heat spread. What becomes stiffer stores more energy, and may need shorter steps.
static void conduct_heat(Sim *sim)
{
    for (int b = 0; b < sim->body_count; b++) {
        Body *body = &sim->body[b];
        bool shown = false;
        if (body->ops->conduct == NULL || guard_is_frozen(sim, b))
            continue;
        if (body->ops->conduct(body, sim->tick, &shown)) {
            guard_renew(sim, b);
            time_step_follow(sim, body);
        }
        // Colours belong to a mesh.
        if (shown)
            body->mesh.topology = topology_after(body->mesh.topology);
    }
}

static bool has_levels(const Sim *sim)
{
    for (int b = 0; b < sim->body_count; b++)
        if (sim->body[b].ops->adapt != NULL)
            return true;
    return false;
}

static bool adapt(Sim *sim, int b, void *context, TopologyChange *change)
{
    (void)context;
    Body *body = &sim->body[b];
    return body->ops->adapt(body, sim->clock->step, sim->tick, change);
}

// Refines and coarsens bodies, some of which are told before of what will touch them soon.
static void adapt_bodies(Sim *sim)
{
    for (int b = 0; b < sim->body_count; b++) {
        if (sim->body[b].ops->adapt == NULL || guard_is_frozen(sim, b))
            continue;
        if (sim->body[b].ops->approach != NULL)
            ahead_tell(sim, b);
        if (sim->body[b].surface.solid)
            change_inside(sim, b, adapt, NULL);
        else
            change_body(sim, b, adapt, NULL);
    }
}

static bool has_attachments(const Sim *sim)
{
    return sim->attachment_count > 0 || sim->ties != NULL;
}

// Makes graspers grasp and release at the pose at the start of the tick.
static void grasp_and_release(Sim *sim)
{
    if (sim->ties != NULL)
        ties_begin_tick(sim);
    for (int k = 0; k < sim->attachment_count; k++) {
        const int tool = attachment_options(sim->attachment[k])->tool;
        if (guard_is_frozen(sim, attachment_options(sim->attachment[k])->body)) {
            attachment_clear(sim->attachment[k]);
            continue;
        }
        const ToolMotion *motion = tool >= 0 ? &sim->motion[tool] : NULL;
        Vec3 position = {0.0, 0.0, 0.0};
        Quat orientation = {1.0, 0.0, 0.0, 0.0};
        // The world is always there, and never moves.
        bool active = motion == NULL || motion->active;
        double grip = 0.0;
        if (motion != NULL && active) {
            tool_motion_at(motion, 0.0, &position, &orientation);
            grip = tool_motion_grip(motion, sim->clock->step, sim->tick);
        }
        attachment_begin_tick(sim->attachment[k], active, grip, position, orientation, sim->tick);
    }
}

// True for tools with which bodies collide.
static bool has_shapes(const Sim *sim)
{
    for (int t = 0; t < sim->tool_count; t++)
        if (sim->tool[t].capsule_count > 0 || sim->tool[t].has_plane)
            return true;
    return false;
}

// True if a tool does not push a body because it grasps the body.
static bool is_muted(const Sim *sim, int b, int tool)
{
    for (int k = sim->attachment_start[b]; k < sim->attachment_start[b + 1]; k++)
        if (attachment_options(sim->attachment[k])->tool == tool &&
            attachment_mutes_contact(sim->attachment[k]))
            return true;
    return false;
}

// Finds candidates for the whole tick: what the tool can reach from its proxy.
static void find_contacts(Sim *sim)
{
    for (int k = 0, b = 0; k < sim->contact_count; k++) {
        const ToolMotion *motion = &sim->motion[sim->contact_tool[k]];
        Contact *contact = sim->contact[k];
        // Contacts are sorted by body.
        while (k >= sim->contact_start[b + 1])
            b++;
        // A withdrawn tool pushes nothing, and one that holds the body does not push it.
        if (!motion->active || guard_is_frozen(sim, b) || is_muted(sim, b, sim->contact_tool[k])) {
            contact_clear(contact);
            continue;
        }
        contact_begin_tick(contact, motion, sim->tick, sim->clock->step);
    }
}

static bool has_touches(const Sim *sim)
{
    return sim->touch_count > 0;
}

// Finds what bodies can touch of each other in this tick. A body takes shorter steps only while
// something of it is near itself.
static void find_touches(Sim *sim)
{
    for (int k = 0; k < sim->touch_count; k++)
        if (touch_begin_tick(sim->touch[k], sim->clock->step))
            time_step_follow(sim, &sim->body[touch_options(sim->touch[k])->body[0]]);
}

// True for what acts between two bodies of a group, neither of them frozen.
static bool acts(const Sim *sim, int first, int body, int other)
{
    return sim->group[body].first == first && !guard_is_frozen(sim, body) &&
           !guard_is_frozen(sim, other);
}

static bool joint_acts(const Sim *sim, int first, int joint)
{
    const AttachmentOptions *options = attachment_options(sim->joint[joint]);
    return acts(sim, first, options->body, options->to_body);
}

static bool touch_acts(const Sim *sim, int first, int touch)
{
    const int *body = touch_options(sim->touch[touch])->body;
    return acts(sim, first, body[0], body[1]) && touch_is_near(sim->touch[touch]);
}

// Adds the forces between the bodies of a group.
static void add_touches(Sim *sim, int first, double dt)
{
    const int64_t begin = clock_now_ns();
    for (int k = 0; k < sim->touch_count; k++) {
        if (touch_acts(sim, first, k))
            touch_apply(sim->touch[k], dt);
    }
    // Timed within the forces.
    const int64_t spent = clock_now_ns() - begin;
    sim->stage_ns[STAGE_TOUCH] += spent;
    sim->stage_ns[STAGE_FORCES] -= spent;
}

// Returns the part of a substep that is over at an evaluation: 1 at the last evaluation.
static double fraction_at(const Integrator *integrator, const Evaluation *evaluation)
{
    const double last = integrator->evaluation[integrator->evaluation_count - 1].at;
    return last > 0.0 ? evaluation->at / last : 1.0;
}

// Adds the contact forces of one evaluation. `begins`: first moves the proxy towards the tool's
// pose at the time of the substep's (last) evaluation.
static void add_contacts(Sim *sim, int b, const Evaluation *evaluation, double substep_time,
                         double h, bool begins)
{
    int64_t begin = clock_now_ns();
    // The proxy arrives at the last evaluation of a substep; earlier ones see it on its way.
    const Integrator *integrator = integrator_get(sim->body[b].integrator);
    double target_at = integrator->evaluation[integrator->evaluation_count - 1].at;
    double fraction = fraction_at(integrator, evaluation);
    for (int k = sim->contact_start[b]; k < sim->contact_start[b + 1]; k++) {
        Contact *contact = sim->contact[k];
        if (!contact_is_near(contact))
            continue;
        // Once a substep: where the tool will be at its last evaluation.
        if (begins) {
            const ToolMotion *motion = &sim->motion[sim->contact_tool[k]];
            Vec3 target;
            Quat orientation;
            tool_motion_at(motion, (substep_time + target_at * h) / sim->tick, &target,
                           &orientation);
            contact_begin_substep(contact, target, orientation, h);
        }
        contact_apply(contact, fraction, evaluation->weight, h);
    }
    // Contacts are timed within the forces.
    int64_t spent = clock_now_ns() - begin;
    sim->stage_ns[STAGE_CONTACT] += spent;
    sim->stage_ns[STAGE_FORCES] -= spent;
}

// Returns the share of a pull that a tool can exert.
static double share_of(const Sim *sim, int tool, double most, double pull)
{
    const bool limited = tool >= 0 && sim->tool[tool].kind != TOOL_STATIC;
    return limited && pull > most ? most / pull : 1.0;
}

// Adds the springs of attachments at one evaluation. All that a tool holds of a body together pulls
// with at most its max_force: beyond, it slips with that force.
static void add_holds(Sim *sim, int b, const Evaluation *evaluation, double substep_time, double h)
{
    const int first = sim->attachment_start[b], end = sim->attachment_start[b + 1];
    const bool ends = fraction_at(integrator_get(sim->body[b].integrator), evaluation) >= 1.0;
    // How hard each tool pulls, all that it holds together.
    Vec3 pull[SIM_TOOLS] = {{0.0, 0.0, 0.0}};
    for (int k = first; k < end; k++) {
        Attachment *attachment = sim->attachment[k];
        const int tool = attachment_options(attachment)->tool;
        if (!attachment_is_holding(attachment))
            continue;
        // The frame: that of the tool at this time, or the world.
        ToolPlacement at = {.orientation = {1.0, 0.0, 0.0, 0.0}};
        if (tool >= 0) {
            const double fraction = (substep_time + evaluation->at * h) / sim->tick;
            at = tool_motion_within(&sim->motion[tool], fraction, sim->tick);
        }
        Vec3 force = attachment_evaluate(attachment, &at);
        if (tool >= 0)
            pull[tool] = vec3_add(pull[tool], force);
    }
    // Scale them down to what the tool can exert.
    for (int k = first; k < end; k++) {
        Attachment *attachment = sim->attachment[k];
        const int tool = attachment_options(attachment)->tool;
        if (!attachment_is_holding(attachment) || attachment_is_implicit(attachment))
            continue;
        const double scale =
            tool < 0 ? 1.0
                     : share_of(sim, tool, sim->tool[tool].max_force, vec3_length(pull[tool]));
        attachment_apply(attachment, scale, evaluation->weight * h, ends);
    }
}

// Gives nodes the impulses of jaws, which depend on the body's own kick: at most what is left of
// max_force beside the tool's explicit springs.
static void kick_holds(Sim *sim, int b, const Evaluation *evaluation)
{
    const double h = sim->body[b].h;
    for (int k = sim->attachment_start[b]; k < sim->attachment_start[b + 1]; k++) {
        Attachment *grip = sim->attachment[k];
        const int tool = attachment_options(grip)->tool;
        if (!attachment_is_holding(grip) || !attachment_is_implicit(grip))
            continue;
        double most = sim->tool[tool].max_force;
        for (int i = sim->attachment_start[b]; i < sim->attachment_start[b + 1]; i++)
            if (i != k && attachment_options(sim->attachment[i])->tool == tool &&
                attachment_is_holding(sim->attachment[i]))
                most -= vec3_length(attachment_force(sim->attachment[i]));
        const double pull = vec3_length(grip_impulses(grip, h));
        grip_kick(grip, share_of(sim, tool, h * fmax(0.0, most), pull), h, evaluation->advance * h);
    }
}

// Adds the external forces on a body in one evaluation.
static void add_outer_forces(Sim *sim, int b, const Evaluation *evaluation, int substep,
                             bool begins)
{
    const Body *body = &sim->body[b];
    if (sim->contact_start[b] < sim->contact_start[b + 1])
        add_contacts(sim, b, evaluation, substep * body->h, body->h, begins);
    if (sim->attachment_start[b] < sim->attachment_start[b + 1])
        add_holds(sim, b, evaluation, substep * body->h, body->h);
}

static void end_substep(Sim *sim, int b)
{
    for (int k = sim->contact_start[b]; k < sim->contact_start[b + 1]; k++)
        contact_end_substep(sim->contact[k]);
}

// Gives solids the impulses of their contacts, which depend on the body's own kick.
static void kick_contacts(Sim *sim, int b, const Evaluation *evaluation)
{
    if (!sim->body[b].surface.solid || sim->contact_start[b] == sim->contact_start[b + 1])
        return;
    int64_t begin = clock_now_ns();
    for (int k = sim->contact_start[b]; k < sim->contact_start[b + 1]; k++)
        if (contact_is_near(sim->contact[k]))
            contact_kick(sim->contact[k], evaluation, sim->body[b].h);
    int64_t spent = clock_now_ns() - begin;
    sim->stage_ns[STAGE_CONTACT] += spent;
    sim->stage_ns[STAGE_FORCES] -= spent;
}

// Adds what depends on the body's own kick.
static void kick_outside(Sim *sim, int b, const Evaluation *evaluation)
{
    kick_contacts(sim, b, evaluation);
    kick_holds(sim, b, evaluation);
}

// What is advanced together, evaluation by evaluation.
typedef enum Advance {
    ADVANCE_GROUP, // all bodies that are joined to this one, or can touch it
    ADVANCE_BODY,  // the body by itself: nothing of its group acts on it in this tick
    ADVANCE_ALONE, // without external forces either, by a single substep's time
} Advance;

// Returns the body, or the next one of its group, that is not frozen; -1: none.
static int thawed(const Sim *sim, int b)
{
    while (b >= 0 && guard_is_frozen(sim, b))
        b = sim->group[b].next;
    return b;
}

// Returns the body that is advanced beside this one; -1: none.
static int next_body(const Sim *sim, int b, Advance what)
{
    return what == ADVANCE_GROUP ? thawed(sim, sim->group[b].next) : -1;
}

// Advances all bodies of a group: the forces of an evaluation are complete before any of them
// moves.
static void advance(Sim *sim, int first, int substeps, Advance what)
{
    const Integrator *integrator = integrator_get(sim->body[first].integrator);
    const bool forced = what != ADVANCE_ALONE;
    const int ties = what == ADVANCE_GROUP ? sim->joint_count : 0,
              touches = what == ADVANCE_GROUP ? sim->touch_count : 0;
    const double part = forced ? 1.0 : 1.0 / substeps; // of a substep
    const int group = sim->group[first].first;
    // Schemes of kicks drift first.
    for (int b = first; b >= 0 && integrator->kicks; b = next_body(sim, b, what))
        sim->body[b].ops->drift(sim->body[b].model,
                                integrator->first_drift * (part * sim->body[b].h));
    for (int substep = 0; substep < substeps; substep++) {
        // Every evaluation: forces from outside, ties, then each body's own, which moves it.
        for (int s = 0; s < integrator->evaluation_count; s++) {
            Evaluation evaluation = integrator_evaluation(integrator, s, substep == substeps - 1);
            for (int b = first; b >= 0 && forced; b = next_body(sim, b, what))
                add_outer_forces(sim, b, &evaluation, substep, s == 0);
            // Ties of this group.
            for (int k = 0; k < ties; k++) {
                if (joint_acts(sim, group, k))
                    joint_apply(sim->joint[k], evaluation.weight * sim->body[first].h);
            }
            if (touches > 0)
                add_touches(sim, group, fraction_at(integrator, &evaluation) * sim->body[first].h);
            for (int b = first; b >= 0; b = next_body(sim, b, what))
                sim->body[b].ops->evaluate(sim->body[b].model, &evaluation, part * sim->body[b].h);
            for (int b = first; b >= 0 && forced; b = next_body(sim, b, what))
                kick_outside(sim, b, &evaluation);
        }
        // Contacts keep what friction remembers.
        for (int b = first; b >= 0 && forced; b = next_body(sim, b, what))
            end_substep(sim, b);
        for (int k = 0; k < touches; k++)
            if (sim->group[touch_options(sim->touch[k])->body[0]].first == group)
                touch_end_substep(sim->touch[k]);
    }
}

void advance_alone(Sim *sim, int body, int substeps)
{
    advance(sim, body, substeps, ADVANCE_ALONE);
}

// True if anything of a group acts on another body of it, or on itself, in this tick.
static bool is_joined(const Sim *sim, int first)
{
    for (int k = 0; k < sim->joint_count; k++)
        if (joint_acts(sim, first, k))
            return true;
    for (int k = 0; k < sim->touch_count; k++)
        if (touch_acts(sim, first, k))
            return true;
    return false;
}

static void advance_bodies(Sim *sim)
{
    for (int first = 0; first < sim->body_count; first++) {
        if (sim->group[first].first != first)
            continue;
        const Advance what = is_joined(sim, first) ? ADVANCE_GROUP : ADVANCE_BODY;
        for (int b = thawed(sim, first); b >= 0;
             b = what == ADVANCE_BODY ? thawed(sim, sim->group[b].next) : -1)
            advance(sim, b, sim->body[b].substeps, what);
    }
}

static bool has_tools(const Sim *sim)
{
    return sim->tool_count > 0;
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

// Sets the stiffness from the contacts of the last tick, if known.
static void report_stiffness(const Sim *sim, int contact, ToolWrench *wrench)
{
    const ContactStiffness *stiffness = stiffness_get(sim->stiffness, contact);
    if (stiffness == NULL)
        return;
    wrench->stiffness = sym3_madd(wrench->stiffness, 1.0, stiffness->k);
    wrench->damping += stiffness->damping;
}

// Computes the wrench on a tool: the impulse of all bodies over the tick.
static void take_wrenches(Sim *sim)
{
    ContactSums sums[SIM_TOOLS];
    bool holds[SIM_TOOLS]; // also without force
    // A tool without contact is at its pose, one in contact at its proxy.
    for (int t = 0; t < sim->tool_count; t++) {
        sums[t] = (ContactSums){0};
        holds[t] = false;
        sim->wrench[t].position = sim->motion[t].end_position;
    }
    // Contacts first: they decide at which point the wrench acts.
    for (int k = 0; k < sim->contact_count; k++) {
        int t = sim->contact_tool[k];
        const ContactSums *part = contact_sums(sim->contact[k]);
        const bool pushes = contact_is_near(sim->contact[k]) && part->weight > 0.0;
        const bool eases = contact_is_easing(sim->contact[k]);
        holds[t] |= eases;
        if (!pushes && !eases)
            continue;
        Quat orientation;
        if (!(sums[t].weight > 0.0)) // of several bodies the first defines the position
            contact_proxy(sim->contact[k], &sim->wrench[t].position, &orientation);
        add_sums(&sums[t], part, sim->wrench[t].position);
    }
    // Attachments pull on their tools.
    for (int k = 0; k < sim->attachment_count; k++) {
        int t = attachment_options(sim->attachment[k])->tool;
        if (t < 0)
            continue;
        add_sums(&sums[t], attachment_sums(sim->attachment[k]), sim->wrench[t].position);
        holds[t] |= attachment_is_holding(sim->attachment[k]);
    }
    // The mean force over the tick; the point of a tool that only grasps is its position.
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
    // The stiffness of contacts that push now.
    for (int k = 0; k < sim->contact_count && sim->stiffness != NULL; k++)
        if (contact_is_near(sim->contact[k]) && contact_sums(sim->contact[k])->weight > 0.0)
            report_stiffness(sim, k, &sim->wrench[sim->contact_tool[k]]);
}

// Checks all results before they are published.
static void check_numbers(Sim *sim)
{
    if (guard_bodies(sim))
        take_wrenches(sim); // of the remaining bodies
    guard_wrenches(sim);
}

static bool is_watched(const Sim *sim, int b)
{
    const BodyOps *ops = sim->body[b].ops;
    return ops->visit != NULL && ops->sections(sim->body[b].model)->region_count > 0;
}

static bool has_watched_regions(const Sim *sim)
{
    for (int b = 0; b < sim->body_count; b++)
        if (is_watched(sim, b) && has_probes(sim))
            return true;
    return false;
}

// Notes where tools are, as recordings do: where bodies feel them.
static void watch_tools(Sim *sim)
{
    for (int b = 0; b < sim->body_count && !sim->settling; b++)
        for (int t = 0; is_watched(sim, b) && t < sim->tool_count; t++) {
            const ToolMotion *motion = &sim->motion[t];
            const ToolWrench *wrench = &sim->wrench[t];
            if (sim->tool[t].kind != TOOL_STATIC && motion->active)
                sim->body[b].ops->visit(sim->body[b].model,
                                        wrench->contact ? wrench->position : motion->end_position);
        }
}

static bool has_ties(const Sim *sim)
{
    return sim->ties != NULL;
}

static bool has_stiffness(const Sim *sim)
{
    return sim->stiffness != NULL;
}

static void estimate_stiffness(Sim *sim)
{
    if (!sim->settling)
        stiffness_step(sim->stiffness, sim->clock->step);
}

static bool has_errors(const Sim *sim)
{
    return sim->options.error_hz > 0.0;
}

static bool has_rounds(const Sim *sim)
{
    return has_errors(sim) || errors_drive(sim);
}

// There are none while the bodies settle.
static void estimate_errors(Sim *sim)
{
    if (sim->drive != NULL)
        errors_step(sim, sim->drive);
    if (sim->errors != NULL)
        errors_step(sim, sim->errors);
}

static bool has_estimate(const Sim *sim)
{
    return sim->options.estimate_error || has_errors(sim);
}

// The stages of a tick, in order. A scene runs those that it needs. Without a function: the
// runner's, before and after the tick, and contact forces, which the substeps add and time.
static const struct {
    const char *name;
    bool (*needed)(const Sim *sim);
    void (*run)(Sim *sim);
} PIPELINE[STAGE_COUNT] = {
    [STAGE_INPUTS] = {"inputs", has_inputs, NULL},
    [STAGE_TOOLS] = {"tools", has_probes, place_tools},
    [STAGE_LOADS] = {"loads", has_loads, start_and_end_loads},
    [STAGE_CUT] = {"cut", has_cuts, cutting_stage},
    [STAGE_REMOVE] = {"remove", has_removers, removing_stage},
    [STAGE_HEAT] = {"heat", has_heat, conduct_heat},
    [STAGE_RECONSTRUCT] = {"reconstruct", has_levels_to_cut, reconstruct_stage},
    [STAGE_ADAPT] = {"adapt", has_levels, adapt_bodies},
    [STAGE_GRASP] = {"grasp", has_attachments, grasp_and_release},
    [STAGE_FIND_CONTACTS] = {"find contacts", has_shapes, find_contacts},
    [STAGE_TOUCH] = {"touch", has_touches, find_touches},
    [STAGE_FORCES] = {"forces", always, advance_bodies},
    [STAGE_CONTACT] = {"contact", has_shapes, NULL},
    [STAGE_WRENCHES] = {"wrenches", has_tools, take_wrenches},
    [STAGE_CHECK] = {"check", always, check_numbers},
    [STAGE_WATCH] = {"watch", has_watched_regions, watch_tools},
    [STAGE_TIES] = {"ties", has_ties, ties_stage},
    [STAGE_STIFFNESS] = {"stiffness", has_stiffness, estimate_stiffness},
    [STAGE_ERROR] = {"error", has_rounds, estimate_errors},
    [STAGE_ESTIMATE] = {"estimate", has_estimate, NULL},
    [STAGE_SNAPSHOT] = {"snapshot", has_inputs, NULL},
};

const char *stage_name(StageId stage)
{
    return PIPELINE[stage].name;
}

void pipeline_create(Sim *sim)
{
    for (int s = 0; s < STAGE_COUNT; s++)
        if (PIPELINE[s].needed(sim))
            sim->stage[sim->stage_count++] = (StageId)s;
}

void sim_step(Sim *sim)
{
    int64_t begin = clock_now_ns();
    for (int i = 0; i < sim->stage_count; i++) {
        // Stages without a function are the runner's.
        const StageId stage = sim->stage[i];
        if (PIPELINE[stage].run == NULL)
            continue;
        PIPELINE[stage].run(sim);
        // Each stage ends where the next begins: one look at the clock for both.
        int64_t end = clock_now_ns();
        sim->stage_ns[stage] += end - begin;
        begin = end;
    }
    sim->clock->step++;
}
