// The operations of a voxel body that can be cut (dynamics/body.h). Step thread: no allocation, no
// lock.
#include "voxel/cut/cut_body.h"

// ---------------------------------------------------------------------------------------------
// A tick

static void body_drift(void *self, double dt)
{
    CutModel *model = self;
    vertices_drift(&model->vertices, dt);
}

static VoxelPass make_pass(const CutModel *model, const void *rows)
{
    return (VoxelPass){
        .law = model->law,
        .damped = model->vertices.damped,
        .rows = rows,
        .force = model->vertices.force,
        .stiffness_scale = model->vertices.parameters->stiffness_scale,
        .damping_scale = model->vertices.parameters->damping_scale,
    };
}

// A pass whose halves run on two threads, each with forces of its own.
typedef struct SharedPass {
    const CutModel *model;
    const VoxelPass *pass;
} SharedPass;

static void evaluate_halves(void *context, int first, int last)
{
    const SharedPass *shared = context;
    const CutModel *model = shared->model;
    for (int half = first; half < last; half++) {
        VoxelPass pass = *shared->pass;
        pass.force = half == 0 ? model->vertices.force : model->vertices.more;
        batch_runs_evaluate(&model->windows.runs, &pass, half);
    }
}

static void evaluate_all(const CutModel *model, const VoxelPass *pass)
{
    SharedPass shared = {model, pass};
    if (!model->vertices.halved)
        batch_runs_evaluate(&model->windows.runs, pass, BATCHES_ALL);
    else if (model->vertices.team == NULL)
        evaluate_halves(&shared, 0, 2);
    else
        team_run(model->vertices.team, evaluate_halves, &shared, 2);
}

static void body_evaluate(void *self, const Stage *stage, double h)
{
    CutModel *model = self;
    Vertices *vertices = &model->vertices;
    const double *g = vertices->parameters->gravity;
    vertices_begin(vertices);
    if (model->tear.felt != NULL)
        cut_tear_feel(&model->tear);
    const VoxelPass pass = make_pass(model, vertices->present);
    evaluate_all(model, &pass);
    vertices_advance(vertices, stage, h, (Vec3){g[0], g[1], g[2]});
}

static void body_abandon(void *self)
{
    CutModel *model = self;
    vertices_abandon(&model->vertices);
}

static bool body_commit(void *self)
{
    CutModel *model = self;
    return vertices_commit(&model->vertices);
}

static bool body_check(const void *self)
{
    const CutModel *model = self;
    return model->sound && batch_runs_check(&model->windows.runs) &&
           vertices_check(&model->vertices);
}

// Cuts stay: broken bits are no numbers that a reset restores.
static void body_restore(void *self, RestoreMode mode)
{
    CutModel *model = self;
    vertices_restore(&model->vertices, mode);
    if (model->tear.felt != NULL)
        cut_tear_forget(&model->tear);
    if (mode != RESTORE_SHAPE)
        return;
    batch_runs_forget_rotations(&model->windows.runs);
    cut_blades_forget(&model->blades);
}

// ---------------------------------------------------------------------------------------------
// Changes of topology

// Updates all data derived from elements and vertices, in the order of their dependencies.
static bool follow(CutModel *model, Body *body, bool divided, bool pieces_came,
                   TopologyChange *change)
{
    cut_masses_follow(&model->masses, divided);
    cut_windows_update(&model->windows);
    bool shown = cut_faces_follow(&model->faces, pieces_came, body, change);
    body->element_count = model->lattice.leaf_count;
    cut_lattice_forget_changes(&model->lattice);
    return shown;
}

static bool has_room(CutModel *model, CutOutcome *outcome, int faces)
{
    const CutLattice *lattice = &model->lattice;
    if (!cut_lattice_has_room(lattice, faces)) {
        outcome->verdict = CUT_NO_NODES;
        outcome->needed = 4 * faces;
        outcome->room = lattice->vertex_capacity - cut_lattice_used(lattice);
        return false;
    }
    if (!cut_faces_has_room(&model->faces, faces, &outcome->needed, &outcome->room)) {
        outcome->verdict = CUT_NO_FACES;
        return false;
    }
    return true;
}

