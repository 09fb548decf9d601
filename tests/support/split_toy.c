#include "split_toy.h"

#include "base/check.h"
#include "geometry/generator.h"
#include "geometry/winged_edge.h"
#include "random.h"

#include <stdio.h>
#include <string.h>

int split_toy_node_of(const SplitToy *toy, int edge)
{
    return toy->base_nodes + edge;
}

static int node_places(const SplitToy *toy)
{
    return toy->base_nodes + toy->edges;
}

static bool is_active(const SplitToy *toy, int node)
{
    return node < toy->base_nodes || toy->split[node - toy->base_nodes];
}

// ---------------------------------------------------------------------------------------------
// How a face is drawn: its corners are 0 1 2, the midpoint of its edge k is 3 + k

static int draw(const bool split[3], int out[4][3])
{
    int count = split[0] + split[1] + split[2];
    for (int k = 0; k < 3; k++) {
        int a = k, b = (k + 1) % 3, c = (k + 2) % 3;
        const int one[2][3] = {{a, 3 + k, c}, {3 + k, b, c}};
        const int two[3][3] = {{a, b, 3 + b}, {a, 3 + b, 3 + c}, {3 + c, 3 + b, c}};
        if (count == 1 && split[k])
            memcpy(out, one, sizeof one);
        if (count == 2 && !split[k])
            memcpy(out, two, sizeof two);
    }
    static const int none[1][3] = {{0, 1, 2}};
    static const int three[4][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};
    if (count == 0)
        memcpy(out, none, sizeof none);
    if (count == 3)
        memcpy(out, three, sizeof three);
    return count + 1;
}

// Whether a point of a face, by its weights of corners 0 and 1, lies inside a triangle drawn.
static bool covers(const int triangle[3], double u, double v)
{
    static const double at[6][2] = {{1, 0}, {0, 1}, {0, 0}, {0.5, 0.5}, {0, 0.5}, {0.5, 0}};
    for (int k = 0; k < 3; k++) {
        const double *p = at[triangle[k]], *q = at[triangle[(k + 1) % 3]];
        if ((q[0] - p[0]) * (v - p[1]) - (q[1] - p[1]) * (u - p[0]) < 0.0)
            return false;
    }
    return true;
}

// By points that lie on no edge of any drawing.
static bool overlap(const int a[3], const int b[3])
{
    enum { N = 16 };
    for (int i = 0; i < N; i++)
        for (int j = 0; i + j < N; j++) {
            double u = (i + 0.31) / N, v = (j + 0.27) / N;
            if (u + v < 1.0 && covers(a, u, v) && covers(b, u, v))
                return true;
        }
    return false;
}

static void splits_of(const SplitToy *toy, const bool *split, int base, bool out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = split[toy->face_edge[base][k]];
}

// ---------------------------------------------------------------------------------------------
// What follows from the split edges

static double area_at_rest(const SplitToy *toy, const int *corner)
{
    Vec3 a = toy->rest[corner[0]];
    return 0.5 * vec3_length(vec3_cross(vec3_sub(toy->rest[corner[1]], a),
                                        vec3_sub(toy->rest[corner[2]], a)));
}

static void list_faces(SplitToy *toy)
{
    for (int base = 0; base < toy->base_faces; base++) {
        bool split[3];
        int drawn[4][3];
        splits_of(toy, toy->split, base, split);
        int count = draw(split, drawn);
        for (int i = 0; i < 4; i++)
            for (int k = 0; k < 3; k++) {
                int c = i < count ? drawn[i][k] : 0;
                int node = c < 3 ? toy->corner[base][c]
                                 : split_toy_node_of(toy, toy->face_edge[base][c - 3]);
                toy->face[4 * base + i][k] = i < count ? node : 0;
            }
        for (int i = 0; i < 4; i++)
            toy->face_area[4 * base + i] =
                i < count ? area_at_rest(toy, toy->face[4 * base + i]) : 0.0;
    }
}

static bool is_used(const SplitToy *toy, int face)
{
    return toy->face_area[face] > 0.0;
}

