// SPDX-License-Identifier: MIT
// The operations of a plane body (body/body.h). Step thread: no allocation, no lock.
#include "plane/cut.h"

#include <string.h>

enum {
    FOLLOW_TICKS = 16, // ticks between moves of the base frame
    FOLLOW_LEAST = 4,  // at least this many, however fast the body
};

// ---------------------------------------------------------------------------------------------
// A tick

// Computes the forces of all elements, then advances the vertices.
static void evaluate_elements(PlaneModel *model, const Evaluation *evaluation, double h)
{
    Vertices *vertices = &model->vertices;
    const BodyParameters *p = vertices->parameters;
    // What the kernel reads and writes.
    const PlanePass pass = {
        .batches = &model->batches,
        .law = model->law,
        .damped = vertices->damping_time > 0.0,
        .rows = vertices->present,
        .force = vertices->force,
        .stiffness_scale = p->stiffness_scale,
        .damping_scale = p->damping_scale,
    };
    model->kernels->evaluate(&pass);
    vertices_advance(vertices, evaluation, h, (Vec3){p->gravity[0], p->gravity[1], 0.0});
}

static void plane_evaluate(void *self, const Evaluation *evaluation, double h)
{
    PlaneModel *model = self;
    vertices_begin(&model->vertices);
    if (model->cut != NULL && model->cut->felt != NULL)
        plane_cut_feel(model); // external forces alone, before those of the elements
    evaluate_elements(model, evaluation, h);
}

// ---------------------------------------------------------------------------------------------
// The base frame of a floating body. rows_follow would use a fit in space, which may flip an
// inverted body about an axis in its plane.

typedef struct PlaneFit {
    double rest[2], shift[2]; // centre of gravity at rest, and its displacement [m]
    double speed[2];          // its velocity, if the frame takes it over [m/s]
    double cosine, sine;      // of the rotation that fits best by mass
} PlaneFit;

static void fit_plane(const PlaneModel *model, const void *row, PlaneFit *fit)
{
    const Rows *rows = &model->vertices.rows;
    double mass = 0.0, p = 0.0, q = 0.0;
    *fit = (PlaneFit){.cosine = 1.0};
    // Means by mass: of rest positions, displacements, and velocities of a body that falls.
    for (int v = 0; v < model->vertices.count; v++) {
        mass += model->vertices.mass[v];
        for (int d = 0; d < 2; d++) {
            fit->rest[d] += model->vertices.mass[v] * rows->rest[v][d];
            fit->shift[d] += model->vertices.mass[v] * rows_get(rows, row, (long)v * ROW + d);
            if (rows->fall != NULL)
                fit->speed[d] +=
                    model->vertices.mass[v] * rows_get(rows, row, (long)v * ROW + 4 + d);
        }
    }
    for (int d = 0; d < 2; d++) {
        fit->rest[d] /= mass;
        fit->shift[d] /= mass;
        fit->speed[d] /= mass;
    }
    // The best rotation in closed form.
    for (int v = 0; v < model->vertices.count; v++) {
        double x = rows->rest[v][0] - fit->rest[0], y = rows->rest[v][1] - fit->rest[1];
        double rx = x + rows_get(rows, row, (long)v * ROW) - fit->shift[0];
        double ry = y + rows_get(rows, row, (long)v * ROW + 1) - fit->shift[1];
        p += model->vertices.mass[v] * (x * rx + y * ry);
        q += model->vertices.mass[v] * (x * ry - y * rx);
    }
    double n = sqrt(p * p + q * q);
    if (n > 0.0) {
        fit->cosine = p / n;
        fit->sine = q / n;
    }
}

// Moves the frame so that the fitted body does not move in it.
static void move_frame(PlaneModel *model, void *row)
{
    const Rows *rows = &model->vertices.rows;
    PlaneFit fit;
    fit_plane(model, row, &fit);
    const double c = fit.cosine, s = fit.sine, less = -2.0 * pow(sin(0.5 * atan2(s, c)), 2);
    for (int v = 0; v < model->vertices.count; v++) {
        double x = rows->rest[v][0] - fit.rest[0], y = rows->rest[v][1] - fit.rest[1];
        double number[ROW];
        for (int k = 0; k < ROW; k++)
            number[k] = rows_get(rows, row, (long)v * ROW + k);
        // R^T (arm + u - shift) - arm, with R - 1 where it is small.
        double ux = number[0] - fit.shift[0], uy = number[1] - fit.shift[1];
        double vx = number[4] - fit.speed[0], vy = number[5] - fit.speed[1];
        const double moved[4] = {less * x + s * y + c * ux + s * uy,
                                 less * y - s * x + c * uy - s * ux, c * vx + s * vy,
                                 c * vy - s * vx};
        for (int k = 0; k < 2; k++) {
            rows_put(rows, row, (long)v * ROW + k, moved[k]);
            rows_put(rows, row, (long)v * ROW + 4 + k, moved[2 + k]);
        }
    }
    // x = origin + turn (rest + u): the frame gains what the rows lose.
    BaseFrame *frame = rows->frame;
    const double *rest = fit.rest;
    Vec3 shift = {fit.shift[0] - (less * rest[0] - s * rest[1]),
                  fit.shift[1] - (s * rest[0] + less * rest[1]), 0.0};
    frame->origin = vec3_add(frame->origin, quat_rotate(frame->turn, shift));
    if (rows->fall != NULL)
        rows->fall->velocity =
            vec3_add(rows->fall->velocity,
                     quat_rotate(frame->turn, (Vec3){fit.speed[0], fit.speed[1], 0.0}));
    Quat turn = quat_from_rotation((Vec3){0.0, 0.0, atan2(s, c)});
    frame->turn = quat_unit(quat_multiply(frame->turn, turn));
    frame->ticks = 0;
}

