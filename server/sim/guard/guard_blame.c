// SPDX-License-Identifier: MIT
// The cause of a body's bad numbers, judged by what acted on it, and its withdrawal. A pure
// function of the state and the tick, so that a repeated run finds the same cause. Step thread,
// only in a bad tick.
#include "sim/guard/guard.h"

#include "sim/cutting.h"
#include "sim/time_step.h"
#include "sim/events.h"

#include <math.h>
#include <stdio.h>

// ---------------------------------------------------------------------------------------------
// What acted

static double strength(Vec3 impulse, double tick, const ToolOptions *tool)
{
    double force = vec3_length(impulse) / tick, most = (double)INFINITY;
    if (tool->kind != TOOL_STATIC)
        most = tool->max_force;          // the body never got more
    return force <= most ? force : most; // also if the number is not finite
}

static void suspect_more(Suspect *worst, const Suspect *one)
{
    // What can be withdrawn ranks first, then the stronger; of equals the first.
    bool nobody = worst->cause == GUARD_UNKNOWN;
    if (nobody || (worst->stays && !one->stays) ||
        (worst->stays == one->stays && one->force > worst->force))
        *worst = *one;
}

static void suspect_tools(const Sim *sim, int b, Suspect *worst)
{
    // Tools that touch the body.
    for (int k = sim->contact_start[b]; k < sim->contact_start[b + 1]; k++) {
        const ContactSums *sums = contact_sums(sim->contact[k]);
        const int t = sim->contact_tool[k];
        if (!contact_is_near(sim->contact[k]) || sums->weight == 0.0) // NaN counts as acting
            continue;
        Suspect one = {.cause = GUARD_TOOL,
                       .index = t,
                       .stays = sim->tool[t].kind == TOOL_STATIC,
                       .force = strength(sums->impulse, sim->tick, &sim->tool[t]),
                       .point = vec3_scale(1.0 / sums->weight, sums->point)};
        // Bad numbers have no middle: the tool's own position then.
        if (!vec3_finite(one.point))
            one.point = sums->about;
        suspect_more(worst, &one);
    }
    // Tools that hold it.
    for (int k = sim->attachment_start[b]; k < sim->attachment_start[b + 1]; k++) {
        const int t = attachment_options(sim->attachment[k])->tool;
        if (t < 0 || !attachment_is_holding(sim->attachment[k]))
            continue;
        const ContactSums *sums = attachment_sums(sim->attachment[k]);
        Suspect one = {.cause = GUARD_TOOL,
                       .index = t,
                       .stays = sim->tool[t].kind == TOOL_STATIC,
                       .force = strength(sums->impulse, sim->tick, &sim->tool[t]),
                       .point = sums->about,
                       .holds = true};
        suspect_more(worst, &one);
    }
}

static void suspect_loads(const Sim *sim, int b, Suspect *worst)
{
    const LoadSet *loads = &sim->loads;
    int first_node = 0;
    for (int i = 0; i < b; i++)
        first_node += sim->body[i].surface.node_count;
    for (int64_t k = 0; loads->count != NULL && k < *loads->count; k++) {
        Suspect one = {
            .cause = GUARD_LOAD, .index = (int)k, .force = vec3_length(loads->load[k].force)};
        if (one.force > 0.0 && loads_act_on(loads, k, first_node, sim->body[b].surface.node_count))
            suspect_more(worst, &one);
    }
}

// ---------------------------------------------------------------------------------------------
// Description

static void describe_load(const Sim *sim, int index, char *text, size_t size)
{
    const LoadRecord *record = &sim->loads.record[index];
    const Load *load = &sim->loads.load[index];
    char whose[64] = "the scene's load";
    if (record->sender != 0 || record->id != 0)
        snprintf(whose, sizeof whose, "load %lld of sender %lld", (long long)record->id,
                 (long long)record->sender);
    snprintf(text, size, "%s, (%.3g %.3g %.3g) N", whose, load->force.x, load->force.y,
             load->force.z);
}

static void describe_tool(const Sim *sim, const Suspect *suspect, char *text, size_t size)
{
    char force[32] = ""; // a static tool may have no valid number
    if (isfinite(suspect->force))
        snprintf(force, sizeof force, ", %.3g N", suspect->force);
    snprintf(text, size, "tool %d %s (%.3g %.3g %.3g)%s", sim->tool[suspect->index].id,
             suspect->holds ? "grasping at" : "in contact at", suspect->point.x, suspect->point.y,
             suspect->point.z, force);
}

// Finds a load that has ended: there is nothing left to withdraw.
static bool find_ended_load(const Sim *sim, int b, Suspect *suspect, char *text, size_t size)
{
    // The newest load that left energy in any body of the group.
    int64_t ended = 0;
    Vec3 force = {0.0, 0.0, 0.0};
    for (int i = 0; i < sim->body_count; i++) {
        const GuardBody *at = &sim->guard->body[i];
        if (!in_one_group(sim, i, b) || at->loaded <= ended)
            continue;
        ended = at->loaded;
        force = at->load_force;
    }
    // None: something else is the cause.
    if (ended == 0)
        return false;
    *suspect = (Suspect){.cause = GUARD_LOAD, .stays = true, .force = vec3_length(force)};
    snprintf(text, size, "a load of (%.3g %.3g %.3g) N that ended %.3g s before", force.x, force.y,
             force.z, (double)(sim->clock->step + 1 - ended) * sim->tick);
    return true;
}

