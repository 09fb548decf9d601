// SPDX-License-Identifier: MIT
// Creates a plane body from a lattice of one layer: elements, vertices, masses, batches. Load time
// only.
#include "plane/cut.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

// Intermediate results of the creation.
typedef struct Making {
    const PlaneOptions *options;
    PlaneLayout layout;
    PlaneMesh mesh;
    bool *fixed;     // [vertex_count]
    VertexId *by_id; // [vertex_count]
    PlaneForms forms;
} Making;

// ---------------------------------------------------------------------------------------------
// Elements

static void make_forms(Making *making, PlaneModel *model, const char *name, Arena *arena)
{
    plane_forms_create(&making->forms, making->options, &making->layout, &making->mesh, false,
                       arena);
    model->form =
        ALLOCATE(ARENA_TOPOLOGY, making->mesh.element_count, PlaneForm, "forms of elements");
    plane_forms_fill(&making->forms, model, &making->layout,
                     (const int(*)[PLANE_PLACES])making->mesh.vertex);
}

// ---------------------------------------------------------------------------------------------
// Vertices

static Vec3 rest_of(const void *context, int vertex)
{
    const Making *making = context;
    const int *p = making->mesh.point[vertex];
    return lattice_point(making->options->lattice, p[0], p[1], 0.5);
}

static bool make_fixed(Making *making, Status *status)
{
    const int vertices = making->mesh.vertex_count;
    making->fixed = calloc((size_t)vertices + 1, sizeof *making->fixed);
    ASSERT(making->fixed != NULL);
    return vertices_mark_fixed(&making->options->body, making->by_id, vertices, rest_of, making,
                               making->fixed, status);
}

static void create_vertices(PlaneModel *model, const Making *making, const char *name, Arena *arena,
                            StateList *state)
{
    const PlaneOptions *options = making->options;
    const Lattice *lattice = options->lattice;
    Vertices *vertices = &model->vertices;
    Rows *rows = &vertices->rows;
    const double middle[2] = {0.5 * lattice->count[0], 0.5 * lattice->count[1]};
    const size_t most = (size_t)(vertices->capacity > 0 ? vertices->capacity : vertices->count);
    // The middle of the lattice is the origin of rest positions.
    rows->rest_origin = lattice_point(lattice, middle[0], middle[1], 0.5);
    rows->rest_turn = quat_unit((Quat){lattice->turn.w, 0.0, 0.0, lattice->turn.z});
    rows->longest_edge = lattice->size;
    // In the plane: z stays 0.
    rows->rest = arena_allocate(arena, ARENA_STEP, most + 1, sizeof *rows->rest, "%s/places", name);
    for (int v = 0; v < vertices->count; v++)
        for (int d = 0; d < 2; d++)
            rows->rest[v][d] = lattice->size * (making->mesh.point[v][d] - middle[d]);
    // A floating body follows its own fit in the plane: no rigid frame.
    vertices->damping_time = making->forms.beta;
    vertices->drag = options->drag;
    vertices_create(vertices, &options->body, making->by_id, making->fixed, (int)most,
                    lattice->size * (lattice->count[0] + lattice->count[1]), arena, state);
    for (long v = 0; v < vertices->count; v++) { // remove out-of-plane parts of an initial state
        rows_put(rows, vertices->row[0], v * ROW + 2, 0.0);
        rows_put(rows, vertices->row[0], v * ROW + 6, 0.0);
    }
}

// ---------------------------------------------------------------------------------------------
// The body

static bool check_options(const PlaneOptions *options, Status *status)
{
    const Lattice *lattice = options->lattice;
    if (lattice->count[2] != 1)
        return status_fail(status, STATUS_INVALID,
                           "dimensions = 2 needs one layer of cells, these are %d layers",
                           lattice->count[2]);
    // Turns about z alone keep the sheet in its plane.
    if (!(fabs(lattice->turn.x) < 1e-9 && fabs(lattice->turn.y) < 1e-9))
        return status_fail(status, STATUS_INVALID,
                           "dimensions = 2 keeps the body in a plane of constant z: it can be "
                           "turned about z only, this one is tilted by %.3g rad",
                           2.0 * asin(fmin(1.0, sqrt(lattice->turn.x * lattice->turn.x +
                                                     lattice->turn.y * lattice->turn.y))));
    if (!integrator_is_symplectic(options->body.integrator))
        return status_fail(status, STATUS_INVALID,
                           "integrator %s is not one of voxel bodies: symplectic_euler or leapfrog",
                           integrator_name(options->body.integrator));
    return true;
}

// Creates what a body needs that is never cut.
static void create_whole(PlaneModel *model, Body *body, Making *making, Arena *arena,
                         StateList *state)
{
    const PlaneOptions *options = making->options;
    const char *name = options->body.name;
    Vertices *vertices = &model->vertices;
    vertices->mass = ALLOCATE(ARENA_TOPOLOGY, vertices->count, double, "vertex masses");
    // Elements and masses first: vertices need their masses.
    make_forms(making, model, name, arena);
    body->mass = plane_forms_add_masses(&making->forms, model);
    create_vertices(model, making, name, arena, state);
    model->spare = vertices->count;
    // What the kernel reads, and what others see.
    plane_reserve_batches(model, model->element_count, model->element_count, name, arena);
    plane_fill_batches(model);
    plane_create_surface(model, body, &making->mesh, options, arena);
    plane_create_mesh(model, body, &making->mesh, name, arena);
    body->ops = &plane_ops;
    body->state_capacity = vertices->count;
    body->half_thickness = model->half;
}

