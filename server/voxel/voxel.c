// SPDX-License-Identifier: MIT
// The operations of a voxel body (body/body.h). Step thread: no allocation, no lock.
#include "voxel/cut/cut_body.h"
#include "voxel/error.h"
#include "voxel/fitted_body.h"
#include "voxel/model.h"
#include "voxel/skin.h"

// ---------------------------------------------------------------------------------------------
// A tick

VoxelPass voxel_pass(const VoxelModel *model, const void *rows)
{
    return (VoxelPass){
        .law = model->law,
        .damped = model->vertices.damping_time > 0.0,
        .viscous = model->viscous,
        .stiffening = model->stiffening,
        .rows = rows,
        .force = model->vertices.force,
        .stiffness_scale = model->vertices.parameters->stiffness_scale,
        .damping_scale = model->vertices.parameters->damping_scale,
    };
}

// A pass whose halves run on two threads, each with forces of its own.
typedef struct SharedPass {
    const VoxelModel *model;
    const VoxelPass *pass;
} SharedPass;

static void evaluate_halves(void *context, int first, int last)
{
    const SharedPass *shared = context;
    const VoxelModel *model = shared->model;
    for (int half = first; half < last; half++) {
        VoxelPass pass = *shared->pass;
        pass.force = half == 0 ? model->vertices.force : model->vertices.more;
        batch_runs_evaluate(model->batches, &pass, half);
    }
}

static void evaluate_all(const VoxelModel *model, const VoxelPass *pass)
{
    SharedPass shared = {model, pass};
    if (!model->vertices.halved)
        batch_runs_evaluate(model->batches, pass, BATCHES_ALL);
    else if (model->vertices.team == NULL)
        evaluate_halves(&shared, 0, 2);
    else
        team_run(model->vertices.team, evaluate_halves, &shared, 2);
}

static bool carries(const VoxelModel *model)
{
    return model->cuts != NULL && model->cuts->carry != NULL;
}

// Computes the forces of all elements, then advances the vertices.
static void voxel_evaluate(void *self, const Evaluation *evaluation, double h)
{
    VoxelModel *model = self;
    Vertices *vertices = &model->vertices;
    const double *g = vertices->parameters->gravity;
    vertices_begin(vertices);
    if (carries(model))
        cut_body_carry_loads(model);
    if (model->cuts != NULL)
        cut_body_feel(model->cuts);
    VoxelPass pass = voxel_pass(model, vertices->present);
    if (model->batches->relaxation != NULL)
        relaxation_begin(model->batches->relaxation, h, &pass.relaxation);
    evaluate_all(model, &pass);
    if (model->cuts != NULL && model->cuts->tension != NULL)
        cut_tension_add_forces(model->cuts->tension, vertices->present, vertices->force,
                               pass.stiffness_scale);
    if (carries(model))
        cut_release_add(model->cuts->release,
                        rows_gravity(&vertices->rows, (Vec3){g[0], g[1], g[2]}));
    vertices_advance(vertices, evaluation, h, (Vec3){g[0], g[1], g[2]});
}

static bool voxel_commit(void *self)
{
    VoxelModel *model = self;
    const bool good = vertices_end(&model->vertices);
    if (good)
        vertices_follow(&model->vertices);
    if (carries(model))
        cut_carry_forget(model->cuts->carry);
    if (good && model->batches->relaxation != NULL)
        relaxation_commit(model->batches->relaxation);
    if (good && model->cuts != NULL && model->vertices.rows.floating)
        cut_body_committed(model->cuts);
    return good;
}

static void voxel_abandon(void *self)
{
    VoxelModel *model = self;
    vertices_abandon(&model->vertices);
    if (carries(model)) {
        cut_release_forget(model->cuts->release, true);
        cut_carry_forget(model->cuts->carry);
    }
    if (model->batches->relaxation != NULL)
        relaxation_abandon(model->batches->relaxation);
}

static bool voxel_check(const void *self)
{
    const VoxelModel *model = self;
    return (model->cuts == NULL || model->cuts->sound) && batch_runs_check(model->batches) &&
           vertices_check(&model->vertices) && voxel_error_check(model);
}

static void voxel_restore(void *self, RestoreMode mode)
{
    VoxelModel *model = self;
    vertices_restore(&model->vertices, mode);
    if (model->batches->relaxation != NULL)
        relaxation_abandon(model->batches->relaxation);
    if (mode == RESTORE_SHAPE)
        batch_runs_forget(model->batches);
    if (model->cuts != NULL)
        cut_body_restore(model->cuts, mode);
}

// ---------------------------------------------------------------------------------------------
// Nodes: the vertices, of bodies that cannot be cut those of the outer faces

// Transforms the region to the rows' coordinates rather than every vertex to the world.
static int voxel_find_nodes(const void *self, const Region *region, int *node, int capacity)
{
    const VoxelModel *model = self;
    if (model->cuts != NULL)
        return cut_faces_find_nodes(&model->cuts->faces, region, node, capacity);
    const Region here = rows_region(&model->vertices.rows, region);
    const RegionTest test = region_test(&here);
    // Nodes count even where there is no more room.
    int found = 0;
    for (int i = 0; i < model->surface_count; i++)
        if (region_contains(&test, rows_local(&model->vertices.rows, model->vertices.present, i))) {
            if (found < capacity)
                node[found] = i;
            found++;
        }
    return found;
}

