// Makes a plane body from a lattice of one layer: elements, vertices, masses, batches. Load time
// only.
#include "voxel/plane/plane_model.h"

#include "base/check.h"
#include "voxel/vertex_ids.h"

#include <stdlib.h>
#include <string.h>

#define ALLOCATE(use, count, type, label)                                                          \
    (type *)arena_allocate(arena, (use), (size_t)(count), sizeof(type), "%s/%s", name, label)

enum { SHAPES = 16 * 512 }; // quarters and present places, as a key

// What creation needs between its steps.
typedef struct Making {
    const VoxelOptions *options;
    PlaneLayout layout;
    PlaneMesh mesh;
    bool *fixed;           // [vertex_count]
    VertexId *by_id;       // [vertex_count]
    short *shape;          // [SHAPES] where in `shapes`, from 1; 0: it does not occur
    PlaneShape *shapes;    // those that occur
    double lambda;         // bound of M^-1 K [1/s2]
    double damping_lambda; // of M^-1 C [1/s], a second of beta
} Making;

// ---------------------------------------------------------------------------------------------
// Elements

static const VoxelMaterial *material_of(const Making *making, int element)
{
    return &making->options->material[making->layout.element[element].material - 1];
}

static double mass_of(const Making *making, const PlaneForm *form, int element)
{
    double thickness = making->options->lattice->size;
    return material_of(making, element)->density * form->shape->extent * form->size * form->size *
           thickness;
}

static int key_of(const Making *making, int element)
{
    return making->layout.element[element].quarters * 512 +
           (int)plane_mesh_present(&making->mesh, element);
}

static void make_shapes(Making *making, const char *name, Arena *arena)
{
    short count = 0;
    making->shape = calloc(SHAPES, sizeof *making->shape);
    ASSERT(making->shape != NULL);
    for (int e = 0; e < making->layout.element_count; e++)
        if (making->shape[key_of(making, e)] == 0)
            making->shape[key_of(making, e)] = ++count;
    making->shapes = ALLOCATE(ARENA_TOPOLOGY, count, PlaneShape, "shapes of elements");
    for (int key = 0; key < SHAPES; key++)
        if (making->shape[key] != 0)
            plane_shape_create(&making->shapes[making->shape[key] - 1], making->options->law,
                               (unsigned)key / 512, (unsigned)key % 512);
}

// The shares of an element's mass are those of its stiffness, so that the largest eigenvalue of the
// body is at most that of its worst element.
static void make_forms(Making *making, PlaneModel *model, const char *name, Arena *arena)
{
    const VoxelOptions *options = making->options;
    const double thickness = options->lattice->size;
    // Eigenvalues for E = 1, once a shape and material.
    double *seen = calloc((size_t)options->material_count * SHAPES, sizeof *seen);
    ASSERT(seen != NULL);
    model->form = ALLOCATE(ARENA_TOPOLOGY, model->element_count, PlaneForm, "forms of elements");
    for (int e = 0; e < model->element_count; e++) {
        const PlaneElement *element = &making->layout.element[e];
        const VoxelMaterial *material = material_of(making, e);
        PlaneForm *form = &model->form[e];
        form->shape = &making->shapes[making->shape[key_of(making, e)] - 1];
        form->size = options->lattice->size * (double)(1 << element->level);
        form->stiffness.law = options->law;
        plane_stiffness(&form->stiffness, form->shape, material->youngs_modulus,
                        material->poisson_ratio, thickness, 1.0);
        for (int i = 0; i < form->shape->count; i++)
            form->vertex[i] = making->mesh.vertex[e][form->shape->at[i]];
        model->element_at_level[element->level]++;

        double *unit = &seen[(element->material - 1) * SHAPES +
                             (int)(form->shape->quarters * 512 + form->shape->present)];
        const double scale = material->youngs_modulus * thickness;
        if (*unit == 0.0)
            *unit = plane_shape_eigenvalue(form->shape, &form->stiffness) / scale;
        const double mass = mass_of(making, form, e);
        making->lambda = fmax(making->lambda, *unit * scale / mass);
        making->damping_lambda = fmax(making->damping_lambda, form->stiffness.damping / mass);
    }
    free(seen);
    // Damping is told in units of the critical step dt0 = 2 / omega.
    const double beta = options->damping * 2.0 / sqrt(making->lambda);
    making->damping_lambda *= beta;
    for (int e = 0; e < model->element_count; e++)
        model->form[e].stiffness.damping *= beta;
}

static void make_masses(const Making *making, PlaneModel *model, double *total)
{
    for (int e = 0; e < model->element_count; e++) {
        const PlaneForm *form = &model->form[e];
        const double mass = mass_of(making, form, e);
        *total += mass;
        for (int i = 0; i < form->shape->count; i++)
            model->mass[form->vertex[i]] += form->shape->share[i] * mass;
    }
}

// ---------------------------------------------------------------------------------------------
// Vertices

