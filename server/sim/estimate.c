// SPDX-License-Identifier: MIT
// Estimates the error of one integrator step while the scene runs, by step doubling (Press et al.,
// Numerical Recipes, section 17.2). One step h from the current state and two of h/2 are tried and
// discarded. From the distance between their results, with the order p of the scheme, a step's own
// error is 2^p / (2^p - 1) of the distance. It is evaluated at a sample of the body's outer nodes.
// Forces of tools and attachments are excluded, since trying them would change their memory. The
// estimate is published and never affects the motion: it is no part of the state, and a run with it
// is bit-identical to one without. Step thread.
#include "sim/estimate.h"

#include "sim/step.h"

#include <math.h>
#include <string.h>

enum { SAMPLE = 64 }; // compared nodes, spread over those in use

// The state that a try changes besides the rows, whose current values commit keeps: warm starts of
// rotations, measured forces. All of the listed state but the rows is saved.
typedef struct Kept {
    int array_count;
    void **array; // [array_count] addresses
    size_t *bytes;
    char *block;  // copies, one after the other
    double error; // largest since it was taken [m]
} Kept;

struct Estimator {
    Kept *kept;                         // [count]
    Vec3 whole[SAMPLE], halves[SAMPLE]; // results of a try [m]
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

// Advances from the current state, whose rows are unchanged, and returns the sample's positions.
static void advance(Sim *sim, int index, int steps, const int *node, int count, Vec3 *position)
{
    const Body *body = &sim->body[index];
    advance_alone(sim, index, steps);
    body->ops->read_nodes(body->model, node, count, position, NULL);
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
    advance(sim, index, 1, estimator->node, count, estimator->whole);
    put_back(kept);
    advance(sim, index, 2, estimator->node, count, estimator->halves);
    put_back(kept);

    // The distance of the two results tells the error of the whole step.
    const double twice = pow(2.0, integrator_get(body->integrator)->order);
    const double apart = farthest(estimator->whole, estimator->halves, count);
    const double error = twice / (twice - 1.0) * apart * body->substeps;
    if (isfinite(error)) // a state that goes bad is reported by the guard
        kept->error = fmax(kept->error, error);
}

double estimate_take(Estimator *estimator, int index)
{
    const double error = estimator->kept[index].error;
    estimator->kept[index].error = 0.0;
    return error;
}
