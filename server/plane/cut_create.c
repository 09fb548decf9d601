// SPDX-License-Identifier: MIT
// Creates the tables of a plane body that can be cut, and restores it from a state. Load time, and
// after the state was restored.
#include "plane/cut.h"

#include "base/check.h"

#include <string.h>

#define ALLOCATE_ROWS(count, row, label)                                                           \
    arena_allocate(arena, ARENA_TOPOLOGY, (size_t)(count), sizeof *(row), "%s/%s", name, label)

// Builds a layout with an element for every square, so that new elements already have numbers.
static void take_layout(PlaneCut *cut, const PlaneOptions *options, Arena *arena)
{
    const char *name = options->body.name;
    // The layout of the uncut body, which has only the elements that exist.
    PlaneLayout made, *layout = &cut->layout;
    plane_layout_create(&made, options->lattice, options->body.levels);
    *layout = (PlaneLayout){.levels = made.levels};
    memcpy(layout->lattice_count, made.lattice_count, sizeof made.lattice_count);
    memcpy(layout->count, made.count, sizeof made.count);
    cut->cell_count = made.count[0] * made.count[1];
    cut->is_solid = ALLOCATE(ARENA_TOPOLOGY, cut->cell_count, bool, "solid cells");
    // Here every aligned square of each level is one, maybe without quarters.
    for (int level = 0; level <= made.levels; level++)
        layout->element_count += cut->cell_count >> 2 * level;
    layout->element = ALLOCATE(ARENA_TOPOLOGY, layout->element_count, PlaneElement, "elements");
    int e = 0;
    for (int level = 0; level <= made.levels; level++) {
        const int size = 1 << level, squares = cut->cell_count >> 2 * level;
        layout->lut[level] = ALLOCATE(ARENA_TOPOLOGY, squares, int, "look-up table");
        for (int at = 0; at < squares; at++, e++) {
            const int wide = made.count[0] / size, i = at % wide * size, j = at / wide * size;
            PlaneElement *element = &layout->element[e];
            element->cell[0] = i;
            element->cell[1] = j;
            element->level = (unsigned char)level;
            element->material = (unsigned char)lattice_label(options->lattice, i, j, 0);
            // Copy what the initial layout has at this square.
            if (level == 0)
                cut->is_solid[at] = element->material != 0;
            if (made.lut[level][at] >= 0) {
                element->quarters = made.element[made.lut[level][at]].quarters;
                element->material = made.element[made.lut[level][at]].material;
            }
            layout->lut[level][at] = e;
        }
    }
    plane_layout_destroy(&made);
}

// Marks fixed points: where a region contains the position, or the initial vertex was fixed.
static void take_fixed_points(PlaneCut *cut, const PlaneOptions *options, const bool *fixed,
                              Arena *arena)
{
    const int wide = cut->layout.lattice_count[0] + 1;
    cut->fixed_point = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)cut->points, sizeof(bool),
                                      "%s/fixed points", options->body.name);
    for (int r = 0; r < options->body.fixed_count; r++)
        for (int p = 0; p < cut->points && options->body.fixed[r].kind != FIXED_NODES; p++)
            cut->fixed_point[p] |= fixed_contains(
                &options->body.fixed[r], lattice_point(options->lattice, p % wide, p / wide, 0.5));
    for (int v = 0; v < cut->mesh.vertex_count; v++)
        cut->fixed_point[cut->mesh.id[v] % cut->points] |= fixed[v];
}

static void take_tables(PlaneCut *cut, const char *name, Arena *arena)
{
    const int most = cut->vertex_capacity, elements = cut->layout.element_count;
    cut->path = ALLOCATE_ROWS(cut->cell_count, cut->path, "paths of cells");
    cut->cells_of_piece = ALLOCATE(ARENA_TOPOLOGY, cut->room.vertices, int, "cells of pieces");
    // From ids and places to rows.
    cut->row_of = ALLOCATE(ARENA_TOPOLOGY, cut->room.vertices, int, "rows of vertices");
    cut->row_of_id = ALLOCATE(ARENA_TOPOLOGY, 4 * cut->points, int, "rows of ids");
    cut->vertex = ALLOCATE_ROWS(elements, cut->vertex, "rows of elements");
    // The state before a change.
    cut->before = ALLOCATE_ROWS(elements, cut->before, "rows of elements before");
    cut->quarters_before = ALLOCATE(ARENA_TOPOLOGY, elements, unsigned char, "quarters before");
    cut->mass_before = ALLOCATE(ARENA_TOPOLOGY, most, double, "masses before");
    cut->birth = ALLOCATE(ARENA_TOPOLOGY, 2 * most, NodeBirth, "births");
    link_finder_create(&cut->links, 2 * cut->cell_count, 2 * cut->cell_count, name, arena);
    // Of published nodes.
    cut->origin_id = ALLOCATE(ARENA_TOPOLOGY, most, int, "vertex origins");
    cut->parent = ALLOCATE_ROWS(most, cut->parent, "vertex parents");
    cut->piece = ALLOCATE(ARENA_TOPOLOGY, most, int, "vertex pieces");
    cut->level = ALLOCATE(ARENA_TOPOLOGY, most, signed char, "vertex levels");
}

