// SPDX-License-Identifier: MIT
// Load time: creates what a voxel body that can be cut has besides others.
#include "voxel/cut/cut_body.h"

#include "base/check.h"
#include "voxel/cut/cut_parts.h"
#include "voxel/model.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// Orders the vertices: those that are kept, which begin with the outer ones, then others that the
// body has at rest, then those that elements lose as they merge.
static void order_mesh(VoxelMaking *making, const CutLattice *lattice)
{
    LatticeMesh *mesh = &making->mesh;
    int *order = calloc((size_t)mesh->vertex_count + 1, sizeof *order), count = 0;
    making->rest_id = calloc((size_t)cut_lattice_used(lattice) + 1, sizeof *making->rest_id);
    ASSERT(order != NULL && making->rest_id != NULL);
    enum { KEPT, OTHER, GONE, GROUPS };
    for (int group = 0; group < GROUPS; group++) {
        for (int v = 0; v < mesh->vertex_count; v++) {
            // Rows of the lattice are those of the mesh until one is used again, for a corner in
            // void.
            const bool is = lattice->vertex_id[v] == mesh->id[v];
            if ((cut_lattice_is_kept(lattice, v) ? KEPT : is ? OTHER : GONE) == group)
                order[count++] = v;
        }
        making->kept = group == KEPT ? count : making->kept;
        making->start = group == OTHER ? count : making->start;
    }
    // Their ids, and those of corners in void.
    for (int k = 0; k < making->start; k++)
        making->rest_id[making->rest_count++] = mesh->id[order[k]];
    for (int v = 0; v < cut_lattice_used(lattice); v++)
        if (lattice->vertex_id[v] >= 0 &&
            (v >= mesh->vertex_count || lattice->vertex_id[v] != mesh->id[v]))
            making->rest_id[making->rest_count++] = lattice->vertex_id[v];
    lattice_mesh_order(mesh, order);
    free(order);
}

bool cut_body_find_rest(VoxelMaking *making, Status *status)
{
    Arena arena = {0};
    StateList state = {0};
    CutLattice lattice;
    // A lattice of today's elements merges until nothing can. Elements with few cells have more
    // corners in void than vertices that end with them.
    making->capacity = 2 * making->mesh.vertex_count;
    const bool ok = cut_lattice_create(&lattice, making, &arena, &state, status);
    if (ok) {
        const size_t elements = (size_t)lattice.element_count;
        cut_lattice_coarsen(&lattice);
        making->divided = malloc(elements);
        ASSERT(making->divided != NULL);
        memcpy(making->divided, lattice.divided, elements);
        order_mesh(making, &lattice);
    }
    state_destroy(&state);
    arena_destroy(&arena);
    return ok;
}

// Returns twice the vertices of the fully divided body, because a broken face is assumed to need
// four new vertices until it is known how many it needs, about one.
static long count_for_all(const VoxelMaking *making, Status *status)
{
    Layout finest;
    LatticeMesh divided;
    layout_create(&finest, making->options->lattice, 0);
    const long count = lattice_mesh_create(&divided, &finest, status) ? divided.vertex_count : 0;
    lattice_mesh_destroy(&divided);
    layout_destroy(&finest);
    return 2 * count;
}

// Returns the vertex capacity. A body that adapts needs those that it always has, and a pool for
// what tools need fine at the same time, and for what cuts bring: half as many as it has at rest,
// of which most are outer ones, are enough for cuts and tools along all of one of its sections.
static int choose_capacity(const VoxelMaking *making, Status *status)
{
    enum { LEAST = 1024, POOL = 16384 };
    if (making->options->body.node_capacity > 0)
        return making->options->body.node_capacity;
    const int start = making->rest_id != NULL ? making->rest_count : making->mesh.vertex_count;
    long count = count_for_all(making, status) + LEAST;
    if (making->options->surface_level > 0 && start + start / 2 + POOL < count)
        count = start + start / 2 + POOL;
    ASSERT(count >= start && count < INT_MAX);
    return (int)count;
}

