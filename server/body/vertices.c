// SPDX-License-Identifier: MIT
#include "body/vertices.h"

#include "base/check.h"
#include "base/sets.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

ISA_KERNELS(VertexKernels, vertex);

const VertexKernels *vertex_kernels_find(Precision precision, const char *level)
{
    IsaLevel found = isa_find(level);
    return found == ISA_COUNT ? NULL : vertex_kernels[precision][found];
}

// ---------------------------------------------------------------------------------------------
// Load time

bool vertices_can_create(const BodyOptions *options, bool has_kernels, int count, Status *status)
{
    if (!has_kernels)
        return status_fail(status, STATUS_INVALID,
                           "isa %s is not a level that this machine can run", options->isa);
    if (options->initial_position != NULL && options->initial_count != count)
        return status_fail(status, STATUS_INVALID, "initial has %d rows, the body %d vertices",
                           options->initial_count, count);
    return true;
}

static bool mark_nodes(const FixedRegion *region, const VertexId *by_id, int count, bool *fixed,
                       Status *status)
{
    for (int k = 0; k < region->node_count; k++) {
        int vertex = vertex_ids_find_fixed(by_id, count, region->node[k], status);
        if (vertex < 0)
            return false;
        fixed[vertex] = true;
    }
    return true;
}

bool vertices_mark_fixed(const BodyOptions *options, const VertexId *by_id, int count,
                         VertexPlace *place, const void *context, bool *fixed, Status *status)
{
    for (int r = 0; r < options->fixed_count; r++) {
        const FixedRegion *region = &options->fixed[r];
        // Nodes by their numbers, boxes and spheres by the place of each vertex.
        if (region->kind == FIXED_NODES) {
            if (!mark_nodes(region, by_id, count, fixed, status))
                return false;
            continue;
        }
        for (int v = 0; v < count; v++)
            fixed[v] |= fixed_contains(region, place(context, v));
    }
    return true;
}

static void create_frame(Vertices *vertices, const char *name, const bool *fixed, Arena *arena,
                         StateList *state)
{
    Rows *rows = &vertices->rows;
    // A body that nothing fixes floats: its frame follows it.
    rows->displaced = rows->turned = rows->floating = true;
    for (int i = 0; i < vertices->count; i++)
        rows->floating &= !fixed[i];
    rows->frame = ALLOCATE(ARENA_STEP, 1, BaseFrame, "base frame");
    *rows->frame = (BaseFrame){.origin = rows->rest_origin, .turn = rows->rest_turn};
    state_add(state, rows->frame, sizeof *rows->frame, "%s/base_frame", name);
    // Falling in the frame keeps the digits of single precision.
    if (rows->floating && rows->precision == PRECISION_SINGLE)
        rows_let_fall(rows, name, arena, state);
}

// Writes the initial rows; returns the largest initial distance of a vertex from the middle of the
// body [m].
static double write_initial(Vertices *vertices, const BodyOptions *options, const VertexId *by_id,
                            const bool *fixed)
{
    double farthest = 0.0;
    // Initial states come in ascending order of ids.
    for (int k = 0; options->initial_position != NULL && k < vertices->count; k++) {
        int i = by_id[k].vertex;
        Vec3 x = options->initial_position[k], v = {0.0, 0.0, 0.0};
        if (options->initial_velocity != NULL && !fixed[i]) // fixed ones rest
            v = options->initial_velocity[k];
        rows_write(&vertices->rows, vertices->row[0], i, x, v);
        farthest = fmax(farthest, vec3_length(vec3_sub(x, vertices->rows.rest_origin)));
    }
    return farthest;
}

static void create_loads(Vertices *vertices, const char *name, int count, Arena *arena,
                         StateList *state)
{
    vertices->loadable_count = count;
    vertices->load =
        arena_allocate(arena, ARENA_STEP, (size_t)count, sizeof *vertices->load, "%s/loads", name);
    vertices->loaded = ALLOCATE(ARENA_STEP, count, int, "loaded");
    state_add(state, vertices->load, (size_t)count * sizeof *vertices->load, "%s/loads", name);
}

