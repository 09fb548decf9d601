// SPDX-License-Identifier: MIT
// Free fall: shape, momentum and energy of bodies that nothing but gravity acts on.
#include "free_fall.h"
#include "scoped.h"

#include "base/check.h"
#include "surface/implicit.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLE = 48 }; // nodes of whose distances the shape is judged

// A body at one moment.
typedef struct View {
    int count, topology;
    int *id;
    Vec3 *x, *v;
    double far, size; // largest distance from the origin, diagonal of the box [m]
    Vec3 middle;      // of the nodes [m]
    Vec3 mean;        // of their velocities [m/s]
    double inner;     // largest velocity against it [m/s]
    Vec3 spin;        // moment of such velocities over that of the arms [rad/s]
    Vec3 momentum;    // of the nodes that tools meet [kg m/s]
    BodyMeasure energy;
} View;

// What rounding alone may do in a run.
typedef struct Rounding {
    double steps;    // substeps
    double place;    // [m]
    double velocity; // [m/s]
} Rounding;

const char *fall_word(FallVerdict verdict)
{
    static const char *const words[FALL_COUNT] = {"shape", "momentum", "spin",
                                                  "work",  "pushed",   "restored"};
    return words[verdict];
}

// ---------------------------------------------------------------------------------------------
// The scene

void free_fall_strip(RandomScene *scene)
{
    // What pushes, holds or drags from outside; what starts strained or moving; what is beyond its
    // bound by the scene's own word; what breaks.
    static const char *const keys[] = {
        "tools = (",          "loads = (",   "attachments = (", "fixed = (",
        "settle_s =",         "prestress =", "initial =",       "node_damping =",
        "unsafe_time_step =", "tear = {",    "cavity = {",      "shape = {"};
    for (size_t k = 0; k < sizeof keys / sizeof *keys; k++) {
        int number = 1;
        for (int i = 0; i < scene->count; i++) {
            if (scene->line[i].gone)
                continue;
            if (strncmp(scene->line[i].text, keys[k], strlen(keys[k])) != 0) {
                number++;
                continue;
            }
            // Shape springs that turn with the body push nothing from outside.
            bool stays = false;
            for (int j = i; k == sizeof keys / sizeof *keys - 1 && j < scene->line[i].last; j++)
                stays |=
                    !scene->line[j].gone && strcmp(scene->line[j].text, "frame = \"body\";") == 0;
            if (stays || !random_scene_strike(scene, number))
                number++;
        }
    }
}

// ---------------------------------------------------------------------------------------------
// Measures

static void measure_motion(View *view)
{
    Vec3 low = view->x[0], high = view->x[0];
    int count = 0;
    for (int i = 0; i < view->count; i++) {
        if (view->id[i] < 0)
            continue;
        const Vec3 x = view->x[i];
        low = count == 0 ? x : (Vec3){fmin(low.x, x.x), fmin(low.y, x.y), fmin(low.z, x.z)};
        high = count == 0 ? x : (Vec3){fmax(high.x, x.x), fmax(high.y, x.y), fmax(high.z, x.z)};
        view->far = fmax(view->far, vec3_length(x));
        view->mean = vec3_madd(view->mean, 1.0 / ++count, vec3_sub(view->v[i], view->mean));
        view->middle = vec3_madd(view->middle, 1.0 / count, vec3_sub(x, view->middle));
    }
    double inertia = 0.0;
    for (int i = 0; i < view->count; i++) {
        if (view->id[i] < 0)
            continue;
        const Vec3 arm = vec3_sub(view->x[i], view->middle), v = vec3_sub(view->v[i], view->mean);
        view->inner = fmax(view->inner, vec3_length(v));
        view->spin = vec3_add(view->spin, vec3_cross(arm, v));
        inertia += vec3_dot(arm, arm);
    }
    view->spin = vec3_scale(inertia > 0.0 ? 1.0 / inertia : 0.0, view->spin);
    view->size = vec3_length(vec3_sub(high, low));
}

static void measure_momentum(const Body *body, View *view)
{
    for (int i = 0; i < body->surface.node_used; i++) {
        Vec3 x, v;
        // Places of nobody have no mass.
        if (!(body->surface.node_mass[i] > 0.0))
            continue;
        body->ops->read_nodes(body->model, &i, 1, &x, &v);
        view->momentum = vec3_madd(view->momentum, body->surface.node_mass[i], v);
    }
}

