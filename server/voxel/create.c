// Creates a voxel body from a lattice: elements, vertices, masses, batches, and what tools act on.
// Load time only.
#include "voxel/voxel.h"

#include "base/check.h"
#include "voxel/batch.h"
#include "voxel/cut/cut_body.h"
#include "voxel/model.h"
#include "voxel/setup.h"
#include "voxel/skin.h"
#include "voxel/stiffness.h"
#include "voxel/tables.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ALLOCATE(use, count, type, label)                                                          \
    (type *)arena_allocate(arena, (use), (size_t)(count), sizeof(type), "%s/%s", name, label)

// Intermediate results of the creation.
typedef struct Making {
    const VoxelOptions *options;
    const VoxelKernels *kernels;
    Layout layout;
    LatticeMesh mesh;
    ElementClass *classes; // [element_count]
    unsigned *mask;        // [element_count]
    double *density;       // [element_count] [kg/m3]
    VertexId *by_id;       // [vertex_count]
    bool *fixed;           // [vertex_count]
    double step;           // dt0: the smallest critical step of the elements [s]
    double lambda;         // bounds of M^-1 K and, per unit of beta, of M^-1 C [1/s2]
    double damping_lambda;
} Making;

static double edge_of(const Making *making, int element)
{
    return making->options->lattice->size * (double)(1 << making->layout.leaf[element].level);
}

// Adds an element's part to the bounds of the time step.
static void set_element(Making *making, int element, const Template *shape)
{
    const VoxelOptions *options = making->options;
    const VoxelMaterial *material = &options->material[making->layout.leaf[element].material - 1];
    const ElementBounds bounds = stiffness_of_element(
        options->law, material, edge_of(making, element), shape, &making->classes[element]);
    making->density[element] = material->density;
    making->lambda = fmax(making->lambda, bounds.lambda);
    making->damping_lambda = fmax(making->damping_lambda, bounds.damping);
    making->step = fmin(making->step, bounds.step);
}

static void make_elements(Making *making)
{
    const int count = making->layout.leaf_count;
    making->classes = calloc((size_t)count, sizeof *making->classes);
    making->mask = calloc((size_t)count, sizeof *making->mask);
    making->density = calloc((size_t)count, sizeof *making->density);
    ASSERT(making->classes != NULL && making->mask != NULL && making->density != NULL);
    making->step = (double)INFINITY;
    Template shape;
    template_create(&shape, 0);
    for (int e = 0; e < count; e++) {
        making->mask[e] = lattice_mesh_mask(&making->mesh, e);
        if (making->mask[e] != shape.mask)
            template_create(&shape, making->mask[e]);
        set_element(making, e, &shape);
    }
    const double beta = making->options->damping * making->step;
    for (int e = 0; e < count; e++)
        making->classes[e].damping *= beta;
}

static Vec3 place_of(const void *context, int vertex)
{
    const Making *making = context;
    const int *p = making->mesh.point[vertex];
    return lattice_point(making->options->lattice, p[0], p[1], p[2]);
}

static bool make_fixed(Making *making, Status *status)
{
    const int vertices = making->mesh.vertex_count;
    making->fixed = calloc((size_t)vertices, sizeof *making->fixed);
    ASSERT(making->fixed != NULL);
    return vertices_mark_fixed(&making->options->body, making->by_id, vertices, place_of, making,
                               making->fixed, status);
}

// Distributes each element's mass to its vertices by weight: total and first moment are exact.
static void make_masses(const Making *making, VoxelModel *model, double *total)
{
    const LatticeMesh *mesh = &making->mesh;
    Template shape;
    template_create(&shape, 0);
    for (int e = 0; e < mesh->element_count; e++) {
        if (making->mask[e] != shape.mask)
            template_create(&shape, making->mask[e]);
        const double edge = edge_of(making, e);
        const double mass = making->density[e] * edge * edge * edge;
        *total += mass;
        for (int i = 0; i < shape.count; i++) {
            bool unit = making->options->law == VOXEL_MIYAZAKI2004;
            double share = unit ? 1.0 / shape.count : shape.weight[i] / 8.0;
            model->vertices.mass[mesh->vertex[e][shape.node[i]]] += share * mass;
        }
    }
}

// One run of plain batches, one of batches of one template each, one of mixed ones.
static void list_runs(BatchRuns *runs)
{
    const int pure = runs->hanging.batch_count - runs->hanging.mixed_count;
    batch_runs_begin(runs, BATCH_PLAIN);
    batch_runs_add(runs, BATCH_PLAIN, (BatchRun){0, runs->plain.batch_count, false});
    batch_runs_end(runs, BATCH_PLAIN);
    batch_runs_begin(runs, BATCH_HANGING);
    batch_runs_add(runs, BATCH_HANGING, (BatchRun){0, pure, false});
    batch_runs_add(runs, BATCH_HANGING, (BatchRun){pure, runs->hanging.mixed_count, true});
    batch_runs_end(runs, BATCH_HANGING);
}

