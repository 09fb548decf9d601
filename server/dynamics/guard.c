// The check at the end of a tick, and what follows from a bad one. Step thread: no allocation, no
// lock, no log; a tick without bad numbers asks each body for its note and looks at a few numbers a
// tool.
#include "dynamics/sim_data.h"

#include <math.h>
#include <string.h>

// Beyond any wrench that a hand, or a scene, has a use for.
#define FORCE_MOST     1e9  // [N], [N m]
#define PLACE_MOST     1e12 // [m]
#define STIFFNESS_MOST 1e15 // [N/m], [N s/m]

#define FAR 1e3 // longest edges of the coarsest level

static const char *const keys[GUARD_KEYS] = {
    "another key", "gravity",         "gravity_x",     "gravity_y",
    "gravity_z",   "stiffness_scale", "damping_scale", "friction",
};

const char *guard_key(int64_t key)
{
    return keys[key];
}

int64_t guard_reason(const GuardCounts *counts, int index, const char **name)
{
    static const char *const names[GUARD_REASONS] = {
        "restored_tool",     "restored_load",    "restored_set",    "restored_time_step",
        "restored_unknown",  "rest_shapes",      "withdrawn_tools", "withdrawn_loads",
        "wrenches_withheld", "figures_withheld",
    };
    const int64_t others[] = {counts->rest_shapes, counts->tools, counts->loads, counts->wrenches,
                              counts->figures};
    *name = names[index];
    return index < GUARD_CAUSE_COUNT ? counts->restored[index] : others[index - GUARD_CAUSE_COUNT];
}

void guard_create(Sim *sim)
{
    // Read when something is bad, or SET: not part of what a step reads.
    Guard *guard = arena_allocate(sim->arena, ARENA_OUTPUT, 1, sizeof *guard, "guard");
    const size_t bodies = (size_t)sim->body_count, tools = (size_t)sim->tool_count;
    guard->body =
        arena_allocate(sim->arena, ARENA_OUTPUT, bodies, sizeof *guard->body, "guard/bodies");
    guard->tool =
        arena_allocate(sim->arena, ARENA_OUTPUT, tools, sizeof *guard->tool, "guard/tools");
    guard->window = llround(fmax(1.0, GUARD_WINDOW / sim->tick));
    state_add_rare(sim->state, guard->body, bodies * sizeof *guard->body, "guard/bodies");
    if (tools > 0)
        state_add_rare(sim->state, guard->tool, tools * sizeof *guard->tool, "guard/tools");
    sim->guard = guard;
}

bool guard_can_be(const Body *body, Status *status)
{
    BodyMeasure measure = {0};
    if (body->ops->measure != NULL)
        body->ops->measure(body->model, &measure);
    if (isfinite(measure.kinetic) && isfinite(measure.elastic) &&
        isfinite(measure.max_displacement) && isfinite(body->mass))
        return true;
    return status_fail(status, STATUS_INVALID,
                       "body %s: its energies, displacements or mass are no numbers at the start; "
                       "its mesh (%.3g kg, longest edge %.3g m) or its material is beyond what can "
                       "be computed",
                       body->name, body->mass, body->surface.longest_edge);
}

// A tick that can have been.
static bool was(const Sim *sim, int64_t tick)
{
    return tick >= 0 && tick <= sim->clock->step + 1;
}

static bool can_be(const Sim *sim, const Blame *blame)
{
    return was(sim, blame->since) && was(sim, blame->last) && blame->count >= 0 &&
           blame->count <= sim->clock->step + 1;
}

bool guard_check(const Sim *sim)
{
    const Guard *guard = sim->guard;
    for (int b = 0; b < sim->body_count; b++) {
        const GuardBody *body = &guard->body[b];
        if (!can_be(sim, &body->bad) || !was(sim, body->told) || body->untold < 0 ||
            !was(sim, body->set) || body->set_key < 0 || body->set_key >= GUARD_KEYS)
            return false;
    }
    for (int t = 0; t < sim->tool_count; t++) {
        const GuardTool *tool = &guard->tool[t];
        if ((tool->withdrawn != 0 && tool->withdrawn != 1) || !was(sim, tool->pose) ||
            !can_be(sim, &tool->blame))
            return false;
        if (tool->withdrawn && (sim->motion[t].active || sim->tool[t].kind == TOOL_STATIC))
            return false;
    }
    for (int k = 0; sim->loads.count != NULL && k < LOAD_CAPACITY; k++)
        if (!can_be(sim, &sim->loads.record[k].blame))
            return false;
    return true;
}

