// What the pipeline asks of a plane body (dynamics/body.h). Step thread: no allocation, no lock.
#include "voxel/plane/plane_model.h"

#include <string.h>

enum {
    FOLLOW_TICKS = 16, // ticks between moves of the base frame
    FOLLOW_LEAST = 4,  // at least so many, however fast the body
};

// ---------------------------------------------------------------------------------------------
// A tick

static void plane_drift(void *self, double dt)
{
    PlaneModel *model = self;
    void *next = model->row[1 - model->current];
    model->kernels->drift(model->present, next, model->vertex_count + 1, dt);
    model->present = next;
}

static void add_force(PlaneModel *model, int vertex, double x, double y)
{
    const Rows *rows = &model->rows;
    Vec3 f = rows_turn_in(rows, (Vec3){x, y, 0.0});
    rows_put(rows, model->force, 4L * vertex, rows_get(rows, model->force, 4L * vertex) + f.x);
    rows_put(rows, model->force, 4L * vertex + 1,
             rows_get(rows, model->force, 4L * vertex + 1) + f.y);
}

// Forces of all elements, then the vertices move. The first kick of a tick writes the rows that are
// not current, so that the state before the tick stays whole until commit; later ones stay there.
static void plane_evaluate(void *self, const Stage *stage, double h)
{
    PlaneModel *model = self;
    const PlaneParameters *p = model->parameters;
    for (int k = 0; k < model->loaded_count; k++) {
        int v = model->loaded[k];
        add_force(model, v, model->load[v][0], model->load[v][1]);
    }
    const PlanePass pass = {
        .batches = &model->batches,
        .law = model->law,
        .damped = model->damped,
        .rows = model->present,
        .force = model->force,
        .stiffness_scale = p->stiffness_scale,
        .damping_scale = p->damping_scale,
    };
    model->kernels->evaluate(&pass);
    Vec3 gravity = rows_turn_in(&model->rows, (Vec3){p->gravity[0], p->gravity[1], 0.0});
    void *next = model->row[1 - model->current];
    const PlaneAdvance advance = {
        .present = model->present,
        .next = next,
        .force = model->force,
        .inverse_mass = model->inverse_mass,
        .vertex_count = model->vertex_count + 1,
        .h = h,
        .advance = stage->advance,
        .gravity = {gravity.x, gravity.y},
        .position_limit = model->position_limit,
        .check = stage->last, // what went bad earlier in the tick is still bad
    };
    model->bad |= !model->kernels->advance(&advance);
    model->present = next;
}

// ---------------------------------------------------------------------------------------------
// The base frame of a floating body. rows_follow would do it with a fit in space, which may turn a
// body that is inside out about an axis in its plane.

typedef struct PlaneFit {
    double rest[2], shift[2]; // centre of gravity at rest, and how far it is from there [m]
    double cosine, sine;      // of the turn that fits best by mass
} PlaneFit;

static void fit_plane(const PlaneModel *model, const void *row, PlaneFit *fit)
{
    const Rows *rows = &model->rows;
    double mass = 0.0, p = 0.0, q = 0.0;
    *fit = (PlaneFit){.cosine = 1.0};
    for (int v = 0; v < model->vertex_count; v++) {
        mass += model->mass[v];
        for (int d = 0; d < 2; d++) {
            fit->rest[d] += model->mass[v] * rows->place[v][d];
            fit->shift[d] += model->mass[v] * rows_get(rows, row, (long)v * ROW + d);
        }
    }
    for (int d = 0; d < 2; d++) {
        fit->rest[d] /= mass;
        fit->shift[d] /= mass;
    }
    for (int v = 0; v < model->vertex_count; v++) {
        double x = rows->place[v][0] - fit->rest[0], y = rows->place[v][1] - fit->rest[1];
        double rx = x + rows_get(rows, row, (long)v * ROW) - fit->shift[0];
        double ry = y + rows_get(rows, row, (long)v * ROW + 1) - fit->shift[1];
        p += model->mass[v] * (x * rx + y * ry);
        q += model->mass[v] * (x * ry - y * rx);
    }
    double n = hypot(p, q);
    if (n > 0.0) {
        fit->cosine = p / n;
        fit->sine = q / n;
    }
}