static void list_faces_around(SplitToy *toy)
{
    for (int i = 0; i < node_places(toy); i++) {
        toy->node_area[i] = 0.0;
        toy->face_end[i] = 0;
    }
    for (int f = 0; f < 4 * toy->base_faces; f++)
        for (int k = 0; k < 3 && is_used(toy, f); k++)
            toy->face_end[toy->face[f][k]]++;
    for (int i = 0, at = 0; i < node_places(toy); i++) {
        toy->face_start[i] = at;
        at += toy->face_end[i];
        toy->face_end[i] = toy->face_start[i];
    }
    for (int f = 0; f < 4 * toy->base_faces; f++)
        for (int k = 0; k < 3 && is_used(toy, f); k++) {
            int node = toy->face[f][k];
            toy->faces[toy->face_end[node]++] = f;
            toy->node_area[node] += toy->face_area[f] / 3.0;
        }
    for (int i = 0; i < node_places(toy); i++)
        toy->node_mass[i] = SPLIT_TOY_DENSITY * toy->node_area[i];
}

static void list_neighbors(SplitToy *toy)
{
    for (int f = 0; f < 4 * toy->base_faces; f++)
        for (int k = 0; k < 3; k++) {
            int a = toy->face[f][k], b = toy->face[f][(k + 1) % 3];
            toy->neighbor[f][k] = -1;
            for (int i = toy->face_start[a]; i < toy->face_end[a] && is_used(toy, f); i++)
                for (int c = 0; c < 3; c++) {
                    const int *other = toy->face[toy->faces[i]];
                    if (other[c] == b && other[(c + 1) % 3] == a)
                        toy->neighbor[f][k] = toy->faces[i];
                }
        }
}

static void rebuild(Body *body)
{
    SplitToy *toy = body->model;
    list_faces(toy);
    list_faces_around(toy);
    list_neighbors(toy);
    bool any = false;
    body->mass = 0.0;
    for (int e = 0; e < toy->edges; e++)
        any |= toy->split[e];
    for (int i = 0; i < node_places(toy); i++)
        body->mass += toy->node_mass[i];
    body->lambda = any ? 4.0 * SPLIT_TOY_LAMBDA : SPLIT_TOY_LAMBDA;
    body->damping = any ? 4.0 * SPLIT_TOY_DAMPING : SPLIT_TOY_DAMPING;
    body->finest_level = any;
}

// ---------------------------------------------------------------------------------------------
// A change

static int change_faces(SplitToy *toy, int base, FaceChange *out)
{
    bool before[3], after[3];
    int old[4][3], drawn[4][3], written = 0;
    splits_of(toy, toy->split, base, before);
    splits_of(toy, toy->wanted, base, after);
    if (memcmp(before, after, sizeof before) == 0)
        return 0;
    int old_count = draw(before, old), count = draw(after, drawn);
    for (int i = 0; i < 4 && (i < count || i < old_count); i++) {
        if (i >= count)
            out[written++] = (FaceChange){4 * base + i, -1};
        for (int j = 0; j < old_count && i < count; j++)
            if (overlap(drawn[i], old[j]))
                out[written++] = (FaceChange){4 * base + i, 4 * base + j};
    }
    return written;
}

static bool toy_adapt(Body *body, int64_t step, double tick, TopologyChange *change)
{
    (void)step, (void)tick;
    SplitToy *toy = body->model;
    if (toy->decide != NULL)
        toy->decide(toy);
    *change = (TopologyChange){.face = toy->change,
                               .born = toy->born,
                               .gone = toy->gone,
                               .gone_parent = (const int(*)[2])toy->gone_parent};
    if (memcmp(toy->split, toy->wanted, (size_t)toy->edges) == 0)
        return false;
    for (int base = 0; base < toy->base_faces; base++)
        change->face_count += change_faces(toy, base, toy->change + change->face_count);
    for (int e = 0; e < toy->edges; e++) {
        const int *parent = toy->parent[e];
        int node = split_toy_node_of(toy, e);
        if (toy->wanted[e] && !toy->split[e]) {
            toy->born[change->born_count++] = (NodeBirth){node, {parent[0], parent[1]}};
            toy->position[node] =
                vec3_scale(0.5, vec3_add(toy->position[parent[0]], toy->position[parent[1]]));
        } else if (!toy->wanted[e] && toy->split[e]) {
            toy->gone[change->gone_count] = node;
            memcpy(toy->gone_parent[change->gone_count++], parent, 2 * sizeof *parent);
            toy->position[node] = (Vec3){0.0, 0.0, 0.0};
        }
        toy->split[e] = toy->wanted[e];
    }
    rebuild(body);
    toy->changes++;
    return true;
}

