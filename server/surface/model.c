// SPDX-License-Identifier: MIT
// What the parts of a surface body call of the model, below all of them: memory for its tables, its
// rows and springs, the pass of the kernel.
#include "surface/model.h"

#include "base/check.h"

#include <math.h>
#include <stdatomic.h>

// ---------------------------------------------------------------------------------------------
// Memory and tables. Load time

void *model_allocate_reals(const SurfaceModel *model, size_t count, const char *name,
                           const char *label, Arena *arena)
{
    return arena_allocate(arena, ARENA_STEP, count, model_real_size(model), "%s/%s", name, label);
}

void model_allocate_springs(SurfaceModel *model, size_t entries, const char *name, Arena *arena)
{
    SpringTable *springs = &model->springs;
    springs->neighbour = ALLOCATE(ARENA_STEP, entries, int, "spring neighbours");
    springs->rest_length = model_allocate_reals(model, entries, name, "spring rest lengths", arena);
    springs->stiffness = model_allocate_reals(model, entries, name, "spring stiffness", arena);
    if (model->stiffening.strain > 0.0)
        springs->inverse = model_allocate_reals(model, entries, name, "spring stiffening", arena);
    if (model->basis.precision != PRECISION_SINGLE)
        return;
    springs->rest_vector = model_allocate_reals(model, 3 * entries, name, "spring vectors", arena);
    if (model->prestressed)
        springs->preload = model_allocate_reals(model, entries, name, "spring preloads", arena);
}

void model_put_spring(SurfaceModel *model, long at, int slot, int other_slot, double r,
                      double stiffness)
{
    SpringTable *springs = &model->springs;
    springs->neighbour[at] = other_slot;
    model_put(model, springs->rest_length, at, r);
    model_put(model, springs->stiffness, at, stiffness);
    if (springs->inverse != NULL)
        model_put(model, springs->inverse, at,
                  r > 0.0 ? model->kernels->law_root / (model->stiffening.strain * r) : 0.0);
    if (model->basis.precision == PRECISION_DOUBLE)
        return;
    // The kernel of displacements needs the spring at rest as well.
    const double *own = model->basis.rest[slot], *other = model->basis.rest[other_slot];
    double square = 0.0;
    long vector = at / LANES * 3 * LANES + at % LANES;
    for (int c = 0; c < 3; c++) {
        double e = own[c] - other[c];
        square += e * e;
        model_put(model, springs->rest_vector, vector + c * LANES, e);
    }
    if (model->prestressed)
        model_put(model, springs->preload, at, square - r * r);
}

void model_create_node_table(SurfaceModel *model, const SurfaceOptions *options, bool all_free,
                             Arena *arena)
{
    const char *name = options->body.name;
    // The kernel variant follows from the shape springs.
    bool uses_drag = options->shape.wanted || options->material.node_damping > 0.0;
    bool body_frame = options->shape.wanted && options->shape.frame == SHAPE_BODY;
    bool radial = options->shape.wanted && options->shape.direction == SHAPE_DAMPS_RADIAL;
    bool single = model->basis.precision == PRECISION_SINGLE;
    model->shape = !uses_drag   ? SHAPE_FRAME_NONE
                   : body_frame ? SHAPE_FRAME_BODY
                   : radial     ? SHAPE_FRAME_WORLD_RADIAL
                                : SHAPE_FRAME_WORLD;
    // A body that nothing ties to the world may travel far: its rows follow the base frame.
    model->basis.floating = single && !shape_stands(model->shape) && all_free;
    model->basis.turned = model->basis.floating;
    model->basis.rest_turn = QUAT_NONE;
    // Only the tables that this variant reads.
    size_t lanes = (size_t)model->lane_count;
    NodeTable *nodes = &model->nodes;
    nodes->inverse_mass = model_allocate_reals(model, lanes, name, "inverse mass", arena);
    model->mass = ALLOCATE(ARENA_TOPOLOGY, model->node_count, double, "node masses");
    if (body_frame || (uses_drag && !single))
        nodes->rest = model_allocate_reals(model, 3 * lanes, name, "rest positions", arena);
    if (uses_drag) {
        nodes->shape_rate = model_allocate_reals(model, lanes, name, "shape rate", arena);
        nodes->drag = model_allocate_reals(model, lanes, name, "drag", arena);
    }
    if (shape_drag_is_apart(model->shape))
        nodes->shape_drag = model_allocate_reals(model, lanes, name, "shape drag", arena);
}

// Sets rest positions: in single precision relative to the middle of the body, so that a body far
// from the origin is represented as exactly as one near it.
void model_create_rest(SurfaceModel *model, const TriMesh *mesh, const char *name, Arena *arena,
                       StateList *state)
{
    model->basis.owner = model->node;
    model->basis.rest = arena_allocate(arena, ARENA_STEP, (size_t)model->basis.count,
                                       sizeof *model->basis.rest, "%s/places", name);
    // Single precision: all positions are relative to the middle of the mesh.
    if (model->basis.precision == PRECISION_SINGLE) {
        Vec3 sum = {0.0, 0.0, 0.0};
        for (int i = 0; i < mesh->node_count; i++)
            sum = vec3_add(sum, mesh->position[i]);
        model->basis.rest_origin = vec3_scale(1.0 / mesh->node_count, sum);
        model->basis.frame = ALLOCATE(ARENA_STEP, 1, BaseFrame, "base frame");
        *model->basis.frame = (BaseFrame){.origin = model->basis.rest_origin, .turn = QUAT_NONE};
        state_add(state, model->basis.frame, sizeof *model->basis.frame, "%s/base_frame", name);
    }
    for (int i = 0; i < mesh->node_count; i++) {
        Vec3 rest = vec3_sub(mesh->position[i], model->basis.rest_origin);
        double *to = model->basis.rest[model->slot[i]];
        to[0] = rest.x, to[1] = rest.y, to[2] = rest.z;
    }
}