// The new frame is the one in which the fitted body does not move.
static void move_frame(PlaneModel *model, void *row)
{
    const Rows *rows = &model->rows;
    PlaneFit fit;
    fit_plane(model, row, &fit);
    const double c = fit.cosine, s = fit.sine, less = -2.0 * pow(sin(0.5 * atan2(s, c)), 2);
    for (int v = 0; v < model->vertex_count; v++) {
        double x = rows->place[v][0] - fit.rest[0], y = rows->place[v][1] - fit.rest[1];
        double number[ROW];
        for (int k = 0; k < ROW; k++)
            number[k] = rows_get(rows, row, (long)v * ROW + k);
        // R^T (arm + u - shift) - arm, with R - 1 where it is small.
        double ux = number[0] - fit.shift[0], uy = number[1] - fit.shift[1];
        const double moved[4] = {less * x + s * y + c * ux + s * uy,
                                 less * y - s * x + c * uy - s * ux, c * number[4] + s * number[5],
                                 c * number[5] - s * number[4]};
        for (int k = 0; k < 2; k++) {
            rows_put(rows, row, (long)v * ROW + k, moved[k]);
            rows_put(rows, row, (long)v * ROW + 4 + k, moved[2 + k]);
        }
    }
    // x = origin + turn (place + u): what the rows lost goes to the frame.
    BaseFrame *frame = rows->frame;
    const double *rest = fit.rest;
    Vec3 shift = {fit.shift[0] - (less * rest[0] - s * rest[1]),
                  fit.shift[1] - (s * rest[0] + less * rest[1]), 0.0};
    frame->origin = vec3_add(frame->origin, quat_rotate(frame->turn, shift));
    Quat turn = quat_from_rotation((Vec3){0.0, 0.0, atan2(s, c)});
    frame->turn = quat_unit(quat_multiply(frame->turn, turn));
    frame->ticks = 0;
}

static void follow(PlaneModel *model)
{
    BaseFrame *frame = model->rows.frame;
    void *row = model->row[model->current];
    frame->ticks++;
    double moved = fabs(rows_get(&model->rows, row, 0)) + fabs(rows_get(&model->rows, row, 1));
    bool far = moved > 0.1 * model->rows.longest_edge && frame->ticks >= FOLLOW_LEAST;
    if (frame->ticks >= FOLLOW_TICKS || far)
        move_frame(model, row);
}

static bool plane_commit(void *self)
{
    PlaneModel *model = self;
    bool good = !model->bad;
    model->bad = false;
    if (good) {
        model->current = 1 - model->current;
        if (model->rows.floating)
            follow(model);
    }
    model->present = model->row[model->current];
    return good;
}

static bool plane_check(const void *self)
{
    const PlaneModel *model = self;
    const Rows *rows = &model->rows;
    const void *row = model->row[model->current];
    for (long v = 0; v < rows->count; v++)
        if (rows_get(rows, row, v * ROW + 2) != 0.0 || rows_get(rows, row, v * ROW + 6) != 0.0)
            return false; // out of the plane
    Quat turn = rows->frame->turn;
    return turn.x == 0.0 && turn.y == 0.0 && fabs(turn.w * turn.w + turn.z * turn.z - 1.0) < 1e-6 &&
           vec3_length(rows->frame->origin) <= model->position_limit &&
           rows_are_sound(rows, row, model->position_limit);
}

