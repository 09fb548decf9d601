// SPDX-License-Identifier: MIT
// Samples a world into a trace, and the errors of traces.
#include "study/sampler.h"

#include "base/sets.h"
#include "study/context.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// --- traces --------------------------------------------------------------------------------------

size_t study_trace_bytes(int sample_count, int point_count)
{
    size_t samples = (size_t)sample_count;
    return sizeof(StudyTrace) + samples * sizeof(StudySample) +
           samples * (size_t)point_count * sizeof(Vec3);
}

StudyTrace *study_trace_create(int sample_count, int point_count)
{
    StudyTrace *trace = calloc(1, study_trace_bytes(sample_count, point_count));
    if (trace != NULL) {
        trace->sample_count = sample_count;
        trace->point_count = point_count;
    }
    return trace;
}

StudySample *study_trace_sample(const StudyTrace *trace, int index)
{
    return (StudySample *)(uintptr_t)(trace + 1) + index;
}

Vec3 *study_trace_points(const StudyTrace *trace, int index)
{
    Vec3 *first = (Vec3 *)(uintptr_t)(study_trace_sample(trace, trace->sample_count));
    return first + (size_t)index * (size_t)trace->point_count;
}

// --- samples -------------------------------------------------------------------------------------

bool sampler_create(Sampler *sampler, const StudyContext *context, const World *world, bool halved)
{
    const Body *body = sim_body(world->sim, context->body);
    size_t rows = (size_t)body->state_capacity, slots = (size_t)body->mesh.node_capacity;
    *sampler = (Sampler){.context = context,
                         .body = body,
                         .sim = world->sim,
                         .halved = halved,
                         .topology = -1,
                         .nodes_least = body->state_capacity};
    // Memory for the largest mesh.
    sampler->id = malloc(rows * sizeof *sampler->id);
    sampler->position = malloc(rows * sizeof(Vec3));
    sampler->velocity = malloc(rows * sizeof(Vec3));
    sampler->mesh = calloc(3 * (slots > 0 ? slots : 1), sizeof *sampler->mesh);
    if (sampler->id != NULL && sampler->position != NULL && sampler->velocity != NULL &&
        sampler->mesh != NULL)
        return true;
    sampler_destroy(sampler);
    return false;
}

void sampler_destroy(Sampler *sampler)
{
    free(sampler->id);
    free(sampler->position);
    free(sampler->velocity);
    free(sampler->mesh);
    *sampler = (Sampler){0};
}

void sampler_feel(Sampler *sampler)
{
    double tick = sim_tick(sampler->sim);
    for (int t = 0; t < sim_tool_count(sampler->sim); t++)
        if (sim_tool(sampler->sim, t)->kind != TOOL_STATIC)
            sampler->impulse =
                vec3_madd(sampler->impulse, tick, sim_wrench(sampler->sim, t)->force);
    sampler->since += tick;
}

typedef struct IdRow {
    int id, row; // id first, for compare_ints
} IdRow;

// Finds the rows of the points, once per topology.
static void find_rows(Sampler *sampler, int rows)
{
    const StudyPoints *points = &sampler->context->points;
    // Look the points up by their ids, which are sorted first.
    const int *wanted = sampler->halved ? points->fine_id : points->id;
    IdRow point[STUDY_POINTS];
    const Body *body = sampler->body;
    int nodes = 0, links = body->spring_count > 0 ? body->spring_count : body->element_count;
    for (int p = 0; p < points->count; p++) {
        point[p] = (IdRow){wanted[p], p};
        sampler->row[p] = -1;
    }
    qsort(point, (size_t)points->count, sizeof *point, compare_ints);
    // Where in the rows each point is now.
    for (int r = 0; r < rows; r++) {
        const IdRow key = {.id = sampler->id[r]};
        nodes += key.id >= 0;
        const IdRow *found =
            bsearch(&key, point, (size_t)points->count, sizeof *point, compare_ints);
        if (key.id >= 0 && found != NULL)
            sampler->row[found->row] = r;
    }
    // The sizes of the mesh over the run.
    sampler->nodes_least = nodes < sampler->nodes_least ? nodes : sampler->nodes_least;
    sampler->nodes_most = nodes > sampler->nodes_most ? nodes : sampler->nodes_most;
    sampler->links_most = links > sampler->links_most ? links : sampler->links_most;
    sampler->topology = body->mesh.topology;
}