static void voxel_fit_node(const void *self, int node, int64_t step, FitNode *out)
{
    const VoxelModel *model = self;
    if (model->cuts != NULL)
        cut_fit_node(model->cuts->fit, node, step, out);
    else
        fitted_node(model->fitted, &model->vertices.rows, node, out);
}

static void voxel_read_nodes(const void *self, const int *node, int count, Vec3 *position,
                             Vec3 *velocity)
{
    if (carries(self))
        cut_body_read(self, node, count, position, velocity);
    else
        vertices_read_nodes(self, node, count, position, velocity);
}

static void voxel_add_forces(void *self, const int *node, int count, const Vec3 *force)
{
    if (carries(self))
        cut_body_add_forces(self, node, count, force);
    else
        vertices_add_forces(self, node, count, force);
}

static bool voxel_is_fixed(const void *self, int node)
{
    const VoxelModel *model = self;
    return carries(model) ? cut_masses_is_fixed(&model->cuts->masses, node)
                          : vertices_is_fixed(self, node);
}

static void voxel_kick_nodes(void *self, const int *node, int count, const Vec3 *impulse, double h,
                             double drift)
{
    VoxelModel *model = self;
    const bool some = carries(model);
    for (int i = 0; i < count; i++)
        if (some)
            cut_body_kick(model, node[i], impulse[i], drift);
        else
            vertices_kick(&model->vertices, node[i], impulse[i], drift);
    if (model->cuts != NULL)
        cut_body_feel_kick(model->cuts, node, count, impulse, h);
}

// ---------------------------------------------------------------------------------------------
// Out

static void voxel_snapshot_rows(const void *self, float *position, float *velocity)
{
    const VoxelModel *model = self;
    fitted_snapshot_rows(model->fitted, &model->vertices.rows, vertices_row(&model->vertices),
                         position, velocity);
    if (carries(model))
        cut_carry_snapshot(model->cuts->carry, model->cuts->fit->row_of, position, velocity);
}

static void voxel_snapshot(const void *self, float *position, float *velocity)
{
    const VoxelModel *model = self;
    const Rows *rows = &model->vertices.rows;
    const void *row = vertices_row(&model->vertices);
    FittedBody *fitted = model->fitted;
    if (model->skin != NULL) {
        skin_snapshot(model->skin, rows, row, position, velocity);
    } else if (fitted != NULL) {
        voxel_snapshot_rows(self, fitted->position, velocity == NULL ? NULL : fitted->velocity);
        fitted_snapshot(fitted, (int)*model->node_count, position, velocity);
    } else {
        rows_snapshot(rows, row, model->node, (int)*model->node_count, position, velocity);
        if (carries(model))
            cut_carry_snapshot(model->cuts->carry, model->cuts->faces.slot_of, position, velocity);
    }
}

static void voxel_snapshot_rest(const void *self, float *position)
{
    const VoxelModel *model = self;
    const Rows *rows = &model->vertices.rows;
    if (model->skin != NULL)
        skin_snapshot_rest(model->skin, rows, position);
    else if (model->fitted != NULL)
        fitted_snapshot_rest(model->fitted, rows, (int)*model->node_count, position);
    else
        rows_snapshot_rest(rows, model->node, (int)*model->node_count, position);
}

// Those of bodies that adapt come first.
static bool voxel_set(void *self, BodyParameter parameter, double value)
{
    const VoxelModel *model = self;
    const bool adapts = model->cuts != NULL && model->cuts->adapt != NULL;
    return (adapts && cut_adapt_set(model->cuts->adapt, parameter, value)) ||
           vertices_set(self, parameter, value);
}

static bool voxel_get(const void *self, BodyParameter parameter, double *value)
{
    const VoxelModel *model = self;
    const bool adapts = model->cuts != NULL && model->cuts->adapt != NULL;
    return (adapts && cut_adapt_get(model->cuts->adapt, parameter, value)) ||
           vertices_get(self, parameter, value);
}

static void voxel_snapshot_coagulated(const void *self, unsigned char *share)
{
    const VoxelModel *model = self;
    const FittedBody *fitted = model->fitted;
    for (int i = 0; i < (int)*model->node_count; i++) {
        const int vertex = fitted != NULL ? fitted->vertex[fitted->fit.row[i]] : model->node[i];
        share[i] = (unsigned char)lrint(255.0 * cut_heat_share(model->cuts->heat, vertex));
    }
}

// Finds out where carried vertices with loads are, whose potential is measured.
static void find_loaded(const VoxelModel *model)
{
    const Vertices *vertices = &model->vertices;
    if (!carries(model) || vertices->loaded_count == 0)
        return;
    for (int v = 0; v < vertices->loadable_count; v++) {
        const double *load = vertices->load[v];
        if (load[0] != 0.0 || load[1] != 0.0 || load[2] != 0.0)
            cut_carry_rows(model->cuts->carry, NULL, v);
    }
}

