// SPDX-License-Identifier: MIT
// The check at the end of a tick, and the reaction to a bad one. Step thread: no allocation, no
// lock, no log. A tick without bad numbers reads one flag per body and a few numbers per tool.
#include "sim/guard/guard.h"

#include "sim/cutting.h"
#include "sim/events.h"
#include "sim/touch/touch.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

// Beyond any useful wrench.
#define FORCE_MOST     1e9  // [N], [N m]
#define POSITION_MOST  1e12 // [m]
#define STIFFNESS_MOST 1e15 // [N/m], [N s/m]

#define FAR 1e3 // longest edges of the coarsest level

int64_t guard_reason(const GuardCounts *counts, int index, const char **name)
{
    static const char *const names[GUARD_REASONS] = {
        "restored_tool",    "restored_load",   "restored_set",      "restored_time_step",
        "restored_unknown", "restored_energy", "restored_pressure", "rest_shapes",
        "withdrawn_tools",  "withdrawn_loads", "wrenches_withheld", "figures_withheld",
        "frozen_bodies",
    };
    const int64_t others[] = {counts->rest_shapes, counts->tools,   counts->loads,
                              counts->wrenches,    counts->figures, counts->frozen};
    *name = names[index];
    return index < GUARD_CAUSE_COUNT ? counts->restored[index] : others[index - GUARD_CAUSE_COUNT];
}

void guard_create(Sim *sim)
{
    // Read only after a bad tick or a SET: not part of what a step reads.
    Guard *guard = arena_allocate(sim->arena, ARENA_OUTPUT, 1, sizeof *guard, "guard");
    // One entry for each body and tool.
    const size_t bodies = (size_t)sim->body_count, tools = (size_t)sim->tool_count;
    guard->body =
        arena_allocate(sim->arena, ARENA_OUTPUT, bodies, sizeof *guard->body, "guard/bodies");
    guard->tool =
        arena_allocate(sim->arena, ARENA_OUTPUT, tools, sizeof *guard->tool, "guard/tools");
    guard->energy =
        arena_allocate(sim->arena, ARENA_OUTPUT, bodies, sizeof *guard->energy, "guard/energy");
    // No motion depends on the account of energies.
    state_add_aside(sim->state, guard->energy, bodies * sizeof *guard->energy, "guard/energy");
    guard->window = llround(fmax(1.0, GUARD_WINDOW / sim->tick));
    // The rest is all zero in good runs, which keep their hashes.
    state_add_rare(sim->state, guard->body, bodies * sizeof *guard->body, "guard/bodies");
    guard->freeze =
        arena_allocate(sim->arena, ARENA_OUTPUT, bodies, sizeof *guard->freeze, "guard/freeze");
    state_add_rare(sim->state, guard->freeze, bodies * sizeof *guard->freeze, "guard/freeze");
    if (tools > 0)
        state_add_rare(sim->state, guard->tool, tools * sizeof *guard->tool, "guard/tools");
    sim->guard = guard;
}

bool guard_can_be(const Body *body, Status *status)
{
    BodyMeasure measure = {0};
    // Figures of the body at rest tell whether its numbers can be computed with.
    if (body->ops->measure != NULL)
        body->ops->measure(body->model, &measure);
    if (isfinite(measure.kinetic) && isfinite(measure.elastic) &&
        isfinite(measure.max_displacement) && isfinite(body->mass))
        return true;
    return status_fail(status, STATUS_INVALID,
                       "body %s: its energies, displacements or mass are not finite at the start; "
                       "its mesh (%.3g kg, longest edge %.3g m) or its material is beyond what can "
                       "be computed",
                       body->name, body->mass, body->surface.longest_edge);
}