static bool mark_nodes(Making *making, const FixedRegion *region, Status *status)
{
    for (int k = 0; k < region->node_count; k++) {
        int v = vertex_ids_find(making->by_id, making->mesh.vertex_count, region->node[k]);
        if (v < 0)
            return status_fail(status, STATUS_INVALID,
                               "fixed: node %d is not a vertex of the body (%d vertices)",
                               region->node[k], making->mesh.vertex_count);
        making->fixed[v] = true;
    }
    return true;
}

static bool make_fixed(Making *making, Status *status)
{
    const VoxelOptions *options = making->options;
    const PlaneMesh *mesh = &making->mesh;
    making->fixed = calloc((size_t)mesh->vertex_count + 1, sizeof *making->fixed);
    ASSERT(making->fixed != NULL);
    for (int r = 0; r < options->fixed_count; r++) {
        const FixedRegion *region = &options->fixed[r];
        if (region->kind == FIXED_NODES) {
            if (!mark_nodes(making, region, status))
                return false;
            continue;
        }
        for (int v = 0; v < mesh->vertex_count; v++)
            making->fixed[v] |= fixed_contains(
                region, lattice_point(options->lattice, mesh->point[v][0], mesh->point[v][1], 0.5));
    }
    return true;
}

static void create_rows(PlaneModel *model, const Making *making, const char *name, Arena *arena,
                        StateList *state)
{
    const Lattice *lattice = making->options->lattice;
    const int count = model->vertex_count;
    bool all_free = true;
    for (int v = 0; v < count; v++)
        all_free &= !making->fixed[v];
    const double middle[2] = {0.5 * lattice->count[0], 0.5 * lattice->count[1]};
    Rows *rows = &model->rows;
    *rows = (Rows){
        .precision = making->options->precision,
        .displaced = true,
        .turned = true,
        .floating = all_free, // but followed by the body's own fit: no rigid frame
        .count = count + 1,
        .rest_origin = lattice_point(lattice, middle[0], middle[1], 0.5),
        .rest_turn = quat_unit((Quat){lattice->turn.w, 0.0, 0.0, lattice->turn.z}),
        .longest_edge = lattice->size,
    };
    rows->place = arena_allocate(arena, ARENA_STEP, (size_t)count + 1, sizeof *rows->place,
                                 "%s/places", name);
    for (int v = 0; v < count; v++)
        for (int d = 0; d < 2; d++)
            rows->place[v][d] = lattice->size * (making->mesh.point[v][d] - middle[d]);
    rows->frame = ALLOCATE(ARENA_STEP, 1, BaseFrame, "base frame");
    *rows->frame = (BaseFrame){.origin = rows->rest_origin, .turn = rows->rest_turn};
    state_add(state, rows->frame, sizeof *rows->frame, "%s/base_frame", name);
}

// Position and velocity of the scene, in the plane.
static void write_initial(PlaneModel *model, const VoxelOptions *options, const Making *making)
{
    const Rows *rows = &model->rows;
    for (int k = 0; k < model->vertex_count && options->initial_position != NULL; k++) {
        int v = making->by_id[k].vertex;
        Vec3 velocity = {0.0, 0.0, 0.0};
        if (options->initial_velocity != NULL && !making->fixed[v])
            velocity = options->initial_velocity[k];
        rows_write(rows, model->row[0], v, options->initial_position[k], velocity);
        rows_put(rows, model->row[0], (long)v * ROW + 2, 0.0);
        rows_put(rows, model->row[0], (long)v * ROW + 6, 0.0);
    }
}

static void create_vertices(PlaneModel *model, const Making *making, const char *name, Arena *arena,
                            StateList *state)
{
    const VoxelOptions *options = making->options;
    const Lattice *lattice = options->lattice;
    const size_t rows = (size_t)model->vertex_count + 1, real = rows_real_size(&model->rows);
    model->inverse_mass = arena_allocate(arena, ARENA_STEP, rows, real, "%s/inverse mass", name);
    model->force = arena_allocate(arena, ARENA_STEP, 4 * rows, real, "%s/forces", name);
    for (int k = 0; k < 2; k++)
        model->row[k] = arena_allocate(arena, ARENA_STEP, ROW * rows, real, "%s/%s", name,
                                       k == 0 ? "rows" : "rows of next tick");
    for (int v = 0; v < model->vertex_count; v++)
        if (!making->fixed[v])
            rows_put(&model->rows, model->inverse_mass, v, 1.0 / model->mass[v]);
    write_initial(model, options, making);
    // Far beyond any use of a scene, and small enough for single precision.
    double farthest = lattice->size * (lattice->count[0] + lattice->count[1]) +
                      vec3_length(model->rows.rest_origin);
    for (int k = 0; k < model->vertex_count && options->initial_position != NULL; k++)
        farthest = fmax(farthest, vec3_length(options->initial_position[k]));
    model->position_limit = 1e6 * farthest;
    model->present = model->row[0];
    state_add_pair(state, model->row[0], model->row[1], &model->current, ROW * rows * real,
                   "%s/rows", name);
    model->parameters = ALLOCATE(ARENA_STEP, 1, PlaneParameters, "parameters");
    *model->parameters = (PlaneParameters){
        .gravity = {options->gravity.x, options->gravity.y, options->gravity.z},
        .stiffness_scale = 1.0,
        .damping_scale = 1.0,
    };
    state_add(state, model->parameters, sizeof *model->parameters, "%s/parameters", name);
    if (options->without_loads)
        return;
    size_t count = (size_t)model->vertex_count;
    model->load = arena_allocate(arena, ARENA_STEP, count, sizeof *model->load, "%s/loads", name);
    model->loaded = ALLOCATE(ARENA_STEP, count, int, "loaded");
    state_add(state, model->load, count * sizeof *model->load, "%s/loads", name);
}

