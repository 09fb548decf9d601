// What the pipeline asks of a surface body (dynamics/body.h). Step thread: no allocation, no lock.
#include "surface/model.h"

#include <string.h>

// ---------------------------------------------------------------------------------------------
// A tick

static void fill_pass(const SurfaceModel *model, SpringPass *pass)
{
    const SurfaceParameters *p = model->parameters;
    *pass = (SpringPass){
        .springs = &model->springs,
        .nodes = &model->nodes,
        .external = model->external,
        .damping_time = model->damping_time * p->damping_scale,
        .stiffness_scale = p->stiffness_scale,
        .gravity = {p->gravity[0], p->gravity[1], p->gravity[2]},
        .position_limit = model->position_limit,
    };
}

static void surface_drift(void *self, double dt)
{
    SurfaceModel *model = self;
    const double *from = model->rows[model->current];
    double *to = model->stage[0];
    for (long s = 0; s < model->slot_count; s++) {
        const double *row = from + s * ROW;
        double *next = to + s * ROW;
        for (int c = 0; c < 4; c++) {
            next[c] = row[c] + dt * row[4 + c];
            next[4 + c] = row[4 + c];
        }
    }
    model->present = to;
    model->next_stage = 1;
}

// Takes the contact forces of one evaluation back, leaving the constant loads as they were.
static void clear_touched(SurfaceModel *model)
{
    for (int k = model->touched_count - 1; k >= 0; k--) {
        const TouchedSlot *touched = &model->touched[k];
        double *external = model->external + (touched->slot / LANES) * 3L * LANES;
        for (int c = 0; c < 3; c++)
            external[c * LANES + touched->slot % LANES] = touched->load[c];
        model->is_touched[touched->slot] = false;
    }
    model->touched_count = 0;
}

static void surface_evaluate(void *self, const Stage *stage, double h)
{
    SurfaceModel *model = self;
    SpringPass pass;
    fill_pass(model, &pass);
    pass.stage = *stage;
    pass.h = h;
    pass.bad = &model->bad;

    // Which rows are read and written: the tick's result goes to the rows that are not current, so
    // that the state before the tick stays whole until commit.
    double *result = model->rows[1 - model->current];
    if (stage->rule == STAGE_RK4_FIRST) {
        model->base = model->present;
        model->next_stage = 0;
    }
    bool ends = stage->rule == STAGE_RK4_LAST || (stage->rule == STAGE_KICK && stage->last);
    pass.present = model->present;
    pass.base = model->base;
    pass.sum = model->sum;
    pass.next = ends ? result : model->stage[model->next_stage];
    if (model->rigid != NULL) {
        rigid_frame_fit(model->rigid, pass.present);
        pass.frame = &model->rigid->pose;
    }

    bool external = *model->loaded != 0 || model->touched_count > 0;
    model->kernels->evaluate[model->damped][model->shape][external](&pass);
    clear_touched(model);
    model->present = pass.next;
    model->next_stage = 1 - model->next_stage;
}

static bool surface_commit(void *self)
{
    SurfaceModel *model = self;
    bool good = !model->bad;
    model->bad = false;
    if (good)
        model->current = 1 - model->current;
    model->present = model->rows[model->current];
    return good;
}

static bool surface_check(const void *self)
{
    const SurfaceModel *model = self;
    const double *rows = model->rows[model->current];
    for (long s = 0; s < model->slot_count; s++)
        for (int c = 0; c < 3; c++)
            if (!(fabs(rows[s * ROW + c]) <= model->position_limit) ||
                !(fabs(rows[s * ROW + 4 + c]) <= SPEED_LIMIT))
                return false;
    return true;
}

static void surface_restore(void *self, bool to_start)
{
    SurfaceModel *model = self;
    double *rows = model->rows[model->current];
    for (long s = 0; s < model->slot_count; s++) {
        double *row = rows + s * ROW;
        row[4] = row[5] = row[6] = 0.0;
        if (to_start)
            for (int c = 0; c < 3; c++)
                row[c] = model->nodes.rest[(s / LANES * 3 + c) * LANES + s % LANES];
    }
    model->present = rows;
}