// Breaks faces {cell, axis}, if the capacity is sufficient.
static bool break_faces(CutModel *model, Body *body, const int (*face)[2], int count,
                        CutOutcome *outcome, TopologyChange *change)
{
    const int before = cut_lattice_used(&model->lattice);
    cut_lattice_break(&model->lattice, face, count);
    const bool pieces_came = cut_pieces_follow(&model->pieces, face, count);
    const bool changed = follow(model, body, false, pieces_came, change);
    outcome->verdict = CUT_DONE;
    outcome->separated = count;
    outcome->nodes_added = cut_lattice_used(&model->lattice) - before;
    outcome->pieces = (int)*model->pieces.count;
    outcome->small_pieces = model->pieces.small_count;
    return changed;
}

static bool body_cut(Body *body, const CutSweep *sweep, CutOutcome *outcome, TopologyChange *change)
{
    CutModel *model = body->model;
    const void *row = vertices_row(&model->vertices);
    const double tick = body->h * body->substeps;
    if (!cut_blades_find(&model->blades, row, tick, sweep, outcome))
        return false;
    if (!has_room(model, outcome, model->blades.hit_count)) {
        outcome->separated = 0;
        cut_blades_refused(&model->blades, row, sweep);
        return false;
    }
    return break_faces(model, body, (const int(*)[2])model->blades.hit, model->blades.hit_count,
                       outcome, change);
}

static bool body_tear(Body *body, double tick, CutOutcome *outcome, TopologyChange *change)
{
    (void)tick;
    CutModel *model = body->model;
    const VoxelPass pass = make_pass(model, vertices_row(&model->vertices));
    *outcome = (CutOutcome){.verdict = CUT_MET_NOTHING};
    if (!cut_tear_find(&model->tear, &pass) || !has_room(model, outcome, model->tear.hit_count))
        return false;
    return break_faces(model, body, (const int(*)[2])model->tear.hit, model->tear.hit_count,
                       outcome, change);
}

static bool body_reconstruct(Body *body, TopologyChange *change)
{
    CutModel *model = body->model;
    if (model->lattice.wanted_count == 0)
        return false;
    if (cut_lattice_reconstruct(&model->lattice) == 0) {
        model->refused++;
        return false;
    }
    return follow(model, body, true, false, change);
}

static void body_reserve_blades(void *self, int blades, Arena *arena, StateList *state)
{
    CutModel *model = self;
    cut_blades_reserve(&model->blades, model->name, blades, arena, state);
}

bool cut_body_derive(CutModel *model, Body *body)
{
    if (!cut_lattice_derive(&model->lattice))
        return false;
    cut_masses_derive(&model->masses);
    cut_windows_restored(&model->windows);
    const bool pieces = cut_pieces_derive(&model->pieces);
    const bool faces = cut_faces_derive(&model->faces, body);
    body->element_count = model->lattice.leaf_count;
    return pieces && faces;
}

static void body_restored(Body *body)
{
    CutModel *model = body->model;
    vertices_restored(&model->vertices);
    model->sound = cut_body_derive(model, body);
    cut_blades_restored(&model->blades);
}

// ---------------------------------------------------------------------------------------------
// Nodes: the vertices

static void body_read_nodes(const void *self, const int *node, int count, Vec3 *position,
                            Vec3 *velocity)
{
    const CutModel *model = self;
    vertices_read_nodes(&model->vertices, node, count, position, velocity);
}

static void body_add_forces(void *self, const int *node, int count, const Vec3 *force)
{
    CutModel *model = self;
    vertices_add_forces(&model->vertices, node, count, force);
}

static int body_find_nodes(const void *self, const Region *region, int *node, int capacity)
{
    const CutModel *model = self;
    return cut_faces_find_nodes(&model->faces, region, node, capacity);
}