bool guard_count(Blame *blame, int64_t tick, int64_t window, int most)
{
    if (blame->count == 0 || tick - blame->since >= window)
        *blame = (Blame){.since = tick};
    blame->count += blame->last != tick; // of several bodies in a tick
    blame->last = tick;
    return blame->count >= most;
}

// ---------------------------------------------------------------------------------------------
// Bodies

// What the body did to tools in this tick did not happen.
static void forget_contacts(Sim *sim, int b)
{
    int first, end = holding_of(sim, b, &first);
    for (int k = first; k < end; k++)
        attachment_clear(sim->attachment[k]);
    for (int k = sim->contact_count > 0 ? sim->contact_start[b] : 0;
         sim->contact_count > 0 && k < sim->contact_start[b + 1]; k++)
        contact_clear(sim->contact[k]);
}

// The first time with its velocities, since a blow that passes should not stop it; when that was
// not enough at rest, then in its rest shape.
static RestoreMode choose_mode(Sim *sim, int b)
{
    GuardBody *at = &sim->guard->body[b];
    const int64_t row = sim->body[b].tuning.bad_in_a_row;
    bool often = guard_count(&at->bad, sim->clock->step + 1, sim->guard->window, GUARD_BAD_TICKS);
    if (row >= GUARD_BAD_TICKS || often)
        return RESTORE_SHAPE;
    return row > 1 ? RESTORE_PLACES : RESTORE_MOTION;
}

// A state that was spoilt before the forces could, by a change of topology, is no good one.
static RestoreMode restore(Sim *sim, int b)
{
    const Body *body = &sim->body[b];
    const BodyOps *ops = body->ops;
    RestoreMode mode = choose_mode(sim, b);
    ops->restore(body->model, mode);
    while (mode != RESTORE_SHAPE && ops->check != NULL && !ops->check(body->model)) {
        mode = mode == RESTORE_MOTION ? RESTORE_PLACES : RESTORE_SHAPE;
        ops->restore(body->model, mode);
    }
    if (mode == RESTORE_SHAPE)
        sim->guard->body[b].bad = (Blame){0}; // begins anew
    return mode;
}

// At most one word a window about each body.
static void tell(Sim *sim, int b, RestoreMode mode, const char *cause)
{
    static const char *const back[] = {"the state before the tick, at rest", "the rest shape",
                                       "the state before the tick"};
    GuardBody *at = &sim->guard->body[b];
    const int64_t tick = sim->clock->step + 1;
    at->untold++;
    if (at->told > 0 && tick - at->told < sim->guard->window)
        return;
    if (at->untold > 1)
        sim_tell(sim, b, "restored", "bad numbers with %s; back to %s; %lld times since last told",
                 cause, back[mode], (long long)at->untold);
    else
        sim_tell(sim, b, "restored", "bad numbers with %s; back to %s", cause, back[mode]);
    at->told = tick;
    at->untold = 0;
}

// What was withdrawn just now has left a state that is good in numbers only.
static bool is_torn_away(const Sim *sim, int b)
{
    const Body *body = &sim->body[b];
    BodyMeasure measure;
    body->ops->measure(body->model, &measure);
    return !(measure.max_displacement <= FAR * body->surface.longest_edge);
}

static void mend(Sim *sim, int b)
{
    Body *body = &sim->body[b];
    Suspect suspect;
    char cause[SIM_EVENT_TEXT];
    const GuardCause found = guard_find_cause(sim, b, &suspect, cause, sizeof cause);
    body->tuning.bad_in_a_row++;
    RestoreMode mode = restore(sim, b);
    if (guard_blame(sim, b, &suspect) && mode != RESTORE_SHAPE && is_torn_away(sim, b)) {
        mode = RESTORE_SHAPE;
        body->ops->restore(body->model, mode);
    }
    body->resets++;
    sim->resets++;
    sim->guard->counts.restored[found]++;
    sim->guard->counts.rest_shapes += mode == RESTORE_SHAPE;
    cutting_break_off(sim, b); // what jumped back did not pass the blade
    tell(sim, b, mode, cause);
}