static void follow(PlaneModel *model)
{
    BaseFrame *frame = model->vertices.rows.frame;
    void *row = model->vertices.row[model->vertices.current];
    frame->ticks++;
    double moved = fabs(rows_get(&model->vertices.rows, row, 0)) +
                   fabs(rows_get(&model->vertices.rows, row, 1));
    bool far = moved > 0.1 * model->vertices.rows.longest_edge && frame->ticks >= FOLLOW_LEAST;
    if (frame->ticks >= FOLLOW_TICKS || far)
        move_frame(model, row);
}

static bool plane_commit(void *self)
{
    PlaneModel *model = self;
    bool good = vertices_end(&model->vertices);
    if (good && model->vertices.rows.floating)
        follow(model);
    return good;
}

static bool plane_check(const void *self)
{
    const PlaneModel *model = self;
    const Rows *rows = &model->vertices.rows;
    const void *row = vertices_row(&model->vertices);
    if (model->cut != NULL && !model->cut->is_valid)
        return false;
    for (long v = 0; v < rows->count; v++)
        if (rows_get(rows, row, v * ROW + 2) != 0.0 || rows_get(rows, row, v * ROW + 6) != 0.0)
            return false; // out of the plane
    Quat turn = rows->frame->turn;
    return turn.x == 0.0 && turn.y == 0.0 && rows_velocity(rows).z == 0.0 &&
           vertices_check(&model->vertices);
}

static void plane_restore(void *self, RestoreMode mode)
{
    PlaneModel *model = self;
    const PlaneCut *cut = model->cut;
    vertices_restore(&model->vertices, mode);
    if (cut != NULL && cut->felt != NULL) // forces of a tick that is undone must not tear anything
        memset(cut->felt, 0, (size_t)cut->vertex_capacity * sizeof *cut->felt);
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
        rows_read(&model->vertices.rows, model->vertices.present, model->node_vertex[node[i]],
                  &position[i], velocity == NULL ? NULL : &velocity[i]);
        position[i].z += height_of(model, node[i]);
    }
}

static void plane_add_forces(void *self, const int *node, int count, const Vec3 *force)
{
    PlaneModel *model = self;
    for (int i = 0; i < count; i++)
        vertices_add_force(&model->vertices, model->node_vertex[node[i]],
                           (Vec3){force[i].x, force[i].y, 0.0});
}

// A vertex receives the impulses of both of its nodes.
static void plane_kick_nodes(void *self, const int *node, int count, const Vec3 *impulse, double h,
                             double drift)
{
    PlaneModel *model = self;
    double *felt = model->cut != NULL ? model->cut->felt : NULL;
    for (int i = 0; i < count; i++) {
        const int vertex = model->node_vertex[node[i]];
        const Vec3 in_plane = {impulse[i].x, impulse[i].y, 0.0};
        vertices_kick(&model->vertices, vertex, in_plane, drift);
        if (felt != NULL) // of both nodes of a vertex alike: half of its force each
            felt[vertex] = fmax(felt[vertex], 4.0 * vec3_dot(in_plane, in_plane) / (h * h));
    }
}

// Transforms the region to the rows' coordinates rather than every node to the world.
static int plane_find_nodes(const void *self, const Region *region, int *node, int capacity)
{
    const PlaneModel *model = self;
    const Region here = rows_region(&model->vertices.rows, region);
    const RegionTest test = region_test(&here);
    int found = 0;
    for (int n = 0; n < model->node_count; n++) {
        // Nodes inside the body have no faces.
        if (model->node_face_end[n] == model->node_face_start[n])
            continue;
        Vec3 x = rows_local(&model->vertices.rows, model->vertices.present, model->node_vertex[n]);
        x.z += height_of(model, n);
        if (region_contains(&test, x)) {
            if (found < capacity)
                node[found] = n;
            found++;
        }
    }
    return found;
}

