// Surface bodies: creation and the operations that the pipeline calls (dynamics/body.h).
#include "surface/surface.h"

#include "base/check.h"
#include "base/log.h"
#include "geometry/winged_edge.h"
#include "surface/model.h"
#include "surface/network.h"
#include "surface/order.h"

#include <stdlib.h>
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
        p->damping_scale = value;
        return model->damped;
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

static const BodyOps surface_ops = {
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
    .measure = surface_measure,
    .is_fixed = surface_is_fixed,
    .set = surface_set,
    .explain = surface_explain,
};

// ---------------------------------------------------------------------------------------------
// Creation

#define ALLOCATE(use, count, type, label)                                                          \
    (type *)arena_allocate(arena, (use), (size_t)(count), sizeof(type), "%s/%s", name, label)

static int compare_ints(const void *a, const void *b)
{
    int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

// Springs by chunk and entry; a node's springs in ascending order of the neighbour's slot.
static void create_springs(SurfaceModel *model, const WingedMesh *winged,
                           const SpringNetwork *network, const char *name, Arena *arena)
{
    int chunk_count = model->slot_count / LANES;
    int *start = ALLOCATE(ARENA_STEP, chunk_count + 1, int, "spring start");
    for (int c = 0; c < chunk_count; c++) {
        int most = 0;
        for (int lane = 0; lane < LANES; lane++) {
            int node = model->node[c * LANES + lane];
            if (node >= 0 && winged_valence(winged, node) > most)
                most = winged_valence(winged, node);
        }
        start[c + 1] = start[c] + most;
    }
    size_t entries = (size_t)start[chunk_count] * LANES;
    int *neighbour = ALLOCATE(ARENA_STEP, entries, int, "spring neighbours");
    double *rest_length = ALLOCATE(ARENA_STEP, entries, double, "spring rest lengths");
    double *stiffness = ALLOCATE(ARENA_STEP, entries, double, "spring stiffness");

    int(*around)[2] = calloc((size_t)winged->edge_count + 1, sizeof *around); // slot, edge
    ASSERT(around != NULL);
    for (int s = 0; s < model->slot_count; s++) {
        int node = model->node[s], count = 0;
        if (node >= 0)
            for (int k = winged->node_edge_start[node]; k < winged->node_edge_start[node + 1];
                 k++) {
                int edge = winged->node_edge[k];
                around[count][0] = model->slot[winged_other(winged, edge, node)];
                around[count++][1] = edge;
            }
        qsort(around, (size_t)count, sizeof *around, compare_ints);
        int chunk = s / LANES;
        for (int e = start[chunk], i = 0; e < start[chunk + 1]; e++, i++) {
            size_t at = (size_t)e * LANES + (size_t)(s % LANES);
            neighbour[at] = i < count ? around[i][0] : s;
            rest_length[at] = i < count ? network->rest_length[around[i][1]] : 0.0;
            stiffness[at] = i < count ? network->stiffness[around[i][1]] : 0.0;
        }
    }
    free(around);
    model->springs = (SpringTable){chunk_count, start, neighbour, rest_length, stiffness};
}

static void create_nodes(SurfaceModel *model, const TriMesh *mesh, const SpringNetwork *network,
                         const SurfaceOptions *options, Arena *arena, StateList *state)
{
    const char *name = options->name;
    bool uses_drag = options->shape.wanted || options->material.node_damping > 0.0;
    model->shape = !uses_drag ? SHAPE_FRAME_NONE
                   : options->shape.wanted && options->shape.frame == SHAPE_BODY
                       ? SHAPE_FRAME_BODY
                       : SHAPE_FRAME_WORLD;
    bool body_frame = model->shape == SHAPE_FRAME_BODY;
    int slots = model->slot_count;
    NodeTable *nodes = &model->nodes;
    nodes->inverse_mass = ALLOCATE(ARENA_STEP, slots, double, "inverse mass");
    model->mass = ALLOCATE(ARENA_TOPOLOGY, mesh->node_count, double, "node masses");
    nodes->rest = ALLOCATE(ARENA_STEP, 3 * slots, double, "rest positions");
    if (uses_drag) {
        nodes->shape_rate = ALLOCATE(ARENA_STEP, slots, double, "shape rate");
        nodes->drag = ALLOCATE(ARENA_STEP, slots, double, "drag");
    }
    double *weight = NULL;
    if (body_frame) {
        nodes->shape_drag = ALLOCATE(ARENA_STEP, slots, double, "shape drag");
        weight = ALLOCATE(ARENA_STEP, slots, double, "frame weights");
    }

    for (int i = 0; i < mesh->node_count; i++) {
        int s = model->slot[i];
        Vec3 x = mesh->position[i];
        double *rest = nodes->rest + (s / LANES) * 3L * LANES + s % LANES;
        rest[0] = x.x;
        rest[LANES] = x.y;
        rest[2 * LANES] = x.z;
        double m = network->mass[i], share = network->fixed[i] ? 0.0 : 1.0 / m;
        model->mass[i] = m;
        nodes->inverse_mass[s] = share;
        if (uses_drag) {
            nodes->shape_rate[s] = share * network->shape_stiffness[i];
            nodes->drag[s] = share * (options->material.node_damping +
                                      (body_frame ? 0.0 : network->shape_damping[i]));
        }
        if (body_frame) {
            nodes->shape_drag[s] = share * network->shape_damping[i];
            weight[s] = network->shape_stiffness[i];
        }
    }
    if (body_frame)
        model->rigid = rigid_frame_create(name, slots, nodes->rest, weight, arena, state);
}

static void create_rows(SurfaceModel *model, const TriMesh *mesh, const SpringNetwork *network,
                        const SurfaceOptions *options, Arena *arena, StateList *state)
{
    const char *name = options->name;
    size_t values = (size_t)model->slot_count * ROW;
    for (int k = 0; k < 2; k++) {
        model->rows[k] =
            ALLOCATE(ARENA_STEP, values, double, k == 0 ? "rows" : "rows of next tick");
        model->stage[k] =
            ALLOCATE(ARENA_STEP, values, double, k == 0 ? "stage rows" : "stage rows 2");
    }
    if (options->integrator == INTEGRATOR_RK4)
        model->sum = ALLOCATE(ARENA_STEP, (size_t)model->slot_count * 6, double, "stage sums");
    model->external = ALLOCATE(ARENA_STEP, (size_t)model->slot_count * 3, double, "outside forces");
    model->touched = ALLOCATE(ARENA_CONTACT, model->slot_count, TouchedSlot, "touched slots");
    model->is_touched = ALLOCATE(ARENA_CONTACT, model->slot_count, bool, "touched marks");
    model->loaded = ALLOCATE(ARENA_STEP, 1, int64_t, "loaded");
    model->parameters = ALLOCATE(ARENA_STEP, 1, SurfaceParameters, "parameters");
    *model->parameters = (SurfaceParameters){
        .gravity = {options->gravity.x, options->gravity.y, options->gravity.z},
        .stiffness_scale = 1.0,
        .damping_scale = 1.0,
    };

    double farthest = 0.0;
    for (int i = 0; i < model->node_count; i++) {
        Vec3 x =
            options->initial_position != NULL ? options->initial_position[i] : mesh->position[i];
        Vec3 v = {0.0, 0.0, 0.0};
        if (options->initial_velocity != NULL && !network->fixed[i])
            v = options->initial_velocity[i];
        double *row = model->rows[0] + (long)model->slot[i] * ROW;
        row[0] = x.x, row[1] = x.y, row[2] = x.z;
        row[4] = v.x, row[5] = v.y, row[6] = v.z;
        farthest = fmax(farthest, fmax(vec3_length(x), vec3_length(mesh->position[i])));
    }
    // Far beyond any use of a scene, and small enough for single precision.
    model->position_limit = 1e6 * farthest;
    model->present = model->rows[0];

    state_add_pair(state, model->rows[0], model->rows[1], &model->current, values * sizeof(double),
                   "%s/rows", name);
    state_add(state, model->external, (size_t)model->slot_count * 3 * sizeof(double), "%s/loads",
              name);
    state_add(state, model->loaded, sizeof *model->loaded, "%s/loaded", name);
    state_add(state, model->parameters, sizeof *model->parameters, "%s/parameters", name);
}

// The piece of each node: connected parts of the mesh, numbered by their lowest node.
static void label_pieces(const TriMesh *mesh, int *piece)
{
    for (int i = 0; i < mesh->node_count; i++)
        piece[i] = i;
    for (bool changed = true; changed;) { // sweeps both ways: few even for long chains
        changed = false;
        for (int pass = 0; pass < 2; pass++)
            for (int k = 0; k < mesh->triangle_count; k++) {
                const int *t = mesh->triangle[pass == 0 ? k : mesh->triangle_count - 1 - k];
                int low = piece[t[0]];
                for (int c = 1; c < 3; c++)
                    low = piece[t[c]] < low ? piece[t[c]] : low;
                for (int c = 0; c < 3; c++) {
                    changed |= piece[t[c]] != low;
                    piece[t[c]] = low;
                }
            }
    }
    int count = 0;
    for (int i = 0; i < mesh->node_count; i++)
        piece[i] = piece[i] == i ? count++ : piece[piece[i]];
}

static void create_surface(SurfaceModel *model, Body *body, const TriMesh *mesh,
                           const WingedMesh *winged, const SpringNetwork *network,
                           const SurfaceOptions *options, Arena *arena)
{
    const char *name = options->name;
    int nodes = mesh->node_count, faces = mesh->triangle_count;
    model->face =
        arena_allocate(arena, ARENA_TOPOLOGY, (size_t)faces, sizeof *model->face, "%s/faces", name);
    model->face_neighbor = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)faces,
                                          sizeof *model->face_neighbor, "%s/face neighbours", name);
    model->face_area = ALLOCATE(ARENA_TOPOLOGY, faces, double, "face areas");
    model->node_area = ALLOCATE(ARENA_TOPOLOGY, nodes, double, "node areas");
    model->node_face_start = ALLOCATE(ARENA_TOPOLOGY, nodes + 1, int, "node face start");
    model->node_face = ALLOCATE(ARENA_TOPOLOGY, 3 * faces, int, "node faces");
    memcpy(model->face, mesh->triangle, (size_t)faces * sizeof *model->face);
    memcpy(model->face_neighbor, winged->face_neighbor,
           (size_t)faces * sizeof *model->face_neighbor);
    memcpy(model->face_area, network->face_area, (size_t)faces * sizeof(double));
    memcpy(model->node_area, network->node_area, (size_t)nodes * sizeof(double));
    memcpy(model->node_face_start, winged->node_face_start, (size_t)(nodes + 1) * sizeof(int));
    memcpy(model->node_face, winged->node_face, 3 * (size_t)faces * sizeof(int));
    double longest = 0.0;
    for (int e = 0; e < winged->edge_count; e++)
        longest = fmax(longest, vec3_length(vec3_sub(mesh->position[winged->edge[e].node[0]],
                                                     mesh->position[winged->edge[e].node[1]])));
    body->surface = (BodySurface){
        .node_count = nodes,
        .face_count = faces,
        .face = (const int(*)[3])model->face,
        .face_area = model->face_area,
        .face_neighbor = (const int(*)[3])model->face_neighbor,
        .node_face_start = model->node_face_start,
        .node_face = model->node_face,
        .node_area = model->node_area,
        .node_mass = model->mass,
        .longest_edge = longest,
    };

    model->id = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "node ids");
    model->parent = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)nodes, sizeof *model->parent,
                                   "%s/node parents", name);
    model->piece = ALLOCATE(ARENA_TOPOLOGY, nodes, int, "node pieces");
    model->level = ALLOCATE(ARENA_TOPOLOGY, nodes, signed char, "node levels");
    for (int i = 0; i < nodes; i++) {
        model->id[i] = mesh->file_index[i];
        model->parent[i][0] = model->parent[i][1] = mesh->file_index[i];
    }
    label_pieces(mesh, model->piece);
    body->mesh = (BodyMesh){
        .topology = 1,
        .node_count = nodes,
        .triangle_count = faces,
        .triangle = (const int(*)[3])model->face,
        .id = model->id,
        .origin = model->id,
        .parent = (const int(*)[2])model->parent,
        .piece = model->piece,
        .level = model->level,
    };
}

