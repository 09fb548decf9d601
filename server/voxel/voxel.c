// What the pipeline asks of a voxel body (dynamics/body.h). Step thread: no allocation, no lock.
#include "voxel/model.h"

#include "voxel/skin.h"

#include <string.h>

// ---------------------------------------------------------------------------------------------
// A tick

static void voxel_drift(void *self, double dt)
{
    VoxelModel *model = self;
    void *next = model->row[1 - model->current];
    model->kernels->drift(model->present, next, model->vertex_count + 1, dt);
    model->present = next;
}

static void add_force(VoxelModel *model, int vertex, Vec3 force)
{
    Vec3 f = rows_turn_in(&model->rows, force);
    const double part[3] = {f.x, f.y, f.z};
    for (int c = 0; c < 3; c++) {
        long at = 4L * vertex + c;
        rows_put(&model->rows, model->force, at,
                 rows_get(&model->rows, model->force, at) + part[c]);
    }
}

static void add_loads(VoxelModel *model)
{
    if (model->loaded_count < 0)
        voxel_list_loads(model);
    for (int k = 0; k < model->loaded_count; k++) {
        const double *load = model->load[model->loaded[k]];
        add_force(model, model->loaded[k], (Vec3){load[0], load[1], load[2]});
    }
}

static VoxelPass make_pass(const VoxelModel *model, const void *rows)
{
    return (VoxelPass){
        .plain = &model->batches.plain,
        .hanging = &model->batches.hanging,
        .tables = model->tables,
        .classes = model->batches.classes,
        .law = model->law,
        .damped = model->damped,
        .rows = rows,
        .force = model->force,
        .last = model->last,
        .stiffness_scale = model->parameters->stiffness_scale,
        .damping_scale = model->parameters->damping_scale,
    };
}

// Forces of all elements, then the vertices move. The first kick of a tick writes the rows that are
// not current, so that the state before the tick stays whole until commit; later ones stay there.
static void voxel_evaluate(void *self, const Stage *stage, double h)
{
    VoxelModel *model = self;
    const VoxelParameters *p = model->parameters;
    Vec3 gravity = {p->gravity[0], p->gravity[1], p->gravity[2]};
    gravity = rows_turn_in(&model->rows, gravity);
    add_loads(model);
    const VoxelPass pass = make_pass(model, model->present);
    model->kernels->evaluate(&pass);
    void *next = model->row[1 - model->current];
    const AdvancePass advance = {
        .present = model->present,
        .next = next,
        .force = model->force,
        .inverse_mass = model->inverse_mass,
        .vertex_count = model->vertex_count + 1,
        .h = h,
        .advance = stage->advance,
        .gravity = {gravity.x, gravity.y, gravity.z},
        .position_limit = model->position_limit,
        .check = stage->last, // what went bad earlier in the tick is still bad
    };
    model->bad |= !model->kernels->advance(&advance);
    model->present = next;
}

static bool voxel_commit(void *self)
{
    VoxelModel *model = self;
    bool good = !model->bad;
    model->bad = false;
    if (good) {
        model->current = 1 - model->current;
        if (model->rows.floating)
            rows_follow(&model->rows, model->row[model->current]);
    }
    model->present = model->row[model->current];
    return good;
}

static bool voxel_check(const void *self)
{
    const VoxelModel *model = self;
    for (int b = 0; b < batches_total(&model->batches); b++)
        for (int lane = 0; lane < LANES; lane++) {
            const double *q = model->last[b][lane];
            if (!(fabs(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] - 1.0) < 1e-3))
                return false;
        }
    return rows_are_sound(&model->rows, model->row[model->current], model->position_limit);
}

void voxel_forget_rotations(VoxelModel *model)
{
    for (int b = 0; b < batches_total(&model->batches); b++)
        for (int lane = 0; lane < LANES; lane++)
            memcpy(model->last[b][lane], (const double[4]){1.0, 0.0, 0.0, 0.0},
                   sizeof model->last[b][lane]);
}

