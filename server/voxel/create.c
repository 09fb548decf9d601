// SPDX-License-Identifier: MIT
// Creates a voxel body from a lattice: elements, vertices, masses, batches, and what tools act on.
// Load time only.
#include "base/check.h"

#include "voxel/batch.h"
#include "voxel/cut/cut_body.h"
#include "voxel/error.h"
#include "voxel/fitted_body.h"
#include "voxel/model.h"
#include "voxel/skin.h"
#include "voxel/template.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Least number of elements for two threads: with fewer, calling a thread costs more than it saves.
enum { HALVED_LEAST = 2000 };

// ---------------------------------------------------------------------------------------------
// Stiffness of elements, and the time step that it requires

double voxel_critical_step(const SolidMaterial *material, double size)
{
    return size * sqrt(material->density * (1.0 - 2.0 * material->poisson_ratio) /
                       material->youngs_modulus);
}

// Returns k for the paper's unit weights: an element with hanging vertices then has the energy of
// one with 8 corners under the same uniform stretch, averaged over the axes.
static double paper_stiffness(const Template *shape, double mu, double edge)
{
    return mu * edge * 6.0 / template_spread(shape); // 8 corners of the unit cube: 6
}

// The largest eigenvalue of M^-1 K of a plain cube is max(4 (2 mu + 3 lambda), 8 alpha mu) / (rho
// H^2) (README.md, "Critical time step"); with hanging vertices it is at most twice that of its own
// cube (tests/voxel/test_voxel_bound.c: 1.81 with nu = 0, less with larger nu).
ElementBounds stiffness_of_element(VoxelLaw law, const SolidMaterial *material, double edge,
                                   const Template *shape, ElementClass *out)
{
    // Lame's parameters, and the residual that makes pure bending exact.
    const double nu = material->poisson_ratio;
    const double mu = material->youngs_modulus / (2.0 * (1.0 + nu));
    const double lambda = 2.0 * mu * nu / (1.0 - 2.0 * nu), alpha = (1.0 + nu) / 3.0;
    *out = (ElementClass){.size = edge,
                          .mu = mu,
                          .lambda = lambda,
                          .residual = alpha * mu * edge,
                          .damping = mu * edge,
                          .share = 1.0};
    // Bounds of a plain cube.
    const double mass = material->density * edge * edge * edge;
    double most = 8.0 * mu + 12.0 * lambda, rate = 8.0 * out->damping / mass;
    // The paper's springs, or the factor 2 of hanging vertices.
    if (law == VOXEL_MIYAZAKI2004) {
        out->residual = out->damping = paper_stiffness(shape, mu, edge);
        rate = shape->count * out->residual / mass;
        most = rate * material->density * edge * edge;
    } else if (shape->mask != 0) {
        most *= 2.0, rate *= 2.0;
    }
    return (ElementBounds){
        .lambda = most / (material->density * edge * edge),
        .damping = rate,
        .step = voxel_critical_step(material, edge),
    };
}

// ---------------------------------------------------------------------------------------------
// The body

static double edge_of(const VoxelMaking *making, int element)
{
    return making->options->lattice->size * (double)(1 << making->layout.leaf[element].level);
}

static void add_bounds(VoxelMaking *making, const ElementBounds *bounds)
{
    const VoxelOptions *options = making->options;
    const double rigidity = maxwell_rigidity(options->branch_count, options->branch);
    // Branches are beside the elastic law, which alone stiffens.
    making->lambda = fmax(
        making->lambda, (rigidity + (stiffening_cap(&options->stiffening) - 1.0)) * bounds->lambda);
    making->elastic = fmax(making->elastic, bounds->lambda);
    making->damping_lambda = fmax(making->damping_lambda, bounds->damping);
    making->step = fmin(making->step, bounds->step);
}