void sampler_estimate(Sampler *sampler)
{
    const Sim *sim = sampler->sim;
    SimError error;
    SimToolError tool[ERROR_TOOLS];
    sim_error(sim, sampler->context->body, &error);
    if (error.space >= 0.0 && error.relative > 0.0) {
        const double size = error.total / error.relative;
        sampler->error2[0] += error.space * error.space;
        sampler->size2[0] += size * size;
    }
    sim_tool_errors(sim, tool);
    for (int t = 0; t < sim_tool_count(sim); t++)
        if (tool[t].error >= 0.0) {
            sampler->error2[1] += tool[t].error * tool[t].error;
            sampler->size2[1] += tool[t].force * tool[t].force;
        }
}

void sampler_estimated(const Sampler *sampler, double *displacement, double *force)
{
    const double *size2 = sampler->size2, *error2 = sampler->error2;
    *displacement = size2[0] > 0.0 ? sqrt(error2[0] / size2[0]) : (double)NAN;
    *force = size2[1] > 0.0 ? sqrt(error2[1] / size2[1]) : (double)NAN;
}

static Vec3 corner(const float *position, int node)
{
    return vec3((double)position[3 * node], (double)position[3 * node + 1],
                (double)position[3 * node + 2]);
}

// Sums relative to the first corner in use, so that a body far from the origin loses no digits.
double sampler_volume(const BodyMesh *mesh, const float *position, double extent)
{
    double volume = 0.0, area = 0.0;
    Vec3 areas = {0.0, 0.0, 0.0}, about = {0.0, 0.0, 0.0};
    // Tetrahedra from one corner to each face.
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int *node = mesh->triangle[t];
        if (node[0] == node[1])
            continue; // a free slot
        if (!(area > 0.0))
            about = corner(position, node[0]);
        Vec3 a = vec3_sub(corner(position, node[0]), about);
        Vec3 b = vec3_sub(corner(position, node[1]), about);
        Vec3 c = vec3_sub(corner(position, node[2]), about);
        Vec3 normal = vec3_cross(vec3_sub(b, a), vec3_sub(c, a));
        volume += vec3_dot(a, vec3_cross(b, c)) / 6.0;
        areas = vec3_add(areas, normal);
        area += vec3_length(normal);
    }
    // The area vectors of a closed surface cancel, within the precision of float positions.
    bool closed = vec3_length(areas) < 1e-4 * area;
    return closed && fabs(volume) > 1e-6 * extent * extent * extent ? volume : (double)NAN;
}

static bool is_finite(Vec3 v)
{
    return isfinite(v.x) && isfinite(v.y) && isfinite(v.z);
}

bool sampler_take(Sampler *sampler, StudyTrace *trace)
{
    const StudyContext *context = sampler->context;
    const StudyPoints *points = &context->points;
    const Body *body = sampler->body;
    // Rows change only with the topology.
    bool changed = sampler->topology != body->mesh.topology;
    int rows = body->ops->read_state(body->model, changed ? sampler->id : NULL, sampler->position,
                                     // Rows change with the topology.
                                     sampler->velocity);
    if (changed)
        find_rows(sampler, rows);
    // Displacements of all points, and their mean over the patch.
    Vec3 patch = {0.0, 0.0, 0.0};
    bool finite = true;
    int index = trace != NULL ? trace->used : 0;
    for (int p = 0; p < points->count; p++) {
        // A point that was cut away keeps its last displacement.
        int row = sampler->row[p];
        Vec3 moved = {0.0, 0.0, 0.0};
        if (row >= 0)
            moved = vec3_sub(sampler->position[row], points->rest[p]);
        else if (trace != NULL && index > 0)
            moved = study_trace_points(trace, index - 1)[p];
        finite = finite && is_finite(moved);
        sampler->moved = fmax(sampler->moved, vec3_length(moved));
        patch = vec3_madd(patch, points->weight[p], moved);
        if (trace != NULL)
            study_trace_points(trace, index)[p] = moved;
    }
    if (trace == NULL)
        return finite;
    // Energies, volume and the mean force since the last sample.
    BodyMeasure measure = {0};
    body->ops->measure(body->model, &measure);
    StudySample *sample = study_trace_sample(trace, index);
    *sample = (StudySample){.patch = patch,
                            .kinetic = measure.kinetic,
                            .elastic = measure.elastic,
                            .volume = (double)NAN};
    if (trace->has_volume) {
        body->ops->snapshot(body->model, sampler->mesh, NULL);
        sample->volume = sampler_volume(&body->mesh, sampler->mesh, context->extent);
    }
    // The mean force is the impulse over the time since the last sample.
    if (sampler->since > 0.0)
        sample->force = vec3_scale(1.0 / sampler->since, sampler->impulse);
    sampler->impulse = (Vec3){0.0, 0.0, 0.0};
    sampler->since = 0.0;
    trace->used = index + 1;
    return finite && isfinite(sample->kinetic) && isfinite(sample->elastic) &&
           is_finite(sample->force);
}