static void voxel_restore(void *self, bool to_start)
{
    VoxelModel *model = self;
    void *rows = model->row[model->current];
    if (to_start) {
        rows_return_to_rest(&model->rows, rows);
        voxel_forget_rotations(model);
    }
    for (long i = 0; i <= model->vertex_count; i++)
        for (int c = 4; c < 7; c++)
            rows_put(&model->rows, rows, i * ROW + c, 0.0);
    model->present = rows;
}

// ---------------------------------------------------------------------------------------------
// Nodes: the vertices of the outer faces

static void voxel_read_nodes(const void *self, const int *node, int count, Vec3 *position,
                             Vec3 *velocity)
{
    const VoxelModel *model = self;
    for (int i = 0; i < count; i++)
        rows_read(&model->rows, model->present, node[i], &position[i],
                  velocity == NULL ? NULL : &velocity[i]);
}

static void voxel_add_forces(void *self, const int *node, int count, const Vec3 *force)
{
    for (int i = 0; i < count; i++)
        add_force(self, node[i], force[i]);
}

static void voxel_reserve_forces(void *self, const char *name, int count, Arena *arena)
{
    (void)self, (void)name, (void)count, (void)arena; // they go where the elements' forces go
}

// The region is brought to the rows' coordinates, not every vertex to the world.
static int voxel_find_nodes(const void *self, const Region *region, int *node, int capacity)
{
    const VoxelModel *model = self;
    const Region here = rows_region(&model->rows, region);
    const RegionTest test = region_test(&here);
    int found = 0;
    for (int i = 0; i < model->surface_count; i++)
        if (region_contains(&test, rows_local(&model->rows, model->present, i))) {
            if (found < capacity)
                node[found] = i;
            found++;
        }
    return found;
}

void voxel_list_loads(VoxelModel *model)
{
    model->loaded_count = 0;
    for (int i = 0; model->load != NULL && i < model->surface_count; i++)
        if (model->load[i][0] != 0.0 || model->load[i][1] != 0.0 || model->load[i][2] != 0.0)
            model->loaded[model->loaded_count++] = i;
}

static void voxel_add_load(void *self, int node, Vec3 force)
{
    VoxelModel *model = self;
    model->load[node][0] += force.x;
    model->load[node][1] += force.y;
    model->load[node][2] += force.z;
    model->loaded_count = -1; // listed once all have been added
}

static void voxel_clear_loads(void *self)
{
    VoxelModel *model = self;
    if (model->load != NULL)
        memset(model->load, 0, (size_t)model->surface_count * sizeof *model->load);
    model->loaded_count = 0;
}

static bool voxel_is_fixed(const void *self, int node)
{
    const VoxelModel *model = self;
    return rows_get(&model->rows, model->inverse_mass, node) == 0.0;
}

// ---------------------------------------------------------------------------------------------
// Out

static void voxel_snapshot(const void *self, float *position, float *velocity)
{
    const VoxelModel *model = self;
    const void *rows = model->row[model->current];
    if (model->skin != NULL)
        skin_snapshot(model->skin, &model->rows, rows, position, velocity);
    else
        rows_snapshot(&model->rows, rows, model->node, model->node_count, position, velocity);
}

int voxel_read_state(const void *self, int *id, Vec3 *position, Vec3 *velocity)
{
    const VoxelModel *model = self;
    for (int i = 0; i < model->vertex_count; i++) {
        if (id != NULL)
            id[i] = model->id[i];
        rows_read(&model->rows, model->row[model->current], i, &position[i], &velocity[i]);
    }
    return model->vertex_count;
}