// Creates what a cuttable body needs: memory for any outcome, filled as after any change.
static void create_cuttable(PlaneModel *model, Body *body, Making *making, Arena *arena,
                            StateList *state)
{
    const PlaneOptions *options = making->options;
    const char *name = options->body.name;
    plane_cut_create(model, options, making->fixed, arena, state);
    PlaneCut *cut = model->cut;
    making->forms = cut->forms;
    // Room for all vertices that cuts may add.
    Vertices *vertices = &model->vertices;
    vertices->capacity = cut->vertex_capacity;
    vertices->id = cut->id;
    vertices->mass = ALLOCATE(ARENA_TOPOLOGY, vertices->capacity, double, "vertex masses");
    // Forms and batches for a body that is cut everywhere.
    const int elements = cut->room.sides / 8; // at most one over each cell
    model->form = ALLOCATE(ARENA_TOPOLOGY, elements, PlaneForm, "forms of elements");
    for (int v = 0; v < vertices->count; v++)
        vertices->mass[v] = 1.0; // until plane_cut_make sets it
    create_vertices(model, making, name, arena, state);
    model->spare = vertices->capacity;
    plane_reserve_batches(model, elements, 2 * (cut->layout.levels + 1) * options->material_count,
                          name, arena);
    // Everything else follows from the bits, as after a change.
    plane_cut_create_surface(model, body, options, arena);
    plane_cut_make(model, body);
    for (int v = 0; v < vertices->count; v++)
        body->mass += vertices->mass[v];
    body->ops = cut->tear_force > 0.0 ? &plane_ops_tearing : &plane_ops_cuttable;
    body->state_capacity = vertices->capacity;
    body->half_thickness = model->half;
}

static void create_body(Body *body, Making *making, const PlaneKernels *kernels, Arena *arena,
                        StateList *state)
{
    const PlaneOptions *options = making->options;
    const char *name = options->body.name;
    PlaneModel *model = ALLOCATE(ARENA_STEP, 1, PlaneModel, "model");
    // What both kinds of bodies have.
    model->kernels = kernels;
    model->law = options->law;
    model->half = 0.5 * options->lattice->size;
    model->vertices.kernels = vertex_kernels_find(options->body.precision, kernels->level);
    model->vertices.count = making->mesh.vertex_count;
    *body = body_of_options(&options->body, NULL, model);
    if (options->body.cuttable)
        create_cuttable(model, body, making, arena, state);
    else
        create_whole(model, body, making, arena, state);
    // Bounds of the time step.
    body->element_count = model->element_count;
    body->lambda = body->contact_lambda = making->forms.lambda;
    body->damping = making->forms.damping_lambda;
    body->damping_time = making->forms.beta;
    body->drag = making->options->drag;
}

// As for solid bodies: an initial mesh that exceeds the capacity is an error.
static bool check_capacity(const PlaneOptions *options, int vertices, Status *status)
{
    if (!options->body.cuttable || options->body.node_capacity == 0 ||
        options->body.node_capacity >= vertices)
        return true;
    return status_fail(
        status, STATUS_INVALID,
        "body %s has %d vertices to start with, capacity.nodes is %d: raise it, or leave it out",
        options->body.name, vertices, options->body.node_capacity);
}

ISA_KERNELS(PlaneKernels, plane);

const PlaneKernels *plane_kernels_find(Precision precision, const char *level)
{
    IsaLevel found = isa_find(level);
    return found == ISA_COUNT ? NULL : plane_kernels[precision][found];
}

bool plane_create(Body *body, const PlaneOptions *options, Arena *arena, StateList *state,
                  Status *status)
{
    const PlaneKernels *kernels = plane_kernels_find(
        options->body.precision, options->body.isa == NULL ? "auto" : options->body.isa);
    // Refuse what does not fit before anything is allocated.
    if (!check_options(options, status))
        return false;
    // Elements and vertices.
    Making making = {.options = options};
    plane_layout_create(&making.layout, options->lattice, options->body.levels);
    bool ok =
        plane_mesh_create(&making.mesh, &making.layout, NULL, status) &&
        vertices_can_create(&options->body, kernels != NULL, making.mesh.vertex_count, status) &&
        check_capacity(options, making.mesh.vertex_count, status);
    // Then the body.
    if (ok)
        making.by_id = vertex_ids_sort(making.mesh.id, making.mesh.vertex_count);
    ok = ok && make_fixed(&making, status);
    if (ok)
        create_body(body, &making, kernels, arena, state);
    // What was needed to build it.
    plane_mesh_destroy(&making.mesh);
    plane_layout_destroy(&making.layout);
    free(making.fixed);
    free(making.by_id);
    return ok;
}
