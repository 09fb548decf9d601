// Creates a voxel body that can be cut. Load time only.
#include "voxel/cut/cut_body.h"

#include "base/check.h"
#include "voxel/lattice_mesh.h"
#include "voxel/setup.h"
#include "voxel/stiffness.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ALLOCATE(use, count, type, label)                                                          \
    (type *)arena_allocate(arena, (use), (size_t)(count), sizeof(type), "%s/%s", name, label)

// Intermediate results of the creation.
typedef struct Making {
    const VoxelOptions *options;
    Layout layout;
    LatticeMesh mesh;    // of the uncut body
    VertexId *by_id;     // [vertex_count]
    bool *fixed;         // [vertex_count]
    unsigned char *held; // see CutMasses
    int capacity;
    double step, lambda, damping_lambda; // bounds of the body, from its smallest elements
} Making;

// Returns the vertex capacity: twice the vertices of the fully divided body, because a broken face
// is assumed to need four new vertices until it is known how many it needs, about one.
static int choose_capacity(const VoxelOptions *options, const LatticeMesh *mesh, Status *status)
{
    enum { LEAST = 1024 };
    if (options->body.node_capacity > 0)
        return options->body.node_capacity;
    Layout finest;
    LatticeMesh divided;
    layout_create(&finest, options->lattice, 0);
    long count = 0;
    if (lattice_mesh_create(&divided, &finest, status))
        count = 2L * divided.vertex_count + LEAST;
    lattice_mesh_destroy(&divided);
    layout_destroy(&finest);
    ASSERT(count >= mesh->vertex_count && count < INT_MAX);
    return (int)count;
}

// ---------------------------------------------------------------------------------------------
// Fixed points

static long point_index(const Making *making, const int point[3])
{
    const int *n = making->layout.lattice_count;
    return ((long)point[2] * (n[1] + 1) + point[1]) * (n[0] + 1) + point[0];
}

// Returns the slots around the point of a vertex that belong to its part, from the leaves that have
// it.
static unsigned char slots_of_vertex(const Making *making, int vertex)
{
    const LatticeMesh *mesh = &making->mesh;
    const int *point = mesh->point[vertex];
    unsigned char slots = 0;
    for (int s = 0; s < 8; s++) {
        const int leaf = layout_leaf_at(&making->layout, point[0] - 1 + (s & 1),
                                        point[1] - 1 + (s >> 1 & 1), point[2] - 1 + (s >> 2));
        bool has = false;
        for (int n = 0; n < NODE_COUNT && leaf >= 0; n++)
            has |= mesh->vertex[leaf][n] == vertex;
        slots |= (unsigned char)(has << s);
    }
    return slots;
}

static bool hold_nodes(Making *making, const FixedRegion *region, Status *status)
{
    const LatticeMesh *mesh = &making->mesh;
    for (int k = 0; k < region->node_count; k++) {
        int vertex =
            vertex_ids_find_fixed(making->by_id, mesh->vertex_count, region->node[k], status);
        if (vertex < 0)
            return false;
        making->held[point_index(making, mesh->point[vertex])] |= slots_of_vertex(making, vertex);
    }
    return true;
}

static void hold_points(Making *making, const FixedRegion *region)
{
    const int *n = making->layout.lattice_count;
    int p[3];
    for (p[2] = 0; p[2] <= n[2]; p[2]++)
        for (p[1] = 0; p[1] <= n[1]; p[1]++)
            for (p[0] = 0; p[0] <= n[0]; p[0]++)
                if (fixed_contains(region,
                                   lattice_point(making->options->lattice, p[0], p[1], p[2])))
                    making->held[point_index(making, p)] = 0xff;
}

static bool make_fixed(Making *making, const char *name, Arena *arena, Status *status)
{
    const VoxelOptions *options = making->options;
    const LatticeMesh *mesh = &making->mesh;
    const int *n = making->layout.lattice_count;
    making->held =
        ALLOCATE(ARENA_TOPOLOGY, point_index(making, n) + 1, unsigned char, "fixed points");
    for (int r = 0; r < options->body.fixed_count; r++) {
        const FixedRegion *region = &options->body.fixed[r];
        if (region->kind != FIXED_NODES)
            hold_points(making, region);
        else if (!hold_nodes(making, region, status))
            return false;
    }
    making->fixed = calloc((size_t)mesh->vertex_count + 1, sizeof *making->fixed);
    ASSERT(making->fixed != NULL);
    for (int v = 0; v < mesh->vertex_count; v++) {
        const unsigned char held = making->held[point_index(making, mesh->point[v])];
        making->fixed[v] = held == 0xff || (held & slots_of_vertex(making, v)) != 0;
    }
    return true;
}