static void take_state(PlaneCut *cut, const char *name, Arena *arena, StateList *state)
{
    const size_t elements = (size_t)cut->layout.element_count, cells = (size_t)cut->cell_count;
    // The two sets of bits.
    cut->quarters = ALLOCATE(ARENA_TOPOLOGY, elements, unsigned char, "quarters");
    cut->broken = ALLOCATE(ARENA_TOPOLOGY, cells, unsigned char, "broken edges");
    cut->wants = ALLOCATE(ARENA_TOPOLOGY, 1, int64_t, "wants");
    for (size_t e = 0; e < elements; e++)
        cut->quarters[e] = cut->layout.element[e].quarters;
    // What a checkpoint keeps.
    state_add(state, cut->quarters, elements, "%s/quarters", name);
    state_add(state, cut->broken, cells, "%s/broken_edges", name);
    state_add(state, cut->id, (size_t)cut->vertex_capacity * sizeof *cut->id, "%s/vertex_ids",
              name);
    state_add(state, cut->origin_id, (size_t)cut->vertex_capacity * sizeof *cut->origin_id,
              "%s/vertex_origins", name);
    state_add(state, cut->wants, sizeof *cut->wants, "%s/wants", name);
    if (cut->tear_force <= 0.0)
        return;
    cut->felt = ALLOCATE(ARENA_STEP, cut->vertex_capacity, double, "felt forces");
    state_add(state, cut->felt, (size_t)cut->vertex_capacity * sizeof *cut->felt, "%s/felt_forces",
              name);
}

void plane_cut_create(PlaneModel *model, const PlaneOptions *options, const bool *fixed,
                      Arena *arena, StateList *state)
{
    const char *name = options->body.name;
    PlaneCut *cut = ALLOCATE(ARENA_TOPOLOGY, 1, PlaneCut, "cuts");
    model->cut = cut;
    snprintf(cut->name, sizeof cut->name, "%s", name);
    cut->is_valid = true;
    // Elements and lattice points.
    take_layout(cut, options, arena);
    cut->points = (cut->layout.lattice_count[0] + 1) * (cut->layout.lattice_count[1] + 1);
    cut->tear_force = options->tear_force;
    // A sub-tick may differ from a twisted patch by a twentieth of a cell.
    cut->links = (LinkFinder){.origin = lattice_point(options->lattice, 0.0, 0.0, 0.5),
                              .q = options->lattice->size / 1024.0,
                              .tolerance = 0.05 * options->lattice->size};
    // The mesh of the uncut body, in memory for any mesh.
    plane_mesh_reserve(&cut->mesh, &cut->room, &cut->layout, name, arena);
    plane_mesh_fill(&cut->mesh, &cut->room, &cut->layout, NULL);
    take_fixed_points(cut, options, fixed, arena);
    // A body with all edges cut has four vertices per cell.
    cut->vertex_capacity =
        options->body.node_capacity > 0 ? options->body.node_capacity : cut->room.vertices;
    ASSERT(cut->vertex_capacity >= cut->mesh.vertex_count); // checked by plane_create
    plane_forms_create(&cut->forms, options, &cut->layout, &cut->mesh, true, arena);
    cut->id = ALLOCATE(ARENA_TOPOLOGY, cut->vertex_capacity, int, "vertex ids");
    take_tables(cut, name, arena);
    take_state(cut, name, arena, state);
    // The first vertices have the rows of their order.
    for (int k = 0; k < 4 * cut->points; k++)
        cut->row_of_id[k] = -1;
    for (int v = 0; v < cut->vertex_capacity; v++) {
        cut->id[v] = v < cut->mesh.vertex_count ? cut->mesh.id[v] : -1;
        if (cut->id[v] >= 0)
            cut->row_of_id[cut->id[v]] = v;
    }
    memcpy(cut->origin_id, cut->id, (size_t)cut->vertex_capacity * sizeof *cut->id);
}