// ---------------------------------------------------------------------------------------------
// Nodes

static void surface_read_nodes(const void *self, const int *node, int count, Vec3 *position,
                               Vec3 *velocity)
{
    const SurfaceModel *model = self;
    for (int i = 0; i < count; i++) {
        const double *row = model->present + (long)model->slot[node[i]] * ROW;
        position[i] = (Vec3){row[0], row[1], row[2]};
        if (velocity != NULL)
            velocity[i] = (Vec3){row[4], row[5], row[6]};
    }
}

static void surface_add_forces(void *self, const int *node, int count, const Vec3 *force)
{
    SurfaceModel *model = self;
    for (int i = 0; i < count; i++) {
        int slot = model->slot[node[i]];
        double *external = model->external + (slot / LANES) * 3L * LANES + slot % LANES;
        if (!model->is_touched[slot]) {
            model->is_touched[slot] = true;
            model->touched[model->touched_count++] =
                (TouchedSlot){slot, {external[0], external[LANES], external[2 * LANES]}};
        }
        external[0] += force[i].x;
        external[LANES] += force[i].y;
        external[2 * LANES] += force[i].z;
    }
}

static int surface_find_nodes(const void *self, const Region *region, int *node, int capacity)
{
    const SurfaceModel *model = self;
    const Vec3 axis = vec3_sub(region->to, region->from);
    const double square = vec3_dot(axis, axis), radius2 = region->radius * region->radius;
    const bool plane = region->kind == REGION_BELOW_PLANE;
    int found = 0;
    for (int s = 0; s < model->slot_count; s++) {
        if (model->node[s] < 0)
            continue;
        const double *row = model->present + (long)s * ROW;
        Vec3 d = {row[0] - region->from.x, row[1] - region->from.y, row[2] - region->from.z};
        bool inside;
        if (plane) {
            inside = vec3_dot(d, region->to) < region->radius;
        } else {
            double t = square > 0.0 ? vec3_dot(d, axis) / square : 0.0;
            t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
            d = vec3_madd(d, -t, axis);
            inside = vec3_dot(d, d) <= radius2;
        }
        if (inside) {
            if (found < capacity)
                node[found] = model->node[s];
            found++;
        }
    }
    return found;
}

static void surface_add_load(void *self, int node, Vec3 force)
{
    SurfaceModel *model = self;
    int slot = model->slot[node];
    double *external = model->external + (slot / LANES) * 3L * LANES + slot % LANES;
    external[0] += force.x;
    external[LANES] += force.y;
    external[2 * LANES] += force.z;
    *model->loaded = 1;
}

static void surface_clear_loads(void *self)
{
    SurfaceModel *model = self;
    if (*model->loaded != 0)
        memset(model->external, 0, (size_t)model->slot_count * 3 * sizeof *model->external);
    *model->loaded = 0;
}

// ---------------------------------------------------------------------------------------------
// Out

static void surface_snapshot(const void *self, float *position, float *velocity)
{
    const SurfaceModel *model = self;
    const double *rows = model->rows[model->current];
    for (long i = 0; i < model->node_count; i++) {
        const double *row = rows + (long)model->slot[i] * ROW;
        for (int c = 0; c < 3; c++) {
            position[3 * i + c] = (float)row[c];
            if (velocity != NULL)
                velocity[3 * i + c] = (float)row[4 + c];
        }
    }
}