void model_create_rows(SurfaceModel *model, const TriMesh *mesh, const bool *fixed,
                       const SurfaceOptions *options, Arena *arena, StateList *state)
{
    const char *name = options->body.name;
    static const char *const labels[2][2] = {{"rows", "rows of next tick"},
                                             {"stage rows", "stage rows 2"}};
    // Rows of this tick and the next, and of the stages between them.
    size_t values = (size_t)model->basis.count * ROW, bytes = values * model_real_size(model);
    for (int k = 0; k < 2; k++) {
        model->rows[k] = model_allocate_reals(model, values, name, labels[0][k], arena);
        model->stage[k] = model_allocate_reals(model, values, name, labels[1][k], arena);
    }
    if (!integrator_get(options->body.integrator)->kicks)
        model->sum =
            model_allocate_reals(model, (size_t)model->lane_count * 6, name, "stage sums", arena);
    // What SET and loads change.
    model->loaded = ALLOCATE(ARENA_STEP, 1, int64_t, "loaded");
    model->parameters = ALLOCATE(ARENA_STEP, 1, BodyParameters, "parameters");
    *model->parameters = body_parameters(options->body.gravity);

    // Initial state; the largest distance gives the limit for bad numbers.
    double farthest = 0.0;
    for (int i = 0; i < mesh->node_count; i++) {
        Vec3 x = options->body.initial_position != NULL ? options->body.initial_position[i]
                                                        : mesh->position[i];
        Vec3 v = {0.0, 0.0, 0.0};
        if (options->body.initial_velocity != NULL && !fixed[i])
            v = options->body.initial_velocity[i];
        rows_write(&model->basis, model->rows[0], model->slot[i], x, v);
        farthest = fmax(farthest, fmax(vec3_length(x), vec3_length(mesh->position[i])));
    }
    // Nodal damping acts relative to the world: such a body does not fall freely.
    if (model->basis.floating && !(options->material.node_damping > 0.0))
        rows_let_fall(&model->basis, name, arena, state);
    // Far beyond any sensible scene, and small enough for single precision.
    model->position_limit = 1e6 * farthest;
    model->present = model->rows[0];

    // All that a checkpoint must keep.
    state_add_pair(state, model->rows[0], model->rows[1], &model->current, bytes, "%s/rows", name);
    // The shape springs of a cut body's pieces act as external forces.
    bool pieces = options->body.cuttable && model->shape == SHAPE_FRAME_BODY;
    if (!options->body.without_contacts || !options->body.without_loads || pieces ||
        model->kind >= SPRINGS_LAW) {
        size_t forces = (size_t)model->lane_count * 3;
        model->external = model_allocate_reals(model, forces, name, "outside forces", arena);
        state_add(state, model->external, forces * model_real_size(model), "%s/loads", name);
    }
    // Loads of a body that turns are kept in the world frame.
    if (model->basis.floating && !options->body.without_loads) {
        size_t slots = (size_t)model->basis.count;
        model->world_load = arena_allocate(arena, ARENA_STEP, slots, sizeof *model->world_load,
                                           "%s/loads in the world", name);
        state_add(state, model->world_load, slots * sizeof *model->world_load, "%s/world_loads",
                  name);
    }
    state_add(state, model->loaded, sizeof *model->loaded, "%s/loaded", name);
    state_add(state, model->parameters, sizeof *model->parameters, "%s/parameters", name);
}

// ---------------------------------------------------------------------------------------------
// A tick. Step thread: no allocation, no lock

void model_drift(SurfaceModel *model, double dt)
{
    const size_t row = ROW * model_real_size(model);
    const char *from = model->rows[model->current];
    char *to = model->stage[0];
    // Only slots in use; velocities stay.
    for (int r = 0; r < model->run_count; r++) {
        const int first = model->run[r][0], count = model->run[r][1] - first;
        model->kernels->drift(from + (size_t)first * row, to + (size_t)first * row, count, dt);
    }
    rows_drift(&model->basis, dt);
    model->present = to;
    model->next_stage = 1;
}

// A pass that several threads share; each has a flag for bad numbers of its own.
typedef struct SharedPass {
    const SpringPass *pass;
    SpringKernel *evaluate;
    atomic_bool bad;
} SharedPass;

static void evaluate_part(void *context, int first, int last)
{
    SharedPass *shared = context;
    bool bad = false;
    SpringPass pass = *shared->pass;
    pass.first_chunk = first;
    pass.last_chunk = last;
    pass.bad = &bad;
    shared->evaluate(&pass);
    if (bad)
        atomic_store_explicit(&shared->bad, true, memory_order_relaxed);
}

void model_run_kernel(SurfaceModel *model, SpringKernel *evaluate, const SpringPass *pass)
{
    if (model->team == NULL) {
        evaluate(pass);
        return;
    }
    SharedPass shared = {.pass = pass, .evaluate = evaluate};
    team_run(model->team, evaluate_part, &shared, pass->last_chunk);
    model->bad |= atomic_load_explicit(&shared.bad, memory_order_relaxed);
}

void model_clear_touched(SurfaceModel *model)
{
    for (int k = 0; k < model->touched_count; k++) {
        int lane = model->touched[k];
        for (int c = 0; c < 3; c++)
            model_put(model, model->external, model_lane(lane) + c * LANES,
                      model_get(model, model->untouched, 3L * k + c));
        model->is_touched[lane] = false;
    }
    model->touched_count = 0;
}