// ---------------------------------------------------------------------------------------------
// The body

static bool check_options(const VoxelOptions *options, const PlaneKernels *kernels, Status *status)
{
    const Lattice *lattice = options->lattice;
    if (kernels == NULL)
        return status_fail(status, STATUS_INVALID,
                           "isa %s is not a level that this machine can run", options->isa);
    if (lattice->count[2] != 1)
        return status_fail(status, STATUS_INVALID,
                           "dimensions = 2 needs one layer of cells, these are %d layers",
                           lattice->count[2]);
    if (!(fabs(lattice->turn.x) < 1e-9 && fabs(lattice->turn.y) < 1e-9))
        return status_fail(status, STATUS_INVALID,
                           "dimensions = 2 keeps the body in a plane of constant z: it can be "
                           "turned about z only, this one is tilted by %.3g rad",
                           2.0 * asin(fmin(1.0, hypot(lattice->turn.x, lattice->turn.y))));
    if (!integrator_get(options->integrator)->kicks)
        return status_fail(status, STATUS_INVALID,
                           "integrator %s is not one of voxel bodies: symplectic_euler or leapfrog",
                           integrator_name(options->integrator));
    if (options->skin != NULL)
        return status_fail(status, STATUS_INVALID,
                           "dimensions = 2 shows its elements: it cannot have a skin");
    return true;
}

static bool check_initial(const Making *making, Status *status)
{
    const VoxelOptions *options = making->options;
    int vertices = making->mesh.vertex_count;
    if (options->initial_position != NULL && options->initial_count != vertices)
        return status_fail(status, STATUS_INVALID, "initial has %d rows, the body %d vertices",
                           options->initial_count, vertices);
    return true;
}

static void create_body(Body *body, Making *making, const PlaneKernels *kernels, Arena *arena,
                        StateList *state)
{
    const VoxelOptions *options = making->options;
    const char *name = options->name;
    PlaneModel *model = ALLOCATE(ARENA_STEP, 1, PlaneModel, "model");
    model->kernels = kernels;
    model->law = options->law;
    model->damped = options->damping > 0.0;
    model->vertex_count = making->mesh.vertex_count;
    model->element_count = making->mesh.element_count;
    model->half = 0.5 * options->lattice->size;
    model->mass = ALLOCATE(ARENA_TOPOLOGY, model->vertex_count, double, "vertex masses");
    double mass = 0.0;
    make_shapes(making, name, arena);
    make_forms(making, model, name, arena);
    make_masses(making, model, &mass);
    create_rows(model, making, name, arena, state);
    create_vertices(model, making, name, arena, state);
    plane_create_batches(model, name, arena);
    *body = (Body){
        .ops = &plane_ops,
        .model = model,
        .integrator = options->integrator,
        .mass = mass,
        .element_count = model->element_count,
        .lambda = making->lambda,
        .damping = making->damping_lambda,
        .contact_lambda = making->lambda,
        .contact_ratio = options->contact_ratio,
        .contact_damping = options->contact_damping,
        .tuning = {.friction = options->friction, .stiffness_scale = 1.0, .damping_scale = 1.0},
        .time_step_wanted = options->time_step,
        .unsafe_time_step = options->unsafe_time_step,
        .state_capacity = model->vertex_count,
    };
    snprintf(body->name, sizeof body->name, "%s", name);
    plane_create_surface(model, body, &making->mesh, options, arena);
    plane_create_mesh(model, body, &making->mesh, name, arena);
}

bool plane_create(Body *body, const VoxelOptions *options, Arena *arena, StateList *state,
                  Status *status)
{
    const PlaneKernels *kernels =
        plane_kernels_find(options->precision, options->isa == NULL ? "auto" : options->isa);
    if (!check_options(options, kernels, status))
        return false;
    Making making = {.options = options};
    plane_layout_create(&making.layout, options->lattice, options->levels);
    bool ok = plane_mesh_create(&making.mesh, &making.layout, NULL, status) &&
              check_initial(&making, status);
    if (ok)
        making.by_id = vertex_ids_sort(making.mesh.id, making.mesh.vertex_count);
    ok = ok && make_fixed(&making, status);
    if (ok)
        create_body(body, &making, kernels, arena, state);
    plane_mesh_destroy(&making.mesh);
    plane_layout_destroy(&making.layout);
    free(making.fixed);
    free(making.by_id);
    free(making.shape);
    return ok;
}