static void toy_restored(Body *body)
{
    rebuild(body);
}

// ---------------------------------------------------------------------------------------------
// Nothing moves, and forces are added up

static void toy_drift(void *self, double dt)
{
    (void)self, (void)dt;
}

static void toy_evaluate(void *self, const Stage *stage, double h)
{
    (void)stage, (void)h;
    const SplitToy *toy = self;
    if (toy->labour != NULL)
        toy->labour(toy);
}

static bool toy_commit(void *self)
{
    (void)self;
    return true;
}

static void toy_restore(void *self, RestoreMode mode)
{
    (void)self, (void)mode;
}

static void toy_read_nodes(const void *self, const int *node, int count, Vec3 *position,
                           Vec3 *velocity)
{
    const SplitToy *toy = self;
    for (int i = 0; i < count; i++) {
        ASSERT(is_active(toy, node[i]));
        position[i] = toy->position[node[i]];
        if (velocity != NULL)
            velocity[i] = (Vec3){0.0, 0.0, 0.0};
    }
}

static void toy_add_forces(void *self, const int *node, int count, const Vec3 *force)
{
    SplitToy *toy = self;
    for (int i = 0; i < count; i++) {
        ASSERT(is_active(toy, node[i]));
        toy->force[node[i]] = vec3_add(toy->force[node[i]], force[i]);
    }
}

// From the last to the first: nobody may count on ascending nodes.
static int toy_find_nodes(const void *self, const Region *region, int *node, int capacity)
{
    const SplitToy *toy = self;
    int found = 0;
    for (int i = node_places(toy) - 1; i >= 0; i--) {
        if (!is_active(toy, i))
            continue;
        Vec3 d = vec3_sub(toy->position[i], region->from);
        bool inside;
        if (region->kind == REGION_BELOW_PLANE) {
            inside = vec3_dot(d, region->to) < region->radius;
        } else {
            Vec3 axis = vec3_sub(region->to, region->from);
            double square = vec3_dot(axis, axis);
            double t = square > 0.0 ? fmax(0.0, fmin(1.0, vec3_dot(d, axis) / square)) : 0.0;
            inside = vec3_length(vec3_madd(d, -t, axis)) <= region->radius;
        }
        if (inside && found++ < capacity)
            node[found - 1] = i;
    }
    return found;
}

static void toy_add_load(void *self, int node, Vec3 force)
{
    SplitToy *toy = self;
    ASSERT(is_active(toy, node));
    toy->load[node] = vec3_add(toy->load[node], force);
}

static void toy_clear_loads(void *self)
{
    SplitToy *toy = self;
    memset(toy->load, 0, (size_t)node_places(toy) * sizeof *toy->load);
}

static bool toy_is_fixed(const void *self, int node)
{
    (void)self, (void)node;
    return false;
}

static bool toy_set(void *self, BodyParameter parameter, double value)
{
    SplitToy *toy = self;
    toy->parameter[parameter] = value;
    return true;
}

static void toy_snapshot(const void *self, float *position, float *velocity)
{
    (void)self, (void)position, (void)velocity; // it publishes no mesh
}

static void toy_measure(const void *self, BodyMeasure *measure)
{
    (void)self;
    *measure = (BodyMeasure){0};
}

static const BodyOps toy_ops = {
    .model = "toy",
    .adapt = toy_adapt,
    .drift = toy_drift,
    .evaluate = toy_evaluate,
    .commit = toy_commit,
    .restore = toy_restore,
    .read_nodes = toy_read_nodes,
    .add_forces = toy_add_forces,
    .find_nodes = toy_find_nodes,
    .add_load = toy_add_load,
    .clear_loads = toy_clear_loads,
    .snapshot = toy_snapshot,
    .measure = toy_measure,
    .is_fixed = toy_is_fixed,
    .set = toy_set,
    .restored = toy_restored,
};

// ---------------------------------------------------------------------------------------------
// Creation

#define ALLOCATE(count, type)                                                                      \
    (type *)arena_allocate(arena, ARENA_STEP, (size_t)(count), sizeof(type), "%s", name)