bool surface_create(Body *body, const TriMesh *mesh, const SurfaceOptions *options, Arena *arena,
                    StateList *state, Status *status)
{
    const char *name = options->name;
    const SpringKernels *kernels = kernels_find(options->isa == NULL ? "auto" : options->isa);
    if (kernels == NULL)
        return status_fail(status, STATUS_INVALID,
                           "isa %s is not a level that this machine can run", options->isa);
    bool per_node = options->shape.wanted && options->shape.per_node;
    double frame_weight = per_node ? options->shape.stiffness : options->shape.angular_frequency;
    if (options->shape.wanted && options->shape.frame == SHAPE_BODY && !(frame_weight > 0.0))
        return status_fail(status, STATUS_INVALID,
                           "shape: frame \"body\" needs a stiffness above 0 to fit the frame with");

    WingedMesh winged;
    winged_create(&winged, mesh);
    SpringNetwork network;
    if (!network_create(&network, mesh, &winged, options, status)) {
        winged_destroy(&winged);
        return false;
    }
    if (network.clamped)
        log_line(LOG_WARNING,
                 "body %s: damping_time %g s shortened to %g s: longer, it would dictate "
                 "the time step",
                 name, options->material.damping_time, network.damping_time);

    SurfaceModel *model = arena_allocate(arena, ARENA_STEP, 1, sizeof *model, "%s/model", name);
    model->kernels = kernels;
    model->node_count = mesh->node_count;
    model->edge_count = winged.edge_count;
    model->face_count = mesh->triangle_count;
    model->slot_count = (mesh->node_count + LANES - 1) / LANES * LANES;
    model->damping_time = network.damping_time;
    model->damped = network.damping_time > 0.0;
    model->slot = ALLOCATE(ARENA_TOPOLOGY, mesh->node_count, int, "slot of node");
    model->node = ALLOCATE(ARENA_TOPOLOGY, model->slot_count, int, "node of slot");
    order_nodes(&winged, model->slot);
    for (int s = 0; s < model->slot_count; s++)
        model->node[s] = -1;
    for (int i = 0; i < mesh->node_count; i++)
        model->node[model->slot[i]] = i;

    create_springs(model, &winged, &network, name, arena);
    create_nodes(model, mesh, &network, options, arena, state);
    create_rows(model, mesh, &network, options, arena, state);

    *body = (Body){
        .ops = &surface_ops,
        .model = model,
        .integrator = options->integrator,
        .mass = network.total_mass,
        .spring_count = winged.edge_count,
        .element_count = mesh->triangle_count,
        .lambda = network.lambda,
        .damping = network.damping,
        .contact_ratio = options->contact_ratio,
        .contact_damping = options->contact_damping,
        .tuning = {.friction = options->friction, .stiffness_scale = 1.0, .damping_scale = 1.0},
        .time_step_wanted = options->time_step,
        .unsafe_time_step = options->unsafe_time_step,
    };
    snprintf(body->name, sizeof body->name, "%s", name);
    create_surface(model, body, mesh, &winged, &network, options, arena);
    network_destroy(&network);
    winged_destroy(&winged);
    return true;
}

void surface_read_state(const Body *body, Vec3 *position, Vec3 *velocity)
{
    const SurfaceModel *model = body->model;
    const double *rows = model->rows[model->current];
    for (int i = 0; i < model->node_count; i++) {
        const double *row = rows + (long)model->slot[i] * ROW;
        position[i] = (Vec3){row[0], row[1], row[2]};
        velocity[i] = (Vec3){row[4], row[5], row[6]};
    }
}

const char *const *surface_isa_levels(void)
{
    static const char *levels[8];
    const SpringKernels *const *available = kernels_available();
    for (int i = 0; i < 7 && available[i] != NULL; i++)
        levels[i] = available[i]->level;
    return levels;
}

const char *surface_isa(const Body *body)
{
    const SurfaceModel *model = body->model;
    return model->kernels->level;
}
