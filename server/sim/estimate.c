// SPDX-License-Identifier: MIT
// Estimates the error of one integrator step while the scene runs, by step doubling (Press et al.,
// Numerical Recipes, section 17.2). One step h from the current state and two of h/2 are tried and
// discarded. From the distance between their results, with the order p of the scheme, a step's own
// error is 2^p / (2^p - 1) of the distance. It is evaluated at a sample of the body's outer nodes.
// Forces of tools and attachments are excluded, since trying them would change their memory. The
// estimate is published and never affects the motion: it is no part of the state, and a run with it
// is bit-identical to one without. Step thread.
//
// Errors of ticks add up for as long as they have one sign, which is that of the acceleration:
// until the motion turns (an oscillation) or fades (a damped body), in a time of about v/a. So much
// of them the present state has: of a first-order scheme h/2 v, its delay by half a step. A body at
// rest has none, whatever pushes it: there v is 0.
#include "sim/estimate.h"

#include "sim/step.h"

#include <math.h>
#include <string.h>

enum { SAMPLE = 64 }; // compared nodes, spread over those in use

static const double EASE = 0.25;   // of the means over tries [s]
static const double OLD = 1.0;     // after which a try tells nothing of the present [s]
static const double LONGEST = 1.0; // that errors add up: those of free flight never fade [s]

// The state that a try changes besides the rows, whose current values commit keeps: warm starts of
// rotations, measured forces. All of the listed state but the rows is saved.
typedef struct Kept {
    int array_count;
    void **array; // [array_count] addresses
    size_t *bytes;
    char *block;  // copies, one after the other
    double error; // largest since it was taken [m]
    // Means of squares, rms over the sample, and the tick of the newest try; -1: none.
    double error2, speed_error2;  // of a tick, in positions [m2] and velocities [m2/s2]
    double speed2, acceleration2; // [m2/s2], [m2/s4]
    int64_t step;
} Kept;

struct Estimator {
    Kept *kept;                         // [count]
    Vec3 whole[SAMPLE], halves[SAMPLE]; // results of a try [m]
    // Velocities before, and as results [m/s]; positions before [m].
    Vec3 before[SAMPLE], after[SAMPLE], halves_after[SAMPLE], place[SAMPLE];
    int node[SAMPLE];
};

static bool belongs_to(const StateArray *array, const char *name)
{
    const size_t length = strlen(name);
    return strncmp(array->name, name, length) == 0 && array->name[length] == '/' &&
           array->current == NULL;
}

static void create_kept(Kept *kept, const char *name, const StateList *state, Arena *arena)
{
    // Count what belongs to this body, then list where it is.
    size_t total = 0;
    for (int i = 0; i < state->count; i++)
        if (belongs_to(&state->array[i], name)) {
            kept->array_count++;
            total += state->array[i].bytes;
        }
    const size_t count = (size_t)kept->array_count;
    kept->array = arena_allocate(arena, ARENA_STEP, count, sizeof *kept->array,
                                 "%s/arrays that a try changes", name);
    kept->bytes =
        arena_allocate(arena, ARENA_STEP, count, sizeof *kept->bytes, "%s/their sizes", name);
    kept->block = arena_allocate(arena, ARENA_STEP, total, 1, "%s/state before a try", name);
    for (int i = 0, k = 0; i < state->count; i++)
        if (belongs_to(&state->array[i], name)) {
            kept->array[k] = state_memory(&state->array[i]);
            kept->bytes[k++] = state->array[i].bytes;
        }
}

Estimator *estimate_create(const Body *body, int count, const StateList *state, Arena *arena)
{
    Estimator *estimator =
        arena_allocate(arena, ARENA_STEP, 1, sizeof *estimator, "error estimate");
    estimator->kept =
        arena_allocate(arena, ARENA_STEP, (size_t)count, sizeof(Kept), "error estimate of bodies");
    for (int b = 0; b < count; b++)
        create_kept(&estimator->kept[b], body[b].name, state, arena);
    estimate_forget(estimator, count);
    return estimator;
}

static void keep(const Kept *kept)
{
    char *to = kept->block;
    for (int i = 0; i < kept->array_count; to += kept->bytes[i], i++)
        memcpy(to, kept->array[i], kept->bytes[i]);
}

static void put_back(const Kept *kept)
{
    const char *from = kept->block;
    for (int i = 0; i < kept->array_count; from += kept->bytes[i], i++)
        memcpy(kept->array[i], from, kept->bytes[i]);
}