static void create_base(SplitToy *toy, const char *name, const TriMesh *mesh, Arena *arena)
{
    WingedMesh winged;
    winged_create(&winged, mesh);
    toy->base_nodes = mesh->node_count;
    toy->base_faces = mesh->triangle_count;
    toy->edges = winged.edge_count;
    toy->corner =
        arena_allocate(arena, ARENA_STEP, (size_t)toy->base_faces, sizeof *toy->corner, "%s", name);
    toy->face_edge = arena_allocate(arena, ARENA_STEP, (size_t)toy->base_faces,
                                    sizeof *toy->face_edge, "%s", name);
    toy->parent =
        arena_allocate(arena, ARENA_STEP, (size_t)toy->edges, sizeof *toy->parent, "%s", name);
    toy->rest = ALLOCATE(node_places(toy), Vec3);
    memcpy(toy->corner, mesh->triangle, (size_t)toy->base_faces * sizeof *toy->corner);
    memcpy(toy->face_edge, winged.face_edge, (size_t)toy->base_faces * sizeof *toy->face_edge);
    memcpy(toy->rest, mesh->position, (size_t)toy->base_nodes * sizeof *toy->rest);
    for (int e = 0; e < toy->edges; e++) {
        memcpy(toy->parent[e], winged.edge[e].node, sizeof toy->parent[e]);
        toy->rest[split_toy_node_of(toy, e)] =
            vec3_scale(0.5, vec3_add(toy->rest[toy->parent[e][0]], toy->rest[toy->parent[e][1]]));
    }
    winged_destroy(&winged);
}

Body split_toy_body(SplitToy **out, const char *name, const TriMesh *mesh, Arena *arena,
                    StateList *state)
{
    SplitToy *toy = ALLOCATE(1, SplitToy);
    *out = toy;
    create_base(toy, name, mesh, arena);
    int nodes = node_places(toy), places = 4 * toy->base_faces;
    toy->split = ALLOCATE(toy->edges, bool);
    toy->wanted = ALLOCATE(toy->edges, bool);
    toy->position = ALLOCATE(nodes, Vec3);
    toy->parameter = ALLOCATE(BODY_ADAPT_LEVEL + 1, double);
    memcpy(toy->position, toy->rest, (size_t)toy->base_nodes * sizeof *toy->rest);
    state_add(state, toy->split, (size_t)toy->edges, "%s/split", name);
    state_add(state, toy->wanted, (size_t)toy->edges, "%s/wanted", name);
    state_add(state, toy->position, (size_t)nodes * sizeof *toy->position, "%s/position", name);
    state_add(state, toy->parameter, (BODY_ADAPT_LEVEL + 1) * sizeof(double), "%s/parameter", name);
    toy->load = ALLOCATE(nodes, Vec3);
    toy->force = ALLOCATE(nodes, Vec3);
    state_add(state, toy->load, (size_t)nodes * sizeof *toy->load, "%s/load", name);

    toy->face = arena_allocate(arena, ARENA_STEP, (size_t)places, sizeof *toy->face, "%s", name);
    toy->neighbor =
        arena_allocate(arena, ARENA_STEP, (size_t)places, sizeof *toy->neighbor, "%s", name);
    toy->face_area = ALLOCATE(places, double);
    toy->finest_area = ALLOCATE(places, double);
    toy->face_start = ALLOCATE(nodes, int);
    toy->face_end = ALLOCATE(nodes, int);
    toy->faces = ALLOCATE(3 * places, int);
    toy->node_area = ALLOCATE(nodes, double);
    toy->node_mass = ALLOCATE(nodes, double);
    toy->change = ALLOCATE(4 * places, FaceChange);
    toy->born = ALLOCATE(toy->edges, NodeBirth);
    toy->gone = ALLOCATE(toy->edges, int);
    toy->gone_parent =
        arena_allocate(arena, ARENA_STEP, (size_t)toy->edges, sizeof *toy->gone_parent, "%s", name);

    double longest = 0.0;
    for (int e = 0; e < toy->edges; e++)
        longest =
            fmax(longest,
                 vec3_length(vec3_sub(toy->rest[toy->parent[e][0]], toy->rest[toy->parent[e][1]])));
    for (int f = 0; f < places; f++)
        toy->finest_area[f] = 0.25 * area_at_rest(toy, toy->corner[f / 4]);
    Body body = {
        .ops = &toy_ops,
        .model = toy,
        .surface = {.node_count = nodes,
                    .face_count = places,
                    .node_used = nodes,
                    .face_used = places,
                    .face = (const int(*)[3])toy->face,
                    .face_area = toy->face_area,
                    .finest_area = toy->finest_area,
                    .face_neighbor = (const int(*)[3])toy->neighbor,
                    .node_face_start = toy->face_start,
                    .node_face_end = toy->face_end,
                    .node_face = toy->faces,
                    .node_area = toy->node_area,
                    .node_mass = toy->node_mass,
                    .longest_edge = longest},
        .integrator = INTEGRATOR_SYMPLECTIC_EULER,
        .contact_lambda = SPLIT_TOY_LAMBDA,
        .finest_lambda = 4.0 * SPLIT_TOY_LAMBDA,
        .finest_damping = 4.0 * SPLIT_TOY_DAMPING,
        .contact_ratio = 0.5,
        .contact_damping = 2e-4,
        .tuning = {.stiffness_scale = 1.0, .damping_scale = 1.0},
    };
    snprintf(body.name, sizeof body.name, "%s", name);
    rebuild(&body);
    return body;
}