void vertices_create(Vertices *vertices, const BodyOptions *options, const VertexId *by_id,
                     const bool *fixed, int loadable_count, double extent, Arena *arena,
                     StateList *state)
{
    const char *name = options->name;
    Rows *rows = &vertices->rows;
    rows->precision = options->precision;
    // Nothing is added later, unless the model has reserved more.
    if (vertices->capacity == 0)
        vertices->capacity = vertices->count;
    create_frame(vertices, name, fixed, arena, state);
    // The spare vertex included.
    const size_t count = (size_t)vertices->capacity + 1, real = rows_real_size(rows);
    vertices->inverse_mass =
        arena_allocate(arena, ARENA_STEP, count, real, "%s/inverse mass", name);
    vertices_set_count(vertices, vertices->count);
    for (int i = 0; i < vertices->count; i++)
        vertices_put_mass(vertices, i, vertices->mass[i], fixed[i]);
    // Forces: of both halves, if two threads share the elements.
    vertices->force = arena_allocate(arena, ARENA_STEP, 4 * count, real, "%s/forces", name);
    if (vertices->halved)
        vertices->more =
            arena_allocate(arena, ARENA_STEP, 4 * count, real, "%s/forces of half", name);
    // Two sets of rows: the tick's result replaces the present one when it is good.
    for (int k = 0; k < 2; k++)
        vertices->row[k] = arena_allocate(arena, ARENA_STEP, ROW * count, real, "%s/%s", name,
                                          k == 0 ? "rows" : "rows of next tick");
    vertices->present = vertices->row[0];
    state_add_pair(state, vertices->row[0], vertices->row[1], &vertices->current,
                   ROW * count * real, "%s/rows", name);
    // Far beyond any sensible scene, and small enough for single precision.
    vertices->position_limit = 1e6 * fmax(extent, write_initial(vertices, options, by_id, fixed));
    // What SET changes is part of the state.
    vertices->parameters = ALLOCATE(ARENA_STEP, 1, BodyParameters, "parameters");
    *vertices->parameters = body_parameters(options->gravity);
    state_add(state, vertices->parameters, sizeof *vertices->parameters, "%s/parameters", name);
    if (vertices->drag > 0.0 && rows->floating)
        vertices->drags = drag_create(name, vertices->capacity, arena);
    // Loads need a list of their own.
    if (!options->without_loads)
        create_loads(vertices, name, loadable_count, arena, state);
}

void vertices_put_mass(Vertices *vertices, int vertex, double mass, bool fixed)
{
    vertices->mass[vertex] = mass;
    rows_put(&vertices->rows, vertices->inverse_mass, vertex, fixed ? 0.0 : 1.0 / mass);
}

void vertices_retire(Vertices *vertices, int vertex)
{
    vertices->mass[vertex] = 0.0;
    rows_put(&vertices->rows, vertices->inverse_mass, vertex, 0.0);
    for (int c = 0; c < ROW; c++)
        rows_put(&vertices->rows, vertices->row[vertices->current], (long)vertex * ROW + c, 0.0);
}

void vertices_clear(Vertices *vertices, int vertex)
{
    for (int c = 0; c < 2 * ROW; c++)
        rows_put(&vertices->rows, vertices->row[c / ROW], (long)vertex * ROW + c % ROW, 0.0);
}

// The spare row counts as in use where it directly follows the vertices.
void vertices_set_count(Vertices *vertices, int count)
{
    vertices->count = count;
    vertices->rows.count = count == vertices->capacity ? count + 1 : count;
}

// ---------------------------------------------------------------------------------------------
// A tick

void vertices_drift(void *model, double dt)
{
    Vertices *vertices = model;
    void *next = vertices->row[1 - vertices->current];
    const size_t bytes = ROW * rows_real_size(&vertices->rows);
    if (vertices->run == NULL)
        vertices->kernels->drift(vertices->present, next, vertices->rows.count, dt);
    for (int r = 0; r < vertices->run_count; r++) {
        const int *run = vertices->run[r];
        vertices->kernels->drift((const char *)vertices->present + (size_t)run[0] * bytes,
                                 (char *)next + (size_t)run[0] * bytes, run[1] - run[0], dt);
    }
    rows_drift(&vertices->rows, dt);
    vertices->present = next;
}

void vertices_add_force(Vertices *vertices, int vertex, Vec3 force)
{
    const Rows *rows = &vertices->rows;
    Vec3 f = rows_turn_in(rows, force);
    const double part[3] = {f.x, f.y, f.z};
    for (int c = 0; c < 3; c++) {
        long at = 4L * vertex + c;
        rows_put(rows, vertices->force, at, rows_get(rows, vertices->force, at) + part[c]);
    }
}

