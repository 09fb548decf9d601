// SPDX-License-Identifier: MIT
// The error of each body's discretisation while it runs. That in space the bodies estimate
// themselves (BodyOps.estimate), one body after the other, a few elements per tick: counts decide,
// never the clock, so that what follows from an estimate is the same in every run. That of the time
// steps is estimate.c's, from the ticks' spare time. Neither enters the motion. Step thread.
#include "sim/error.h"

#include "base/check.h"
#include "sim/estimate.h"
#include "sim/events.h"
#include "sim/guard/guard.h"

#include <limits.h>
#include <math.h>
#include <string.h>

// Of a tick, approximately, if an element of a solid or a spring of a wall takes so long [s]:
// measured on config/{cube,liver-fine,stomach,gallbladder}.cfg and 64 cells a side, without wide
// instructions, with ten times more to do than processors: 240 to 370 and 1 to 2 ns.
static const double SHARE = 0.04;
static const double ELEMENT_TIME = 300e-9, SPRING_TIME = 2e-9;
// A body that has not moved has no relative error: displacements count from this fraction of its
// longest edge on, as in body_status_t.
static const double LEAST = 1e-3;
// What a body has moved counts for so long, ever less [s]: one that swings through its rest shape
// has no smaller displacements to go by.
static const double MEMORY = 0.2;

_Static_assert((int)ERROR_TOOLS >= (int)SIM_TOOLS, "a question has all tools of a scene");

// A driven body gets finer by a step when its error is above the target, and coarser when it is
// below this part of it: one step changes an error by far less, so that it comes to rest between.
static const double LOW = 0.5;
// So many times more elements have to lower the error by this part of it, or they are not worth it:
// what is left is not due to detail. Then no more are tried until the error has grown by so much.
static const double MORE = 1.5, WORTH = 0.1, GROWN = 1.25;
// Rounds after a step before the error is looked at again, since elements follow in some ticks, and
// the estimate of a wall in some rounds.
enum { SETTLE_SOLID = 1, SETTLE_WALL = 3 };
// Rounds below the target before a step is taken back: doubled each time that this was wrong, up to
// about ten seconds.
enum { PATIENCE = 4, MOST_PATIENCE = 128 };
static const double DRIVE_HZ = 20.0; // rounds, at most
static const double FINENESS_STEP = 1.1;
// Of the error of a wall its last round's share, since a tool that is dragged meets nodes and faces
// in turn.
static const double LAST = 0.5;
// Powers of FINENESS_STEP: factors of 0.68 to 2.6 for solids; of 1/14 to 950 for walls, whose
// levels are far apart: their steps are four at once, up to eight towards a target far off.
enum { SOLID_LEAST = -4, SOLID_MOST = 10, WALL_LEAST = -28, WALL_MOST = 72 };
enum { WALL_STEP = 4, WALL_STRIDE = 8 };

// What is known of one body; plain data.
typedef struct BodyRounds {
    int64_t rounds;            // completed
    int64_t step;              // tick at whose end the last one began; -1: nothing is known
    double space;              // [m]
    double moved;              // rms displacement of the outer nodes, the largest lately [m]
    double share[ERROR_TOOLS]; // relative error of the force on a tool; -1: unknown
    // --- of a driven body ---
    double error;     // by which it is driven, of a wall a mean over rounds; 0: none yet
    int64_t fineness; // power of FINENESS_STEP
    int64_t settles;  // rounds left after a step
    // Before the last steps to finer elements, until these are worth it.
    double before; // error; 0: none since
    int64_t elements, from;
    double stuck;     // error that no more detail has lowered; 0: none
    int64_t calm;     // rounds below in a row
    int64_t patience; // so many before a step is taken back; 0: PATIENCE
    int64_t returned; // rounds since one was taken back
    int64_t told;     // 1: that the target is out of reach, since it was met
} BodyRounds;

