// The operations of a surface body (dynamics/body.h). Step thread: no allocation, no lock.
#include "surface/detail/detail.h"
#include "surface/implicit.h"
#include "surface/model.h"

#include "base/check.h"

#include <stdatomic.h>
#include <string.h>

// ---------------------------------------------------------------------------------------------
// A tick

void surface_drift(void *self, double dt)
{
    SurfaceModel *model = self;
    const size_t row = ROW * model_real_size(model);
    const char *from = model->rows[model->current];
    char *to = model->stage[0];
    for (int r = 0; r < model->run_count; r++) {
        const int first = model->run[r][0], count = model->run[r][1] - first;
        model->kernels->drift(from + (size_t)first * row, to + (size_t)first * row, count, dt);
    }
    rows_drift(&model->basis, dt);
    model->present = to;
    model->next_stage = 1;
}

void model_touch(SurfaceModel *model, int lane)
{
    if (model->is_touched[lane])
        return;
    model->is_touched[lane] = true;
    int k = model->touched_count++;
    ASSERT(k < model->touched_capacity);
    model->touched[k] = lane;
    for (int c = 0; c < 3; c++)
        model_put(model, model->untouched, 3L * k + c,
                  model_get(model, model->external, model_lane(lane) + c * LANES));
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

void model_fill_pass(SurfaceModel *model, const Stage *stage, double h, SpringPass *pass)
{
    const BodyParameters *p = model->parameters;
    Vec3 gravity = rows_gravity(&model->basis, (Vec3){p->gravity[0], p->gravity[1], p->gravity[2]});
    *pass = (SpringPass){
        .springs = &model->springs,
        .nodes = &model->nodes,
        .last_chunk = model->springs.chunk_count,
        .external = model->external,
        .stage = *stage,
        .h = h,
        .damping_time = model->damping_time * p->damping_scale,
        .stiffness_scale = p->stiffness_scale,
        .gravity = {gravity.x, gravity.y, gravity.z},
        .position_limit = model->position_limit,
        .bad = &model->bad,
    };
    // The result of the tick goes to the rows that are not current, so that the state before the
    // tick stays intact until commit.
    void *result = model->rows[1 - model->current];
    if (stage->rule == STAGE_RK4_FIRST) {
        model->base = model->present;
        model->next_stage = 0;
    }
    bool ends = stage->rule == STAGE_RK4_LAST || (stage->rule == STAGE_KICK && stage->last);
    pass->present = model->present;
    pass->base = model->base;
    pass->sum = model->sum;
    pass->next = ends ? result : model->stage[model->next_stage];
    if (model->shape == SHAPE_FRAME_BODY) {
        rigid_frame_fit(model->basis.rigid, pass->present);
        pass->frame = &model->basis.rigid->pose;
    }
}

void model_end_pass(SurfaceModel *model, const SpringPass *pass)
{
    const double *g = model->parameters->gravity;
    model_clear_touched(model);
    rows_advance(&model->basis, &pass->stage, pass->h, (Vec3){g[0], g[1], g[2]});
    model->present = pass->next;
    model->next_stage = 1 - model->next_stage;
}

static void surface_evaluate(void *self, const Stage *stage, double h)
{
    SurfaceModel *model = self;
    SpringPass pass;
    model_fill_pass(model, stage, h, &pass);
    bool external = *model->loaded != 0 || model->touched_count > 0;
    model_run_kernel(
        model, model->kernels->evaluate[model->damped][model->shape][external][model->prestressed],
        &pass);
    model_end_pass(model, &pass);
}

bool surface_commit(void *self)
{
    SurfaceModel *model = self;
    // The coordinates of a floating body are small however far it has travelled: check the distance
    // too.
    bool good = !model->bad &&
                (!model->basis.floating || rows_are_near(&model->basis, model->position_limit));
    model->bad = false;
    rows_end_tick(&model->basis, good);
    if (good) {
        model->current = 1 - model->current;
        if (model->basis.floating && rows_follow(&model->basis, model->rows[model->current]) &&
            model->world_load != NULL)
            model_turn_loads(model);
    }
    model->present = model->rows[model->current];
    return good;
}

void surface_abandon(void *self)
{
    SurfaceModel *model = self;
    rows_end_tick(&model->basis, false);
    model->present = model->rows[model->current];
    model->bad = false;
}

bool surface_check(const void *self)
{
    const SurfaceModel *model = self;
    return rows_are_sound(&model->basis, model->rows[model->current], model->position_limit);
}

void surface_restore(void *self, RestoreMode mode)
{
    SurfaceModel *model = self;
    void *rows = model->rows[model->current];
    if (mode == RESTORE_SHAPE) {
        rows_return_to_rest(&model->basis, rows);
        if (model->world_load != NULL)
            model_turn_loads(model);
    } else if (mode != RESTORE_MOTION) {
        rows_stop(&model->basis, rows);
    }
    model->present = rows;
}

// ---------------------------------------------------------------------------------------------
// Nodes

void surface_read_nodes(const void *self, const int *node, int count, Vec3 *position,
                        Vec3 *velocity)
{
    const SurfaceModel *model = self;
    for (int i = 0; i < count; i++)
        rows_read(&model->basis, model->present, model->slot[node[i]], &position[i],
                  velocity == NULL ? NULL : &velocity[i]);
}

static void surface_add_forces(void *self, const int *node, int count, const Vec3 *force)
{
    SurfaceModel *model = self;
    for (int i = 0; i < count; i++) {
        int slot = model->slot[node[i]];
        model_touch(model, slot);
        model_add_external(model, slot, force[i]);
    }
}

void model_reserve_touched(SurfaceModel *model, const char *name, int count, Arena *arena)
{
    size_t lanes = (size_t)(count < model->lane_count ? count : model->lane_count);
    model->touched_capacity = (int)lanes;
    model->touched = arena_allocate(arena, ARENA_CONTACT, lanes, sizeof *model->touched,
                                    "%s/touched slots", name);
    model->untouched = arena_allocate(arena, ARENA_CONTACT, 3 * lanes, model_real_size(model),
                                      "%s/touched loads", name);
    model->is_touched = arena_allocate(arena, ARENA_CONTACT, (size_t)model->lane_count,
                                       sizeof *model->is_touched, "%s/touched marks", name);
}

static void surface_reserve_forces(void *self, const char *name, int count, Arena *arena)
{
    model_reserve_touched(self, name, count, arena);
}

int surface_find_nodes(const void *self, const Region *region, int *node, int capacity)
{
    const SurfaceModel *model = self;
    const RegionTest test = region_test(region);
    int found = 0;
    for (int s = 0; s < model->basis.count; s++) {
        if (model->node[s] < 0)
            continue;
        Vec3 x;
        rows_read(&model->basis, model->present, s, &x, NULL);
        if (region_contains(&test, x)) {
            if (found < capacity)
                node[found] = model->node[s];
            found++;
        }
    }
    return found;
}

void model_add_load(SurfaceModel *model, int slot, Vec3 force)
{
    if (model->world_load != NULL) {
        model->world_load[slot][0] += force.x;
        model->world_load[slot][1] += force.y;
        model->world_load[slot][2] += force.z;
    }
    model_add_external(model, slot, force);
    *model->loaded = 1;
}

static void surface_add_load(void *self, int node, Vec3 force)
{
    SurfaceModel *model = self;
    model_add_load(model, model->slot[node], force);
}

void surface_clear_loads(void *self)
{
    SurfaceModel *model = self;
    if (*model->loaded != 0) {
        memset(model->external, 0, (size_t)model->lane_count * 3 * model_real_size(model));
        if (model->world_load != NULL)
            memset(model->world_load, 0, (size_t)model->basis.count * sizeof *model->world_load);
    }
    *model->loaded = 0;
}

// ---------------------------------------------------------------------------------------------
// Out

static void clear_free_slots(const SurfaceShown *shown, float *value)
{
    for (int s = 0; shown->free_count > 0 && s < shown->count; s++)
        if (shown->id[s] < 0)
            memset(value + 3L * s, 0, 3 * sizeof *value);
}

void surface_snapshot_rest(const void *self, float *position)
{
    const SurfaceModel *model = self;
    rows_snapshot_rest(&model->basis, model->shown.row, model->shown.count, position);
    clear_free_slots(&model->shown, position);
}

void surface_snapshot(const void *self, float *position, float *velocity)
{
    const SurfaceModel *model = self;
    rows_snapshot(&model->basis, model->rows[model->current], model->shown.row, model->shown.count,
                  position, velocity);
    clear_free_slots(&model->shown, position);
    if (velocity != NULL)
        clear_free_slots(&model->shown, velocity);
}

// Returns the potential of gravity and constant loads at a slot [J].
static double outer_potential(const SurfaceModel *model, int slot, Vec3 x)
{
    const double *g = model->parameters->gravity, mass = model->mass[model->node[slot]];
    Vec3 force = {mass * g[0], mass * g[1], mass * g[2]};
    if (*model->loaded != 0 && model->world_load != NULL) {
        const double *load = model->world_load[slot];
        force = vec3_add(force, (Vec3){load[0], load[1], load[2]});
    } else if (*model->loaded != 0) {
        const long at = model_lane(model_lane_of(model, slot));
        force = vec3_add(force, (Vec3){model_get(model, model->external, at),
                                       model_get(model, model->external, at + LANES),
                                       model_get(model, model->external, at + 2 * LANES)});
    }
    return -vec3_dot(force, x);
}

// Returns the elastic energy of a slot's springs, half of each: the other half is at the other end
// [J].
static double spring_energy(const SurfaceModel *model, const void *rows, int slot, Vec3 x)
{
    const SpringTable *springs = &model->springs;
    double energy = 0.0;
    int lane = model_lane_of(model, slot), chunk = lane / LANES;
    int end = springs->end[chunk];
    for (int e = springs->start[chunk]; e < end; e++) {
        long at = (long)e * LANES + lane % LANES;
        Vec3 other;
        rows_read(&model->basis, rows, springs->neighbour[at], &other, NULL);
        double stretch =
            vec3_length(vec3_sub(x, other)) - model_get(model, springs->rest_length, at);
        energy += 0.25 * model_get(model, springs->stiffness, at) * stretch * stretch;
    }
    return energy;
}

void surface_measure(const void *self, BodyMeasure *measure)
{
    const SurfaceModel *model = self;
    const void *rows = model->rows[model->current];
    double kinetic = 0.0, elastic = 0.0, shape = 0.0, farthest = 0.0, outer = 0.0;
    for (int s = 0; s < model->basis.count; s++) {
        if (model->node[s] < 0)
            continue;
        Vec3 x, v;
        rows_read(&model->basis, rows, s, &x, &v);
        Vec3 rest = vec3_add(model->basis.rest_origin, model_place(model, s));
        Vec3 u = vec3_sub(x, rest);
        double mass = model->mass[model->node[s]], away = vec3_dot(u, u);
        kinetic += 0.5 * mass * vec3_dot(v, v);
        elastic += spring_energy(model, rows, s, x);
        outer += outer_potential(model, s, x);
        farthest = fmax(farthest, away);
        // Shape springs to the world are summed by node, those to a body's frame by its fit below.
        if (shape_stands(model->shape))
            shape += 0.5 * mass * away *
                     model_get(model, model->nodes.shape_rate, model_lane_of(model, s));
    }
    if (model->shape == SHAPE_FRAME_BODY)
        shape = rigid_frame_energy(model->basis.rigid, rows);
    *measure = (BodyMeasure){
        .kinetic = kinetic,
        .elastic = model->parameters->stiffness_scale * elastic + shape,
        .max_displacement = sqrt(farthest),
        .outer = outer,
    };
}

static bool surface_is_fixed(const void *self, int node)
{
    const SurfaceModel *model = self;
    return model_get(model, model->nodes.inverse_mass, model->slot[node]) == 0.0;
}

bool surface_set(void *self, BodyParameter parameter, double value)
{
    SurfaceModel *model = self;
    return body_parameters_set(model->parameters, model->damped, parameter, value);
}

void surface_explain(const void *self, FILE *out)
{
    const SurfaceModel *model = self;
    static const char *const shapes[] = {"none", "virtual nodes fixed in the world",
                                         "virtual nodes on a best-fit rigid frame",
                                         ("virtual nodes fixed in the world, damped along the "
                                          "springs")};
    fprintf(out, "    kernel: %s, %s, %d lanes a chunk, %d nodes, %d springs\n",
            model->basis.precision == PRECISION_SINGLE ? "single" : "double", model->kernels->level,
            LANES, model->node_count, model->edge_count);
    if (model->team != NULL)
        fprintf(out, "    shared by %d threads\n", team_threads(model->team));
    fprintf(out, "    spring damping: %s\n",
            model->damped ? "in the kernel" : "left out (material.damping_time, spring_damping)");
    fprintf(out, "    shape-preserving springs: %s%s\n", shapes[model->shape],
            model->shape == SHAPE_FRAME_NONE ? " (shape)" : "");
    fprintf(out, "    outside forces: read only while a load or a tool acts\n");
    if (model->detail != NULL)
        detail_explain(model->detail, out);
    if (model->implicit != NULL)
        implicit_explain(model->implicit, out);
}

int surface_read_rows(const void *self, int *id, Vec3 *position, Vec3 *velocity)
{
    const SurfaceModel *model = self;
    const SurfaceShown *shown = &model->shown;
    const void *rows = model->rows[model->current];
    if (id != NULL)
        memcpy(id, shown->id, (size_t)shown->count * sizeof *id);
    for (int s = 0; s < shown->count; s++) {
        position[s] = velocity[s] = (Vec3){0.0, 0.0, 0.0};
        if (shown->id[s] >= 0)
            rows_read(&model->basis, rows, shown->row[s], &position[s], &velocity[s]);
    }
    return shown->count;
}

const char *surface_isa(const void *self)
{
    const SurfaceModel *model = self;
    return model->kernels->level;
}

#define ONE_LEVEL                                                                                  \
    SURFACE_OPERATIONS, .check = surface_check, .restore = surface_restore,                        \
                        .reserve_forces = surface_reserve_forces,                                  \
                        .add_forces = surface_add_forces, .add_load = surface_add_load,            \
                        .measure = surface_measure, .is_fixed = surface_is_fixed,                  \
                        .set = surface_set

const BodyOps *surface_ops(const SurfaceOptions *options)
{
    static const BodyOps explicit_steps = {ONE_LEVEL, .drift = surface_drift,
                                           .evaluate = surface_evaluate};
    static const BodyOps implicit_steps = {ONE_LEVEL, IMPLICIT_STEPS};
    return options->body.integrator == INTEGRATOR_IMPLICIT ? &implicit_steps : &explicit_steps;
}

void surface_read_state(const Body *body, Vec3 *position, Vec3 *velocity)
{
    surface_read_rows(body->model, NULL, position, velocity);
}