void vertices_add_forces(void *model, const int *vertex, int count, const Vec3 *force)
{
    Vertices *vertices = model;
    for (int i = 0; i < count; i++)
        vertices_add_force(vertices, vertex[i], force[i]);
}

void vertices_kick(Vertices *vertices, int vertex, Vec3 impulse, double drift)
{
    const Rows *rows = &vertices->rows;
    void *row = vertices->row[1 - vertices->current]; // what the advance has written
    const double by_mass = rows_get(rows, vertices->inverse_mass, vertex);
    const Vec3 dv = vec3_scale(by_mass, rows_turn_in(rows, impulse));
    const double part[3] = {dv.x, dv.y, dv.z};
    for (int c = 0; c < 3; c++) {
        const long at = (long)vertex * ROW + c;
        rows_put(rows, row, at, rows_get(rows, row, at) + drift * part[c]);
        rows_put(rows, row, at + 4, rows_get(rows, row, at + 4) + part[c]);
    }
    vertices->bad |= !(vec3_length(dv) <= SPEED_LIMIT);
}

static void list_loads(Vertices *vertices)
{
    vertices->loaded_count = 0;
    for (int i = 0; i < vertices->loadable_count; i++) {
        const double *load = vertices->load[i];
        if (load[0] != 0.0 || load[1] != 0.0 || load[2] != 0.0)
            vertices->loaded[vertices->loaded_count++] = i;
    }
}

void vertices_begin(Vertices *vertices)
{
    if (vertices->loaded_count < 0)
        list_loads(vertices);
    for (int k = 0; k < vertices->loaded_count; k++) {
        const double *load = vertices->load[vertices->loaded[k]];
        vertices_add_force(vertices, vertices->loaded[k], (Vec3){load[0], load[1], load[2]});
    }
}

enum { SHARE = 1024 }; // vertices per thread and piece

typedef struct SharedAdvance {
    const AdvancePass *pass;
    AdvanceKernel *advance;
    size_t real;
    atomic_bool bad;
} SharedAdvance;

// Returns the same pass over the vertices [first, end) alone.
static AdvancePass part_of(const AdvancePass *whole, size_t real, int first, int end)
{
    // In bytes of each array.
    const size_t begin = (size_t)first, row = begin * ROW * real, force = begin * 4 * real;
    AdvancePass pass = *whole;
    pass.present = (const char *)whole->present + row;
    pass.next = (char *)whole->next + row;
    pass.force = (char *)whole->force + force;
    pass.more = whole->more == NULL ? NULL : (char *)whole->more + force;
    pass.inverse_mass = (const char *)whole->inverse_mass + begin * real;
    pass.vertex_count = end - first;
    return pass;
}

// Each vertex is advanced independently: any division among threads gives the same bits.
static void advance_part(void *context, int first, int last)
{
    SharedAdvance *shared = context;
    const int count = shared->pass->vertex_count;
    const AdvancePass pass = part_of(shared->pass, shared->real, first * SHARE,
                                     last * SHARE < count ? last * SHARE : count);
    if (!shared->advance(&pass)) // several may say so
        atomic_store_explicit(&shared->bad, true, memory_order_relaxed);
}

static bool advance_all(const Vertices *vertices, const AdvancePass *pass)
{
    AdvanceKernel *advance = vertices->kernels->advance;
    if (vertices->team == NULL || !vertices->halved || pass->vertex_count <= SHARE)
        return advance(pass);
    SharedAdvance shared = {
        .pass = pass, .advance = advance, .real = rows_real_size(&vertices->rows)};
    team_run(vertices->team, advance_part, &shared, (pass->vertex_count + SHARE - 1) / SHARE);
    return !atomic_load_explicit(&shared.bad, memory_order_relaxed);
}

static bool advance_runs(const Vertices *vertices, const AdvancePass *pass)
{
    const size_t real = rows_real_size(&vertices->rows);
    bool good = true;
    for (int r = 0; r < vertices->run_count; r++) {
        const AdvancePass part = part_of(pass, real, vertices->run[r][0], vertices->run[r][1]);
        good &= advance_all(vertices, &part);
    }
    return good;
}