static void voxel_measure(const void *self, BodyMeasure *measure)
{
    const VoxelModel *model = self;
    const Rows *rows = &model->rows;
    const void *row = model->row[model->current];
    const VoxelPass pass = make_pass(model, row);
    double kinetic = 0.0, farthest = 0.0;
    for (int i = 0; i < model->vertex_count; i++) {
        Vec3 u = rows_vector(rows, row, i, 0), v = rows_vector(rows, row, i, 4);
        if (rows->floating) { // u is small whatever the body's way
            Vec3 x;
            rows_read(rows, row, i, &x, NULL);
            u = vec3_sub(x, rows_rest(rows, i));
        }
        kinetic += 0.5 * model->mass[i] * vec3_dot(v, v);
        farthest = fmax(farthest, vec3_dot(u, u));
    }
    *measure = (BodyMeasure){
        .kinetic = kinetic,
        .elastic = model->kernels->energy(&pass),
        .max_displacement = sqrt(farthest),
    };
}

static bool voxel_set(void *self, BodyParameter parameter, double value)
{
    VoxelModel *model = self;
    VoxelParameters *p = model->parameters;
    switch (parameter) {
    case BODY_GRAVITY_X:
    case BODY_GRAVITY_Y:
    case BODY_GRAVITY_Z:
        p->gravity[parameter - BODY_GRAVITY_X] = value;
        return true;
    case BODY_STIFFNESS_SCALE:
        p->stiffness_scale = value;
        return true;
    case BODY_DAMPING_SCALE:
        if (!model->damped)
            return false; // its kernel has no damping to scale
        p->damping_scale = value;
        return true;
    case BODY_ADAPT_FORCE:
    case BODY_ADAPT_SPEED:
    case BODY_ADAPT_CURVATURE:
    case BODY_ADAPT_SCALE:
    case BODY_ADAPT_LEVEL:
        return false; // its elements stay as they are
    }
    return false;
}

static void voxel_restored(Body *body)
{
    voxel_list_loads(body->model);
}

static void voxel_explain(const void *self, FILE *out)
{
    const VoxelModel *model = self;
    const Batches *batches = &model->batches;
    fprintf(out, "    kernel: %s, %s, %d lanes a batch, %d vertices, %d elements (",
            model->rows.precision == PRECISION_SINGLE ? "single" : "double", model->kernels->level,
            LANES, model->vertex_count, model->element_count);
    int coarsest = VOXEL_LEVELS_MAX;
    while (coarsest > 0 && model->element_at_level[coarsest] == 0)
        coarsest--;
    for (int level = 0; level <= coarsest; level++)
        fprintf(out, "%s%d", level > 0 ? " + " : "", model->element_at_level[level]);
    fprintf(out, " by level)\n");
    fprintf(out, "    plain cubes: %d batches; with hanging vertices: %d batches of %d templates\n",
            batches->plain.batch_count, batches->hanging.batch_count, batches->template_count);
    fprintf(out, "    law: %s\n", model->law == VOXEL_AFFINE ? "affine" : "miyazaki2004");
    fprintf(out, "    damping: %s\n",
            model->damped ? "in the kernel" : "left out (material.damping)");
    fprintf(out, "    base frame: %s\n", model->rows.floating ? "follows the body" : "still");
}

static const char *voxel_isa(const void *self)
{
    const VoxelModel *model = self;
    return model->kernels->level;
}

const BodyOps voxel_ops = {
    .model = "voxel",
    .drift = voxel_drift,
    .evaluate = voxel_evaluate,
    .commit = voxel_commit,
    .check = voxel_check,
    .restore = voxel_restore,
    .read_nodes = voxel_read_nodes,
    .reserve_forces = voxel_reserve_forces,
    .add_forces = voxel_add_forces,
    .find_nodes = voxel_find_nodes,
    .add_load = voxel_add_load,
    .clear_loads = voxel_clear_loads,
    .snapshot = voxel_snapshot,
    .read_state = voxel_read_state,
    .measure = voxel_measure,
    .is_fixed = voxel_is_fixed,
    .set = voxel_set,
    .restored = voxel_restored,
    .explain = voxel_explain,
    .isa = voxel_isa,
};