static void set_element(VoxelMaking *making, int element, const Template *shape)
{
    const VoxelOptions *options = making->options;
    const SolidMaterial *material = &options->material[making->layout.leaf[element].material - 1];
    ElementBounds bounds = stiffness_of_element(options->law, material, edge_of(making, element),
                                                shape, &making->classes[element]);
    add_bounds(making, &bounds);
    making->density[element] = material->density;
    if (!voxel_changes(options))
        return;
    // It may be divided into the smallest ones.
    Template plain;
    ElementClass cell;
    template_create(&plain, 0);
    bounds = stiffness_of_element(options->law, material, options->lattice->size, &plain, &cell);
    // Partly filled elements are not above their finest cells, but for 1.02 near nu = 0
    // (tests/voxel/test_voxel_bound.c: 1.0192 with nu = 0, 1 from 0.03 on).
    if (options->surface_level > 0 && material->poisson_ratio < 0.03)
        bounds.lambda *= 1.02;
    add_bounds(making, &bounds);
}

static void make_elements(VoxelMaking *making)
{
    const int count = making->layout.leaf_count;
    making->classes = calloc((size_t)count, sizeof *making->classes);
    making->mask = calloc((size_t)count, sizeof *making->mask);
    making->density = calloc((size_t)count, sizeof *making->density);
    ASSERT(making->classes != NULL && making->mask != NULL && making->density != NULL);
    making->step = (double)INFINITY;
    Template shape;
    template_create(&shape, 0);
    // Most neighbours have the same shape: make it only when it changes.
    for (int e = 0; e < count; e++) {
        making->mask[e] = template_mask_of(making->mesh.vertex[e]);
        if (making->mask[e] != shape.mask)
            template_create(&shape, making->mask[e]);
        set_element(making, e, &shape);
    }
    // Damping is a time, or in units of the smallest critical step.
    const VoxelOptions *options = making->options;
    making->beta =
        options->damping_time > 0.0 ? options->damping_time : options->damping * making->step;
    for (int e = 0; e < count; e++)
        making->classes[e].damping *= making->beta;
}

static Vec3 rest_of(const void *context, int vertex)
{
    const VoxelMaking *making = context;
    const int *p = making->mesh.point[vertex];
    return lattice_point(making->options->lattice, p[0], p[1], p[2]);
}

static bool make_fixed(VoxelMaking *making, Status *status)
{
    const int vertices = making->mesh.vertex_count;
    making->fixed = calloc((size_t)vertices, sizeof *making->fixed);
    ASSERT(making->fixed != NULL);
    return vertices_mark_fixed(&making->options->body, making->by_id, vertices, rest_of, making,
                               making->fixed, status);
}

static double mass_of(const VoxelMaking *making, int element)
{
    const double edge = edge_of(making, element);
    return making->density[element] * edge * edge * edge;
}

// Distributes each element's mass to its vertices by weight: total and first moment are exact.
static void add_masses(const VoxelMaking *making, double *to)
{
    const LatticeMesh *mesh = &making->mesh;
    Template shape;
    template_create(&shape, 0);
    for (int e = 0; e < mesh->element_count; e++) {
        if (making->mask[e] != shape.mask)
            template_create(&shape, making->mask[e]);
        const double mass = mass_of(making, e);
        for (int i = 0; i < shape.count; i++) {
            // The paper gives all vertices of an element the same share.
            bool unit = making->options->law == VOXEL_MIYAZAKI2004;
            double share = unit ? 1.0 / shape.count : shape.weight[i] / 8.0;
            to[mesh->vertex[e][shape.node[i]]] += share * mass;
        }
    }
}

// Hangs masses on vertices. Returns false with a status if there are none for one of them.
static bool hang_weights(VoxelMaking *making, Status *status)
{
    const VoxelOptions *options = making->options;
    const int vertices = making->mesh.vertex_count;
    making->hung = calloc((size_t)vertices, sizeof *making->hung);
    bool *inside = calloc((size_t)vertices, sizeof *inside);
    ASSERT(making->hung != NULL && inside != NULL);
    bool whole = true;
    for (int w = 0; w < options->weight_count && whole; w++) {
        const BodyOptions region = {.fixed_count = 1, .fixed = &options->weight[w].region};
        int count = 0;
        memset(inside, 0, (size_t)vertices * sizeof *inside);
        whole =
            vertices_mark_fixed(&region, making->by_id, vertices, rest_of, making, inside, status);
        for (int v = 0; v < vertices; v++)
            count += inside[v];
        if (whole && count == 0)
            whole = status_fail(status, STATUS_INVALID, "weights: entry %d holds no vertex", w + 1);
        for (int v = 0; v < vertices && whole; v++)
            making->hung[v] += inside[v] ? options->weight[w].mass / count : 0.0;
    }
    free(inside);
    return whole;
}