bool guard_bodies(Sim *sim)
{
    bool bad[SIM_BODIES], any = false;
    for (int b = 0; b < sim->body_count; b++) {
        Body *body = &sim->body[b];
        bad[b] = !body->ops->commit(body->model);
        any |= bad[b];
        if (!bad[b])
            body->tuning.bad_in_a_row = 0;
    }
    if (!any)
        return false;
    // Who acted on whom is looked up before anybody forgets.
    for (int b = 0; b < sim->body_count; b++)
        if (bad[b])
            mend(sim, b);
    for (int b = 0; b < sim->body_count; b++)
        if (bad[b])
            forget_contacts(sim, b);
    return true;
}

// ---------------------------------------------------------------------------------------------
// What leaves

static bool is_within(Vec3 v, double most)
{
    return fabs(v.x) <= most && fabs(v.y) <= most && fabs(v.z) <= most; // false of NaN
}

static bool is_sound(const ToolWrench *wrench)
{
    bool ok = is_within(wrench->position, PLACE_MOST) && is_within(wrench->force, FORCE_MOST) &&
              is_within(wrench->torque, FORCE_MOST) && is_within(wrench->point, PLACE_MOST) &&
              is_within(wrench->normal, 2.0) && fabs(wrench->depth) <= PLACE_MOST &&
              fabs(wrench->damping) <= STIFFNESS_MOST;
    for (int i = 0; i < 6; i++)
        ok = ok && fabs(wrench->stiffness[i]) <= STIFFNESS_MOST;
    return ok;
}

void guard_wrenches(Sim *sim)
{
    for (int t = 0; t < sim->tool_count; t++) {
        ToolWrench *wrench = &sim->wrench[t];
        if (is_sound(wrench))
            continue;
        bool there = is_within(wrench->position, PLACE_MOST);
        *wrench = (ToolWrench){.position = there ? wrench->position : sim->motion[t].to_position};
        sim->guard->counts.wrenches++;
    }
}

double sim_figure(Sim *sim, double figure)
{
    if (isfinite(figure))
        return figure;
    sim->guard->counts.figures++;
    return 0.0;
}

void sim_measure(Sim *sim, int b, BodyMeasure *measure)
{
    const Body *body = &sim->body[b];
    body->ops->measure(body->model, measure);
    measure->kinetic = sim_figure(sim, measure->kinetic);
    measure->elastic = sim_figure(sim, measure->elastic);
    measure->max_displacement = sim_figure(sim, measure->max_displacement);
}

// ---------------------------------------------------------------------------------------------
// What comes in

// Its sender must let go of it, or be silent for as long as it takes to become stale.
bool guard_admits(Sim *sim, int t, const ToolPose *pose)
{
    GuardTool *tool = &sim->guard->tool[t];
    const int64_t tick = sim->clock->step + 1;
    if (!tool->withdrawn)
        return true;
    const double silent = (double)(tick - tool->pose) * sim->tick;
    if (pose->active && (sim->clock->lockstep || silent <= sim->options.tool_timeout_s)) {
        tool->pose = tick;
        return false;
    }
    *tool = (GuardTool){0};
    return true;
}

void guard_note_set(Sim *sim, int body, const char *key)
{
    // Of levels of detail all are stable, and the governor of a live run chooses among them.
    if (strncmp(key, "adapt_", 6) == 0)
        return;
    int64_t about = 0;
    for (int k = 1; k < GUARD_KEYS; k++)
        if (strcmp(key, keys[k]) == 0)
            about = k;
    for (int b = 0; b < sim->body_count; b++)
        if (body < 0 || body == b) {
            sim->guard->body[b].set = sim->clock->step + 1;
            sim->guard->body[b].set_key = about;
        }
}

// ---------------------------------------------------------------------------------------------
// What others ask

const GuardCounts *sim_guard_counts(const Sim *sim)
{
    return &sim->guard->counts;
}

bool sim_tool_withdrawn(const Sim *sim, int index)
{
    return sim->guard->tool[index].withdrawn != 0;
}