// ---------------------------------------------------------------------------------------------
// Elements

static int class_of(const VoxelOptions *options, int level, int material)
{
    return level * options->material_count + material;
}

static bool has_material(const Making *making, int material)
{
    for (int e = 0; e < making->layout.leaf_count; e++)
        if (making->layout.leaf[e].material == material + 1)
            return true;
    return false;
}

// Sets classes and masses by level and material. The smallest elements, which any element may be
// divided into, bound the step: those with hanging vertices are at least twice as large, and have
// at most twice the largest eigenvalue of their own cube.
static void make_classes(Making *making, ElementClass *classes, double *mass)
{
    const VoxelOptions *options = making->options;
    Template plain;
    template_create(&plain, 0);
    making->step = (double)INFINITY;
    for (int m = 0; m < options->material_count; m++)
        for (int level = 0; level <= making->layout.levels; level++) {
            const double edge = options->lattice->size * (double)(1 << level);
            const ElementBounds bounds =
                stiffness_of_element(options->law, &options->material[m], edge, &plain,
                                     &classes[class_of(options, level, m)]);
            mass[class_of(options, level, m)] = options->material[m].density * edge * edge * edge;
            if (level > 0 || !has_material(making, m))
                continue;
            making->lambda = fmax(making->lambda, bounds.lambda);
            making->damping_lambda = fmax(making->damping_lambda, bounds.damping);
            making->step = fmin(making->step, bounds.step);
        }
    const int count = options->material_count * (making->layout.levels + 1);
    for (int c = 0; c < count; c++)
        classes[c].damping *= options->damping * making->step;
}

// ---------------------------------------------------------------------------------------------
// Vertices

static void create_vertices(VoxelModel *model, const Making *making, const VoxelKernels *kernels,
                            const char *name, Arena *arena, StateList *state)
{
    const LatticeMesh *mesh = &making->mesh;
    Vertices *vertices = &model->vertices;
    vertices->kernels = vertex_kernels_find(making->options->body.precision, kernels->level);
    vertices->capacity = making->capacity;
    vertices->count = mesh->vertex_count;
    vertices->mass = ALLOCATE(ARENA_TOPOLOGY, making->capacity, double, "vertex masses");
    vertices->id = model->cuts->lattice.vertex_id;
    for (int v = 0; v < vertices->count; v++)
        vertices->mass[v] = 1.0; // set below
    setup_vertices(vertices, making->options, (const int(*)[3])mesh->point, making->by_id,
                   making->fixed, mesh->element_count, making->capacity, arena, state);
}

static void create_masses(VoxelModel *model, const Making *making, const double *mass,
                          const char *name, Arena *arena)
{
    CutMasses *masses = &model->cuts->masses;
    masses->lattice = &model->cuts->lattice;
    masses->templates = &model->cuts->templates;
    masses->vertices = &model->vertices;
    masses->law = model->law;
    masses->size = making->options->lattice->size;
    for (int d = 0; d < 3; d++)
        masses->middle[d] = 0.5 * making->options->lattice->count[d];
    masses->mass = mass;
    masses->material_count = making->options->material_count;
    masses->held = making->held;
    cut_masses_create(masses, name, arena);
    cut_masses_derive(masses);
}

// ---------------------------------------------------------------------------------------------

static bool check_options(const Making *making, const VoxelKernels *kernels, Status *status)
{
    const VoxelOptions *options = making->options;
    const int vertices = making->mesh.vertex_count;
    if (!vertices_can_create(&options->body, kernels != NULL, vertices, status))
        return false;
    if (options->skin != NULL)
        return status_fail(status, STATUS_INVALID,
                           "body %s: a skin does not follow cuts; leave it out or set cuttable = "
                           "false",
                           options->body.name);
    if (vertices > making->capacity)
        return status_fail(status, STATUS_INVALID,
                           "body %s has %d vertices to start with, capacity.nodes is %d",
                           options->body.name, vertices, making->capacity);
    return true;
}

static bool tears(const VoxelOptions *options)
{
    return options->tear_stress > 0.0 || options->tear_force > 0.0;
}