bool cut_body_check(VoxelMaking *making, Status *status)
{
    const VoxelOptions *options = making->options;
    const int vertices = making->rest_id != NULL ? making->rest_count : making->mesh.vertex_count;
    making->capacity = choose_capacity(making, status);
    if (options->skin != NULL)
        return status_fail(
            status, STATUS_INVALID,
            "body %s: a skin does not follow cuts; leave it out (surface = \"fitted\" is "
            "smooth and does), or set cuttable = false",
            options->body.name);
    // The uncut body must fit.
    if (vertices > making->capacity)
        return status_fail(status, STATUS_INVALID,
                           "body %s has %d vertices to start with, capacity.nodes is %d: raise it, "
                           "or leave it out",
                           options->body.name, vertices, making->capacity);
    return true;
}

// ---------------------------------------------------------------------------------------------
// Fixed points

static long point_index(const VoxelMaking *making, const int point[3])
{
    const int *n = making->layout.lattice_count;
    return ((long)point[2] * (n[1] + 1) + point[1]) * (n[0] + 1) + point[0];
}

// Returns the slots around the point of a vertex that belong to its part, from the leaves that have
// it.
static unsigned char slots_of_vertex(const VoxelMaking *making, int vertex)
{
    const LatticeMesh *mesh = &making->mesh;
    const int *point = mesh->point[vertex];
    unsigned char slots = 0;
    for (int s = 0; s < 8; s++) {
        // The element in each slot around the point, and whether the vertex is its node.
        const int leaf = layout_leaf_at(&making->layout, point[0] - 1 + (s & 1),
                                        point[1] - 1 + (s >> 1 & 1), point[2] - 1 + (s >> 2));
        bool has = false;
        for (int n = 0; n < NODE_COUNT && leaf >= 0; n++)
            has |= mesh->vertex[leaf][n] == vertex;
        slots |= (unsigned char)(has << s);
    }
    return slots;
}

static void hold_nodes(const VoxelMaking *making, const FixedRegion *region, unsigned char *held)
{
    const LatticeMesh *mesh = &making->mesh;
    for (int k = 0; k < region->node_count; k++) {
        const int vertex = vertex_ids_find(making->by_id, mesh->vertex_count, region->node[k]);
        held[point_index(making, mesh->point[vertex])] |= slots_of_vertex(making, vertex);
    }
}

static void hold_points(const VoxelMaking *making, const FixedRegion *region, unsigned char *held)
{
    const int *n = making->layout.lattice_count;
    int p[3];
    for (p[2] = 0; p[2] <= n[2]; p[2]++)
        for (p[1] = 0; p[1] <= n[1]; p[1]++)
            for (p[0] = 0; p[0] <= n[0]; p[0]++)
                if (fixed_contains(region,
                                   lattice_point(making->options->lattice, p[0], p[1], p[2])))
                    held[point_index(making, p)] = 0xff;
}

// Returns the fixed parts of all points (CutMasses.held), also of those that have no vertex yet.
static const unsigned char *hold(const VoxelMaking *making, const char *name, Arena *arena)
{
    const BodyOptions *options = &making->options->body;
    const int *n = making->layout.lattice_count;
    unsigned char *held =
        ALLOCATE(ARENA_TOPOLOGY, point_index(making, n) + 1, unsigned char, "fixed points");
    for (int r = 0; r < options->fixed_count; r++)
        if (options->fixed[r].kind == FIXED_NODES)
            hold_nodes(making, &options->fixed[r], held);
        else
            hold_points(making, &options->fixed[r], held);
    return held;
}

// ---------------------------------------------------------------------------------------------
// Elements