static void voxel_measure(const void *self, BodyMeasure *measure)
{
    const VoxelModel *model = self;
    VoxelPass pass = voxel_pass(model, vertices_row(&model->vertices));
    if (model->batches->relaxation != NULL)
        relaxation_measure(model->batches->relaxation, &pass.relaxation);
    *measure = (BodyMeasure){
        .elastic = batch_runs_energy(model->batches, &pass),
        .refused = model->cuts != NULL ? model->cuts->refused : 0,
    };
    find_loaded(model);
    vertices_measure(&model->vertices, measure);
    if (model->cuts != NULL && model->cuts->tension != NULL)
        measure->outer += cut_tension_energy(model->cuts->tension, pass.rows, pass.stiffness_scale);
}

static void voxel_restored(Body *body)
{
    VoxelModel *model = body->model;
    vertices_restored(&model->vertices);
    if (model->cuts != NULL)
        cut_body_restored(model->cuts, body);
}

static void voxel_explain(const void *self, FILE *out)
{
    const VoxelModel *model = self;
    vertices_explain(&model->vertices, LANES, model->element_at_level, VOXEL_LEVELS_MAX + 1, out);
    fprintf(out, "    batches: %d of plain cubes, %d with hanging vertices\n",
            batch_runs_count(model->batches, BATCH_PLAIN),
            batch_runs_count(model->batches, BATCH_HANGING));
    fprintf(out, "    law: %s\n", model->law == VOXEL_AFFINE ? "affine" : "miyazaki2004");
    if (model->stiffening != NULL)
        fprintf(out, "    stiffening: in the kernel\n");
    if (model->batches->relaxation != NULL)
        fprintf(out, "    relaxation: in the kernel, %d branches\n",
                model->batches->relaxation->count);
    if (model->fitted != NULL)
        fprintf(out, "    surface: fitted, from %d vertices and %d cells\n",
                model->fitted->fit.row_count, model->fitted->fit.cell_count);
    if (model->cuts != NULL)
        cut_body_explain(model->cuts, out);
}

static const char *voxel_isa(const void *self)
{
    const VoxelModel *model = self;
    return model->batches->kernels->level;
}

#define OPERATIONS                                                                                 \
    .model = "voxel", .drift = vertices_drift, .evaluate = voxel_evaluate, .commit = voxel_commit, \
    .abandon = voxel_abandon, .check = voxel_check, .restore = voxel_restore,                      \
    .read_nodes = voxel_read_nodes, .bound_motion = vertices_bound_motion,                         \
    .fit_node = voxel_fit_node, .add_forces = voxel_add_forces, .kick_nodes = voxel_kick_nodes,    \
    .find_nodes = voxel_find_nodes, .add_load = vertices_add_load,                                 \
    .clear_loads = vertices_clear_loads, .snapshot = voxel_snapshot,                               \
    .snapshot_rows = voxel_snapshot_rows, .snapshot_rest = voxel_snapshot_rest,                    \
    .read_state = vertices_read_state, .measure = voxel_measure, .is_fixed = voxel_is_fixed,       \
    .gather_patch = voxel_gather_patch, .set = voxel_set, .get = voxel_get,                        \
    .estimate = voxel_estimate, .snapshot_error = voxel_snapshot_error,                            \
    .snapshot_elements = voxel_snapshot_elements, .restored = voxel_restored,                      \
    .explain = voxel_explain, .isa = voxel_isa
#define OPERATIONS_OF_CUTTABLE                                                                     \
    OPERATIONS, .cut = cut_body_cut, .remove = cut_body_remove,                                    \
                .reconstruct = cut_body_reconstruct, .reserve_blades = cut_body_reserve_blades,    \
                .account = cut_body_account, .sections = cut_body_sections,                        \
                .visit = cut_body_visit
#define TEARS  .tear = cut_body_tear
#define HEATS  .conduct = cut_body_conduct, .snapshot_coagulated = voxel_snapshot_coagulated
#define ADAPTS .adapt = cut_body_adapt, .approach = cut_body_approach

// The pipeline has stages for operations that a body has.
const BodyOps voxel_ops[2] = {{OPERATIONS}, {OPERATIONS, ADAPTS}};
const BodyOps voxel_ops_of_cuttable[2][2][2] = {
    {{{OPERATIONS_OF_CUTTABLE}, {OPERATIONS_OF_CUTTABLE, HEATS}},
     {{OPERATIONS_OF_CUTTABLE, TEARS}, {OPERATIONS_OF_CUTTABLE, TEARS, HEATS}}},
    {{{OPERATIONS_OF_CUTTABLE, ADAPTS}, {OPERATIONS_OF_CUTTABLE, ADAPTS, HEATS}},
     {{OPERATIONS_OF_CUTTABLE, ADAPTS, TEARS}, {OPERATIONS_OF_CUTTABLE, ADAPTS, TEARS, HEATS}}},
};