// True for a possible tick.
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
        // Ticks that have been, counts and causes that exist.
        const GuardBody *body = &guard->body[b];
        if (!can_be(sim, &body->bad) || !can_be(sim, &body->energy) || !was(sim, body->told) ||
            body->unreported < 0 || !was(sim, body->set) || !setting_is_numbered(body->set_key) ||
            !was(sim, body->loaded) || !vec3_finite(body->load_force) || body->cause < 0 ||
            body->cause >= GUARD_CAUSE_COUNT || !can_be(sim, &guard->freeze[b].shapes) ||
            !was(sim, guard->freeze[b].since))
            return false;
        // Energies that a sum could have given.
        const EnergyAccount *energy = &guard->energy[b];
        if (!(energy->had >= 0.0) || !(energy->given >= 0.0) || !isfinite(energy->outer) ||
            !isfinite(energy->touch) || !(energy->held >= 0.0) ||
            (energy->known != 0 && energy->known != 1))
            return false;
    }
    // A withdrawn tool stands still until its sender releases it.
    for (int t = 0; t < sim->tool_count; t++) {
        const GuardTool *tool = &guard->tool[t];
        if ((tool->withdrawn != 0 && tool->withdrawn != 1) || !was(sim, tool->pose) ||
            !can_be(sim, &tool->blame))
            return false;
        if (tool->withdrawn && (sim->motion[t].active || sim->tool[t].kind == TOOL_STATIC))
            return false;
    }
    // Bad ticks that loads were blamed for.
    for (int k = 0; sim->loads.count != NULL && k < LOAD_CAPACITY; k++)
        if (!can_be(sim, &sim->loads.record[k].blame))
            return false;
    return true;
}

// ---------------------------------------------------------------------------------------------
// Bodies

// Discards the body's effect on tools in this tick.
static void forget_contacts(Sim *sim, int b)
{
    for (int k = sim->attachment_start[b]; k < sim->attachment_start[b + 1]; k++)
        attachment_clear(sim->attachment[k]);
    for (int k = sim->contact_start[b]; k < sim->contact_start[b + 1]; k++)
        contact_clear(sim->contact[k]);
    for (int k = 0; k < sim->touch_count; k++)
        if (touch_options(sim->touch[k])->body[0] == b ||
            touch_options(sim->touch[k])->body[1] == b)
            touch_forget_friction(sim->touch[k]);
}

// The first restore keeps velocities, since a passing blow should not stop the body; if that was
// not enough, it restores rest, then the rest shape.
static RestoreMode choose_mode(Sim *sim, int b)
{
    GuardBody *at = &sim->guard->body[b];
    const int64_t row = sim->body[b].tuning.bad_in_a_row;
    bool often = guard_count(&at->bad, sim->clock->step + 1, sim->guard->window, GUARD_BAD_TICKS);
    if (row >= GUARD_BAD_TICKS || often)
        return RESTORE_SHAPE;
    return row > 1 ? RESTORE_POSITIONS : RESTORE_MOTION;
}

// A state that a change of topology spoilt before the forces were evaluated is not a good one.
static RestoreMode restore(Sim *sim, int b)
{
    const Body *body = &sim->body[b];
    const BodyOps *ops = body->ops;
    RestoreMode mode = choose_mode(sim, b);
    ops->restore(body->model, mode);
    while (mode != RESTORE_SHAPE && ops->check != NULL && !ops->check(body->model)) {
        mode = mode == RESTORE_MOTION ? RESTORE_POSITIONS : RESTORE_SHAPE;
        ops->restore(body->model, mode);
    }
    if (mode == RESTORE_SHAPE)
        sim->guard->body[b].bad = (Blame){0}; // restarts the window
    return mode;
}

// Reports at most once per window about each body.
static void tell(Sim *sim, int b, RestoreMode mode, const char *what)
{
    static const char *const back[] = {"the state before the tick, at rest", "the rest shape",
                                       "the state before the tick"};
    // At most one report about a body per window; the others are counted.
    GuardBody *at = &sim->guard->body[b];
    const int64_t tick = sim->clock->step + 1;
    at->unreported++;
    if (at->told > 0 && tick - at->told < sim->guard->window)
        return;
    // The report tells how many it stands for.
    if (at->unreported > 1)
        sim_report(sim, b, "restored", "%s; restored to %s; %lld times since the last report", what,
                   back[mode], (long long)at->unreported);
    else
        sim_report(sim, b, "restored", "%s; restored to %s", what, back[mode]);
    at->told = tick;
    at->unreported = 0;
}

// A tool or load that was just withdrawn left a state with good numbers only.
static bool is_torn_away(const Sim *sim, int b)
{
    const Body *body = &sim->body[b];
    BodyMeasure measure;
    body->ops->measure(body->model, &measure);
    return !(measure.max_displacement <= FAR * body->surface.longest_edge);
}