// Of a body that adapts, nodes of finer levels come and go, and a new one may have the id of one
// that went: the coarsest tell.
static void forget_finer(const Body *body, View *view)
{
    const BodyMesh *mesh = &body->mesh;
    for (int i = 0; i < view->count && body->ops->adapt != NULL; i++)
        for (int k = 0; k < mesh->node_count && view->id[i] >= 0; k++)
            if (mesh->id[k] == view->id[i] && mesh->level[k] > 0)
                view->id[i] = -1;
}

static void view_take(View *view, const Body *body)
{
    const size_t most = (size_t)body->state_capacity;
    *view = (View){.topology = body->mesh.topology,
                   .id = calloc(most, sizeof *view->id),
                   .x = calloc(most, sizeof *view->x),
                   .v = calloc(most, sizeof *view->v)};
    ASSERT(view->id != NULL && view->x != NULL && view->v != NULL);
    view->count = body->ops->read_state(body->model, view->id, view->x, view->v);
    body->ops->measure(body->model, &view->energy);
    forget_finer(body, view);
    measure_motion(view);
    measure_momentum(body, view);
}

static void view_free(View *view)
{
    free(view->id);
    free(view->x);
    free(view->v);
}

static const Vec3 *place_of(const View *view, int id, int guess)
{
    if (guess < view->count && view->id[guess] == id)
        return &view->x[guess];
    for (int i = 0; i < view->count; i++)
        if (view->id[i] == id)
            return &view->x[i];
    return NULL;
}

// Largest change of a distance between two nodes [m]: no motion of the whole changes it, neither a
// shift nor a turn, as it would a box along the axes.
static double change_of_shape(const View *start, const View *end)
{
    double change = 0.0;
    const int every = 1 + start->count / SAMPLE;
    for (int i = 0; i < start->count; i += every)
        for (int j = 0; j < i && start->id[i] >= 0; j += every) {
            const Vec3 *a = place_of(end, start->id[i], i), *b = place_of(end, start->id[j], j);
            if (start->id[j] >= 0 && a != NULL && b != NULL)
                change = fmax(change, fabs(vec3_length(vec3_sub(*a, *b)) -
                                           vec3_length(vec3_sub(start->x[i], start->x[j]))));
        }
    return change;
}

// Substep by substep a place is off by half a unit in its last place, in either direction, a
// velocity by as much of its own, always in the same direction as it grows evenly; springs turn the
// first into velocities, time the second into places. In single precision the rows hold places
// within the body alone, while its base frame flies in double precision. Implicit bodies have what
// their solver leaves on top of rounding in double precision: as much as single precision would.
static Rounding rounding_of(const Body *body, const View *end, Precision precision, int ticks)
{
    const double within = precision == PRECISION_SINGLE ? 0x1p-24 : 0x1p-53;
    const double world = body->integrator == INTEGRATOR_IMPLICIT ? within : 0x1p-53;
    Rounding rounding = {.steps = (double)ticks * body->substeps};
    const double place = 4.0 * sqrt(rounding.steps) * (within * end->size + world * end->far);
    rounding.velocity = 2.0 * rounding.steps * world * vec3_length(end->mean) +
                        place * fmin(sqrt(body->lambda), 2.0 / body->h);
    rounding.place = place + rounding.velocity * rounding.steps * body->h;
    return rounding;
}

// ---------------------------------------------------------------------------------------------
// Verdicts

__attribute__((format(printf, 4, 5))) static void judge(FallResult *result, FallVerdict verdict,
                                                        bool right, const char *format, ...)
{
    result->judged[verdict]++;
    if (right)
        return;
    result->wrong[verdict]++;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(result->text[verdict], sizeof result->text[verdict], format, arguments);
    va_end(arguments);
}