// One run of each kind.
static void list_runs(BatchRuns *runs)
{
    batch_runs_begin(runs, BATCH_PLAIN);
    batch_runs_add(runs, BATCH_PLAIN, (BatchRun){0, runs->plain.batch_count});
    batch_runs_end(runs, BATCH_PLAIN);
    batch_runs_begin(runs, BATCH_HANGING);
    batch_runs_add(runs, BATCH_HANGING, (BatchRun){0, runs->hanging.batch_count});
    batch_runs_end(runs, BATCH_HANGING);
}

static void create_batches(VoxelModel *model, const VoxelMaking *making, const char *name,
                           Arena *arena, StateList *state)
{
    const LatticeMesh *mesh = &making->mesh;
    // Every element brings a class of its own.
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
    // The kernels see all batches, in one run of each kind.
    BatchRuns *runs = ALLOCATE(ARENA_STEP, 1, BatchRuns, "batches");
    model->batches = runs;
    runs->kernels = making->kernels;
    runs->plain = batches.plain;
    runs->hanging = batches.hanging;
    runs->classes = batches.classes;
    runs->tables =
        voxel_tables_create(&batches, model->law, model->vertices.rows.precision, name, arena);
    batch_runs_create(runs, BATCH_KINDS, name, arena, state);
    if (making->options->branch_count > 0)
        batch_runs_relax(runs, making->options->branch_count, making->options->branch,
                         model->vertices.rows.precision, name, arena, state);
    list_runs(runs);
    // For status messages.
    int *at_level = ALLOCATE(ARENA_TOPOLOGY, VOXEL_LEVELS_MAX + 1, int, "elements by level");
    for (int e = 0; e < mesh->element_count; e++)
        at_level[making->layout.leaf[e].level]++;
    model->element_at_level = at_level;
}

// ---------------------------------------------------------------------------------------------
// The body

static void create_rows(Vertices *vertices, const VoxelMaking *making, Arena *arena)
{
    const Lattice *lattice = making->options->lattice;
    const LatticeMesh *mesh = &making->mesh;
    const double middle[3] = {0.5 * lattice->count[0], 0.5 * lattice->count[1],
                              0.5 * lattice->count[2]};
    Rows *rows = &vertices->rows;
    rows->longest_edge = lattice->size;
    // Rest positions are relative to the middle of the lattice.
    rows->rest_origin = lattice_point(lattice, middle[0], middle[1], middle[2]);
    rows->rest_turn = lattice->turn;
    rows->rest = arena_allocate(arena, ARENA_STEP, (size_t)making->capacity + 1, sizeof *rows->rest,
                                "%s/places", making->options->body.name);
    for (int i = 0; i < making->start; i++)
        for (int c = 0; c < 3; c++)
            rows->rest[i][c] = lattice->size * (mesh->point[i][c] - middle[c]);
}