// --- errors --------------------------------------------------------------------------------------

// Differences that decrease more slowly do not show a limit, and cannot be extrapolated.
static const double LEAST_ORDER = 0.5;

StudyErrors study_no_errors(void)
{
    return (StudyErrors){.patch = (double)NAN,
                         .surface = (double)NAN,
                         .volume = (double)NAN,
                         .energy = (double)NAN,
                         .force = (double)NAN};
}

// Returns a difference divided by a size, if that is positive.
static double relative(double difference, double size)
{
    return size > 0.0 ? difference / size : difference > 0.0 ? HUGE_VAL : (double)NAN;
}

static double square(Vec3 v)
{
    return vec3_dot(v, v);
}

static double energy_of(const StudySample *sample)
{
    return sample->kinetic + sample->elastic;
}

static double surface_error(const StudyTrace *trace, const StudyTrace *reference, int samples)
{
    double farthest = 0.0, size = 0.0;
    for (int s = 0; s < samples; s++) {
        const Vec3 *x = study_trace_points(trace, s), *y = study_trace_points(reference, s);
        for (int p = 0; p < reference->point_count; p++) {
            farthest = fmax(farthest, square(vec3_sub(x[p], y[p])));
            size = fmax(size, square(y[p]));
        }
    }
    return relative(sqrt(farthest), sqrt(size));
}

StudyErrors study_errors(const StudyTrace *trace, const StudyTrace *reference)
{
    StudyErrors errors = study_no_errors();
    int samples = trace->used < reference->used ? trace->used : reference->used;
    if (samples == 0 || trace->point_count != reference->point_count)
        return errors;
    // Sums over all samples of what the two runs differ by, and of the reference itself.
    double patch = 0.0, patch_size = 0.0, force = 0.0, force_size = 0.0;
    double energy = 0.0, energy_size = 0.0, volume = 0.0;
    for (int s = 0; s < samples; s++) {
        const StudySample *a = study_trace_sample(trace, s), *b = study_trace_sample(reference, s);
        patch += square(vec3_sub(a->patch, b->patch));
        patch_size += square(b->patch);
        force += square(vec3_sub(a->force, b->force));
        force_size += square(b->force);
        energy = fmax(energy, fabs(energy_of(a) - energy_of(b)));
        energy_size = fmax(energy_size, energy_of(b));
        volume = fmax(volume, fabs(a->volume - b->volume)); // skips unknown values
    }
    // Each relative to the largest value or the norm of the reference.
    errors.patch = relative(sqrt(patch), sqrt(patch_size));
    errors.surface = surface_error(trace, reference, samples);
    errors.energy = relative(energy, energy_size);
    if (trace->has_force && reference->has_force)
        errors.force = relative(sqrt(force), sqrt(force_size));
    if (trace->has_volume && reference->has_volume)
        errors.volume = relative(volume, fabs(reference->rest_volume));
    return errors;
}

void study_richardson(StudyReference *reference, double expected)
{
    // Both differences are needed, and the second one must be smaller.
    const double coarse = reference->difference[0], fine = reference->difference[1];
    reference->known = isfinite(coarse) && isfinite(fine);
    reference->order = (double)NAN;
    reference->own_error = (double)NAN;
    if (!reference->known)
        return;
    reference->own_error = fmax(coarse, fine);
    if (!(coarse > fine))
        return;
    // How fast they decrease is the order.
    reference->order = fine > 0.0 ? log2(coarse / fine) : HUGE_VAL;
    if (reference->order < LEAST_ORDER)
        return;
    double order = fmin(reference->order, expected);
    reference->own_error = fine / (exp2(order) - 1.0);
}
