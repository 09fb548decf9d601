// SPDX-License-Identifier: MIT
#include "mesh_toy.h"

#include "base/check.h"
#include "random.h"

#include <string.h>

// --- the hierarchy ---

static int midpoint_of(MeshToy *toy, int a, int b, int level)
{
    int low = a < b ? a : b, high = a < b ? b : a;
    for (int i = 0; i < toy->nodes; i++)
        if (toy->node_level[i] > 0 && toy->node_parent[i][0] == low &&
            toy->node_parent[i][1] == high)
            return i;
    ASSERT(toy->nodes < TOY_NODES);
    toy->node_parent[toy->nodes][0] = low;
    toy->node_parent[toy->nodes][1] = high;
    toy->node_level[toy->nodes] = (signed char)level;
    toy->rest[toy->nodes] = vec3_scale(0.5, vec3_add(toy->rest[a], toy->rest[b]));
    return toy->nodes++;
}

static void set_face(int face[3], int a, int b, int c)
{
    face[0] = a;
    face[1] = b;
    face[2] = c;
}

static void divide(MeshToy *toy, int level)
{
    toy->face_count[level + 1] = 4 * toy->face_count[level];
    for (int f = 0; f < toy->face_count[level]; f++) {
        const int *c = toy->face[level][f];
        int m[3];
        for (int k = 0; k < 3; k++)
            m[k] = midpoint_of(toy, c[k], c[(k + 1) % 3], level + 1);
        int(*child)[3] = &toy->face[level + 1][4 * f];
        set_face(child[0], c[0], m[0], m[2]);
        set_face(child[1], m[0], c[1], m[1]);
        set_face(child[2], m[2], m[1], c[2]);
        set_face(child[3], m[0], m[1], m[2]);
    }
}