// Clears the forces that lanes without an element have added; nothing else does.
static void forget_spare(const Vertices *vertices)
{
    const size_t bytes = 4 * rows_real_size(&vertices->rows);
    memset((char *)vertices->force + (size_t)vertices->capacity * bytes, 0, bytes);
    if (vertices->more != NULL)
        memset((char *)vertices->more + (size_t)vertices->capacity * bytes, 0, bytes);
}

// The drag of a body that nothing fixes, on its new rows: once a tick where elements have enough
// damping for that to be stable, else in each substep (server/sim/README.md, "Drag").
static void slow(Vertices *vertices, const Evaluation *evaluation, double h, void *row)
{
    Drag *drags = vertices->drags;
    drags->time += h;
    if (!evaluation->last && vertices->damping_time >= vertices->drag * h * h)
        return;
    SlowPass pass = {
        .row = row,
        .rest = (const double(*)[3])vertices->rows.rest,
        .mass = vertices->mass,
        .loss = -expm1(-vertices->drag * vertices->parameters->damping_scale * drags->time),
    };
    drags->run = vertices->run;
    drags->run_count = vertices->run_count;
    drag_slow(drags, vertices->kernels, &pass, vertices->count,
              vertices->halved ? vertices->team : NULL);
    drags->time = 0.0;
}

// The first kick of a tick writes the rows that are not current, so that the state before the tick
// stays intact until the end; later ones stay there.
void vertices_advance(Vertices *vertices, const Evaluation *evaluation, double h, Vec3 gravity)
{
    // The result goes to the other rows.
    void *next = vertices->row[1 - vertices->current];
    Vec3 g = rows_gravity(&vertices->rows, gravity);
    const AdvancePass pass = {
        .present = vertices->present,
        .next = next,
        .force = vertices->force,
        .more = vertices->more,
        .inverse_mass = vertices->inverse_mass,
        .vertex_count = vertices->rows.count,
        .h = h,
        .advance = evaluation->advance,
        .gravity = {g.x, g.y, g.z},
        .position_limit = vertices->position_limit,
        .loss = vertices->drags == NULL ? h * vertices->drag * vertices->parameters->damping_scale
                                        : 0.0,
        .check = evaluation->last, // a number that went bad earlier in the tick is still bad
    };
    // Bad numbers are noticed in the last evaluation of a tick.
    vertices->bad |=
        !(vertices->run == NULL ? advance_all(vertices, &pass) : advance_runs(vertices, &pass));
    rows_advance(&vertices->rows, evaluation, h, gravity);
    if (vertices->drags != NULL)
        slow(vertices, evaluation, h, next);
    // Unused places stay zero.
    if (vertices->count < vertices->capacity || vertices->run != NULL)
        forget_spare(vertices);
    vertices->present = next;
}

bool vertices_end(Vertices *vertices)
{
    // The coordinates of a floating body are small however far it has travelled: check the distance
    // too.
    bool good = !vertices->bad && (!vertices->rows.floating ||
                                   rows_are_near(&vertices->rows, vertices->position_limit));
    vertices->bad = false;
    rows_end_tick(&vertices->rows, good);
    if (good)
        vertices->current = 1 - vertices->current;
    vertices->present = vertices->row[vertices->current];
    return good;
}

void vertices_abandon(void *model)
{
    Vertices *vertices = model;
    rows_end_tick(&vertices->rows, false);
    vertices->present = vertices->row[vertices->current];
    vertices->bad = false;
    if (vertices->drags != NULL)
        vertices->drags->time = 0.0;
}

void vertices_follow(Vertices *vertices)
{
    if (vertices->rows.floating)
        rows_follow(&vertices->rows, vertices->row[vertices->current]);
}

bool vertices_commit(void *model)
{
    Vertices *vertices = model;
    bool good = vertices_end(vertices);
    if (good)
        vertices_follow(vertices);
    return good;
}

void vertices_restore(Vertices *vertices, RestoreMode mode)
{
    Rows *rows = &vertices->rows;
    void *row = vertices->row[vertices->current];
    // Back to the shape, or the same shape at rest.
    if (mode == RESTORE_SHAPE)
        rows_return_to_rest(rows, row);
    else if (mode != RESTORE_MOTION)
        rows_stop(rows, row);
    // What tools and elements added in the bad tick is discarded.
    const size_t bytes = ((size_t)vertices->capacity + 1) * 4 * rows_real_size(rows);
    memset(vertices->force, 0, bytes);
    if (vertices->more != NULL)
        memset(vertices->more, 0, bytes);
    vertices->present = row;
}

