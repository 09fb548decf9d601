// SPDX-License-Identifier: MIT
// The operations of a surface body (body/body.h). Step thread: no allocation, no lock.
#include "surface/bending.h"
#include "surface/cavity.h"
#include "surface/detail/detail.h"
#include "surface/error.h"
#include "surface/implicit.h"
#include "surface/law.h"
#include "surface/model.h"

#include "base/check.h"

#include <string.h>

// ---------------------------------------------------------------------------------------------
// A tick

static void surface_drift(void *self, double dt)
{
    SurfaceModel *model = self;
    model_drift(model, dt);
    if (model->cavity != NULL)
        cavity_drift(model->cavity, dt);
}

static void fill_pass(SurfaceModel *model, const Evaluation *evaluation, double h, SpringPass *pass)
{
    const BodyParameters *p = model->parameters;
    Vec3 gravity = rows_gravity(&model->basis, (Vec3){p->gravity[0], p->gravity[1], p->gravity[2]});
    *pass = (SpringPass){
        .springs = &model->springs,
        .nodes = &model->nodes,
        .last_chunk = model->springs.chunk_count,
        .external = model->external,
        .evaluation = *evaluation,
        .h = h,
        .damping_time = model->damping_time * p->damping_scale,
        .stiffness_scale = p->stiffness_scale,
        .gravity = {gravity.x, gravity.y, gravity.z},
        .position_limit = model->position_limit,
        .stiffening = model->stiffening,
        .bad = &model->bad,
    };
    if (model->relaxation != NULL)
        relaxation_begin(model->relaxation, h, &pass->relaxation);
    // The result of the tick goes to the rows that are not current, so that the state before the
    // tick stays intact until commit.
    void *result = model->rows[1 - model->current];
    // RK4 remembers where its substep began.
    if (evaluation->rule == EVALUATION_RK4_FIRST) {
        model->base = model->present;
        model->next_stage = 0;
    }
    bool ends = evaluation->rule == EVALUATION_RK4_LAST ||
                (evaluation->rule == EVALUATION_KICK && evaluation->last);
    pass->present = model->present;
    pass->base = model->base;
    pass->sum = model->sum;
    pass->next = ends ? result : model->stage[model->next_stage];
    if (model->shape == SHAPE_FRAME_BODY) {
        rigid_frame_fit(model->basis.rigid, pass->present);
        pass->frame = &model->basis.rigid->pose;
    }
    if (model->cavity != NULL) {
        cavity_begin(model, evaluation, h);
        pass->cavity = &model->cavity->pass;
    }
}

static void end_pass(SurfaceModel *model, const SpringPass *pass)
{
    const double *g = model->parameters->gravity;
    if (model->touched_count > 0)
        model_clear_touched(model);
    if (model->cavity != NULL)
        cavity_end(model, pass);
    rows_advance(&model->basis, &pass->evaluation, pass->h, (Vec3){g[0], g[1], g[2]});
    model->present = pass->next;
    model->next_stage = 1 - model->next_stage;
}

static void surface_evaluate(void *self, const Evaluation *evaluation, double h)
{
    SurfaceModel *model = self;
    SpringPass pass;
    fill_pass(model, evaluation, h, &pass);
    if (model->detail != NULL) {
        detail_evaluate(model, &pass);
    } else {
        if (*model->loaded == 0 && model->touched_count == 0)
            pass.external = NULL;
        if (model->bending != NULL)
            bending_evaluate(model, &pass);
        model_run_kernel(model, model->kernels->evaluate[model->kind][model->shape], &pass);
    }
    end_pass(model, &pass);
}