static void create_vertices(VoxelModel *model, const VoxelMaking *making, const char *name,
                            Arena *arena, StateList *state)
{
    const VoxelOptions *options = making->options;
    const LatticeMesh *mesh = &making->mesh;
    const int *cells = options->lattice->count;
    Vertices *vertices = &model->vertices;
    // Room for all vertices that cuts may add; two threads for large bodies.
    vertices->kernels = vertex_kernels_find(options->body.precision, making->kernels->level);
    vertices->count = making->start;
    vertices->capacity = making->capacity;
    vertices->team = options->body.team;
    vertices->halved = mesh->element_count >= HALVED_LEAST;
    // Masses and ids; those of a cut body belong to its lattice.
    vertices->mass = ALLOCATE(ARENA_TOPOLOGY, making->capacity, double, "vertex masses");
    if (making->rest_id == NULL) // else its elements say
        add_masses(making, vertices->mass);
    for (int v = 0; v < mesh->vertex_count && making->hung != NULL; v++)
        vertices->mass[v] += making->hung[v];
    if (model->cuts != NULL) {
        vertices->id = model->cuts->lattice.vertex_id;
    } else {
        vertices->id = ALLOCATE(ARENA_TOPOLOGY, mesh->vertex_count, int, "vertex ids");
        memcpy(vertices->id, mesh->id, (size_t)mesh->vertex_count * sizeof *vertices->id);
    }
    // Rows and what else all solids have.
    create_rows(vertices, making, arena);
    vertices->damping_time = making->beta;
    vertices->drag = options->drag;
    vertices_create(vertices, &options->body, making->by_id, making->fixed,
                    model->cuts != NULL ? making->capacity : mesh->surface_count,
                    options->lattice->size * (cells[0] + cells[1] + cells[2]), arena, state);
}

// Creates the frame that follows a floating body, weighted by the masses.
static void create_frame(Vertices *vertices, const VoxelCuts *cuts, const char *name, Arena *arena,
                         StateList *state)
{
    Rows *rows = &vertices->rows;
    if (!rows->floating)
        return;
    double *weight = ALLOCATE(ARENA_STEP, rows->count, double, "frame weights");
    // Of a body that adapts those that it always has: the shown ones.
    for (int v = 0; v < vertices->count; v++)
        weight[v] = cuts == NULL || !cuts->lattice.adapts    ? vertices->mass[v]
                    : cut_lattice_is_kept(&cuts->lattice, v) ? cuts->masses.node_mass[v]
                                                             : 0.0;
    rows->rigid = rigid_frame_create(name, rows->precision, true, rows->count,
                                     (const double(*)[3])rows->rest, weight, arena, state);
}

static void describe(Body *body, VoxelModel *model, const VoxelMaking *making)
{
    const VoxelOptions *options = making->options;
    const bool tears = options->tear_stress > 0.0 || options->tear_force > 0.0;
    const bool adapts = options->surface_level > 0;
    const BodyOps *ops = options->body.cuttable
                             ? &voxel_ops_of_cuttable[adapts][tears][options->heats]
                             : &voxel_ops[adapts];
    // Mass, counts and bounds, which cuts will change.
    *body = body_of_options(&options->body, ops, model);
    for (int e = 0; e < making->mesh.element_count; e++)
        body->mass += mass_of(making, e);
    for (int w = 0; w < options->weight_count; w++)
        body->mass += options->weight[w].mass;
    body->element_count = making->mesh.element_count;
    body->fine_elements = adapts ? making->mesh.element_count : 0;
    body->spare_nodes =
        making->rest_id != NULL ? making->capacity - making->rest_count : 0; // at load
    body->lambda = body->contact_lambda = making->lambda;
    body->damping = making->beta * (model->viscous ? making->elastic : making->damping_lambda) *
                    sqrt(stiffening_cap(&options->stiffening));
    body->damping_time = making->beta;
    body->drag = options->drag;
    body->state_capacity = making->capacity;
}

static bool create_surface(VoxelModel *model, const VoxelMaking *making, Body *body, Arena *arena,
                           Status *status)
{
    const VoxelOptions *options = making->options;
    const LatticeMesh *mesh = &making->mesh;
    voxel_create_surface(model, body, mesh, options, arena);
    if (options->skin != NULL)
        model->skin = skin_create(body, options->skin, options->lattice, &making->layout, mesh,
                                  &model->vertices.rows, arena, status);
    else
        voxel_create_mesh(model, body, mesh, options->publish_all, options->body.name, arena);
    if (options->skin == NULL && options->field != NULL && !options->publish_all)
        fitted_create(model, body, mesh, &making->layout, options, arena);
    return options->skin == NULL || model->skin != NULL;
}