// The round under way; plain data.
typedef struct Round {
    int64_t at;         // its body; body_count: all have had theirs
    int64_t cycle;      // tick at which the first body's turn came, plus 1; 0: never
    int64_t cycles;     // in which all bodies have had theirs
    int64_t since;      // tick at whose end it began; -1: none is under way
    int64_t is_of_past; // 1: the state was restored since
    int64_t tool_count;
    int tool[ERROR_TOOLS]; // indices
    Vec3 place[ERROR_TOOLS];
    double size[ERROR_TOOLS];
    Vec3 force[ERROR_TOOLS];
    double depth[ERROR_TOOLS];
    Vec3 axis[ERROR_TOOLS];
    double kappa[ERROR_TOOLS];
    double barrier;
} Round;

struct ErrorRounds {
    bool drives;           // those of the bodies that are driven, else of the others
    int elements, springs; // per tick
    int period;            // ticks between two rounds of one body
    // Of the driven bodies part of the state, since the motion depends on them.
    BodyRounds *body;
    Round *now;
};

// Rounds of driven bodies do not depend on what is published: others have their own.
static bool is_driven(const Body *body)
{
    double error;
    return body->ops->estimate != NULL && body->ops->get(body->model, BODY_ADAPT_ERROR, &error);
}

bool errors_drive(const Sim *sim)
{
    bool any = false;
    for (int b = 0; b < sim->body_count; b++)
        any |= is_driven(&sim->body[b]);
    return any;
}

static ErrorRounds *create(Sim *sim, double hz, bool drives)
{
    const char *name = drives ? "drive" : "errors";
    const int bodies = sim->body_count;
    Arena *arena = sim->arena;
    ErrorRounds *errors = ALLOCATE(ARENA_STEP, 1, ErrorRounds, "rounds");
    errors->body = ALLOCATE(ARENA_STEP, bodies, BodyRounds, "bodies");
    errors->now = ALLOCATE(ARENA_STEP, 1, Round, "round");
    errors->drives = drives;
    errors->elements = (int)fmin(1e6, fmax(1.0, SHARE * sim->tick / ELEMENT_TIME));
    errors->springs = (int)fmin(1e6, fmax(1.0, SHARE * sim->tick / SPRING_TIME));
    if (!drives && sim->options.error_whole)
        errors->elements = errors->springs = INT_MAX / 4;
    errors->period = (int)fmin(1e6, fmax(1.0, 1.0 / hz / sim->tick));
    errors->now->since = -1;
    errors->now->at = bodies;
    errors_forget(errors, bodies);
    if (drives) {
        state_add(sim->state, errors->body, (size_t)bodies * sizeof *errors->body, "drive/bodies");
        state_add(sim->state, errors->now, sizeof *errors->now, "drive/round");
    }
    return errors;
}

void errors_create(Sim *sim)
{
    if (errors_drive(sim))
        sim->drive = create(sim, DRIVE_HZ, true);
    if (sim->options.error_hz > 0.0)
        sim->errors = create(sim, sim->options.error_hz, false);
}

void errors_forget(ErrorRounds *errors, int body_count)
{
    for (int b = 0; b < body_count; b++) {
        errors->body[b].step = -1;
        for (int t = 0; t < ERROR_TOOLS; t++)
            errors->body[b].share[t] = -1.0;
    }
    errors->now->is_of_past = errors->now->since >= 0;
    errors->now->cycle = 0; // the clock may have gone back
}

static bool is_count(int64_t count)
{
    return count >= 0 && count <= INT64_MAX / 2;
}

bool errors_check(const Sim *sim)
{
    if (sim->drive == NULL)
        return true;
    const Round *now = sim->drive->now;
    bool sound = now->at >= 0 && now->at <= sim->body_count && is_count(now->cycle) &&
                 is_count(now->cycles) && now->since >= -1 && now->tool_count >= 0 &&
                 now->tool_count <= ERROR_TOOLS && (now->since < 0 || now->at < sim->body_count);
    for (int i = 0; sound && i < now->tool_count; i++)
        sound = now->tool[i] >= 0 && now->tool[i] < sim->tool_count;
    for (int b = 0; sound && b < sim->body_count; b++) {
        const BodyRounds *body = &sim->drive->body[b];
        sound = body->fineness >= WALL_LEAST && body->fineness <= WALL_MOST &&
                body->from >= WALL_LEAST && body->from <= WALL_MOST && is_count(body->rounds) &&
                is_count(body->calm) && body->settles >= 0 && body->patience >= 0 &&
                body->patience <= MOST_PATIENCE && body->returned >= 0;
    }
    return sound;
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
    bool holds;   // a grasp
    // Of what touches, the point of its axis that is nearest to the place, and its radius [m].
    Vec3 axis;
    double radius;
} Touching;