// Freezes a body that its rest shape has not helped: it would only take the time of the others.
static void freeze(Sim *sim, int b, GuardCause cause, const char *what)
{
    static const char *const cure[GUARD_CAUSE_COUNT] = {
        [GUARD_TOOL] = "move the tool off",
        [GUARD_LOAD] = "lower the load",
        [GUARD_SET] = "SET another value",
        [GUARD_TIME_STEP] = "shorten time_step",
        [GUARD_UNKNOWN] = "shorten its time_step",
        [GUARD_ENERGY] = "shorten its time_step",
        [GUARD_PRESSURE] = "lower the pressure inside",
    };
    GuardFreeze *at = &sim->guard->freeze[b];
    const int64_t tick = sim->clock->step + 1;
    if (!guard_count(&at->shapes, tick, sim->guard->window, GUARD_MOST_SHAPES))
        return;
    at->since = tick;
    sim->guard->counts.frozen++;
    sim_report(sim, b, "frozen", "until RESET, restored too often: %s; %s", what, cure[cause]);
}

static void note_restore(Sim *sim, int b, RestoreMode mode, GuardCause cause, const char *what)
{
    sim->body[b].resets++;
    sim->resets++;
    sim->guard->counts.restored[cause]++;
    sim->guard->counts.rest_shapes += mode == RESTORE_SHAPE;
    sim->guard->energy[b] = (EnergyAccount){0};
    if (mode == RESTORE_SHAPE) { // no effect of it remains
        sim->guard->body[b].loaded = 0;
        sim->guard->body[b].cause = GUARD_UNKNOWN;
    }
    cutting_break_off(sim, b); // the jump back is no motion past the blade
    tell(sim, b, mode, what);
    if (mode == RESTORE_SHAPE)
        freeze(sim, b, cause, what);
}

static void mend(Sim *sim, int b)
{
    Body *body = &sim->body[b];
    Suspect suspect;
    char cause[SIM_EVENT_TEXT], what[SIM_EVENT_TEXT + 32];
    // Find the cause first: restoring removes its traces.
    const GuardCause found = guard_find_cause(sim, b, &suspect, cause, sizeof cause);
    snprintf(what, sizeof what, "bad numbers with %s", cause);
    body->tuning.bad_in_a_row++;
    sim->guard->body[b].cause = found;
    RestoreMode mode = restore(sim, b);
    // A body far from what it hung on cannot come back by itself.
    if (guard_blame(sim, b, &suspect) && mode != RESTORE_SHAPE && is_torn_away(sim, b)) {
        mode = RESTORE_SHAPE;
        body->ops->restore(body->model, mode);
    }
    note_restore(sim, b, mode, found, what);
}

// Handles good numbers with wrong energy, for which the tick before would be no better. Zero
// velocity may not be enough, so a body with wrong energy again soon gets its rest shape.
static void mend_energy(Sim *sim, int b, EnergyVerdict verdict, double has, double most)
{
    char what[SIM_EVENT_TEXT];
    const Body *body = &sim->body[b];
    GuardBody *at = &sim->guard->body[b];
    // A second fault within four checks, or the window: stopping the body was not enough.
    const int64_t looks = 4 * guard_energy_ticks(body), window = sim->guard->window;
    const bool again =
        guard_count(&at->energy, sim->clock->step + 1, looks > window ? looks : window, 2);
    // Motion is stopped; a wrong shape, or a second fault, needs the rest shape.
    const RestoreMode mode =
        again || verdict == ENERGY_WRONG_SHAPE ? RESTORE_SHAPE : RESTORE_POSITIONS;
    body->ops->restore(body->model, mode);
    if (mode == RESTORE_SHAPE)
        at->energy = (Blame){0};
    // Tell what was there and what it should have been.
    if (verdict == ENERGY_WRONG_TOUCH)
        snprintf(what, sizeof what, "%.3g J out of contacts that had %.3g J to give", has, most);
    else
        snprintf(what, sizeof what, "%.3g J where %.3g J were there or given", has, most);
    note_restore(sim, b, mode, GUARD_ENERGY, what);
}

