// SPDX-License-Identifier: MIT
// The error of each body's discretisation while it runs. That in space the bodies estimate
// themselves (BodyOps.estimate), one body after the other, a few elements per tick: counts decide,
// never the clock, so that what follows from an estimate is the same in every run. That of the time
// steps is estimate.c's, from the ticks' spare time. Neither enters the motion. Step thread.
#include "sim/error.h"

#include "base/check.h"
#include "sim/estimate.h"
#include "sim/guard/guard.h"

#include <math.h>
#include <string.h>

// Of a tick, approximately, if an element of a solid or a spring of a wall takes so long [s]:
// measured on config/{block,cube,organ-volume,stomach,adaptive-organ}.cfg, 300 to 550 and 1 to 2 ns
// with far more to do than processors, for solids about half of that without.
static const double SHARE = 0.04;
static const double ELEMENT_TIME = 200e-9, SPRING_TIME = 2e-9;
// A body that has not moved has no relative error: displacements count from this fraction of its
// longest edge on, as in body_status_t.
static const double LEAST = 1e-3;

_Static_assert((int)ERROR_TOOLS >= (int)SIM_TOOLS, "a question has all tools of a scene");

// What is known of one body.
typedef struct BodyRounds {
    int rounds;                // completed
    int64_t step;              // tick at whose end the last one began; -1: nothing is known
    double space;              // [m]
    double moved;              // rms displacement of the outer nodes [m]
    double share[ERROR_TOOLS]; // relative error of the force on a tool; -1: unknown
} BodyRounds;

struct ErrorRounds {
    int elements, springs; // per tick
    int period;            // ticks between two rounds of one body
    BodyRounds *body;

    // --- the round under way ---
    int at;          // its body; body_count: all have had theirs
    int64_t cycle;   // tick at which the first body's turn came, plus 1; 0: never
    int cycles;      // in which all bodies have had theirs
    int64_t since;   // tick at whose end it began; -1: none is under way
    bool is_of_past; // the state was restored since
    int tool_count;
    int tool[ERROR_TOOLS]; // indices
    Vec3 place[ERROR_TOOLS];
    double size[ERROR_TOOLS];
    Vec3 force[ERROR_TOOLS];
    double depth[ERROR_TOOLS];
};

ErrorRounds *errors_create(int body_count, double tick, double hz, Arena *arena)
{
    ErrorRounds *errors = arena_allocate(arena, ARENA_STEP, 1, sizeof *errors, "errors/rounds");
    errors->body = arena_allocate(arena, ARENA_STEP, (size_t)body_count, sizeof *errors->body,
                                  "errors/bodies");
    errors->elements = (int)fmin(1e6, fmax(1.0, SHARE * tick / ELEMENT_TIME));
    errors->springs = (int)fmin(1e6, fmax(1.0, SHARE * tick / SPRING_TIME));
    errors->period = (int)fmin(1e6, fmax(1.0, 1.0 / hz / tick));
    errors->since = -1;
    errors->at = body_count;
    errors_forget(errors, body_count);
    return errors;
}

void errors_forget(ErrorRounds *errors, int body_count)
{
    for (int b = 0; b < body_count; b++) {
        errors->body[b].step = -1;
        for (int t = 0; t < ERROR_TOOLS; t++)
            errors->body[b].share[t] = -1.0;
    }
    errors->is_of_past = errors->since >= 0;
    errors->cycle = 0; // the clock may have gone back
}

// ---------------------------------------------------------------------------------------------
// Tools in contact

static double radius_of(const ToolOptions *tool)
{
    double most = 0.0;
    for (int c = 0; c < tool->capsule_count; c++)
        most = fmax(most, tool->capsule[c].radius);
    return most;
}

// What a body and a tool do to each other in the last tick.
typedef struct Touching {
    Vec3 force;   // on the tool, by contact and by a grasp [N]
    Vec3 place;   // [m]; valid with a force
    double depth; // of the tool in faces [m]
} Touching;

static void find_touching(const Sim *sim, int b, Touching tool[SIM_TOOLS])
{
    memset(tool, 0, (size_t)sim->tool_count * sizeof *tool);
    for (int k = sim->contact_start[b]; k < sim->contact_start[b + 1]; k++) {
        const ContactSums *sums = contact_sums(sim->contact[k]);
        Touching *by = &tool[sim->contact_tool[k]];
        if (!contact_is_near(sim->contact[k]) || !(sums->weight > 0.0))
            continue;
        by->force = vec3_madd(by->force, 1.0 / sim->tick, sums->impulse);
        by->place = vec3_scale(1.0 / sums->weight, sums->point);
        by->depth = fmax(by->depth, sums->depth);
    }
    for (int k = sim->attachment_start[b]; k < sim->attachment_start[b + 1]; k++) {
        const int t = attachment_options(sim->attachment[k])->tool;
        if (t < 0 || !attachment_is_holding(sim->attachment[k]))
            continue;
        const ContactSums *sums = attachment_sums(sim->attachment[k]);
        tool[t].force = vec3_madd(tool[t].force, 1.0 / sim->tick, sums->impulse);
        tool[t].place = sim->motion[t].end_position;
    }
}

