// SPDX-License-Identifier: MIT
// Taking tissue away in a tick: what each remover whose pedal is down takes from each body, and the
// events of it. Step thread. No allocation except in removing_create.
#include "sim/removing.h"

#include "sim/cutting.h"
#include "sim/events.h"
#include "sim/follow.h"
#include "sim/guard/guard.h"

#include "base/check.h"

#include <math.h>
#include <stdio.h>

// ---------------------------------------------------------------------------------------------
// Creation

static void create_body(Sim *sim, int b)
{
    const size_t count = (size_t)sim->removing->count;
    Taking *taking = arena_allocate(sim->arena, ARENA_STEP, count, sizeof *taking, "%s/removed",
                                    sim->body[b].name);
    for (size_t k = 0; k < count; k++)
        taking[k] = (Taking){.refused_step = STEP_NEVER};
    state_add(sim->state, taking, count * sizeof *taking, "%s/removed", sim->body[b].name);
    sim->removing->taking[b] = taking;
    if (sim->body[b].ops->conduct == NULL)
        return;
    Heated *heated = arena_allocate(sim->arena, ARENA_STEP, count, sizeof *heated, "%s/heated",
                                    sim->body[b].name);
    state_add(sim->state, heated, count * sizeof *heated, "%s/heated", sim->body[b].name);
    sim->removing->heated[b] = heated;
}

void removing_create(Sim *sim)
{
    int removers = 0, bodies = 0;
    for (int t = 0; t < sim->tool_count; t++)
        removers += sim->tool[t].kind == TOOL_REMOVER;
    for (int b = 0; b < sim->body_count; b++)
        bodies += sim->body[b].ops->remove != NULL;
    if (removers == 0 || bodies == 0)
        return;
    Removing *removing =
        arena_allocate(sim->arena, ARENA_STEP, 1, sizeof *removing, "sim/removing");
    sim->removing = removing;
    for (int t = 0; t < sim->tool_count; t++)
        if (sim->tool[t].kind == TOOL_REMOVER)
            removing->tool[removing->count++] = t;
    removing->remover = arena_allocate(sim->arena, ARENA_STEP, (size_t)removing->count,
                                       sizeof *removing->remover, "sim/removers");
    state_add(sim->state, removing->remover, (size_t)removing->count * sizeof *removing->remover,
              "sim/removers");
    for (int b = 0; b < sim->body_count; b++)
        if (sim->body[b].ops->remove != NULL)
            create_body(sim, b);
}

bool removing_check(const Sim *sim)
{
    const Removing *removing = sim->removing;
    for (int k = 0; removing != NULL && k < removing->count; k++) {
        const Remover *remover = &removing->remover[k];
        if ((remover->on != 0 && remover->on != 1) || !(remover->credit >= 0.0) ||
            !isfinite(remover->credit))
            return false;
        for (int b = 0; b < sim->body_count; b++) {
            const Heated *heated = removing->heated[b] != NULL ? &removing->heated[b][k] : NULL;
            if (heated != NULL && (!isfinite(heated->joules) || !isfinite(heated->coagulated)))
                return false;
            const Taking *taking = removing->taking[b] != NULL ? &removing->taking[b][k] : NULL;
            if (taking != NULL &&
                (taking->removed < 0 || !isfinite(taking->volume) || !isfinite(taking->area) ||
                 !isfinite(taking->mass) || !cutting_was(sim, taking->refused_step)))
                return false;
        }
    }
    return true;
}

// ---------------------------------------------------------------------------------------------
// Events

static void report_refusal(Sim *sim, int b, int k, const RemovalOutcome *outcome)
{
    Taking *taking = &sim->removing->taking[b][k];
    if ((double)(sim->clock->step - taking->refused_step) * sim->tick < 1.0)
        return;
    taking->refused_step = sim->clock->step;
    char why[SIM_EVENT_TEXT];
    const CutOutcome cut = {
        .verdict = outcome->verdict, .needed = outcome->needed, .room = outcome->room};
    cut_describe(&cut, sim->body[b].name, why, sizeof why);
    sim_report(sim, b, "remove_refused", "tool %d: %.140s", sim->tool[sim->removing->tool[k]].id,
               why);
}

// Summarises what a remover took since its pedal went down.
static void report_taken(Sim *sim, int b, int k)
{
    Taking *taking = &sim->removing->taking[b][k];
    const int id = sim->tool[sim->removing->tool[k]].id;
    Heated *heated = sim->removing->heated[b] != NULL ? &sim->removing->heated[b][k] : NULL;
    const bool solid = sim->body[b].surface.solid; // else a wall: its coagulated area
    if (heated != NULL && heated->joules > 0.0)
        sim_report(sim, b, "remove",
                   "tool %d: %.4g J heated body '%s', %lld %s removed, %.4g %s, %.4g g; "
                   "%.4g %s are coagulated",
                   id, heated->joules, sim->body[b].name, (long long)taking->removed,
                   solid ? "cells" : "faces", solid ? 1e9 * taking->volume : 1e6 * taking->area,
                   solid ? "mm3" : "mm2", 1e3 * taking->mass,
                   solid ? 1e9 * heated->coagulated : 1e6 * heated->coagulated / REMOVED_THICKNESS,
                   solid ? "mm3" : "mm2");
    else if (taking->removed > 0 && taking->area > 0.0)
        sim_report(sim, b, "remove", "tool %d: %lld faces of body '%s' removed, %.4g mm2, %.4g g",
                   id, (long long)taking->removed, sim->body[b].name, 1e6 * taking->area,
                   1e3 * taking->mass);
    else if (taking->removed > 0)
        sim_report(sim, b, "remove", "tool %d: %lld cells of body '%s' removed, %.4g mm3, %.4g g",
                   id, (long long)taking->removed, sim->body[b].name, 1e9 * taking->volume,
                   1e3 * taking->mass);
    *taking = (Taking){.refused_step = taking->refused_step};
    if (heated != NULL)
        *heated = (Heated){0.0, 0.0};
}