// ---------------------------------------------------------------------------------------------
// Commands

void split_toy_want(SplitToy *toy, int edge, bool split)
{
    toy->wanted[edge] = split;
}

void split_toy_want_all(SplitToy *toy, bool split)
{
    memset(toy->wanted, split, (size_t)toy->edges);
}

void split_toy_want_some(SplitToy *toy, int odds, uint64_t *random)
{
    for (int e = 0; e < toy->edges; e++)
        if (random_below(random, odds) == 0)
            toy->wanted[e] = random_below(random, 2) == 0;
}

void split_toy_move(SplitToy *toy, int node, Vec3 by)
{
    toy->position[node] = vec3_add(toy->position[node], by);
}

void split_toy_move_all(SplitToy *toy, Vec3 by)
{
    for (int i = 0; i < node_places(toy); i++)
        if (is_active(toy, i))
            split_toy_move(toy, i, by);
}

// ---------------------------------------------------------------------------------------------
// Scenes

TriMesh toy_sheet(int cells, double cell)
{
    TriMesh mesh;
    Status status = {0};
    ASSERT(generate_sheet(&mesh, cells + 1, cells + 1, cells * cell, cells * cell, &status));
    return mesh;
}

bool toy_scene_try(ToyScene *scene, const ToySceneOptions *options, Status *status)
{
    static const char *const names[2] = {"wall", "twin"};
    *scene = (ToyScene){.mesh = options->mesh, .count = options->count == 0 ? 1 : options->count};
    SimOptions sim = {
        .rate_hz = options->rate_hz, .tool_timeout_s = 0.2, .may_load = options->may_load};
    scene->sim = sim_create(&sim, &scene->arena, &scene->state);
    for (int b = 0; b < scene->count; b++) {
        Body body =
            split_toy_body(&scene->toy[b], names[b], &scene->mesh, &scene->arena, &scene->state);
        body.time_step_wanted = options->time_step;
        body.unsafe_time_step = options->unsafe_time_step;
        body.contact_damping = options->contact_damping;
        scene->body[b] = sim_add_body(scene->sim, &body);
    }
    for (int t = 0; t < options->tool_count; t++)
        sim_add_tool(scene->sim, &options->tool[t]);
    bool good = sim_seal(scene->sim, 0.0, status);
    if (good)
        sim_set_lockstep(scene->sim, true); // a held tool does not become stale
    return good;
}

void toy_scene_create(ToyScene *scene, const ToySceneOptions *options)
{
    Status status = {0};
    bool good = toy_scene_try(scene, options, &status);
    if (!good)
        fprintf(stderr, "toy scene: %s\n", status.text);
    ASSERT(good);
}

void toy_scene_destroy(ToyScene *scene)
{
    mesh_destroy(&scene->mesh);
    state_destroy(&scene->state);
    arena_destroy(&scene->arena);
}

void toy_scene_step(ToyScene *scene)
{
    for (int b = 0; b < scene->count; b++)
        memset(scene->toy[b]->force, 0, (size_t)node_places(scene->toy[b]) * sizeof(Vec3));
    sim_step(scene->sim);
}