static void plane_restore(void *self, bool to_start)
{
    PlaneModel *model = self;
    const Rows *rows = &model->rows;
    void *row = model->row[model->current];
    if (to_start)
        rows_return_to_rest(&model->rows, row);
    for (long v = 0; v < rows->count; v++)
        for (int c = 4; c < ROW; c++)
            rows_put(rows, row, v * ROW + c, 0.0);
    memset(model->force, 0, (size_t)rows->count * 4 * rows_real_size(rows));
    model->present = row;
}

// ---------------------------------------------------------------------------------------------
// Nodes: those of the strip

static double height_of(const PlaneModel *model, int node)
{
    return node % 2 == 0 ? -model->half : model->half;
}

static void plane_read_nodes(const void *self, const int *node, int count, Vec3 *position,
                             Vec3 *velocity)
{
    const PlaneModel *model = self;
    for (int i = 0; i < count; i++) {
        rows_read(&model->rows, model->present, model->node_vertex[node[i]], &position[i],
                  velocity == NULL ? NULL : &velocity[i]);
        position[i].z += height_of(model, node[i]);
    }
}

static void plane_add_forces(void *self, const int *node, int count, const Vec3 *force)
{
    PlaneModel *model = self;
    for (int i = 0; i < count; i++)
        add_force(model, model->node_vertex[node[i]], force[i].x, force[i].y);
}

static void plane_reserve_forces(void *self, const char *name, int count, Arena *arena)
{
    (void)self, (void)name, (void)count, (void)arena; // they go where the elements' forces go
}

// The region is brought to the rows' coordinates, not every node to the world.
static int plane_find_nodes(const void *self, const Region *region, int *node, int capacity)
{
    const PlaneModel *model = self;
    const Region here = rows_region(&model->rows, region);
    const RegionTest test = region_test(&here);
    int found = 0;
    for (int n = 0; n < model->node_count; n++) {
        Vec3 x = rows_local(&model->rows, model->present, model->node_vertex[n]);
        x.z += height_of(model, n);
        if (region_contains(&test, x)) {
            if (found < capacity)
                node[found] = n;
            found++;
        }
    }
    return found;
}

void plane_list_loads(PlaneModel *model)
{
    model->loaded_count = 0;
    for (int v = 0; model->load != NULL && v < model->vertex_count; v++)
        if (model->load[v][0] != 0.0 || model->load[v][1] != 0.0)
            model->loaded[model->loaded_count++] = v;
}

static void plane_add_load(void *self, int node, Vec3 force)
{
    PlaneModel *model = self;
    double *load = model->load[model->node_vertex[node]];
    bool had = load[0] != 0.0 || load[1] != 0.0;
    load[0] += force.x;
    load[1] += force.y;
    if (!had || (load[0] == 0.0 && load[1] == 0.0))
        plane_list_loads(model);
}

static void plane_clear_loads(void *self)
{
    PlaneModel *model = self;
    if (model->load != NULL)
        memset(model->load, 0, (size_t)model->vertex_count * sizeof *model->load);
    model->loaded_count = 0;
}

static bool plane_is_fixed(const void *self, int node)
{
    const PlaneModel *model = self;
    return rows_get(&model->rows, model->inverse_mass, model->node_vertex[node]) == 0.0;
}

// ---------------------------------------------------------------------------------------------
// Out

static void plane_snapshot(const void *self, float *position, float *velocity)
{
    const PlaneModel *model = self;
    rows_snapshot(&model->rows, model->row[model->current], model->vertex, model->vertex_count,
                  position, velocity);
}

static int plane_read_state(const void *self, int *id, Vec3 *position, Vec3 *velocity)
{
    const PlaneModel *model = self;
    for (int v = 0; v < model->vertex_count; v++) {
        if (id != NULL)
            id[v] = model->id[v];
        rows_read(&model->rows, model->row[model->current], v, &position[v], &velocity[v]);
    }
    return model->vertex_count;
}