// ---------------------------------------------------------------------------------------------
// The stage

typedef struct Work {
    Removal removal;
    RemovalOutcome sum; // of all calls for a body; the verdict is the last one's
    bool reached;       // there was tissue to take
    double left;        // heat that the bodies before did not take [J]
} Work;

static bool remove_once(Sim *sim, int b, void *context, TopologyChange *change)
{
    Work *work = context;
    RemovalOutcome one = {.verdict = CUT_MET_NOTHING}, *sum = &work->sum;
    const bool changed = sim->body[b].ops->remove(&sim->body[b], &work->removal, &one, change);
    work->removal.volume -= one.volume + REMOVED_THICKNESS * one.area;
    work->left = work->removal.heat > 0.0 ? work->removal.heat - one.heat : work->left;
    work->removal.heat = 0.0; // given once
    work->reached |= one.verdict == CUT_DONE;
    sum->verdict = one.verdict;
    sum->removed += one.removed;
    sum->volume += one.volume;
    sum->area += one.area;
    sum->mass += one.mass;
    sum->heat += one.heat;
    sum->coagulated = one.coagulated;
    sum->needed = one.needed;
    sum->room = one.room;
    sum->pieces = one.pieces > 0 ? one.pieces : sum->pieces;
    return changed;
}

// Returns where a remover's mouth is at the start of the tick: the time of the bodies' positions.
static Region mouth_now(const Sim *sim, int tool)
{
    Vec3 position;
    Quat orientation;
    tool_motion_at(&sim->motion[tool], 0.0, &position, &orientation);
    const Capsule *mouth = &sim->tool[tool].mouth;
    return (Region){.kind = REGION_CAPSULE,
                    .from = vec3_add(position, quat_rotate(orientation, mouth->from)),
                    .to = vec3_add(position, quat_rotate(orientation, mouth->to)),
                    .radius = mouth->radius};
}

static void take_from(Sim *sim, int b, int k, Work *work)
{
    Taking *taking = &sim->removing->taking[b][k];
    work->sum = (RemovalOutcome){.verdict = CUT_MET_NOTHING};
    change_body(sim, b, remove_once, work);
    taking->removed += work->sum.removed;
    taking->volume += work->sum.volume;
    taking->area += work->sum.area;
    taking->mass += work->sum.mass;
    if (sim->removing->heated[b] != NULL) {
        sim->removing->heated[b][k].joules += work->sum.heat;
        sim->removing->heated[b][k].coagulated = work->sum.coagulated;
    }
    if (cut_refuses(work->sum.verdict))
        report_refusal(sim, b, k, &work->sum);
    cutting_note_pieces(sim, b, work->sum.pieces);
}

// Takes from all bodies. Suction saves what its rate allows until that is a cell's volume; with
// nothing in its mouth it saves nothing.
static void take(Sim *sim, int k)
{
    const int t = sim->removing->tool[k];
    const ToolOptions *tool = &sim->tool[t];
    Remover *remover = &sim->removing->remover[k];
    const bool sucks = tool->rate_mm3_s > 0.0; // or drills at a rate
    const double credit = sucks ? remover->credit + 1e-9 * tool->rate_mm3_s * sim->tick : 0.0;
    Work work = {.removal = {.kind = tool->removes,
                             .mouth = mouth_now(sim, t),
                             .volume = sucks ? credit : (double)INFINITY,
                             .tick = sim->tick}};
    work.left = tool->removes == REMOVER_DIATHERMY ? tool->power * sim->tick : 0.0;
    for (int b = 0; b < sim->body_count; b++) {
        work.removal.heat = work.left;
        if (sim->removing->taking[b] != NULL && !guard_is_frozen(sim, b))
            take_from(sim, b, k, &work);
    }
    remover->credit = sucks && work.reached ? fmax(0.0, work.removal.volume) : 0.0;
}

void removing_stage(Sim *sim)
{
    Removing *removing = sim->removing;
    for (int k = 0; k < removing->count; k++) {
        Remover *remover = &removing->remover[k];
        const ToolMotion *motion = &sim->motion[removing->tool[k]];
        const double grip =
            motion->active ? tool_motion_grip(motion, sim->clock->step, sim->tick) : 0.0;
        // The pedal, as the jaws of graspers.
        const bool on = grip >= (remover->on ? GRIP_OPENS : GRIP_CLOSES);
        for (int b = 0; b < sim->body_count && remover->on && !on; b++)
            if (removing->taking[b] != NULL)
                report_taken(sim, b, k);
        if (!on) {
            *remover = (Remover){0};
            continue;
        }
        remover->on = 1;
        take(sim, k);
    }
}