static void create_batches(VoxelModel *model, const Making *making, const char *name, Arena *arena,
                           StateList *state)
{
    const LatticeMesh *mesh = &making->mesh;
    int *element_class = calloc((size_t)mesh->element_count, sizeof *element_class);
    ASSERT(element_class != NULL);
    for (int e = 0; e < mesh->element_count; e++)
        element_class[e] = e; // batches_create merges equal ones
    const BatchOptions options = {
        .name = name,
        .element_count = mesh->element_count,
        .vertex = (const int(*)[NODE_COUNT])mesh->vertex,
        .element_class = element_class,
        .classes = making->classes,
        .vertex_count = mesh->vertex_count,
    };
    Batches batches;
    batches_create(&batches, &options, arena);
    free(element_class);
    BatchRuns *runs = ALLOCATE(ARENA_STEP, 1, BatchRuns, "batches");
    model->batches = runs;
    runs->kernels = making->kernels;
    runs->plain = batches.plain;
    runs->hanging = batches.hanging;
    runs->classes = batches.classes;
    runs->tables =
        voxel_tables_create(&batches, model->law, model->vertices.rows.precision, name, arena);
    batch_runs_create(runs, 3, name, arena, state);
    list_runs(runs);
}

static bool create_body(Body *body, Making *making, Arena *arena, StateList *state, Status *status)
{
    const VoxelOptions *options = making->options;
    const LatticeMesh *mesh = &making->mesh;
    const char *name = options->body.name;
    make_elements(making);
    VoxelModel *model = arena_allocate(arena, ARENA_STEP, 1, sizeof *model, "%s/model", name);
    model->law = options->law;
    model->surface_count = mesh->surface_count;
    model->element_count = mesh->element_count;
    for (int e = 0; e < mesh->element_count; e++)
        model->element_at_level[making->layout.leaf[e].level]++;
    Vertices *vertices = &model->vertices;
    vertices->kernels = vertex_kernels_find(options->body.precision, making->kernels->level);
    vertices->count = mesh->vertex_count;
    vertices->mass = ALLOCATE(ARENA_TOPOLOGY, mesh->vertex_count, double, "vertex masses");
    vertices->id = ALLOCATE(ARENA_TOPOLOGY, mesh->vertex_count, int, "vertex ids");
    memcpy(vertices->id, mesh->id, (size_t)mesh->vertex_count * sizeof *vertices->id);
    double mass = 0.0;
    make_masses(making, model, &mass);
    // The order matters: rows need masses, the frame needs rows, batches need the vertices'
    // precision.
    setup_vertices(vertices, options, (const int(*)[3])mesh->point, making->by_id, making->fixed,
                   mesh->element_count, mesh->surface_count, arena, state);
    setup_frame(vertices, name, arena, state);
    create_batches(model, making, name, arena, state);
    *body = body_of_options(&options->body, &voxel_ops, model);
    body->mass = mass;
    body->element_count = mesh->element_count;
    body->lambda = body->contact_lambda = making->lambda;
    body->damping = options->damping * making->step * making->damping_lambda;
    body->state_capacity = mesh->vertex_count;
    voxel_create_surface(model, body, mesh, options, arena);
    if (options->skin == NULL) {
        voxel_create_mesh(model, body, mesh, options->publish_all, name, arena);
        return true;
    }
    model->skin = skin_create(body, options->skin, options->lattice, &making->layout, mesh,
                              &model->vertices.rows, arena, status);
    return model->skin != NULL;
}

bool voxel_create(Body *body, const VoxelOptions *options, Arena *arena, StateList *state,
                  Status *status)
{
    if (options->body.cuttable)
        return cut_body_create(body, options, arena, state, status);
    const char *isa = options->body.isa == NULL ? "auto" : options->body.isa;
    Making making = {.options = options,
                     .kernels = voxel_kernels_find(options->body.precision, isa)};
    layout_create(&making.layout, options->lattice, options->body.levels);
    bool ok = lattice_mesh_create(&making.mesh, &making.layout, status);
    ok = ok && vertices_can_create(&options->body, making.kernels != NULL, making.mesh.vertex_count,
                                   status);
    if (ok)
        making.by_id = vertex_ids_sort(making.mesh.id, making.mesh.vertex_count);
    ok = ok && make_fixed(&making, status) && create_body(body, &making, arena, state, status);
    lattice_mesh_destroy(&making.mesh);
    layout_destroy(&making.layout);
    free(making.by_id);
    free(making.classes);
    free(making.mask);
    free(making.density);
    free(making.fixed);
    return ok;
}