// Finds the capsule of a tool that is nearest to where it touches.
static void find_axis(const Sim *sim, int contact, Touching *by)
{
    const ToolOptions *tool = &sim->tool[sim->contact_tool[contact]];
    Vec3 position;
    Quat turned;
    contact_proxy(sim->contact[contact], &position, &turned);
    double least = (double)INFINITY;
    for (int c = 0; c < tool->capsule_count; c++) {
        const Capsule *capsule = &tool->capsule[c];
        const Vec3 from = vec3_add(position, quat_rotate(turned, capsule->from));
        const Vec3 along = quat_rotate(turned, vec3_sub(capsule->to, capsule->from));
        const double length2 = vec3_dot(along, along);
        const double part =
            length2 > 0.0 ? vec3_dot(vec3_sub(by->place, from), along) / length2 : 0.0;
        const Vec3 at = vec3_madd(from, fmin(1.0, fmax(0.0, part)), along);
        const double gap = vec3_length(vec3_sub(by->place, at)) - capsule->radius;
        if (gap < least) {
            least = gap;
            by->axis = at;
            by->radius = capsule->radius;
        }
    }
}

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
        find_axis(sim, k, by);
    }
    for (int k = sim->attachment_start[b]; k < sim->attachment_start[b + 1]; k++) {
        const int t = attachment_options(sim->attachment[k])->tool;
        if (t < 0 || !attachment_is_holding(sim->attachment[k]))
            continue;
        const ContactSums *sums = attachment_sums(sim->attachment[k]);
        tool[t].force = vec3_madd(tool[t].force, 1.0 / sim->tick, sums->impulse);
        tool[t].place = sim->motion[t].end_position;
        tool[t].holds = true;
    }
}

// Asks for the tools that touch the body now. A plane has no radius, and is not asked for.
static void ask(Round *now, const Sim *sim, int b)
{
    Touching tool[SIM_TOOLS];
    find_touching(sim, b, tool);
    int count = 0;
    for (int t = 0; t < sim->tool_count; t++) {
        const double radius = radius_of(&sim->tool[t]);
        if (!(vec3_length(tool[t].force) > 0.0) || !(radius > 0.0))
            continue;
        now->tool[count] = t;
        now->place[count] = tool[t].place;
        now->size[count] = radius;
        now->force[count] = tool[t].force;
        now->axis[count] = tool[t].axis;
        now->kappa[count] = 0.0;
        if (!sim->body[b].surface.solid && !tool[t].holds) {
            now->kappa[count] = sim->body[b].contact_kappa;
            now->size[count] = tool[t].radius;
        }
        now->depth[count++] = tool[t].depth;
    }
    now->tool_count = count;
    now->barrier = sim->body[b].contact_barrier;
}

// ---------------------------------------------------------------------------------------------
// Rounds

static bool has_rounds(const Sim *sim, const ErrorRounds *errors, int b)
{
    return sim->body[b].ops->estimate != NULL && !guard_is_frozen(sim, b) &&
           is_driven(&sim->body[b]) == errors->drives;
}

// Passes over bodies that have no rounds.
static void skip(const Sim *sim, ErrorRounds *errors)
{
    Round *now = errors->now;
    while (now->at < sim->body_count && !has_rounds(sim, errors, (int)now->at))
        now->at++;
    now->cycles += now->at >= sim->body_count;
}

// Begins the next round, of the next body that has any; returns false if none is due.
static bool begin(const Sim *sim, ErrorRounds *errors)
{
    Round *now = errors->now;
    const int64_t step = sim->clock->step;
    if (now->at >= sim->body_count && now->cycle > 0 && step < now->cycle - 1 + errors->period)
        return false;
    if (now->at >= sim->body_count) {
        now->at = 0;
        now->cycle = step + 1;
    }
    skip(sim, errors);
    if (now->at >= sim->body_count)
        return false;
    ask(now, sim, (int)now->at);
    now->since = step;
    now->is_of_past = false;
    return true;
}