// In the base frame, where a rotation changes nothing.
static double form_energy(const PlaneModel *model, const void *row, const PlaneForm *form)
{
    double x[PLANE_PLACES][2], unused[PLANE_PLACES][2];
    for (int i = 0; i < form->shape->count; i++)
        for (int d = 0; d < 2; d++) {
            int v = form->vertex[i];
            x[i][d] = model->rows.place[v][d] + rows_get(&model->rows, row, (long)v * ROW + d);
            unused[i][d] = 0.0;
        }
    return plane_shape_forces(form->shape, &form->stiffness, form->size, (const double(*)[2])x,
                              NULL, unused);
}

static void plane_measure(const void *self, BodyMeasure *measure)
{
    const PlaneModel *model = self;
    const Rows *rows = &model->rows;
    const void *row = model->row[model->current];
    double kinetic = 0.0, elastic = 0.0, farthest = 0.0;
    for (int v = 0; v < model->vertex_count; v++) {
        Vec3 x, velocity;
        rows_read(rows, row, v, &x, &velocity);
        Vec3 u = vec3_sub(x, rows_rest(rows, v));
        kinetic += 0.5 * model->mass[v] * vec3_dot(velocity, velocity);
        farthest = fmax(farthest, vec3_dot(u, u));
    }
    for (int e = 0; e < model->element_count; e++)
        elastic += form_energy(model, row, &model->form[e]);
    *measure = (BodyMeasure){
        .kinetic = kinetic,
        .elastic = model->parameters->stiffness_scale * elastic,
        .max_displacement = sqrt(farthest),
    };
}

static bool plane_set(void *self, BodyParameter parameter, double value)
{
    PlaneModel *model = self;
    PlaneParameters *p = model->parameters;
    switch (parameter) {
    case BODY_GRAVITY_X:
    case BODY_GRAVITY_Y:
    case BODY_GRAVITY_Z: // kept, though nothing moves along z
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

static void plane_restored(Body *body)
{
    plane_list_loads(body->model);
}

static void plane_explain(const void *self, FILE *out)
{
    const PlaneModel *model = self;
    fprintf(out, "    kernel: plane, %s, %s, %d lanes a batch, %d vertices, %d elements (",
            model->rows.precision == PRECISION_SINGLE ? "single" : "double", model->kernels->level,
            PLANE_LANES, model->vertex_count, model->element_count);
    int coarsest = VOXEL_LEVELS_MAX;
    while (coarsest > 0 && model->element_at_level[coarsest] == 0)
        coarsest--;
    for (int level = 0; level <= coarsest; level++)
        fprintf(out, "%s%d", level > 0 ? " + " : "", model->element_at_level[level]);
    fprintf(out, " by level)\n    squares: %d batches; other shapes: %d batches\n",
            model->batches.square_count, model->batches.other_count);
    fprintf(out, "    law: %s\n",
            model->law == VOXEL_AFFINE ? "affine, plane stress" : "miyazaki2004");
    fprintf(out, "    damping: %s\n",
            model->damped ? "in the kernel" : "left out (material.damping)");
    fprintf(out, "    forces and gravity along z: left out (dimensions = 2)\n");
    fprintf(out, "    base frame: %s\n", model->rows.floating ? "follows the body" : "still");
}

static const char *plane_isa(const void *self)
{
    const PlaneModel *model = self;
    return model->kernels->level;
}

const BodyOps plane_ops = {
    .model = "voxel",
    .drift = plane_drift,
    .evaluate = plane_evaluate,
    .commit = plane_commit,
    .check = plane_check,
    .restore = plane_restore,
    .read_nodes = plane_read_nodes,
    .reserve_forces = plane_reserve_forces,
    .add_forces = plane_add_forces,
    .find_nodes = plane_find_nodes,
    .add_load = plane_add_load,
    .clear_loads = plane_clear_loads,
    .snapshot = plane_snapshot,
    .read_state = plane_read_state,
    .measure = plane_measure,
    .is_fixed = plane_is_fixed,
    .set = plane_set,
    .restored = plane_restored,
    .explain = plane_explain,
    .isa = plane_isa,
};
