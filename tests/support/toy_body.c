// SPDX-License-Identifier: MIT
#include "toy_body.h"

#include "base/check.h"
#include "geometry/generator.h"
#include "toy_parts.h"

#include <stdio.h>
#include <string.h>

double toy_area(const Vec3 *position, const int corner[3])
{
    const Vec3 a = position[corner[0]];
    return 0.5 * vec3_length(vec3_cross(vec3_sub(position[corner[1]], a),
                                        vec3_sub(position[corner[2]], a)));
}

bool toy_is_active(const Toy *toy, int node)
{
    if (toy->cuts != NULL)
        return node < *toy->cuts->used;
    return node < toy->base_nodes || toy->splits->split[node - toy->base_nodes];
}

void toy_list_around(Toy *toy)
{
    memset(toy->node_area, 0, (size_t)toy->nodes * sizeof *toy->node_area);
    memset(toy->face_end, 0, (size_t)toy->nodes * sizeof *toy->face_end);
    for (int f = 0; f < toy->faces; f++)
        for (int k = 0; k < 3 && toy->face_area[f] > 0.0; k++)
            toy->face_end[toy->face[f][k]]++;
    for (int i = 0, at = 0; i < toy->nodes; i++) {
        toy->face_start[i] = at;
        at += toy->face_end[i];
        toy->face_end[i] = toy->face_start[i];
    }
    for (int f = 0; f < toy->faces; f++)
        for (int k = 0; k < 3 && toy->face_area[f] > 0.0; k++) {
            int node = toy->face[f][k];
            toy->around[toy->face_end[node]++] = f;
            toy->node_area[node] += toy->face_area[f] / 3.0;
        }
    for (int i = 0; i < toy->nodes; i++)
        toy->node_mass[i] = TOY_DENSITY * toy->node_area[i];
}

// ---------------------------------------------------------------------------------------------
// Nothing moves, and forces are added up

static void toy_drift(void *self, double dt)
{
    (void)self, (void)dt;
}

static void toy_evaluate(void *self, const Evaluation *evaluation, double h)
{
    (void)evaluation, (void)h;
    const Toy *toy = self;
    if (toy->splits != NULL && toy->splits->labour != NULL)
        toy->splits->labour(toy);
}

static bool toy_commit(void *self)
{
    const Toy *toy = self;
    const bool bad = toy->cuts != NULL && toy->cuts->bad;
    if (bad)
        toy->cuts->bad = false;
    return !bad;
}

static void toy_restore(void *self, RestoreMode mode)
{
    (void)self, (void)mode;
}

static void toy_read_nodes(const void *self, const int *node, int count, Vec3 *position,
                           Vec3 *velocity)
{
    const Toy *toy = self;
    for (int i = 0; i < count; i++) {
        ASSERT(toy_is_active(toy, node[i]));
        position[i] = toy->position[node[i]];
        if (velocity != NULL)
            velocity[i] = (Vec3){0.0, 0.0, 0.0};
    }
}

static void toy_add_forces(void *self, const int *node, int count, const Vec3 *force)
{
    Toy *toy = self;
    for (int i = 0; i < count; i++) {
        ASSERT(toy_is_active(toy, node[i]));
        toy->force[node[i]] = vec3_add(toy->force[node[i]], force[i]);
    }
}