// ---------------------------------------------------------------------------------------------
// The check that bits and ids from a checkpoint are possible

// True if each solid cell, and no other, is in the quarter of exactly one element.
static bool covers_each_cell_once(const PlaneCut *cut)
{
    for (int j = 0; j < cut->layout.count[1]; j++)
        for (int i = 0; i < cut->layout.count[0]; i++) {
            int over = 0;
            for (int level = 0; level <= cut->layout.levels; level++) {
                // The square of this level over the cell, and the cell's quarter of it.
                int e =
                    cut->layout
                        .lut[level][(j >> level) * (cut->layout.count[0] >> level) + (i >> level)];
                int q = level == 0 ? 0 : (i >> (level - 1) & 1) + 2 * (j >> (level - 1) & 1);
                over += cut->quarters[e] >> q & 1;
            }
            if (over != cut->is_solid[j * cut->layout.count[0] + i])
                return false;
        }
    return true;
}

static bool quarters_can_be(const PlaneCut *cut)
{
    for (int e = 0; e < cut->layout.element_count; e++) {
        const unsigned quarters = cut->quarters[e], level = cut->layout.element[e].level;
        if (quarters > PLANE_WHOLE || quarters == 6 || quarters == 9 ||
            (level == 0 && quarters != 0 && quarters != PLANE_WHOLE))
            return false;
    }
    return true;
}

static bool levels_can_be(const PlaneCut *cut)
{
    for (int j = 0; j < cut->layout.count[1]; j++)
        for (int i = 0; i < cut->layout.count[0]; i++) {
            const int own = plane_layout_at(&cut->layout, i, j);
            const int beside[2] = {plane_layout_at(&cut->layout, i + 1, j),
                                   plane_layout_at(&cut->layout, i, j + 1)};
            for (int k = 0; k < 2 && own >= 0; k++) {
                if (beside[k] < 0)
                    continue;
                // Neighbours differ by one level at most.
                int a = cut->layout.element[own].level, b = cut->layout.element[beside[k]].level;
                if (a - b > 1 || b - a > 1)
                    return false;
            }
        }
    return true;
}

static bool ids_can_be(const PlaneModel *model)
{
    const PlaneCut *cut = model->cut;
    int count = 0;
    for (int k = 0; k < 4 * cut->points; k++)
        cut->row_of_id[k] = -1;
    for (int v = 0; v < cut->vertex_capacity; v++) {
        int id = cut->id[v];
        // Ids in range, and all of them before the free rows.
        if (id < -1 || id >= 4 * cut->points || (id >= 0 && v != count))
            return false;
        if (id < 0)
            continue;
        // No id twice; the origin is an id, too.
        if (cut->row_of_id[id] >= 0 || cut->origin_id[v] < 0 ||
            cut->origin_id[v] >= 4 * cut->points)
            return false;
        cut->row_of_id[id] = count++;
    }
    return true;
}

// True if the vertices that follow from the bits are exactly those of the ids.
static bool vertices_are_there(const PlaneCut *cut)
{
    int count = 0;
    for (int v = 0; v < cut->vertex_capacity; v++)
        count += cut->id[v] >= 0;
    for (int v = 0; v < cut->mesh.vertex_count; v++)
        if (cut->row_of_id[cut->mesh.id[v]] < 0)
            return false;
    return count == cut->mesh.vertex_count;
}

bool plane_cut_restore(Body *body)
{
    PlaneModel *model = body->model;
    PlaneCut *cut = model->cut;
    // What can be checked before anything follows from it.
    if (!quarters_can_be(cut) || !covers_each_cell_once(cut) || !ids_can_be(model))
        return false;
    for (int e = 0; e < cut->layout.element_count; e++)
        cut->layout.element[e].quarters = cut->quarters[e];
    // The elements, then the vertices that follow from them.
    if (!levels_can_be(cut))
        return false;
    if (!plane_cut_fill_mesh(cut) || !vertices_are_there(cut))
        return false;
    // Rows by ids, and all the rest.
    int count = 0;
    while (count < cut->vertex_capacity && cut->id[count] >= 0)
        count++;
    vertices_set_count(&model->vertices, count);
    for (int v = 0; v < cut->mesh.vertex_count; v++)
        plane_cut_assign_row(model, v, cut->row_of_id[cut->mesh.id[v]]);
    plane_cut_make(model, body);
    return true;
}