// Includes the spare row, which lanes without an element read.
bool vertices_check(const Vertices *vertices)
{
    const Rows *rows = &vertices->rows;
    const char *row = vertices_row(vertices);
    Rows spare = *rows;
    spare.count = 1;
    return rows_are_valid(rows, row, vertices->position_limit) &&
           rows_are_valid(&spare, row + (size_t)vertices->capacity * ROW * rows_real_size(rows),
                          vertices->position_limit);
}

// ---------------------------------------------------------------------------------------------
// Loads

void vertices_add_load(void *model, int vertex, Vec3 force)
{
    Vertices *vertices = model;
    double *load = vertices->load[vertex];
    load[0] += force.x;
    load[1] += force.y;
    load[2] += force.z;
    vertices->loaded_count = -1;
}

void vertices_clear_loads(void *model)
{
    Vertices *vertices = model;
    if (vertices->load != NULL)
        memset(vertices->load, 0, (size_t)vertices->loadable_count * sizeof *vertices->load);
    vertices->loaded_count = 0;
}

void vertices_restored(Vertices *vertices)
{
    vertices->loaded_count = -1;
}

// ---------------------------------------------------------------------------------------------
// Operations

bool vertices_is_fixed(const void *model, int vertex)
{
    const Vertices *vertices = model;
    return rows_get(&vertices->rows, vertices->inverse_mass, vertex) == 0.0;
}

void vertices_read_nodes(const void *model, const int *vertex, int count, Vec3 *position,
                         Vec3 *velocity)
{
    const Vertices *vertices = model;
    for (int i = 0; i < count; i++)
        rows_read(&vertices->rows, vertices->present, vertex[i], &position[i],
                  velocity == NULL ? NULL : &velocity[i]);
}

void vertices_bound_motion(const void *model, double *displacement, double *speed)
{
    const Vertices *vertices = model;
    const size_t bytes = ROW * rows_real_size(&vertices->rows);
    if (vertices->run == NULL) {
        rows_bound_motion(&vertices->rows, vertices->present, displacement, speed);
        return;
    }
    Rows rows = vertices->rows;
    *displacement = *speed = 0.0;
    for (int r = 0; r < vertices->run_count; r++) {
        const int *run = vertices->run[r];
        double far, fast;
        rows.count = run[1] - run[0];
        rows_bound_motion(&rows, (const char *)vertices->present + (size_t)run[0] * bytes, &far,
                          &fast);
        *displacement = fmax(*displacement, far);
        *speed = fmax(*speed, fast);
    }
}

int vertices_read_state(const void *model, int *id, Vec3 *position, Vec3 *velocity)
{
    const Vertices *vertices = model;
    for (int i = 0; i < vertices->count; i++) {
        const bool free = vertices->mass[i] == 0.0; // without elements
        if (id != NULL)
            id[i] = free ? -1 : vertices->id[i];
        if (free) {
            position[i] = velocity[i] = (Vec3){0.0, 0.0, 0.0};
            continue;
        }
        rows_read(&vertices->rows, vertices_row(vertices), i, &position[i], &velocity[i]);
    }
    return vertices->count;
}

static bool is_damped(const Vertices *vertices)
{
    return vertices->damping_time > 0.0 || vertices->drag > 0.0;
}

bool vertices_set(void *model, BodyParameter parameter, double value)
{
    Vertices *vertices = model;
    return body_parameters_set(vertices->parameters, is_damped(vertices), parameter, value);
}

bool vertices_get(const void *model, BodyParameter parameter, double *value)
{
    const Vertices *vertices = model;
    return body_parameters_get(vertices->parameters, is_damped(vertices), parameter, value);
}