bool cut_body_create_elements(VoxelModel *model, const VoxelMaking *making, Arena *arena,
                              StateList *state, Status *status)
{
    const VoxelOptions *options = making->options;
    const char *given = options->body.name;
    char *name = arena_allocate(arena, ARENA_TOPOLOGY, strlen(given) + 1, 1, "%s/name", given);
    memcpy(name, given, strlen(given) + 1);
    VoxelCuts *cuts = ALLOCATE(ARENA_STEP, 1, VoxelCuts, "cuts");
    model->cuts = cuts;
    cuts->name = name;
    cuts->sound = true;
    if (!cut_lattice_create(&cuts->lattice, making, arena, state, status))
        return false;
    if (options->surface_level > 0)
        template_cache_create_partial(&cuts->templates, name, options->body.precision,
                                      cut_shape_solid, &cuts->lattice,
                                      cut_shape_count_parts(&cuts->lattice), arena);
    else
        template_cache_create(&cuts->templates, name, options->law, options->body.precision, arena);
    if (making->options->heats) {
        cuts->heat = ALLOCATE(ARENA_STEP, 1, CutHeat, "heat");
        cut_heat_create(cuts->heat, name, &cuts->lattice, making, arena, state);
    }
    return true;
}

// ---------------------------------------------------------------------------------------------
// What follows from elements and vertices

// Returns the masses of all elements that can ever come, by level and material.
static const double *masses_of(const VoxelMaking *making, int levels, const char *name,
                               Arena *arena)
{
    const VoxelOptions *options = making->options;
    const int materials = options->material_count, count = materials * (levels + 1);
    double *mass = ALLOCATE(ARENA_TOPOLOGY, count, double, "element masses");
    for (int c = 0; c < count; c++) {
        const double edge = options->lattice->size * (double)(1 << c / materials);
        mass[c] = options->material[c % materials].density * edge * edge * edge;
    }
    return mass;
}

// Returns their classes; behind them those of coagulated ones, if there can be any.
static const ElementClass *classes_of(const VoxelMaking *making, int levels, const char *name,
                                      Arena *arena)
{
    const VoxelOptions *options = making->options;
    const int materials = options->material_count, count = materials * (levels + 1);
    const int all = options->heats ? 2 * count : count;
    ElementClass *classes = ALLOCATE(ARENA_STEP, all, ElementClass, "element classes");
    Template plain;
    template_create(&plain, 0);
    for (int c = 0; c < count; c++) {
        // By level, then by material.
        const double edge = options->lattice->size * (double)(1 << c / materials);
        stiffness_of_element(options->law, &options->material[c % materials], edge, &plain,
                             &classes[c]);
        classes[c].damping *= making->beta;
    }
    for (int c = count; c < all; c++) {
        ElementClass *stiff = &classes[c];
        *stiff = classes[c - count];
        stiff->mu *= options->coagulated_stiffness;
        stiff->lambda *= options->coagulated_stiffness;
        stiff->residual *= options->coagulated_stiffness;
        stiff->damping *= sqrt(options->coagulated_stiffness);
    }
    return classes;
}

void cut_body_create_masses(VoxelModel *model, const VoxelMaking *making, Arena *arena)
{
    const char *name = model->cuts->name;
    CutMasses *masses = &model->cuts->masses;
    masses->lattice = &model->cuts->lattice;
    masses->templates = &model->cuts->templates;
    masses->vertices = &model->vertices;
    masses->law = model->law;
    masses->size = making->options->lattice->size;
    for (int d = 0; d < 3; d++)
        masses->middle[d] = 0.5 * making->options->lattice->count[d];
    // By material and level, and where the body is fixed.
    masses->mass = masses_of(making, masses->lattice->levels, name, arena);
    masses->material_count = making->options->material_count;
    masses->held = hold(making, name, arena);
    cut_masses_create(masses, name, arena);
    cut_masses_derive(masses);
    if (!masses->lattice->adapts)
        return;
    model->vertices.rows.owner = masses->lattice->vertex_id; // negative ids are free rows
    model->cuts->carry = ALLOCATE(ARENA_STEP, 1, CutCarry, "carried vertices");
    cut_carry_create(model->cuts->carry, masses, name, arena);
    masses->carry = model->cuts->lattice.carry = model->cuts->carry;
    model->vertices.rows.carried = masses->lattice->carried;
    model->vertices.rows.carried_end = masses->lattice->kept_end;
    model->vertices.rows.carried_row = model->cuts->carry->row;
}

