// Why the numbers of a body went bad, as far as what acted on it tells; and what becomes of who did
// it. A pure function of the state and the tick, so that a repeated run blames the same. Step
// thread, only in a bad tick.
#include "dynamics/sim_data.h"

#include <math.h>
#include <stdio.h>

// ---------------------------------------------------------------------------------------------
// Who acted

static double strength(Vec3 impulse, double tick, const ToolOptions *tool)
{
    double force = vec3_length(impulse) / tick, most = (double)INFINITY;
    if (tool->kind != TOOL_STATIC)
        most = tool->max_force;          // the body was never given more
    return force <= most ? force : most; // also of a number that is none
}

static void suspect_more(Suspect *worst, const Suspect *one)
{
    // What can be withdrawn comes first, then what pushes harder; of equals the first.
    bool nobody = worst->cause == GUARD_UNKNOWN;
    if (nobody || (worst->stays && !one->stays) ||
        (worst->stays == one->stays && one->force > worst->force))
        *worst = *one;
}

static void suspect_tools(const Sim *sim, int b, Suspect *worst)
{
    for (int k = sim->contact_count > 0 ? sim->contact_start[b] : 0;
         sim->contact_count > 0 && k < sim->contact_start[b + 1]; k++) {
        const ContactSums *sums = contact_sums(sim->contact[k]);
        const int t = sim->contact_tool[k];
        if (!contact_is_near(sim->contact[k]) || sums->weight == 0.0) // NaN acted
            continue;
        Suspect one = {.cause = GUARD_TOOL,
                       .index = t,
                       .stays = sim->tool[t].kind == TOOL_STATIC,
                       .force = strength(sums->impulse, sim->tick, &sim->tool[t]),
                       .point = vec3_scale(1.0 / sums->weight, sums->point)};
        if (!vec3_finite(one.point))
            one.point = sums->about;
        suspect_more(worst, &one);
    }
    int k, end = holding_of(sim, b, &k);
    for (; k < end; k++) {
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

static bool are_joined(const Sim *sim, int a, int b)
{
    return a == b || (sim->joint_count > 0 && sim->joined[a] == sim->joined[b]);
}

// ---------------------------------------------------------------------------------------------
// In words

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
    char force[32] = ""; // of a static tool it may be no number
    if (isfinite(suspect->force))
        snprintf(force, sizeof force, ", %.3g N", suspect->force);
    snprintf(text, size, "tool %d %s (%.3g %.3g %.3g)%s", sim->tool[suspect->index].id,
             suspect->holds ? "holding at" : "in contact at", suspect->point.x, suspect->point.y,
             suspect->point.z, force);
}

GuardCause guard_find_cause(const Sim *sim, int b, Suspect *suspect, char *text, size_t size)
{
    const Body *body = &sim->body[b];
    const GuardBody *at = &sim->guard->body[b];
    *suspect = (Suspect){.cause = GUARD_UNKNOWN};
    for (int i = 0; i < sim->body_count; i++)
        if (are_joined(sim, i, b)) {
            suspect_tools(sim, i, suspect);
            suspect_loads(sim, i, suspect);
        }
    if (suspect->cause == GUARD_TOOL)
        describe_tool(sim, suspect, text, size);
    else if (suspect->cause == GUARD_LOAD)
        describe_load(sim, suspect->index, text, size);
    if (suspect->cause != GUARD_UNKNOWN)
        return suspect->cause;

    const int64_t since = sim->clock->step + 1 - at->set;
    if (at->set > 0 && since < sim->guard->window) {
        snprintf(text, size, "%s SET %.3g s before", guard_key(at->set_key),
                 (double)since * sim->tick);
        return GUARD_SET;
    }
    double limit, finest; // by the scales as they are now
    time_step_allows(sim, body, body->tuning.stiffness_scale, body->tuning.damping_scale, &limit,
                     &finest);
    if (body->unsafe_time_step && body->h > limit) {
        snprintf(text, size, "time_step %.4g s beyond its bound %.4g s (unsafe_time_step)", body->h,
                 limit);
        return GUARD_TIME_STEP;
    }
    snprintf(text, size, "nothing acting");
    return GUARD_UNKNOWN;
}

// ---------------------------------------------------------------------------------------------
// Withdrawal

// As a stale one, but for that its poses do nothing until its sender lets go of it.
static void withdraw_tool(Sim *sim, int b, int t)
{
    cutting_lift(sim, t);
    tool_motion_init(&sim->motion[t]);
    sim->guard->tool[t] = (GuardTool){.withdrawn = 1, .pose = sim->clock->step + 1};
    sim->guard->counts.tools++;
    sim_tell(
        sim, b, "withdrawn",
        "tool %d: %d bad ticks within %g s; it comes back when its sender has made it inactive",
        sim->tool[t].id, GUARD_MOST_BLAME, GUARD_WINDOW);
}

static void withdraw_load(Sim *sim, int b, int index)
{
    char which[96];
    describe_load(sim, index, which, sizeof which);
    sim->guard->counts.loads++;
    sim_tell(sim, b, "withdrawn", "%s: %d bad ticks within %g s", which, GUARD_MOST_BLAME,
             GUARD_WINDOW);
    sim->loads.load[index].end_step = sim->clock->step;
    loads_expire(&sim->loads, sim->body, sim->body_count, sim->clock->step);
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