static bool is_figure(double value)
{
    return isfinite(value) && value >= 0.0;
}

// Keeps the answer for the body; what is no figure is unknown, and counted.
static void take(Sim *sim, ErrorRounds *errors, const BodyError *found)
{
    const Round *now = errors->now;
    BodyRounds *body = &errors->body[now->at];
    const double passed =
        body->step < 0 ? MEMORY : fmax(0.0, (double)(now->since - body->step) * sim->tick);
    for (int t = 0; t < ERROR_TOOLS; t++)
        body->share[t] = -1.0;
    body->step = -1;
    body->rounds++;
    if (!is_figure(found->displacement) || !is_figure(found->relative)) {
        sim_figure(sim, (double)NAN);
        return;
    }
    body->step = now->since;
    body->space = found->displacement;
    const double moved = found->relative > 0.0 ? found->displacement / found->relative : 0.0;
    body->moved = fmax(moved, body->moved * fmax(0.0, 1.0 - passed / MEMORY));
    for (int i = 0; i < now->tool_count; i++) {
        if (is_figure(found->force[i]))
            body->share[now->tool[i]] = found->force[i];
        else
            sim_figure(sim, (double)NAN);
    }
}

// ---------------------------------------------------------------------------------------------
// Driven bodies

// Returns the error that a body is driven by: that of its displacements, or of the force on a tool
// if that is larger; -1: it has not moved.
static double driving_error(const Sim *sim, const ErrorRounds *errors)
{
    const BodyRounds *at = &errors->body[errors->now->at];
    const double edge = sim->body[errors->now->at].surface.longest_edge;
    double error = at->moved > LEAST * edge ? at->space / at->moved : -1.0;
    for (int t = 0; t < ERROR_TOOLS; t++)
        error = fmax(error, at->share[t]);
    return at->step < 0 ? -1.0 : error;
}

// Returns FINENESS_STEP to a power, the same on all machines.
static double fineness_of(int64_t steps)
{
    double factor = 1.0;
    for (int64_t k = 0; k < (steps < 0 ? -steps : steps); k++)
        factor *= FINENESS_STEP;
    return steps < 0 ? 1.0 / factor : factor;
}

static void set_fineness(Body *body, BodyRounds *at, int64_t steps)
{
    at->fineness = steps;
    at->settles = body->surface.solid ? SETTLE_SOLID : SETTLE_WALL;
    at->calm = 0;
    body->ops->set(body->model, BODY_ADAPT_FINENESS, fineness_of(steps));
}

// True if the last steps have made elements finer and were not worth them.
static bool is_in_vain(BodyRounds *at, double error, double target, int elements)
{
    const double before = at->before;
    if (before == 0.0 || (error > target && elements < MORE * (double)at->elements))
        return false; // it is too early to say
    at->before = 0.0;
    return error > target && error > (1.0 - WORTH) * before && error < GROWN * before;
}

// Reports, once until the target is met, that it is out of reach; `least`: the error that is not.
static void tell(Sim *sim, BodyRounds *at, double target, double least)
{
    if (at->told == 0)
        sim_report(sim, (int)(at - sim->drive->body), "error",
                   "an error of %.2g %% is out of reach: %.2g %% is left whatever the detail",
                   100.0 * target, 100.0 * least);
    at->told = 1;
}

// Returns the change of detail for an error: a step or none.
static int choose(BodyRounds *at, double error, double target)
{
    if (error < target || error > GROWN * at->stuck)
        at->stuck = 0.0;
    at->told &= error >= target;
    at->calm = error < LOW * target ? at->calm + 1 : 0;
    if (error > target && at->stuck == 0.0)
        return 1;
    return at->calm >= at->patience ? -1 : 0;
}