// Finds bodies that touch with a friction that cannot be.
static void judge_friction(const Sim *sim, bool bad[SIM_BODIES])
{
    for (int k = 0; k < sim->touch_count; k++) {
        const TouchOptions *options = touch_options(sim->touch[k]);
        const bool can_be = touch_can_rub(sim->touch[k]);
        for (int e = 0; e < touch_bodies(options); e++)
            bad[options->body[e]] |= !can_be && !guard_is_frozen(sim, options->body[e]);
    }
}

bool guard_bodies(Sim *sim)
{
    bool bad[SIM_BODIES], any = false;
    // Commit accepts the numbers of each body, or reports them as bad.
    for (int b = 0; b < sim->body_count; b++) {
        Body *body = &sim->body[b];
        bad[b] = !guard_is_frozen(sim, b) && !body->ops->commit(body->model);
    }
    // What a checkpoint would be refused for is bad now.
    judge_friction(sim, bad);
    for (int b = 0; b < sim->body_count; b++) {
        any |= bad[b];
        if (!bad[b])
            sim->body[b].tuning.bad_in_a_row = 0;
    }
    // Good numbers may still have too much energy.
    bool wrong[SIM_BODIES];
    for (int b = 0; b < sim->body_count; b++) {
        double has, most;
        const EnergyVerdict verdict =
            bad[b] || guard_is_frozen(sim, b) ? ENERGY_RIGHT : guard_energy(sim, b, &has, &most);
        wrong[b] = verdict != ENERGY_RIGHT;
        any |= wrong[b];
        if (wrong[b])
            mend_energy(sim, b, verdict, has, most);
    }
    if (!any)
        return false;
    // Find the causes before contacts are discarded.
    for (int b = 0; b < sim->body_count; b++)
        if (bad[b])
            mend(sim, b);
    // Contacts of a restored body remember another motion.
    for (int b = 0; b < sim->body_count; b++)
        if (bad[b] || wrong[b])
            forget_contacts(sim, b);
    return true;
}

// ---------------------------------------------------------------------------------------------
// Outputs

static bool is_within(Vec3 v, double most)
{
    return fabs(v.x) <= most && fabs(v.y) <= most && fabs(v.z) <= most; // false for NaN
}

static bool is_valid(const ToolWrench *wrench)
{
    const bool ok = is_within(wrench->position, POSITION_MOST) &&
                    is_within(wrench->force, FORCE_MOST) && is_within(wrench->torque, FORCE_MOST) &&
                    is_within(wrench->point, POSITION_MOST) && is_within(wrench->normal, 2.0) &&
                    fabs(wrench->depth) <= POSITION_MOST && fabs(wrench->damping) <= STIFFNESS_MOST;
    const Sym3 *k = &wrench->stiffness;
    return ok && is_within(vec3(k->xx, k->yy, k->zz), STIFFNESS_MOST) &&
           is_within(vec3(k->yz, k->zx, k->xy), STIFFNESS_MOST);
}

void guard_wrenches(Sim *sim)
{
    for (int t = 0; t < sim->tool_count; t++) {
        ToolWrench *wrench = &sim->wrench[t];
        if (is_valid(wrench))
            continue;
        // The tool keeps its place, if that is one.
        bool there = is_within(wrench->position, POSITION_MOST);
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
// Inputs

// The sender must release it, or be silent until it is stale.
bool guard_admits(Sim *sim, int t, const ToolPose *pose)
{
    GuardTool *tool = &sim->guard->tool[t];
    const int64_t tick = sim->clock->step + 1;
    if (!tool->withdrawn)
        return true;
    // A sender that was silent for so long has let go of it.
    const double silent = (double)(tick - tool->pose) * sim->tick;
    if (pose->active && (sim->clock->lockstep || silent <= sim->options.tool_timeout_s)) {
        tool->pose = tick;
        return false;
    }
    *tool = (GuardTool){0};
    return true;
}

void guard_note_set(Sim *sim, int body, int key)
{
    guard_renew(sim, body);
    for (int b = 0; b < sim->body_count; b++)
        if (body < 0 || body == b) {
            sim->guard->body[b].set = sim->clock->step + 1;
            sim->guard->body[b].set_key = key;
        }
}

// ---------------------------------------------------------------------------------------------
// Queries

const GuardCounts *sim_guard_counts(const Sim *sim)
{
    return &sim->guard->counts;
}

bool sim_tool_withdrawn(const Sim *sim, int index)
{
    return sim->guard->tool[index].withdrawn != 0;
}