static bool surface_commit(void *self)
{
    SurfaceModel *model = self;
    // The coordinates of a floating body are small however far it has travelled: check the distance
    // too.
    bool good = !model->bad && (model->cavity == NULL || cavity_can_flow(model->cavity)) &&
                (!model->basis.floating || rows_are_near(&model->basis, model->position_limit));
    model->bad = false;
    rows_end_tick(&model->basis, good);
    if (good && model->relaxation != NULL)
        relaxation_commit(model->relaxation);
    if (good) {
        model->current = 1 - model->current;
        if (model->basis.floating && rows_follow(&model->basis, model->rows[model->current]) &&
            model->world_load != NULL)
            model_turn_loads(model);
    }
    model->present = model->rows[model->current];
    if (model->cavity != NULL && good)
        cavity_commit(model);
    else if (model->cavity != NULL)
        cavity_abandon(model->cavity);
    // What a cut wall encloses is measured at the end only.
    return good && (model->cavity == NULL || cavity_can_flow(model->cavity));
}

static void surface_abandon(void *self)
{
    SurfaceModel *model = self;
    rows_end_tick(&model->basis, false);
    if (model->relaxation != NULL)
        relaxation_abandon(model->relaxation);
    model->present = model->rows[model->current];
    if (model->cavity != NULL)
        cavity_abandon(model->cavity);
    model->bad = false;
}

static bool surface_check(const void *self)
{
    const SurfaceModel *model = self;
    return (model->detail == NULL || model->detail->is_valid) &&
           (model->cavity == NULL || cavity_check(model->cavity)) &&
           (model->relaxation == NULL || relaxation_check(model->relaxation)) &&
           surface_error_check(model) &&
           rows_are_valid(&model->basis, model->rows[model->current], model->position_limit);
}

static void surface_restore(void *self, RestoreMode mode)
{
    SurfaceModel *model = self;
    void *rows = model->rows[model->current];
    if (model->relaxation != NULL)
        relaxation_abandon(model->relaxation);
    if (mode == RESTORE_SHAPE)
        law_rest(model);
    // Loads stay, but the frame has turned back.
    if (mode == RESTORE_SHAPE) {
        rows_return_to_rest(&model->basis, rows);
        if (model->world_load != NULL)
            model_turn_loads(model);
    } else if (mode != RESTORE_MOTION) {
        rows_stop(&model->basis, rows);
    }
    model->present = rows;
    if (model->cavity != NULL && mode == RESTORE_SHAPE)
        cavity_refill(model->cavity);
    else if (model->cavity != NULL)
        cavity_forget(model->cavity);
    if (model->detail != NULL)
        detail_forget(model->detail, mode);
}

static void surface_restored(Body *body)
{
    SurfaceModel *model = body->model;
    const bool is_current = surface_error_is_current(model);
    if (model->detail != NULL)
        detail_restored(body);
    if (model->detail == NULL || model->detail->is_valid)
        surface_error_restored(model, is_current);
    if (model->cavity != NULL)
        cavity_restored(model->cavity);
}

// ---------------------------------------------------------------------------------------------
// Nodes

static bool has_lips(const SurfaceModel *model)
{
    return model->detail != NULL && model->detail->set.cut != NULL &&
           model->detail->set.cut->lips.count > 0;
}

static void surface_read_nodes(const void *self, const int *node, int count, Vec3 *position,
                               Vec3 *velocity)
{
    const SurfaceModel *model = self;
    for (int i = 0; i < count; i++)
        rows_read(&model->basis, model->present, model->slot[node[i]], &position[i],
                  velocity == NULL ? NULL : &velocity[i]);
    if (has_lips(model))
        for (int i = 0; i < count; i++)
            detail_lips_read(model, model->present, node[i], &position[i],
                             velocity == NULL ? NULL : &velocity[i]);
}

static void surface_bound_motion(const void *self, double *displacement, double *speed)
{
    const SurfaceModel *model = self;
    rows_bound_motion(&model->basis, model->present, displacement, speed);
}

static int surface_find_nodes(const void *self, const Region *region, int *node, int capacity)
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

// ---------------------------------------------------------------------------------------------
// Out

static void clear_free_slots(const SurfaceShown *shown, float *value)
{
    for (int s = 0; shown->free_count > 0 && s < shown->count; s++)
        if (shown->id[s] < 0)
            memset(value + 3L * s, 0, 3 * sizeof *value);
}