static void plane_add_load(void *self, int node, Vec3 force)
{
    PlaneModel *model = self;
    vertices_add_load(&model->vertices, model->node_vertex[node], (Vec3){force.x, force.y, 0.0});
}

static bool plane_is_fixed(const void *self, int node)
{
    const PlaneModel *model = self;
    return vertices_is_fixed(&model->vertices, model->node_vertex[node]);
}

// ---------------------------------------------------------------------------------------------
// Out

static void plane_snapshot(const void *self, float *position, float *velocity)
{
    const PlaneModel *model = self;
    const Vertices *vertices = &model->vertices;
    rows_snapshot(&vertices->rows, vertices_row(vertices), model->vertex, vertices->count, position,
                  velocity);
}

static void plane_snapshot_rest(const void *self, float *position)
{
    const PlaneModel *model = self;
    rows_snapshot_rest(&model->vertices.rows, model->vertex, model->vertices.count, position);
}

// Returns an element's energy [J] in the base frame, where a rotation changes nothing.
static double form_energy(const PlaneModel *model, const void *row, const PlaneForm *form)
{
    double x[PLANE_PLACES][2], unused[PLANE_PLACES][2];
    for (int i = 0; i < form->shape->count; i++)
        for (int d = 0; d < 2; d++) {
            int v = form->vertex[i];
            x[i][d] = model->vertices.rows.rest[v][d] +
                      rows_get(&model->vertices.rows, row, (long)v * ROW + d);
            unused[i][d] = 0.0;
        }
    return plane_shape_forces(form->shape, &form->stiffness, form->size, (const double(*)[2])x,
                              NULL, unused);
}

static void plane_measure(const void *self, BodyMeasure *measure)
{
    const PlaneModel *model = self;
    double elastic = 0.0;
    for (int e = 0; e < model->element_count; e++)
        elastic += form_energy(model, vertices_row(&model->vertices), &model->form[e]);
    *measure = (BodyMeasure){.elastic = model->vertices.parameters->stiffness_scale * elastic};
    vertices_measure(&model->vertices, measure);
}

static bool plane_set(void *self, BodyParameter parameter, double value)
{
    PlaneModel *model = self;
    return vertices_set(&model->vertices, parameter, value); // gravity's z has no effect
}

static bool plane_get(const void *self, BodyParameter parameter, double *value)
{
    const PlaneModel *model = self;
    return vertices_get(&model->vertices, parameter, value);
}

static void plane_restored(Body *body)
{
    PlaneModel *model = body->model;
    if (model->cut != NULL)
        model->cut->is_valid = plane_cut_restore(body);
    vertices_restored(&model->vertices);
}

static void plane_explain(const void *self, FILE *out)
{
    const PlaneModel *model = self;
    vertices_explain(&model->vertices, PLANE_LANES, model->element_at_level, PLANE_LEVELS_MAX + 1,
                     out);
    fprintf(out, "    squares: %d batches; other shapes: %d batches\n", model->batches.square_count,
            model->batches.other_count);
    fprintf(out, "    law: %s\n",
            model->law == PLANE_AFFINE ? "affine, plane stress" : "miyazaki2004");
    fprintf(out, "    forces and gravity along z: left out (dimensions = 2)\n");
    if (model->cut != NULL)
        fprintf(out, "    cuts: at most %d vertices; all made anew after a change\n",
                model->cut->vertex_capacity);
}

static const char *plane_isa(const void *self)
{
    const PlaneModel *model = self;
    return model->kernels->level;
}

#define OPERATIONS                                                                                 \
    .model = "voxel", .drift = vertices_drift, .evaluate = plane_evaluate, .commit = plane_commit, \
    .abandon = vertices_abandon, .check = plane_check, .restore = plane_restore,                   \
    .read_nodes = plane_read_nodes, .add_forces = plane_add_forces,                                \
    .kick_nodes = plane_kick_nodes, .find_nodes = plane_find_nodes, .add_load = plane_add_load,    \
    .clear_loads = vertices_clear_loads, .snapshot = plane_snapshot,                               \
    .snapshot_rest = plane_snapshot_rest, .read_state = vertices_read_state,                       \
    .measure = plane_measure, .is_fixed = plane_is_fixed, .set = plane_set, .get = plane_get,      \
    .restored = plane_restored, .explain = plane_explain, .isa = plane_isa
#define CUTTING                                                                                    \
    .cut = plane_cut_along, .reconstruct = plane_cut_reconstruct,                                  \
    .reserve_blades = plane_cut_reserve_blades

const BodyOps plane_ops = {OPERATIONS};
const BodyOps plane_ops_cuttable = {OPERATIONS, CUTTING};
const BodyOps plane_ops_tearing = {OPERATIONS, CUTTING, .tear = plane_cut_tear};