static void judge_fall(const Body *body, const View *start, const View *end, Vec3 gravity,
                       const Rounding *rounding, FallResult *result)
{
    const double seconds = rounding->steps * body->h;
    Vec3 velocity = vec3_scale(seconds, gravity);
    if (body->half_thickness > 0.0) // it stays in its plane
        velocity.z = 0.0;
    const double speed = vec3_length(velocity);
    // A thousandth of its size is far below what anybody sees, and above what the solver of
    // implicit steps leaves.
    const double change = change_of_shape(start, end), most = 1e-3 * start->size + rounding->place;
    judge(result, FALL_SHAPE, change <= most, "%s: shape changed by %.3g of its size (%.3g m)",
          body->name, change / start->size, change);
    const bool surface = strcmp(body->ops->model, "surface") == 0; // all masses are known
    const Vec3 mean = surface ? vec3_scale(1.0 / body->mass, end->momentum) : end->mean;
    const double off = vec3_length(vec3_sub(mean, velocity));
    judge(result, FALL_MOMENTUM, off <= 1e-6 * speed + rounding->velocity,
          "%s: mean velocity off by %.3g of %.3g m/s", body->name, off, speed);
    // The solver of implicit steps leaves moments, not forces.
    const double share = body->integrator == INTEGRATOR_IMPLICIT ? 1e-3 : 1e-6;
    const double turns = vec3_length(end->spin) * end->size;
    judge(result, FALL_SPIN, turns <= share * speed + rounding->velocity,
          "%s: turns at %.3g m/s, falling at %.3g m/s", body->name, turns, speed);
    // A first-order scheme is a substep ahead of or behind the parabola; parts that move against
    // each other at a thousandth of the whole's velocity have a millionth of its energy.
    const double work = start->energy.outer - end->energy.outer;
    const double gain = end->energy.kinetic + end->energy.elastic - start->energy.kinetic -
                        start->energy.elastic - work;
    const double least = fabs(work) * (1e-6 + 2.0 / rounding->steps) +
                         body->mass * (rounding->velocity * (speed + rounding->velocity) +
                                       vec3_length(gravity) * rounding->place);
    judge(result, FALL_WORK, gain <= least, "%s: %.3g J more than gravity's work of %.3g J",
          body->name, gain, work);
}

static void fall(Sim *sim, Vec3 gravity, Precision precision, int ticks, FallResult *result)
{
    const int bodies = sim_body_count(sim);
    FREED View *start = zeroed((size_t)bodies, sizeof *start);
    for (int b = 0; b < bodies; b++)
        view_take(&start[b], sim_body(sim, b));
    for (int i = 0; i < ticks; i++)
        sim_step(sim);
    for (int b = 0; b < bodies; b++) {
        const Body *body = sim_body(sim, b);
        View end;
        view_take(&end, body);
        const Rounding rounding = rounding_of(body, &end, precision, ticks);
        judge(result, FALL_RESTORED, body->resets == 0, "%s: restored %lld times in free fall",
              body->name, (long long)body->resets);
        if (body->resets == 0)
            judge_fall(body, &start[b], &end, gravity, &rounding, result);
        view_free(&end);
        view_free(&start[b]);
    }
}

static double shortest_edge(const Body *body)
{
    double shortest = body->surface.longest_edge;
    for (int f = 0; f < body->surface.face_used; f++) {
        const int *face = body->surface.face[f];
        Vec3 x[3];
        body->ops->read_nodes(body->model, face, 3, x, NULL);
        for (int c = 0; c < 3 && face[0] != face[1]; c++) // else a place of nobody
            shortest = fmin(shortest, vec3_length(vec3_sub(x[c], x[(c + 1) % 3])));
    }
    return shortest;
}

// So large a force that the whole body is shifted by a hundredth of its shortest edge in the time
// that its stiffest spring takes to answer, for one tick: no spring is strained or turned by much.
static bool push(Sim *sim, int b, Vec3 *impulse)
{
    char why[SIM_EVENT_TEXT];
    const Body *body = sim_body(sim, b);
    const double tick = sim_tick(sim);
    const double speed = 0.01 * shortest_edge(body) * fmin(sqrt(body->contact_lambda), 2.0 / tick);
    const int node = 0;
    LoadOptions load = {.body = b,
                        .radius = 2.0 * body->surface.longest_edge,
                        .force = vec3_scale(body->mass * speed / tick, (Vec3){0.6, 0.8, 0.0}),
                        .duration = tick};
    body->ops->read_nodes(body->model, &node, 1, &load.center, NULL);
    *impulse = vec3_scale(tick, load.force);
    // Near the smallest number of single precision nothing is accurate.
    return speed > 1e-30 && vec3_length(load.force) > 1e-30 &&
           sim_apply_load(sim, &load, why, sizeof why);
}