static void surface_snapshot_rest(const void *self, float *position)
{
    const SurfaceModel *model = self;
    rows_snapshot_rest(&model->basis, model->shown.row, model->shown.count, position);
    if (has_lips(model))
        detail_lips_show_rest(model, position);
    clear_free_slots(&model->shown, position);
}

static void surface_snapshot(const void *self, float *position, float *velocity)
{
    const SurfaceModel *model = self;
    rows_snapshot(&model->basis, model->rows[model->current], model->shown.row, model->shown.count,
                  position, velocity);
    if (has_lips(model))
        detail_lips_show(model, model->rows[model->current], position, velocity);
    clear_free_slots(&model->shown, position);
    if (velocity != NULL)
        clear_free_slots(&model->shown, velocity);
}

// Returns the potential of gravity and constant loads at a slot [J].
static double outer_potential(const SurfaceModel *model, int slot, Vec3 x)
{
    const double *g = model->parameters->gravity, mass = model->mass[model->node[slot]];
    Vec3 force = {mass * g[0], mass * g[1], mass * g[2]};
    // Loads, in the frame in which they are kept.
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
        const double k = model_get(model, springs->stiffness, at);
        double stretch =
            vec3_length(vec3_sub(x, other)) - model_get(model, springs->rest_length, at);
        energy += model->kind >= SPRINGS_LAW ? 0.5 * k * law_spring(model, at, stretch, 0.0).energy
                                             : 0.25 * k * stretch * stretch;
    }
    return energy;
}

static void surface_measure(const void *self, BodyMeasure *measure)
{
    const SurfaceModel *model = self;
    const void *rows = model->rows[model->current];
    double kinetic = 0.0, elastic = 0.0, shape = 0.0, farthest = 0.0, outer = 0.0;
    for (int s = 0; s < model->basis.count; s++) {
        if (model->node[s] < 0)
            continue;
        Vec3 x, v;
        rows_read(&model->basis, rows, s, &x, &v);
        Vec3 rest = vec3_add(model->basis.rest_origin, model_rest(model, s));
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
    if (model->bending != NULL)
        elastic += bending_energy(model, rows);
    if (model->shape == SHAPE_FRAME_BODY)
        shape = rigid_frame_energy(model->basis.rigid, rows);
    *measure = (BodyMeasure){
        .kinetic = kinetic,
        .elastic = model->parameters->stiffness_scale * elastic + shape,
        .max_displacement = sqrt(farthest),
        .outer = outer + (model->cavity != NULL ? cavity_energy(model) : 0.0),
    };
    if (model->detail != NULL)
        measure->refused = model->detail->adapt.sweep->refused;
    // Pieces with frames of their own.
    if (model->detail != NULL && model->detail->frames != NULL)
        measure->elastic += detail_frames_energy(model, rows);
}

static bool surface_is_fixed(const void *self, int node)
{
    const SurfaceModel *model = self;
    return model->detail != NULL
               ? model->detail->fixed[node]
               : model_get(model, model->nodes.inverse_mass, model->slot[node]) == 0.0;
}

static bool surface_set(void *self, BodyParameter parameter, double value)
{
    SurfaceModel *model = self;
    if (model->detail != NULL && detail_set(model->detail, parameter, value))
        return true;
    if (model->cavity != NULL &&
        (parameter == BODY_PRESSURE || parameter == BODY_VOLUME || parameter == BODY_SUPPLY)) {
        cavity_set(model, parameter, value);
        return true;
    }
    return body_parameters_set(model->parameters, model->damped, parameter, value);
}

static bool surface_get(const void *self, BodyParameter parameter, double *value)
{
    const SurfaceModel *model = self;
    return (model->detail != NULL && detail_get(model->detail, parameter, value)) ||
           (model->cavity != NULL && cavity_get(model, parameter, value)) ||
           body_parameters_get(model->parameters, model->damped, parameter, value);
}

static bool surface_range(const void *self, BodyParameter parameter, double *low, double *high)
{
    const SurfaceModel *model = self;
    return model->cavity != NULL && cavity_range(model->cavity, parameter, low, high);
}

static void surface_explain(const void *self, FILE *out)
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
    if (model->relaxation != NULL)
        fprintf(out, "    relaxation: in the kernel, %d branches\n", model->relaxation->count);
    if (model->springs.inverse != NULL)
        fprintf(out, "    stiffening: in the kernel\n");
    fprintf(out, "    shape-preserving springs: %s%s\n", shapes[model->shape],
            model->shape == SHAPE_FRAME_NONE ? " (shape)" : "");
    if (model->cavity != NULL)
        cavity_explain(model, out);
    if (model->bending != NULL)
        fprintf(out, "    bending: %d hinges, one thread\n", model->bending->hinge_count);
    fprintf(out, "    outside forces: read only while a load or a tool acts\n");
    if (model->detail != NULL)
        detail_explain(model->detail, out);
    if (model->implicit != NULL)
        implicit_explain(model->implicit, out);
}