static void body_add_load(void *self, int node, Vec3 force)
{
    CutModel *model = self;
    vertices_add_load(&model->vertices, node, force);
}

static void body_clear_loads(void *self)
{
    CutModel *model = self;
    vertices_clear_loads(&model->vertices);
}

static bool body_is_fixed(const void *self, int node)
{
    const CutModel *model = self;
    return vertices_is_fixed(&model->vertices, node);
}

// ---------------------------------------------------------------------------------------------
// Out

static void body_snapshot(const void *self, float *position, float *velocity)
{
    const CutModel *model = self;
    rows_snapshot(&model->vertices.rows, vertices_row(&model->vertices), model->faces.slot_vertex,
                  (int)*model->faces.slot_count, position, velocity);
}

static void body_snapshot_rest(const void *self, float *position)
{
    const CutModel *model = self;
    rows_snapshot_rest(&model->vertices.rows, model->faces.slot_vertex,
                       (int)*model->faces.slot_count, position);
}

static int body_read_state(const void *self, int *id, Vec3 *position, Vec3 *velocity)
{
    const CutModel *model = self;
    return vertices_read_state(&model->vertices, id, position, velocity);
}

static void body_measure(const void *self, BodyMeasure *measure)
{
    const CutModel *model = self;
    const VoxelPass pass = make_pass(model, vertices_row(&model->vertices));
    *measure = (BodyMeasure){
        .elastic = batch_runs_energy(&model->windows.runs, &pass),
        .refused = model->refused,
    };
    vertices_measure(&model->vertices, measure);
}

static bool body_set(void *self, BodyParameter parameter, double value)
{
    CutModel *model = self;
    return vertices_set(&model->vertices, parameter, value);
}

static void body_explain(const void *self, FILE *out)
{
    const CutModel *model = self;
    vertices_explain(&model->vertices, LANES, model->lattice.leaf_at_level, out);
    fprintf(out, "    batches by window: %d of plain cubes, %d with hanging vertices\n",
            batch_runs_count(&model->windows.runs, BATCH_PLAIN),
            batch_runs_count(&model->windows.runs, BATCH_HANGING));
    fprintf(out, "    law: %s\n", model->law == VOXEL_AFFINE ? "affine" : "miyazaki2004");
    fprintf(out, "    cuttable: room for %d vertices, %d triangles; %d divisions a tick\n",
            model->lattice.vertex_capacity, 2 * model->faces.square_capacity,
            model->lattice.split_budget);
    if (model->tear.stress > 0.0)
        fprintf(out, "    tears: where it is pulled with more than %g Pa\n", model->tear.stress);
    if (model->tear.force > 0.0)
        fprintf(out, "    tears: at vertices pushed or pulled with more than %g N\n",
                model->tear.force);
}

static const char *body_isa(const void *self)
{
    const CutModel *model = self;
    return model->windows.runs.kernels->level;
}

#define OPERATIONS                                                                                 \
    .model = "voxel", .cut = body_cut, .reconstruct = body_reconstruct, .drift = body_drift,       \
    .evaluate = body_evaluate, .commit = body_commit, .abandon = body_abandon,                     \
    .check = body_check, .restore = body_restore, .read_nodes = body_read_nodes,                   \
    .reserve_blades = body_reserve_blades, .add_forces = body_add_forces,                          \
    .find_nodes = body_find_nodes, .add_load = body_add_load, .clear_loads = body_clear_loads,     \
    .snapshot = body_snapshot, .snapshot_rest = body_snapshot_rest, .read_state = body_read_state, \
    .measure = body_measure, .is_fixed = body_is_fixed, .gather_patch = cut_body_gather_patch,     \
    .set = body_set, .restored = body_restored, .explain = body_explain, .isa = body_isa

const BodyOps cut_body_ops = {OPERATIONS};
const BodyOps cut_body_ops_tearing = {OPERATIONS, .tear = body_tear};