void vertices_measure(const Vertices *vertices, BodyMeasure *measure)
{
    const Rows *rows = &vertices->rows;
    const void *row = vertices_row(vertices);
    const Vec3 velocity = rows_turn_in(rows, rows_velocity(rows)); // of the frame
    double kinetic = 0.0, farthest = 0.0;
    Vec3 weight = {0.0, 0.0, 0.0}; // sum of mass times displacement, in the rows' axes
    // Energy, weight and the farthest vertex.
    for (int i = 0; i < vertices->count; i++) {
        if (vertices->mass[i] == 0.0) // without elements
            continue;
        Vec3 u = rows_vector(rows, row, i, 0), v = rows_vector(rows, row, i, 4);
        if (rows->floating) { // u is small however far the body has travelled
            Vec3 x;
            rows_read(rows, row, i, &x, NULL);
            u = vec3_sub(x, rows_rest(rows, i));
            v = vec3_add(velocity, v);
        }
        kinetic += 0.5 * vertices->mass[i] * vec3_dot(v, v);
        weight = vec3_madd(weight, vertices->mass[i], u);
        farthest = fmax(farthest, vec3_dot(u, u));
    }
    measure->kinetic = kinetic;
    measure->max_displacement = sqrt(farthest);
    // Gravity acts in the world.
    const double *g = vertices->parameters->gravity;
    if (!rows->floating)
        weight = quat_rotate(rows->frame->turn, weight);
    // Potential of gravity and of the constant loads.
    measure->outer = -(g[0] * weight.x + g[1] * weight.y + g[2] * weight.z);
    for (int i = 0; i < vertices->loadable_count; i++) {
        const double *load = vertices->load[i];
        if (load[0] == 0.0 && load[1] == 0.0 && load[2] == 0.0)
            continue;
        Vec3 x;
        rows_read(rows, rows_of(rows, row, i), i, &x, NULL);
        measure->outer -= vec3_dot((Vec3){load[0], load[1], load[2]}, x);
    }
}

void vertices_explain(const Vertices *vertices, int lanes, const int *element_at_level, int levels,
                      FILE *out)
{
    // Levels without elements at the end are not listed.
    int coarsest = levels - 1, elements = 0;
    while (coarsest > 0 && element_at_level[coarsest] == 0)
        coarsest--;
    for (int level = 0; level <= coarsest; level++)
        elements += element_at_level[level];
    // Which kernel, for how many elements of which size.
    fprintf(out, "    kernel: %s, %s, %d lanes a batch, %d vertices, %d elements (",
            vertices->rows.precision == PRECISION_SINGLE ? "single" : "double",
            vertices->kernels->level, lanes, vertices->count, elements);
    for (int level = 0; level <= coarsest; level++)
        fprintf(out, "%s%d", level > 0 ? " + " : "", element_at_level[level]);
    fprintf(out, " by level)\n");
    // What the scene chooses, by its key.
    if (vertices->team != NULL && vertices->halved)
        fprintf(out, "    shared by two threads\n");
    fprintf(out, "    drag: %s\n",
            vertices->drags != NULL ? "on the motion relative to the body's rigid one"
            : vertices->drag > 0.0  ? "in the kick"
                                    : "left out (material.drag)");
    fprintf(out, "    damping: %s\n    base frame: %s\n",
            vertices->damping_time > 0.0 ? "in the kernel"
                                         : "left out (material.damping or damping_time)",
            vertices->rows.fall != NULL ? "follows the body, and falls in its place"
            : vertices->rows.floating   ? "follows the body"
                                        : "still");
}

// --- vertices by id ------------------------------------------------------------------------------

VertexId *vertex_ids_sort(const int *id, int count)
{
    VertexId *sorted = calloc((size_t)count + 1, sizeof *sorted);
    ASSERT(sorted != NULL);
    for (int i = 0; i < count; i++)
        sorted[i] = (VertexId){id[i], i};
    qsort(sorted, (size_t)count, sizeof *sorted, compare_ints);
    return sorted;
}

int vertex_ids_find(const VertexId *sorted, int count, int id)
{
    const VertexId key = {id, 0};
    const VertexId *found = bsearch(&key, sorted, (size_t)count, sizeof *sorted, compare_ints);
    return found != NULL ? found->vertex : -1;
}

int vertex_ids_find_fixed(const VertexId *sorted, int count, int id, Status *status)
{
    int vertex = vertex_ids_find(sorted, count, id);
    if (vertex < 0)
        status_fail(status, STATUS_INVALID,
                    "fixed: node %d is not a vertex of the body (%d vertices)", id, count);
    return vertex;
}