static int surface_read_rows(const void *self, int *id, Vec3 *position, Vec3 *velocity)
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

static const char *surface_isa(const void *self)
{
    const SurfaceModel *model = self;
    return model->kernels->level;
}

// What every surface body does, and what depends on the scene.
#define EXPLICIT                                                                                   \
    OPERATIONS, .drift = surface_drift, .evaluate = surface_evaluate,                              \
                .kick_nodes = surface_kick_nodes
#define IMPLICIT OPERATIONS, .drift = implicit_drift, .evaluate = implicit_evaluate
#define ADAPTS   .adapt = detail_adapt, .look = detail_look
#define CUTS                                                                                       \
    .cut = detail_blade_cut, .reserve_blades = detail_blade_reserve, .remove = detail_remove,      \
    .account = detail_account
#define TEARS CUTS, .tear = detail_tear
#define OPERATIONS                                                                                 \
    .model = "surface", .commit = surface_commit, .abandon = surface_abandon,                      \
    .check = surface_check, .restore = surface_restore, .restored = surface_restored,              \
    .read_nodes = surface_read_nodes, .bound_motion = surface_bound_motion,                        \
    .is_fixed = surface_is_fixed, .reserve_forces = surface_reserve_forces,                        \
    .add_forces = surface_add_forces, .find_nodes = surface_find_nodes,                            \
    .add_load = surface_add_load, .clear_loads = surface_clear_loads,                              \
    .gather_patch = model_gather_patch, .snapshot = surface_snapshot,                              \
    .snapshot_rest = surface_snapshot_rest, .read_state = surface_read_rows,                       \
    .measure = surface_measure, .estimate = surface_estimate,                                      \
    .snapshot_error = surface_snapshot_error, .set = surface_set, .get = surface_get,              \
    .range = surface_range, .explain = surface_explain, .isa = surface_isa

const BodyOps *surface_ops(const SurfaceOptions *options)
{
    enum { WHOLE, CUT, TORN, KINDS };
    static const BodyOps table[2][KINDS][2] = {
        {
            [WHOLE] = {{EXPLICIT}, {IMPLICIT}},
            [CUT] = {{EXPLICIT, CUTS}, {IMPLICIT, CUTS}},
            [TORN] = {{EXPLICIT, TEARS}, {IMPLICIT, TEARS}},
        },
        {
            [WHOLE] = {{EXPLICIT, ADAPTS}, {IMPLICIT, ADAPTS}},
            [CUT] = {{EXPLICIT, ADAPTS, CUTS}, {IMPLICIT, ADAPTS, CUTS}},
            [TORN] = {{EXPLICIT, ADAPTS, TEARS}, {IMPLICIT, ADAPTS, TEARS}},
        },
    };
    // A table in place of tests while it runs.
    const int kind = !options->body.cuttable ? WHOLE : options->tear_stretch > 0.0 ? TORN : CUT;
    return &table[options->adaptive][kind][options->body.integrator == INTEGRATOR_IMPLICIT];
}