// True of a wall that bursts, or collapses, by what is inside.
static bool bursts(const Body *body, char *text, size_t size)
{
    double inside;
    const double most = body->bears * body->tuning.stiffness_scale;
    if (!body->ops->get(body->model, BODY_PRESSURE, &inside) || !(fabs(inside) > most))
        return false;
    snprintf(text, size, "%.3g Pa inside, %.2g times what its wall bears", inside,
             fabs(inside) / most);
    return true;
}

GuardCause guard_find_cause(const Sim *sim, int b, Suspect *suspect, char *text, size_t size)
{
    const Body *body = &sim->body[b];
    const GuardBody *at = &sim->guard->body[b];
    *suspect = (Suspect){.cause = GUARD_UNKNOWN};
    // Tools and loads on any body of the group may be the cause.
    for (int i = 0; i < sim->body_count; i++)
        if (in_one_group(sim, i, b)) {
            suspect_tools(sim, i, suspect);
            suspect_loads(sim, i, suspect);
        }
    // Describe whoever it is.
    if (suspect->cause == GUARD_TOOL)
        describe_tool(sim, suspect, text, size);
    else if (suspect->cause == GUARD_LOAD)
        describe_load(sim, suspect->index, text, size);
    if (suspect->cause != GUARD_UNKNOWN)
        return suspect->cause;

    // Without them, in order: a SET, the time step, past loads, past pushes.
    const int64_t since = sim->clock->step + 1 - at->set;
    if (at->set > 0 && since < sim->guard->window) {
        snprintf(text, size, "%s SET %.3g s before", setting_name(at->set_key),
                 (double)since * sim->tick);
        return GUARD_SET;
    }
    double limit, finest; // with the current scales
    time_step_allows(sim, body, body->tuning.stiffness_scale, body->tuning.damping_scale, &limit,
                     &finest);
    if (body->unsafe_time_step && body->h > limit) {
        snprintf(text, size, "time_step %.4g s beyond its bound %.4g s (unsafe_time_step)", body->h,
                 limit);
        return GUARD_TIME_STEP;
    }
    // Past causes: their energy may still be there.
    if (find_ended_load(sim, b, suspect, text, size))
        return GUARD_LOAD;
    if (guard_was_pushed(sim, b)) {
        snprintf(text, size, "tools that pushed it earlier");
        return GUARD_TOOL;
    }
    if (bursts(body, text, size))
        return GUARD_PRESSURE;
    if (body->tuning.bad_in_a_row > 0 && at->cause != GUARD_UNKNOWN) { // it moved out of its reach
        snprintf(text, size, "the same cause as in the tick before");
        return (GuardCause)at->cause;
    }
    snprintf(text, size, "nothing acting");
    return GUARD_UNKNOWN;
}

// ---------------------------------------------------------------------------------------------
// Withdrawal

// Withdraws like a stale tool, but its poses have no effect until the sender releases it.
static void withdraw_tool(Sim *sim, int b, int t)
{
    cutting_lift(sim, t);
    tool_motion_init(&sim->motion[t]);
    sim->guard->tool[t] = (GuardTool){.withdrawn = 1, .pose = sim->clock->step + 1};
    sim->guard->counts.tools++;
    sim_report(
        sim, b, "withdrawn",
        "tool %d: %d bad ticks within %g s; it comes back when its sender has made it inactive",
        sim->tool[t].id, GUARD_MOST_BLAME, GUARD_WINDOW);
}

static void withdraw_load(Sim *sim, int b, int index)
{
    char which[96];
    describe_load(sim, index, which, sizeof which);
    sim->guard->counts.loads++;
    sim_report(sim, b, "withdrawn", "%s: %d bad ticks within %g s", which, GUARD_MOST_BLAME,
               GUARD_WINDOW);
    sim->loads.load[index].end_step = sim->clock->step;
    guard_note_loads(sim);
    loads_expire(&sim->loads, sim->body, sim->body_count, sim->clock->step);
    guard_renew(sim, -1);
}

bool guard_count(Blame *blame, int64_t tick, int64_t window, int most)
{
    if (blame->count == 0 || tick - blame->since >= window)
        *blame = (Blame){.since = tick};
    blame->count += blame->last != tick; // once per tick, for any number of bodies
    blame->last = tick;
    return blame->count >= most;
}

bool guard_blame(Sim *sim, int b, const Suspect *suspect)
{
    if (suspect->stays || (suspect->cause != GUARD_TOOL && suspect->cause != GUARD_LOAD))
        return false;
    Blame *blame = suspect->cause == GUARD_TOOL ? &sim->guard->tool[suspect->index].blame
                                                : &sim->loads.record[suspect->index].blame;
    if (!guard_count(blame, sim->clock->step + 1, sim->guard->window, GUARD_MOST_BLAME))
        return false;
    if (suspect->cause == GUARD_TOOL)
        withdraw_tool(sim, b, suspect->index);
    else
        withdraw_load(sim, b, suspect->index);
    return true;
}