// From the last to the first: no caller may count on ascending nodes.
static int toy_find_nodes(const void *self, const Region *region, int *node, int capacity)
{
    const Toy *toy = self;
    int found = 0;
    for (int i = toy->nodes - 1; i >= 0; i--) {
        if (!toy_is_active(toy, i))
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
    Toy *toy = self;
    ASSERT(toy_is_active(toy, node));
    toy->load[node] = vec3_add(toy->load[node], force);
}

static void toy_clear_loads(void *self)
{
    Toy *toy = self;
    memset(toy->load, 0, (size_t)toy->nodes * sizeof *toy->load);
}

static bool toy_is_fixed(const void *self, int node)
{
    (void)self, (void)node;
    return false;
}

static bool toy_set(void *self, BodyParameter parameter, double value)
{
    Toy *toy = self;
    toy->parameter[parameter] = value;
    return true;
}

static bool toy_get(const void *self, BodyParameter parameter, double *value)
{
    const Toy *toy = self;
    if (parameter > BODY_ADAPT_LEVEL) // it is not driven by its error
        return false;
    *value = toy->parameter[parameter];
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

void toy_rebuild(Body *body)
{
    const Toy *toy = body->model;
    if (toy->cuts != NULL)
        toy_cuts_rebuild(body);
    else
        toy_splits_rebuild(body);
    body->mass = 0.0;
    for (int i = 0; i < toy->nodes; i++)
        body->mass += toy->node_mass[i];
}

// What bodies have besides their topology.
#define STILL_OPS                                                                                  \
    .drift = toy_drift, .evaluate = toy_evaluate, .commit = toy_commit, .restore = toy_restore,    \
    .read_nodes = toy_read_nodes, .add_forces = toy_add_forces, .find_nodes = toy_find_nodes,      \
    .add_load = toy_add_load, .clear_loads = toy_clear_loads, .snapshot = toy_snapshot,            \
    .measure = toy_measure, .is_fixed = toy_is_fixed, .set = toy_set, .get = toy_get,              \
    .restored = toy_rebuild

static const BodyOps *ops_of(const ToyOptions *options)
{
    static const BodyOps splits = {.model = "toy", STILL_OPS, .adapt = toy_adapt};
    static const BodyOps cuts = {.model = "toy",
                                 STILL_OPS,
                                 .cut = toy_cut,
                                 .reconstruct = toy_reconstruct,
                                 .reserve_blades = toy_reserve_blades};
    static const BodyOps tears = {.model = "toy",
                                  STILL_OPS,
                                  .cut = toy_cut,
                                  .tear = toy_tear,
                                  .reconstruct = toy_reconstruct,
                                  .reserve_blades = toy_reserve_blades};
    return !options->cuttable ? &splits : options->tears ? &tears : &cuts;
}

// ---------------------------------------------------------------------------------------------
// Creation

static double longest_edge(const TriMesh *mesh)
{
    double longest = 0.0;
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            Vec3 a = mesh->position[mesh->triangle[t][k]];
            Vec3 b = mesh->position[mesh->triangle[t][(k + 1) % 3]];
            longest = fmax(longest, vec3_length(vec3_sub(a, b)));
        }
    return longest;
}

static void create_arrays(Toy *toy, const char *name, const TriMesh *mesh, Arena *arena,
                          StateList *state)
{
    const size_t nodes = (size_t)toy->nodes;
    TOY_ARRAY(nodes, toy->position);
    TOY_ARRAY(nodes, toy->load);
    TOY_ARRAY(BODY_ADAPT_LEVEL + 1, toy->parameter);
    memcpy(toy->position, mesh->position, (size_t)toy->base_nodes * sizeof *toy->position);
    state_add(state, toy->position, nodes * sizeof *toy->position, "%s/position", name);
    state_add(state, toy->load, nodes * sizeof *toy->load, "%s/load", name);
    state_add(state, toy->parameter, (BODY_ADAPT_LEVEL + 1) * sizeof(double), "%s/parameter", name);
    TOY_ARRAY(nodes, toy->force);
    TOY_ARRAY(toy->faces, toy->neighbor);
    TOY_ARRAY(nodes, toy->face_start);
    TOY_ARRAY(nodes, toy->face_end);
    TOY_ARRAY(3 * toy->faces, toy->around);
    TOY_ARRAY(nodes, toy->node_area);
    TOY_ARRAY(nodes, toy->node_mass);
}

static BodySurface surface_of(const Toy *toy, const TriMesh *mesh)
{
    return (BodySurface){.node_count = toy->nodes,
                         .face_count = toy->faces,
                         .node_used = toy->cuts != NULL ? 0 : toy->nodes,
                         .face_used = toy->faces,
                         .face = (const int(*)[3])toy->face,
                         .face_area = toy->face_area,
                         .finest_area = toy->finest_area,
                         .face_neighbor = (const int(*)[3])toy->neighbor,
                         .node_face_start = toy->face_start,
                         .node_face_end = toy->face_end,
                         .node_face = toy->around,
                         .node_area = toy->node_area,
                         .node_mass = toy->node_mass,
                         .longest_edge = longest_edge(mesh)};
}

Body toy_body(Toy **out, const char *name, const TriMesh *mesh, const ToyOptions *options,
              Arena *arena, StateList *state)
{
    Toy *toy = TOY_ARRAY(1, *out);
    toy->base_nodes = mesh->node_count;
    toy->base_faces = mesh->triangle_count;
    if (options->cuttable)
        toy_cuts_create(toy, name, mesh, options, arena, state);
    else
        toy_splits_create(toy, name, mesh, arena, state);
    create_arrays(toy, name, mesh, arena, state);
    toy->parameter[BODY_STIFFNESS_SCALE] = toy->parameter[BODY_DAMPING_SCALE] = 1.0;
    Body body = {
        .ops = ops_of(options),
        .model = toy,
        .surface = surface_of(toy, mesh),
        .integrator = INTEGRATOR_SYMPLECTIC_EULER,
        .lambda = TOY_LAMBDA,
        .damping = TOY_DAMPING,
        .contact_lambda = TOY_LAMBDA,
        .finest_lambda = options->cuttable ? 0.0 : 4.0 * TOY_LAMBDA,
        .finest_damping = options->cuttable ? 0.0 : 4.0 * TOY_DAMPING,
        .contact_ratio = 0.5,
        .contact_damping = 2e-4,
        .tuning = {.stiffness_scale = 1.0, .damping_scale = 1.0},
    };
    snprintf(body.name, sizeof body.name, "%s", name);
    toy_rebuild(&body);
    return body;
}

void toy_move_node(Toy *toy, int node, Vec3 by)
{
    toy->position[node] = vec3_add(toy->position[node], by);
}

void toy_move(Toy *toy, Vec3 by)
{
    for (int i = 0; i < toy->nodes; i++)
        if (toy_is_active(toy, i))
            toy_move_node(toy, i, by);
}

// ---------------------------------------------------------------------------------------------
// Scenes

TriMesh toy_sheet(int cells, double cell)
{
    TriMesh mesh;
    ASSERT(generate_sheet(&mesh, cells + 1, cells + 1, cells * cell, cells * cell, &(Status){0}));
    return mesh;
}

bool toy_scene_try(ToyScene *scene, const ToySceneOptions *options, Status *status)
{
    static const char *const names[2] = {"wall", "twin"};
    const ToyOptions toy = {.cuttable = options->cuttable,
                            .tears = options->tears,
                            .quantum = options->cell / 1024.0,
                            .size = options->cell};
    *scene = (ToyScene){.mesh = toy_sheet(options->cells, options->cell),
                        .count = options->count == 0 ? 1 : options->count};
    SimOptions sim = {
        .rate_hz = options->rate_hz, .tool_timeout_s = 0.2, .may_load = options->may_load};
    scene->sim = sim_create(&sim, &scene->arena, &scene->state);
    for (int b = 0; b < scene->count; b++) {
        Body body =
            toy_body(&scene->toy[b], names[b], &scene->mesh, &toy, &scene->arena, &scene->state);
        body.time_step_wanted = options->time_step;
        body.unsafe_time_step = options->unsafe_time_step;
        body.contact_damping = options->contact_damping;
        scene->body[b] = sim_add_body(scene->sim, &body);
    }
    for (int t = 0; t < options->tool_count; t++)
        sim_add_tool(scene->sim, &options->tool[t]);
    bool good = sim_seal(scene->sim, 0.0, status);
    if (good)
        sim_set_lockstep(scene->sim, options->lockstep);
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

void toy_scene_touched(ToyScene *scene, int cells, double cell, const ToolOptions *tool)
{
    toy_scene_create(scene, &(ToySceneOptions){.cells = cells,
                                               .cell = cell,
                                               .lockstep = true,
                                               .rate_hz = 1000.0,
                                               .tool_count = 1,
                                               .tool = tool});
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
        memset(scene->toy[b]->force, 0, (size_t)scene->toy[b]->nodes * sizeof(Vec3));
    sim_step(scene->sim);
}