static void describe(Body *body, VoxelModel *model, const Making *making, const double *mass)
{
    const VoxelOptions *options = making->options;
    *body = body_of_options(&options->body,
                            tears(options) ? &voxel_ops_of_tearing : &voxel_ops_of_cuttable, model);
    body->element_count = model->cuts->lattice.leaf_count;
    body->lambda = body->contact_lambda = making->lambda;
    body->damping = options->damping * making->step * making->damping_lambda;
    body->state_capacity = making->capacity;
    for (int e = 0; e < making->layout.leaf_count; e++) {
        const Leaf *leaf = &making->layout.leaf[e];
        body->mass += mass[class_of(options, leaf->level, leaf->material - 1)];
    }
}

static bool create_body(Body *body, Making *making, const VoxelKernels *kernels, Arena *arena,
                        StateList *state, Status *status)
{
    const VoxelOptions *options = making->options;
    const char *name = options->body.name;
    const int classes_count = options->material_count * (making->layout.levels + 1);
    ElementClass *classes = ALLOCATE(ARENA_STEP, classes_count, ElementClass, "element classes");
    double *mass = ALLOCATE(ARENA_TOPOLOGY, classes_count, double, "element masses");
    char *own_name = ALLOCATE(ARENA_TOPOLOGY, strlen(name) + 1, char, "name");
    VoxelModel *model = ALLOCATE(ARENA_STEP, 1, VoxelModel, "model");
    VoxelCuts *cuts = ALLOCATE(ARENA_STEP, 1, VoxelCuts, "cuts");
    memcpy(own_name, name, strlen(name) + 1);
    cuts->name = own_name;
    cuts->sound = true;
    model->law = options->law;
    model->cuts = cuts;
    make_classes(making, classes, mass);
    if (!cut_lattice_create(&cuts->lattice, name, &making->layout, making->capacity,
                            options->split_budget, arena, state, status))
        return false;
    template_cache_create(&cuts->templates, name, options->law, options->body.precision, arena);

    Vertices *vertices = &model->vertices;
    create_vertices(model, making, kernels, name, arena, state);
    create_masses(model, making, mass, name, arena);
    setup_frame(vertices, name, arena, state); // weighted by the vertices of the uncut body

    const WindowOptions windows = {.name = name,
                                   .kernels = kernels,
                                   .lattice = &cuts->lattice,
                                   .templates = &cuts->templates,
                                   .material_count = options->material_count,
                                   .classes = classes};
    cut_windows_create(&cuts->windows, &windows, arena, state);
    model->batches = &cuts->windows.runs;
    if (tears(options))
        cut_tear_create(&cuts->tear, name, options->tear_stress, options->tear_force,
                        &cuts->windows, vertices, model->law, arena, state);
    cut_pieces_create(&cuts->pieces, name, &cuts->lattice, &making->mesh, &making->layout, arena,
                      state);
    cut_blades_create(&cuts->blades, name, &cuts->lattice, &vertices->rows, options->lattice->size,
                      arena);
    describe(body, model, making, mass);
    return cut_faces_create(&cuts->faces, name, &cuts->lattice, &cuts->pieces, vertices,
                            &making->mesh, &making->layout, options->lattice->size,
                            options->body.face_capacity, options->publish_all,
                            options->body.without_contacts, body, arena, state, status);
}

bool cut_body_create(Body *body, const VoxelOptions *options, Arena *arena, StateList *state,
                     Status *status)
{
    const char *isa = options->body.isa == NULL ? "auto" : options->body.isa;
    Making making = {.options = options};
    layout_create(&making.layout, options->lattice, options->body.levels);
    bool ok = lattice_mesh_create(&making.mesh, &making.layout, status);
    const VoxelKernels *kernels = voxel_kernels_find(options->body.precision, isa);
    if (ok)
        making.capacity = choose_capacity(options, &making.mesh, status);
    ok = ok && check_options(&making, kernels, status);
    if (ok)
        making.by_id = vertex_ids_sort(making.mesh.id, making.mesh.vertex_count);
    ok = ok && make_fixed(&making, options->body.name, arena, status) &&
         create_body(body, &making, kernels, arena, state, status);
    lattice_mesh_destroy(&making.mesh);
    layout_destroy(&making.layout);
    free(making.by_id);
    free(making.fixed);
    return ok;
}