static void make_base(TriMesh *base, bool open)
{
    static const int octahedron[TOY_BASE_FACES][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                                      {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    static const int sheet[TOY_BASE_FACES][3] = {{0, 1, 4}, {0, 4, 3}, {1, 2, 4}, {2, 5, 4},
                                                 {3, 4, 6}, {4, 7, 6}, {4, 5, 8}, {4, 8, 7}};
    mesh_create(base, open ? 9 : 6, TOY_BASE_FACES);
    memcpy(base->triangle, open ? sheet : octahedron, sizeof sheet);
    for (int i = 0; i < base->node_count; i++) {
        base->position[i] = vec3(i % 3, i / 3, 0.1 * i * i); // bent: no two nodes coincide
        if (!open)
            base->position[i] =
                vec3(i == 0 ? 1 : -(i == 1), i == 2 ? 1 : -(i == 3), i == 4 ? 1 : -(i == 5));
        base->file_index[i] = 10 + i;
    }
}

// --- drawing ---

typedef struct Drawing {
    bool active[TOY_NODES];
    int triangle[TOY_FACES][3]; // nodes
    int count;
} Drawing;

static bool is_leaf(const MeshToy *toy, int level, int face)
{
    if (level > 0 && !toy->state.refined[level - 1][face / 4])
        return false;
    return level == TOY_LEVELS || !toy->state.refined[level][face];
}

static void mark_active(MeshToy *toy, bool active[TOY_NODES])
{
    memset(active, 0, TOY_NODES);
    for (int i = 0; i < toy->base.node_count; i++)
        active[i] = true;
    for (int l = 0; l < TOY_LEVELS; l++)
        for (int f = 0; f < toy->face_count[l]; f++)
            for (int k = 0; k < 3 && toy->state.refined[l][f]; k++)
                active[midpoint_of(toy, toy->face[l][f][k], toy->face[l][f][(k + 1) % 3], l + 1)] =
                    true;
}

// Neighbours differ by one level at most: no half of a leaf's edge is divided.
static bool balance(MeshToy *toy)
{
    bool active[TOY_NODES], changed = false;
    mark_active(toy, active);
    for (int f = 0; f < toy->face_count[0]; f++) {
        const int *c = toy->face[0][f];
        for (int k = 0; k < 3 && !toy->state.refined[0][f]; k++) {
            int a = c[k], b = c[(k + 1) % 3], m = midpoint_of(toy, a, b, 1);
            if (active[midpoint_of(toy, a, m, 2)] || active[midpoint_of(toy, m, b, 2)])
                toy->state.refined[0][f] = changed = true;
        }
    }
    return changed;
}

static void add_triangle(Drawing *drawing, int a, int b, int c)
{
    ASSERT(drawing->count < TOY_FACES);
    set_face(drawing->triangle[drawing->count++], a, b, c);
}

static void draw_leaf(MeshToy *toy, Drawing *drawing, const int corner[3], int level)
{
    int hanging = 0, m[3];
    for (int k = 0; k < 3; k++) {
        m[k] =
            level < TOY_LEVELS ? midpoint_of(toy, corner[k], corner[(k + 1) % 3], level + 1) : -1;
        if (m[k] >= 0 && !drawing->active[m[k]])
            m[k] = -1;
        hanging += m[k] >= 0;
    }
    // Turned so that with one or two the divided edges come first.
    int first = 0;
    while (hanging > 0 && hanging < 3 &&
           !(m[first] >= 0 && (hanging == 1 || m[(first + 1) % 3] >= 0)))
        first++;
    int a = corner[first], b = corner[(first + 1) % 3], c = corner[(first + 2) % 3];
    int ab = m[first], bc = m[(first + 1) % 3], ca = m[(first + 2) % 3];
    if (hanging == 0) {
        add_triangle(drawing, a, b, c);
    } else if (hanging == 1) {
        add_triangle(drawing, a, ab, c);
        add_triangle(drawing, ab, b, c);
    } else if (hanging == 2) {
        add_triangle(drawing, ab, b, bc);
        add_triangle(drawing, a, ab, bc);
        add_triangle(drawing, a, bc, c);
    } else {
        add_triangle(drawing, a, ab, ca);
        add_triangle(drawing, ab, b, bc);
        add_triangle(drawing, ca, bc, c);
        add_triangle(drawing, ab, bc, ca);
    }
}

// --- slots ---

static int id_of(const MeshToy *toy, int node)
{
    return toy->node_level[node] == 0 ? 10 + node : 1000 - node;
}

static int free_node(MeshToyState *state)
{
    int slot = 0;
    while (slot < state->node_count && state->id[slot] >= 0)
        slot++;
    state->node_count += slot == state->node_count;
    return slot;
}

static void publish_nodes(MeshToy *toy, const bool active[TOY_NODES])
{
    MeshToyState *state = &toy->state;
    for (int i = 0; i < toy->nodes; i++) {
        if (active[i] || state->slot_of[i] < 0)
            continue;
        state->id[state->slot_of[i]] = -1;
        state->slot_of[i] = -1;
    }
    for (int i = 0; i < toy->nodes; i++) {
        if (!active[i] || state->slot_of[i] >= 0)
            continue;
        int slot = state->slot_of[i] = free_node(state);
        state->id[slot] = state->origin[slot] = id_of(toy, i);
        state->level[slot] = toy->node_level[i];
        for (int k = 0; k < 2; k++)
            state->parent[slot][k] =
                toy->node_level[i] == 0 ? id_of(toy, i) : id_of(toy, toy->node_parent[i][k]);
    }
}

static bool is_free(const int triangle[3])
{
    return triangle[0] == triangle[1];
}

static int find_triangle(const int (*list)[3], int count, const int triangle[3])
{
    for (int t = 0; t < count; t++)
        if (memcmp(list[t], triangle, sizeof list[t]) == 0)
            return t;
    return -1;
}

static void publish_triangles(MeshToy *toy, const Drawing *drawing)
{
    MeshToyState *state = &toy->state;
    int wanted[TOY_FACES][3];
    for (int t = 0; t < drawing->count; t++)
        for (int k = 0; k < 3; k++)
            wanted[t][k] = state->slot_of[drawing->triangle[t][k]];
    for (int t = 0; t < state->triangle_count; t++)
        if (find_triangle((const int(*)[3])wanted, drawing->count, state->triangle[t]) < 0)
            memset(state->triangle[t], 0, sizeof state->triangle[t]);
    for (int t = 0; t < drawing->count; t++) {
        if (find_triangle((const int(*)[3])state->triangle, state->triangle_count, wanted[t]) >= 0)
            continue;
        int slot = 0;
        while (slot < state->triangle_count && !is_free(state->triangle[slot]))
            slot++;
        state->triangle_count += slot == state->triangle_count;
        memcpy(state->triangle[slot], wanted[t], sizeof wanted[t]);
    }
}

static void publish(MeshToy *toy)
{
    Drawing drawing = {.count = 0};
    while (balance(toy)) {
    }
    mark_active(toy, drawing.active);
    for (int l = 0; l <= TOY_LEVELS; l++)
        for (int f = 0; f < toy->face_count[l]; f++)
            if (is_leaf(toy, l, f) && (l < 2 || toy->state.refined[0][f / 16]))
                draw_leaf(toy, &drawing, toy->face[l][f], l);
    publish_nodes(toy, drawing.active);
    publish_triangles(toy, &drawing);
    toy->state.topology++;
}

void mesh_toy_create(MeshToy *toy, bool open, uint64_t seed)
{
    memset(toy, 0, sizeof *toy);
    make_base(&toy->base, open);
    toy->nodes = toy->base.node_count;
    for (int i = 0; i < toy->nodes; i++) {
        toy->node_parent[i][0] = toy->node_parent[i][1] = i;
        toy->rest[i] = toy->base.position[i];
    }
    toy->face_count[0] = TOY_BASE_FACES;
    memcpy(toy->face[0], toy->base.triangle, TOY_BASE_FACES * sizeof *toy->face[0]);
    for (int l = 0; l < TOY_LEVELS; l++)
        divide(toy, l);
    toy->state.random = seed * 2 + 1;
    memset(toy->state.slot_of, -1, sizeof toy->state.slot_of);
    publish(toy);
}

void mesh_toy_destroy(MeshToy *toy)
{
    mesh_destroy(&toy->base);
}

bool mesh_toy_change(MeshToy *toy)
{
    MeshToyState *state = &toy->state;
    bool before[TOY_LEVELS][TOY_FACES];
    memcpy(before, state->refined, sizeof before);
    int changes = 1 + random_below(&state->random, 4);
    for (int i = 0; i < changes; i++) {
        int level = random_below(&state->random, TOY_LEVELS);
        int face = random_below(&state->random, toy->face_count[level]);
        bool refine = random_below(&state->random, 2) == 0;
        state->refined[level][face] = refine;
        if (level == 0 && !refine)
            memset(&state->refined[1][4 * face], 0, 4);
        if (level == 1 && refine)
            state->refined[0][face / 4] = true;
    }
    while (balance(toy)) {
    }
    if (memcmp(before, state->refined, sizeof before) == 0)
        return false;
    publish(toy);
    return true;
}

void mesh_toy_refine_all(MeshToy *toy)
{
    memset(toy->state.refined, 1, sizeof toy->state.refined);
    publish(toy);
}

BodyMesh mesh_toy_mesh(const MeshToy *toy)
{
    const MeshToyState *state = &toy->state;
    return (BodyMesh){.topology = state->topology,
                      .node_count = state->node_count,
                      .triangle_count = state->triangle_count,
                      .node_capacity = TOY_NODES,
                      .triangle_capacity = TOY_FACES,
                      .triangle = state->triangle,
                      .id = state->id,
                      .origin = state->origin,
                      .parent = state->parent,
                      .piece = state->piece,
                      .level = state->level};
}

// --- as a body ---

static Vec3 position_of(const MeshToy *toy, int node)
{
    return vec3_add(toy->rest[node], vec3(0.0, 0.0, 0.125 * (double)toy->state.moves));
}

void mesh_toy_positions(const MeshToy *toy, Vec3 *position)
{
    for (int i = 0; i < toy->state.node_count; i++)
        position[i] = vec3(0.0, 0.0, 0.0);
    for (int i = 0; i < toy->nodes; i++)
        if (toy->state.slot_of[i] >= 0)
            position[toy->state.slot_of[i]] = position_of(toy, i);
}

static int read_state(const void *model, int *id, Vec3 *position, Vec3 *velocity)
{
    const MeshToy *toy = model;
    mesh_toy_positions(toy, position);
    for (int i = 0; i < toy->state.node_count; i++)
        velocity[i] = vec3(toy->state.id[i] < 0 ? 0.0 : toy->state.id[i], 0.0, -1.0);
    if (id != NULL)
        memcpy(id, toy->state.id, (size_t)toy->state.node_count * sizeof *id);
    return toy->state.node_count;
}

static void snapshot(const void *model, float *position, float *velocity)
{
    const MeshToy *toy = model;
    Vec3 x[TOY_NODES], v[TOY_NODES];
    read_state(model, NULL, x, v);
    for (int i = 0; i < toy->state.node_count; i++) {
        const double values[6] = {x[i].x, x[i].y, x[i].z, v[i].x, v[i].y, v[i].z};
        for (int k = 0; k < 3; k++) {
            position[3 * i + k] = (float)values[k];
            if (velocity != NULL)
                velocity[3 * i + k] = (float)values[3 + k];
        }
    }
}

static void restored(Body *body)
{
    body->mesh = mesh_toy_mesh(body->model);
}

static bool adapt(Body *body, int64_t step, double tick, TopologyChange *change)
{
    (void)step, (void)tick;
    *change = (TopologyChange){0};
    bool changed = mesh_toy_change(body->model);
    restored(body);
    return changed;
}

static void drift(void *model, double dt)
{
    (void)dt;
    ((MeshToy *)model)->state.moves++;
}

static void evaluate(void *model, const Evaluation *evaluation, double h)
{
    (void)model, (void)evaluation, (void)h;
}

static bool commit(void *model)
{
    (void)model;
    return true;
}

// As hostile as a file can be: counts first, for what reads slots next.
static bool check(const void *model)
{
    const MeshToyState *state = &((const MeshToy *)model)->state;
    return state->node_count >= 0 && state->node_count <= TOY_NODES && state->triangle_count >= 0 &&
           state->triangle_count <= TOY_FACES;
}

static void measure(const void *model, BodyMeasure *measure)
{
    (void)model;
    *measure = (BodyMeasure){0};
}

static const char *isa(const void *model)
{
    (void)model;
    return "toy";
}

Body mesh_toy_body(MeshToy *toy, const char *name, bool adapts, StateList *state)
{
    static const BodyOps changing = {.model = "toy",
                                     .adapt = adapt,
                                     .drift = drift,
                                     .evaluate = evaluate,
                                     .commit = commit,
                                     .check = check,
                                     .snapshot = snapshot,
                                     .read_state = read_state,
                                     .measure = measure,
                                     .restored = restored,
                                     .isa = isa};
    static const BodyOps still = {.model = "toy",
                                  .drift = drift,
                                  .evaluate = evaluate,
                                  .commit = commit,
                                  .check = check,
                                  .snapshot = snapshot,
                                  .read_state = read_state,
                                  .measure = measure,
                                  .isa = isa};
    Body body = {.ops = adapts ? &changing : &still,
                 .model = toy,
                 .mesh = mesh_toy_mesh(toy),
                 .state_capacity = adapts ? TOY_NODES : toy->state.node_count,
                 .mass = 1.0,
                 .integrator = INTEGRATOR_LEAPFROG,
                 .lambda = 1.0,
                 .contact_lambda = 1.0,
                 .tuning = {.stiffness_scale = 1.0, .damping_scale = 1.0}};
    snprintf(body.name, sizeof body.name, "%s", name);
    state_add(state, &toy->state, sizeof toy->state, "%s/toy", name);
    return body;
}