static const VoxelStiffening *create_stiffening(const Stiffening *options, const char *name,
                                                Arena *arena)
{
    VoxelStiffening *stiffening = ALLOCATE(ARENA_STEP, 1, VoxelStiffening, "stiffening");
    *stiffening = (VoxelStiffening){options->strain, stiffening_curve(options->cap)};
    return stiffening;
}

static bool create_body(Body *body, VoxelMaking *making, Arena *arena, StateList *state,
                        Status *status)
{
    const VoxelOptions *options = making->options;
    const bool changes = voxel_changes(options);
    const char *name = options->body.name;
    make_elements(making);
    VoxelModel *model = ALLOCATE(ARENA_STEP, 1, VoxelModel, "model");
    model->law = options->law;
    model->viscous = options->damping_time > 0.0 && options->law == VOXEL_AFFINE;
    model->surface_count = making->mesh.surface_count;
    if (stiffening_is_on(&options->stiffening))
        model->stiffening = create_stiffening(&options->stiffening, name, arena);
    // The order matters: rows need masses, the frame needs rows, batches need the vertices'
    // precision.
    if (changes && !cut_body_create_elements(model, making, arena, state, status))
        return false;
    create_vertices(model, making, name, arena, state);
    if (changes)
        cut_body_create_masses(model, making, arena);
    create_frame(&model->vertices, model->cuts, name, arena, state);
    if (changes)
        cut_body_create_batches(model, making, arena, state);
    else
        create_batches(model, making, name, arena, state);
    if (options->body.estimate_error)
        model->error = voxel_error_create(making->capacity, name, arena,
                                          options->body.adapt_error > 0.0 ? state : NULL);
    describe(body, model, making);
    if (options->skin == NULL) {
        body->element_at_level = model->element_at_level;
        body->element_levels = VOXEL_LEVELS_MAX + 1;
        for (int d = 0; d < 3; d++)
            model->points[d] = making->layout.lattice_count[d] + 1;
    }
    return changes ? cut_body_create_surface(model, making, body, arena, state, status)
                   : create_surface(model, making, body, arena, status);
}

ISA_KERNELS(VoxelKernels, voxel);

const VoxelKernels *voxel_kernels_find(Precision precision, const char *level)
{
    IsaLevel found = isa_find(level);
    return found == ISA_COUNT ? NULL : voxel_kernels[precision][found];
}

bool voxel_create(Body *body, const VoxelOptions *options, Arena *arena, StateList *state,
                  Status *status)
{
    const char *isa = options->body.isa == NULL ? "auto" : options->body.isa;
    VoxelMaking making = {.options = options,
                          .kernels = voxel_kernels_find(options->body.precision, isa)};
    // Elements and vertices.
    layout_create(&making.layout, options->lattice, options->body.levels);
    bool ok = lattice_mesh_create(&making.mesh, &making.layout, status);
    if (ok && options->surface_level > 0)
        lattice_mesh_sort(&making.mesh, options->body.levels > options->surface_level
                                            ? options->body.levels
                                            : options->surface_level);
    making.start = making.capacity = making.mesh.vertex_count;
    // At rest nothing needs to be fine. What starts deformed merges as it comes to rest.
    if (ok && options->surface_level > 0 && options->body.initial_position == NULL)
        ok = cut_body_find_rest(&making, status);
    // Refuse what does not fit.
    ok = ok &&
         vertices_can_create(&options->body, making.kernels != NULL, making.mesh.vertex_count,
                             status) &&
         (!voxel_changes(options) || cut_body_check(&making, status));
    // The body itself.
    if (ok)
        making.by_id = vertex_ids_sort(making.mesh.id, making.mesh.vertex_count);
    ok = ok && make_fixed(&making, status) &&
         (options->weight_count == 0 || hang_weights(&making, status)) &&
         create_body(body, &making, arena, state, status);
    // What was needed to build it.
    lattice_mesh_destroy(&making.mesh);
    layout_destroy(&making.layout);
    free(making.by_id);
    free(making.classes);
    free(making.mask);
    free(making.density);
    free(making.fixed);
    free(making.hung);
    free(making.rest_id);
    free(making.divided);
    return ok;
}