static void surface_measure(const void *self, BodyMeasure *measure)
{
    const SurfaceModel *model = self;
    const double *rows = model->rows[model->current];
    const SpringTable *springs = &model->springs;
    double kinetic = 0.0, elastic = 0.0, shape = 0.0, farthest = 0.0;
    for (int s = 0; s < model->slot_count; s++) {
        if (model->node[s] < 0)
            continue;
        const double *row = rows + (long)s * ROW;
        const long chunk = s / LANES, lane = s % LANES;
        kinetic += 0.5 * model->mass[model->node[s]] *
                   (row[4] * row[4] + row[5] * row[5] + row[6] * row[6]);
        for (int e = springs->start[chunk]; e < springs->start[chunk + 1]; e++) {
            long at = (long)e * LANES + lane;
            const double *other = rows + (long)springs->neighbour[at] * ROW;
            double d[3] = {row[0] - other[0], row[1] - other[1], row[2] - other[2]};
            double stretch =
                sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) - springs->rest_length[at];
            elastic += 0.25 * springs->stiffness[at] * stretch * stretch; // half at each end
        }
        double away = 0.0;
        for (int c = 0; c < 3; c++) {
            double u = row[c] - model->nodes.rest[(chunk * 3 + c) * LANES + lane];
            away += u * u;
        }
        farthest = fmax(farthest, away);
        if (model->shape == SHAPE_FRAME_WORLD)
            shape += 0.5 * model->nodes.shape_rate[s] * model->mass[model->node[s]] * away;
    }
    if (model->rigid != NULL)
        shape = rigid_frame_energy(model->rigid, rows);
    measure->kinetic = kinetic;
    measure->elastic = model->parameters->stiffness_scale * elastic + shape;
    measure->max_displacement = sqrt(farthest);
}

static bool surface_is_fixed(const void *self, int node)
{
    const SurfaceModel *model = self;
    return model->nodes.inverse_mass[model->slot[node]] == 0.0;
}

static bool surface_set(void *self, BodyParameter parameter, double value)
{
    SurfaceModel *model = self;
    SurfaceParameters *p = model->parameters;
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
    }
    return false;
}

static void surface_explain(const void *self, FILE *out)
{
    static const char *const shapes[] = {"none", "virtual nodes fixed in the world",
                                         "virtual nodes on a best-fit rigid frame"};
    const SurfaceModel *model = self;
    fprintf(out, "    kernel: double, %s, %d lanes a chunk, %d nodes, %d springs\n",
            model->kernels->level, LANES, model->node_count, model->edge_count);
    fprintf(out, "    spring damping: %s\n",
            model->damped ? "in the kernel" : "left out (material.damping_time, spring_damping)");
    fprintf(out, "    shape-preserving springs: %s%s\n", shapes[model->shape],
            model->shape == SHAPE_FRAME_NONE ? " (shape)" : "");
    fprintf(out, "    outside forces: read only while a load or a tool acts\n");
}

static void surface_read_rows(const void *self, Vec3 *position, Vec3 *velocity)
{
    const SurfaceModel *model = self;
    const double *rows = model->rows[model->current];
    for (int i = 0; i < model->node_count; i++) {
        const double *row = rows + (long)model->slot[i] * ROW;
        position[i] = (Vec3){row[0], row[1], row[2]};
        velocity[i] = (Vec3){row[4], row[5], row[6]};
    }
}

static const char *surface_level(const void *self)
{
    const SurfaceModel *model = self;
    return model->kernels->level;
}

const BodyOps surface_ops = {
    .model = "surface",
    .drift = surface_drift,
    .evaluate = surface_evaluate,
    .commit = surface_commit,
    .check = surface_check,
    .restore = surface_restore,
    .read_nodes = surface_read_nodes,
    .add_forces = surface_add_forces,
    .find_nodes = surface_find_nodes,
    .add_load = surface_add_load,
    .clear_loads = surface_clear_loads,
    .snapshot = surface_snapshot,
    .read_state = surface_read_rows,
    .measure = surface_measure,
    .is_fixed = surface_is_fixed,
    .set = surface_set,
    .explain = surface_explain,
    .isa = surface_level,
};

void surface_read_state(const Body *body, Vec3 *position, Vec3 *velocity)
{
    surface_read_rows(body->model, position, velocity);
}