// Changes the detail of a driven body by at most one step, after a round.
static void drive(Sim *sim, ErrorRounds *errors)
{
    BodyRounds *at = &errors->body[errors->now->at];
    Body *body = &sim->body[errors->now->at];
    const int64_t most = body->surface.solid ? SOLID_MOST : WALL_MOST,
                  least = body->surface.solid ? SOLID_LEAST : WALL_LEAST,
                  step = body->surface.solid ? 1 : WALL_STEP;
    double target, scale = 1.0;
    const double found = driving_error(sim, errors);
    if (found < 0.0 || !body->ops->get(body->model, BODY_ADAPT_ERROR, &target))
        return;
    const double last = body->surface.solid || at->error == 0.0 ? 1.0 : LAST;
    const double error = at->error += last * (found - at->error);
    // Where time is short the time budget has made detail coarser: that is not taken back here.
    body->ops->get(body->model, BODY_ADAPT_SCALE, &scale);
    const bool is_short = scale > 1.0;
    target *= fmax(1.0, scale);
    if (at->patience == 0) {
        at->patience = PATIENCE;
        at->returned = MOST_PATIENCE;
    }
    if (at->returned < MOST_PATIENCE && ++at->returned == MOST_PATIENCE)
        at->patience = PATIENCE; // taking it back lasted
    if (at->settles > 0) {
        at->settles--;
        return;
    }
    if (is_in_vain(at, error, target, body->element_count)) {
        at->stuck = error;
        set_fineness(body, at, at->from);
        if (!is_short)
            tell(sim, at, target, error);
        return;
    }
    const int change = choose(at, error, target);
    if (change > 0 && at->fineness < most) {
        if (at->returned <= at->patience && at->patience < MOST_PATIENCE)
            at->patience *= 2;
        at->returned = MOST_PATIENCE;
        if (at->before == 0.0) {
            at->before = error;
            at->elements = body->element_count;
            at->from = at->fineness;
        }
        // The thresholds of a wall go with the size of its faces, and its error with the square.
        const int64_t stride = body->surface.solid ? step : WALL_STRIDE;
        int64_t by = step;
        while (by < stride && fineness_of(2 * by) * target < error)
            by++;
        set_fineness(body, at, at->fineness + by < most ? at->fineness + by : most);
    } else if (change > 0 && !is_short) {
        tell(sim, at, target, error);
    } else if (change < 0 && at->fineness > least) {
        at->returned = 0;
        at->before = 0.0;
        set_fineness(body, at, at->fineness - step > least ? at->fineness - step : least);
    }
}

void errors_step(Sim *sim, ErrorRounds *errors)
{
    Round *now = errors->now;
    if (now->since < 0 && !begin(sim, errors))
        return;
    const Body *body = &sim->body[now->at];
    const ErrorQuestion question = {.tool_count = (int)now->tool_count,
                                    .tool = now->place,
                                    .size = now->size,
                                    .force = now->force,
                                    .depth = now->depth,
                                    .axis = now->axis,
                                    .kappa = now->kappa,
                                    .barrier = now->barrier};
    const int budget = body->surface.solid ? errors->elements : errors->springs;
    BodyError found = {0};
    if (!body->ops->estimate(body->model, &question, budget, &found))
        return;
    if (!now->is_of_past) {
        take(sim, errors, &found);
        if (errors->drives)
            drive(sim, errors);
    }
    now->since = -1;
    now->at++;
    if (now->at == sim->body_count)
        now->cycles++;
}

// ---------------------------------------------------------------------------------------------
// What is known

static const BodyRounds *rounds_of(const Sim *sim, int body)
{
    const bool driven = is_driven(&sim->body[body]);
    return &(driven ? sim->drive : sim->errors)->body[body];
}

void sim_error(const Sim *sim, int index, SimError *error)
{
    const BodyRounds *body = rounds_of(sim, index);
    *error = (SimError){.space = -1.0, .total = -1.0, .relative = -1.0, .age = -1};
    error->steps = sim->estimator == NULL
                       ? -1.0
                       : estimate_now(sim->estimator, index, sim->clock->step, sim->tick);
    error->rounds = (int)body->rounds;
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
        const double *share = rounds_of(sim, b)->share;
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
    // Where all bodies are driven the others' rounds are empty.
    const int64_t driven = sim->drive != NULL ? sim->drive->now->cycles : 0;
    return (int)(sim->errors->now->cycles + driven);
}