void cut_body_create_batches(VoxelModel *model, const VoxelMaking *making, Arena *arena,
                             StateList *state)
{
    VoxelCuts *cuts = model->cuts;
    const WindowOptions windows = {.name = cuts->name,
                                   .kernels = making->kernels,
                                   .lattice = &cuts->lattice,
                                   .templates = &cuts->templates,
                                   .material_count = making->options->material_count,
                                   .classes =
                                       classes_of(making, cuts->lattice.levels, cuts->name, arena),
                                   .stiff = cuts->heat != NULL ? cuts->heat->stiff : NULL,
                                   .branch_count = making->options->branch_count,
                                   .branch = making->options->branch};
    cut_windows_create(&cuts->windows, &windows, arena, state);
    model->batches = &cuts->windows.runs;
    model->element_at_level = cuts->lattice.leaf_at_level;
}

bool cut_body_create_surface(VoxelModel *model, const VoxelMaking *making, Body *body, Arena *arena,
                             StateList *state, Status *status)
{
    const char *name = model->cuts->name;
    const VoxelOptions *options = making->options;
    VoxelCuts *cuts = model->cuts;
    cuts->lambda = body->lambda;
    cuts->damping = body->damping;
    body->element_count = cuts->lattice.leaf_count; // fewer, if it adapts
    if (cuts->heat != NULL) {
        // The most substeps that it may come to need.
        body->finest_lambda = cuts->heat->stiffer * body->lambda;
        body->finest_damping = sqrt(cuts->heat->stiffer) * body->damping;
    }
    if (options->tear_stress > 0.0 || options->tear_force > 0.0)
        cut_tear_create(&cuts->tear, options, &cuts->windows, &model->vertices, arena, state);
    // Pieces first: faces publish them.
    cut_pieces_create(&cuts->pieces, &cuts->lattice, making, arena, state);
    cut_account_create(&cuts->account, &cuts->pieces, making, cuts->masses.held, arena, state);
    cut_blades_create(&cuts->blades, cuts->name, &cuts->lattice, &model->vertices.rows,
                      options->lattice->size, arena);
    if (!cut_faces_create(&cuts->faces, &cuts->pieces, &cuts->masses, making, body, arena, state,
                          status))
        return false;
    if (cuts->faces.found != NULL)
        cuts->faces.carry = cuts->carry;
    if (options->field != NULL && !options->publish_all) {
        cuts->fit = ALLOCATE(ARENA_OUTPUT, 1, CutFit, "fit");
        cut_fit_create(cuts->fit, &cuts->faces, &cuts->lattice, making, body, arena, state);
        if (cuts->carry != NULL)
            cut_carry_want_moves(cuts->carry, cuts->name, arena);
        model->fitted = &cuts->fit->fitted;
    }
    if (cuts->fit != NULL || options->body.watch_count > 0)
        cut_blades_want_crossings(&cuts->blades, cuts->name, arena);
    cuts->tension = cut_tension_create(&cuts->faces, cuts->carry, making, arena);
    cuts->tear.tension = cuts->tension;
    if (options->body.removable) {
        cuts->reach = ALLOCATE(ARENA_CONTACT, 1, CutReach, "reach of removers");
        cut_reach_create(cuts->reach, cuts->name, &cuts->blades, arena, state);
        cuts->gone = ALLOCATE(ARENA_CONTACT, options->material_count, int, "cells that are gone");
        cuts->mass_at_load = body->mass;
        cut_body_count_gone(cuts, body);
    }
    if (cuts->lattice.adapts) {
        cuts->adapt = ALLOCATE(ARENA_TOPOLOGY, 1, CutAdapt, "adaptation of elements");
        cut_adapt_create(cuts->adapt, &cuts->lattice, &cuts->masses,
                         making->options->body.adapt_error, cuts->name, arena, state);
        cuts->release = ALLOCATE(ARENA_STEP, 1, CutRelease, "forces after divisions");
        cut_release_create(cuts->release, &cuts->masses, cuts->name, arena, state);
        cut_body_count_elements(cuts, body);
    }
    cuts->account.gone = cuts->gone;
    if (cuts->heat != NULL)
        cuts->account.coagulated = cuts->heat->coagulated;
    // Published nodes come and go with the faces.
    model->node = cuts->faces.slot_vertex;
    model->node_count = cuts->faces.slot_count;
    return true;
}