// Samples nodes of outer faces, evenly over the slots in use.
static int sample(const BodySurface *surface, int *node)
{
    const int used = surface->node_used, stride = used > SAMPLE ? used / SAMPLE : 1;
    int count = 0;
    for (int i = 0; i < used && count < SAMPLE; i += stride)
        if (surface->node_face_end[i] > surface->node_face_start[i])
            node[count++] = i;
    return count;
}

// Advances from the current state, whose rows are unchanged, and returns the sample's positions
// and, unless NULL, velocities.
static void advance(Sim *sim, int index, int steps, const int *node, int count, Vec3 *position,
                    Vec3 *velocity)
{
    const Body *body = &sim->body[index];
    advance_alone(sim, index, steps);
    body->ops->read_nodes(body->model, node, count, position, velocity);
    body->ops->abandon(body->model);
}

static double farthest(const Vec3 *a, const Vec3 *b, int count)
{
    double most = 0.0;
    for (int i = 0; i < count; i++) {
        const Vec3 apart = vec3_sub(a[i], b[i]);
        most = fmax(most, vec3_dot(apart, apart));
    }
    return sqrt(most);
}

static double mean2(const Vec3 *a, const Vec3 *b, int count)
{
    double sum = 0.0;
    for (int i = 0; i < count; i++) {
        const Vec3 apart = b != NULL ? vec3_sub(a[i], b[i]) : a[i];
        sum += vec3_dot(apart, apart);
    }
    return sum / count;
}

static void ease(double *mean, double weight, double value)
{
    *mean += weight * (value - *mean);
}

// Lets the means follow a try; `scale`: from the distance of its results to the error of a tick.
static void follow(Kept *kept, const Sim *sim, int index, int count, double scale)
{
    const Estimator *from = sim->estimator;
    const double h = sim->body[index].h, scale2 = scale * scale;
    const double error2 = scale2 * mean2(from->whole, from->halves, count);
    const double speed_error2 = scale2 * mean2(from->after, from->halves_after, count);
    const double speed2 = mean2(from->before, NULL, count);
    const double acceleration2 = mean2(from->after, from->before, count) / (h * h);
    if (!isfinite(error2 + speed_error2 + speed2 + acceleration2))
        return;
    const int64_t step = sim->clock->step;
    const double passed = (double)(step - kept->step) * sim->tick;
    const double weight = kept->step < 0 ? 1.0 : -expm1(-passed / EASE);
    ease(&kept->error2, weight, error2);
    ease(&kept->speed_error2, weight, speed_error2);
    ease(&kept->speed2, weight, speed2);
    ease(&kept->acceleration2, weight, acceleration2);
    kept->step = step;
}

void estimate_try(Sim *sim, int index)
{
    Estimator *estimator = sim->estimator;
    const Body *body = &sim->body[index];
    Kept *kept = &estimator->kept[index];
    const int count = sample(&body->surface, estimator->node);
    if (body->ops->abandon == NULL || count == 0)
        return;
    // From one state, one whole step and two halves, both taken back.
    keep(kept);
    body->ops->read_nodes(body->model, estimator->node, count, estimator->place, estimator->before);
    advance(sim, index, 1, estimator->node, count, estimator->whole, estimator->after);
    put_back(kept);
    advance(sim, index, 2, estimator->node, count, estimator->halves, estimator->halves_after);
    put_back(kept);

    // The distance of the two results tells the error of the whole step.
    const double twice = pow(2.0, integrator_get(body->integrator)->order);
    const double apart = farthest(estimator->whole, estimator->halves, count);
    const double scale = twice / (twice - 1.0) * body->substeps;
    const double error = scale * apart;
    if (isfinite(error)) // a state that goes bad is reported by the guard
        kept->error = fmax(kept->error, error);
    follow(kept, sim, index, count, scale);
}

double estimate_take(Estimator *estimator, int index)
{
    const double error = estimator->kept[index].error;
    estimator->kept[index].error = 0.0;
    return error;
}

double estimate_now(const Estimator *estimator, int index, int64_t step, double tick)
{
    const Kept *kept = &estimator->kept[index];
    if (kept->step < 0 || (double)(step - kept->step) * tick > OLD)
        return -1.0;
    const double turning = LONGEST * LONGEST * kept->acceleration2;
    const double lasts =
        kept->speed2 < turning ? sqrt(kept->speed2 / kept->acceleration2) : LONGEST;
    // An error of the velocity moves the body for as long.
    return sqrt(kept->error2 + lasts * lasts * kept->speed_error2) * lasts / tick;
}

void estimate_forget(Estimator *estimator, int count)
{
    for (int b = 0; b < count; b++)
        estimator->kept[b].step = -1;
}