// Asks for the tools that touch the body now. A plane has no radius, and is not asked for.
static void ask(ErrorRounds *errors, const Sim *sim, int b)
{
    Touching tool[SIM_TOOLS];
    find_touching(sim, b, tool);
    int count = 0;
    for (int t = 0; t < sim->tool_count; t++) {
        const double radius = radius_of(&sim->tool[t]);
        if (!(vec3_length(tool[t].force) > 0.0) || !(radius > 0.0))
            continue;
        errors->tool[count] = t;
        errors->place[count] = tool[t].place;
        errors->size[count] = radius;
        errors->force[count] = tool[t].force;
        errors->depth[count++] = tool[t].depth;
    }
    errors->tool_count = count;
}

// ---------------------------------------------------------------------------------------------
// Rounds

// Passes over bodies that have no rounds.
static void skip(Sim *sim)
{
    ErrorRounds *errors = sim->errors;
    while (errors->at < sim->body_count &&
           (sim->body[errors->at].ops->estimate == NULL || guard_is_frozen(sim, errors->at)))
        errors->at++;
    errors->cycles += errors->at >= sim->body_count;
}

// Begins the next round, of the next body that has any; returns false if none is due.
static bool begin(Sim *sim)
{
    ErrorRounds *errors = sim->errors;
    const int64_t step = sim->clock->step;
    if (errors->at >= sim->body_count && errors->cycle > 0 &&
        step < errors->cycle - 1 + errors->period)
        return false;
    if (errors->at >= sim->body_count) {
        errors->at = 0;
        errors->cycle = step + 1;
    }
    skip(sim);
    if (errors->at >= sim->body_count)
        return false;
    ask(errors, sim, errors->at);
    errors->since = step;
    errors->is_of_past = false;
    return true;
}

static bool is_figure(double value)
{
    return isfinite(value) && value >= 0.0;
}

// Keeps the answer for the body; what is no figure is unknown, and counted.
static void take(Sim *sim, const BodyError *found)
{
    ErrorRounds *errors = sim->errors;
    BodyRounds *body = &errors->body[errors->at];
    for (int t = 0; t < ERROR_TOOLS; t++)
        body->share[t] = -1.0;
    body->step = -1;
    body->rounds++;
    if (!is_figure(found->displacement) || !is_figure(found->relative)) {
        sim_figure(sim, (double)NAN);
        return;
    }
    body->step = errors->since;
    body->space = found->displacement;
    body->moved = found->relative > 0.0 ? found->displacement / found->relative : 0.0;
    for (int i = 0; i < errors->tool_count; i++) {
        if (is_figure(found->force[i]))
            body->share[errors->tool[i]] = found->force[i];
        else
            sim_figure(sim, (double)NAN);
    }
}

void errors_step(Sim *sim)
{
    ErrorRounds *errors = sim->errors;
    if (errors->since < 0 && !begin(sim))
        return;
    const Body *body = &sim->body[errors->at];
    const ErrorQuestion question = {.tool_count = errors->tool_count,
                                    .tool = errors->place,
                                    .size = errors->size,
                                    .force = errors->force,
                                    .depth = errors->depth};
    const int budget = body->surface.solid ? errors->elements : errors->springs;
    BodyError found = {0};
    if (!body->ops->estimate(body->model, &question, budget, &found))
        return;
    if (!errors->is_of_past)
        take(sim, &found);
    errors->since = -1;
    errors->at++;
    if (errors->at == sim->body_count)
        errors->cycles++;
}

// ---------------------------------------------------------------------------------------------
// What is known

void sim_error(const Sim *sim, int index, SimError *error)
{
    const BodyRounds *body = &sim->errors->body[index];
    *error = (SimError){.space = -1.0, .total = -1.0, .relative = -1.0, .age = -1};
    error->steps = estimate_now(sim->estimator, index, sim->clock->step, sim->tick);
    error->rounds = body->rounds;
    if (body->step < 0)
        return;
    error->space = body->space;
    error->total = body->space + fmax(0.0, error->steps);
    error->relative =
        error->total / fmax(body->moved, LEAST * sim->body[index].surface.longest_edge);
    error->age = sim->clock->step - body->step;
}

void sim_tool_errors(const Sim *sim, SimToolError *error)
{
    Touching tool[SIM_TOOLS];
    for (int t = 0; t < sim->tool_count; t++)
        error[t] = (SimToolError){0};
    for (int b = 0; b < sim->body_count; b++) {
        const double *share = sim->errors->body[b].share;
        find_touching(sim, b, tool);
        for (int t = 0; t < sim->tool_count; t++) {
            const double part = vec3_length(tool[t].force);
            if (!(part > 0.0) || !isfinite(part))
                continue;
            // One part that is unknown leaves the sum unknown.
            error[t].force += part;
            error[t].error =
                share[t] < 0.0 || error[t].error < 0.0 ? -1.0 : error[t].error + share[t] * part;
        }
    }
}

int sim_error_cycles(const Sim *sim)
{
    return sim->errors->cycles;
}