static double energy_of(const Body *body)
{
    BodyMeasure measure;
    body->ops->measure(body->model, &measure);
    return measure.kinetic + measure.elastic;
}

// True if an implicit step was left before its tolerance was reached: its energy has no bound then
// (config/manual/membranes.md, "Stiff membranes").
static bool is_unsolved(const Body *body)
{
    return body->integrator == INTEGRATOR_IMPLICIT &&
           ((const SurfaceModel *)body->model)->implicit->stopped > 0;
}

static void judge_pushed(const Body *body, const View *start, const View *end, double most,
                         Vec3 impulse, const Rounding *rounding, FallResult *result)
{
    // What the guard allows, with its reasons (server/sim/guard/guard_energy.c): leapfrog near the
    // bound of its step lets the energy swing by 5.3, symplectic Euler by 19.
    const double growth = body->integrator == INTEGRATOR_SYMPLECTIC_EULER ? 40.0 : 10.0;
    const double had = start->energy.kinetic + start->energy.elastic;
    if (!is_unsolved(body))
        judge(result, FALL_PUSHED,
              most <= growth * had + body->mass * rounding->velocity * rounding->velocity,
              "%s: %.3g J after a push that gave it %.3g J", body->name, most, had);
    // Nodes inside of solids are not known here.
    if (strcmp(body->ops->model, "surface") != 0)
        return;
    const double off = vec3_length(vec3_sub(end->momentum, impulse));
    judge(
        result, FALL_MOMENTUM, off <= 1e-6 * vec3_length(impulse) + body->mass * rounding->velocity,
        "%s: momentum off by %.3g of %.3g N s after a push", body->name, off, vec3_length(impulse));
}

static void push_and_leave(Sim *sim, Precision precision, int ticks, FallResult *result)
{
    const int bodies = sim_body_count(sim);
    FREED View *start = zeroed((size_t)bodies, sizeof *start);
    FREED Vec3 *impulse = zeroed((size_t)bodies, sizeof *impulse);
    FREED double *most = zeroed((size_t)bodies, sizeof *most);
    FREED bool *pushed = zeroed((size_t)bodies, sizeof *pushed);
    for (int b = 0; b < bodies; b++)
        pushed[b] = push(sim, b, &impulse[b]);
    sim_step(sim);
    for (int b = 0; b < bodies; b++)
        view_take(&start[b], sim_body(sim, b));
    for (int i = 0; i < ticks; i++) {
        sim_step(sim);
        for (int b = 0; b < bodies; b++)
            most[b] = fmax(most[b], energy_of(sim_body(sim, b)));
    }
    for (int b = 0; b < bodies; b++) {
        const Body *body = sim_body(sim, b);
        View end;
        view_take(&end, body);
        const Rounding rounding = rounding_of(body, &end, precision, ticks);
        if (pushed[b])
            judge(result, FALL_RESTORED, body->resets == 0, "%s: restored %lld times after a push",
                  body->name, (long long)body->resets);
        // Refinement may exchange energy, and by the rules of Choi et al. 2005 mass.
        if (pushed[b] && body->resets == 0 && start[b].topology == end.topology)
            judge_pushed(body, &start[b], &end, most[b], impulse[b], &rounding, result);
        view_free(&end);
        view_free(&start[b]);
    }
}

// So many ticks that no body falls out of what the server can hold, a million times its size from
// where it was: at a tick a second that is soon.
static int bound_ticks(Sim *sim, Vec3 gravity, int ticks)
{
    for (int b = 0; b < sim_body_count(sim); b++) {
        const double way = 1e5 * sim_body(sim, b)->surface.longest_edge;
        const double seconds = sqrt(2.0 * way / fmax(vec3_length(gravity), 1e-30));
        ticks = (int)fmax(2.0, fmin(ticks, seconds / sim_tick(sim)));
    }
    return ticks;
}

void free_fall_judge(Sim *sim, Vec3 gravity, Precision precision, int ticks, FallResult *result)
{
    char why[SIM_EVENT_TEXT];
    fall(sim, gravity, precision, bound_ticks(sim, gravity, ticks), result);
    for (int v = 0; v < FALL_COUNT; v++)
        if (result->wrong[v] > 0)
            return;
    sim_reset(sim);
    if (sim_apply_gravity(sim, (Vec3){0.0, 0.0, 0.0}, why, sizeof why))
        push_and_leave(sim, precision, ticks, result);
}
