// SPDX-License-Identifier: MIT
#include "voxel/cut/cut_fit_parts.h"

#include "voxel/cut/cut_parts.h"
#include "voxel/lattice_faces.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define RIM_CLOSE 1e-3 // [cells] a step that ends the search for a rim

// ---------------------------------------------------------------------------------------------
// The offset of a point

// The crossings of the broken links around a point.
typedef struct Wall {
    int count;
    double mean[3];   // of the crossings [cells]
    double normal[3]; // unit
} Wall;

// A state from a body without crossings has zeros: then the middle.
static void add_crossing(Wall *wall, const CutCrossing *kept, const short cell[3], int axis)
{
    const CutCrossing middle = cut_crossing_middle(axis);
    const bool known = kept->normal[0] != 0 || kept->normal[1] != 0 || kept->normal[2] != 0;
    const CutCrossing *crossing = known ? kept : &middle;
    double along = 0.0;
    for (int c = 0; c < 3; c++) {
        wall->mean[c] += cell[c] + 0.5;
        along += crossing->normal[c] * wall->normal[c];
    }
    wall->mean[axis] += ((double)crossing->along + 0.5) / CROSSING_ALONG;
    // A sheet has two sides: all normals to that of the first.
    for (int c = 0; c < 3; c++)
        wall->normal[c] += (along < 0.0 ? -1.0 : 1.0) * crossing->normal[c] / CROSSING_UNIT;
    wall->count++;
}

// Returns the cell in a slot around a point, also if it is gone; -1: void, or one of a larger leaf.
static int cell_around(const CutFit *fit, const CutMoved *at, int slot)
{
    const int leaf = at->leaf[slot];
    if (leaf < 0 && fit->lattice->removable)
        return cut_parts_cell_in(fit->lattice, at->point, slot);
    return leaf < fit->faces->cell_count ? leaf : -1;
}

// True for a cell that is part of a larger leaf: its faces are not open yet.
static bool is_covered(const CutLattice *lattice, int cell)
{
    return !cut_lattice_is_leaf(lattice, cell) && !cut_lattice_is_gone(lattice, cell);
}

// Faces open between the cells around the point.
static Wall find_wall(const CutFit *fit, const CutMoved *at)
{
    const CutLattice *lattice = fit->lattice;
    Wall wall = {0};
    for (int s = 0; s < 8; s++)
        for (int axis = 0; axis < 3; axis++) {
            const int t = s | 1 << axis;
            if (s >> axis & 1 || (at->leaf[s] < 0 && at->leaf[t] < 0))
                continue;
            const int low = cell_around(fit, at, s), high = cell_around(fit, at, t);
            if (low >= 0 && high >= 0 && (lattice->broken[low] >> axis & 1) &&
                !is_covered(lattice, low) && !is_covered(lattice, high))
                add_crossing(&wall, &fit->crossing[low][axis], lattice->element[low].cell, axis);
        }
    double length = 1e-12;
    for (int c = 0; c < 3 && wall.count > 0; c++) {
        wall.mean[c] /= wall.count;
        length += wall.normal[c] * wall.normal[c];
    }
    for (int c = 0; c < 3; c++)
        wall.normal[c] /= sqrt(length);
    return wall;
}

// Where a wall meets the outer surface: a point on both.
static void find_rim(const CutFit *fit, const Wall *wall, const double point[3], double offset[3])
{
    enum { ROUNDS = 12 };
    const double limit[3] = {FITTED_LIMIT, FITTED_LIMIT, FITTED_LIMIT};
    double square = 1.0;
    for (int round = 0; round < ROUNDS && square > RIM_CLOSE * RIM_CLOSE; round++) {
        const double last[3] = {offset[0], offset[1], offset[2]};
        double away = 0.0;
        fitted_step(&fit->field, fit->level, point, offset, limit);
        for (int c = 0; c < 3; c++)
            away += (point[c] + offset[c] - wall->mean[c]) * wall->normal[c];
        square = 0.0;
        for (int c = 0; c < 3; c++) {
            offset[c] = fmin(fmax(offset[c] - away * wall->normal[c], -FITTED_LIMIT), FITTED_LIMIT);
            square += (offset[c] - last[c]) * (offset[c] - last[c]);
        }
    }
}

// Finds the present offset of a point [cells], and notes that of before.
static void find_offset(CutFit *fit, CutMoved *at)
{
    const Wall wall = find_wall(fit, at);
    const double point[3] = {at->point[0], at->point[1], at->point[2]};
    float *found = fit->point_offset[at->index];
    memcpy(at->before, found, sizeof at->before);
    memcpy(found, fit->outer[at->index], sizeof at->before);
    if (wall.count > 0) {
        double offset[3];
        for (int c = 0; c < 3; c++)
            offset[c] = fmin(fmax(wall.mean[c] - point[c], -FITTED_LIMIT), FITTED_LIMIT);
        if (fit->is_outer[at->index])
            find_rim(fit, &wall, point, offset);
        for (int c = 0; c < 3; c++)
            found[c] = (float)offset[c];
    }
    at->moved = memcmp(found, at->before, sizeof at->before) != 0;
}

// ---------------------------------------------------------------------------------------------
// Rows, cells and nodes

// True if all corners of a cell are vertices: not where a larger leaf covers it, and they are not
// kept.
static bool has_corners(const CutLattice *lattice, int cell)
{
    bool all = true;
    for (int k = 0; k < NODE_CORNERS && all; k++)
        all = cut_carry_corner(lattice, cell, k) >= 0;
    return all;
}

void cut_fit_around(const CutFit *fit, CutMoved *at)
{
    const CutLattice *lattice = fit->lattice;
    cut_lattice_around(lattice, at->point, at->leaf);
    for (int s = 0; s < 8 && lattice->adapts; s++) {
        if (at->leaf[s] < fit->faces->cell_count) // void, or a finest one
            continue;
        const int cell =
            cut_lattice_cell(lattice, at->point[0] - 1 + (s & 1), at->point[1] - 1 + (s >> 1 & 1),
                             at->point[2] - 1 + (s >> 2));
        at->leaf[s] = cell < 0 ? -1 : has_corners(lattice, cell) ? cell : at->leaf[s];
    }
}

static int row_for(CutFit *fit, int vertex)
{
    int *row = &fit->row_of[vertex];
    if (*row < 0) {
        *row = fit->fitted.fit.row_count++;
        fit->vertex[*row] = vertex;
        memset(fit->offset[*row], 0, sizeof *fit->offset);
    }
    return *row;
}

// Enters a cell that has a node, or updates its corners.
static void enter_cell(CutFit *fit, int cell)
{
    if (fit->entered[cell] == fit->stamp)
        return;
    fit->entered[cell] = fit->stamp;
    int *at = &fit->cell_at[cell];
    if (*at < 0) {
        *at = fit->fitted.fit.cell_count++;
        if (fit->of_cell != NULL)
            fit->of_cell[*at] = cell;
    }
    for (int k = 0; k < FIT_CORNERS; k++)
        fit->cell[*at][k] = row_for(fit, cut_fit_corner(fit, cell, k));
}

// Takes out a cell that went, or is inside of a larger leaf now: the last takes its place.
static void leave_cell(CutFit *fit, int cell)
{
    const int at = fit->cell_at[cell], last = --fit->fitted.fit.cell_count;
    fit->cell_at[fit->of_cell[last]] = at;
    fit->of_cell[at] = fit->of_cell[last];
    memcpy(fit->cell[at], fit->cell[last], sizeof *fit->cell);
    fit->cell_at[cell] = -1;
}

// Enters the cells around a point that have a node there.
static void enter_point(CutFit *fit, const CutMoved *at)
{
    for (int s = 0; s < 8; s++) {
        const int v = cut_fit_vertex_of(fit, at, s);
        if (v >= 0 && cut_fit_is_node(fit, v))
            enter_cell(fit, at->leaf[s]);
    }
}

static void set_offsets(CutFit *fit, int index)
{
    const CutScratch *scratch = fit->lattice->scratch;
    for (int v = cut_parts_first(scratch, index); v >= 0; v = scratch->next[v])
        if (cut_fit_is_node(fit, v))
            memcpy(fit->offset[row_for(fit, v)], fit->point_offset[index], sizeof *fit->offset);
}

// ---------------------------------------------------------------------------------------------
// Triangles: the better diagonal of each square

static void choose_diagonal(CutFit *fit, int square)
{
    CutFaces *faces = fit->faces;
    const int code = faces->square[square];
    const int *n = fit->lattice->scratch->points;
    int cell[3];
    cut_lattice_place(fit->lattice, code / 6, cell);
    const int first = cut_parts_index(fit->lattice->scratch, cell);
    int slot[4];
    double at[4][3];
    for (int k = 0; k < 4; k++) {
        const int corner = SQUARE_CORNER[code % 6][k];
        const int x = corner & 1, y = corner >> 1 & 1, z = corner >> 2;
        const float *offset = fit->point_offset[first + (z * n[1] + y) * n[0] + x];
        slot[k] = faces->slot_of[cut_fit_corner(fit, code / 6, corner)];
        at[k][0] = x + (double)offset[0];
        at[k][1] = y + (double)offset[1];
        at[k][2] = z + (double)offset[2];
    }
    const bool turned = fitted_turns_diagonal((const double(*)[3])at, code % 2 == 0);
    for (int half = 0; half < 2; half++)
        for (int c = 0; c < 3; c++)
            faces->triangle[2 * square + half][c] = slot[FITTED_TRIANGLES[turned][half][c]];
}

// Those of the squares around a point.
static void choose_diagonals(CutFit *fit, int index)
{
    const CutScratch *scratch = fit->lattice->scratch;
    const CutFaces *faces = fit->faces;
    for (int v = cut_parts_first(scratch, index); v >= 0; v = scratch->next[v])
        for (int k = faces->start[v]; k < faces->end[v]; k++) {
            const int square = faces->list[k] / 2;
            if (fit->seen_square[square] != fit->seen)
                choose_diagonal(fit, square);
            fit->seen_square[square] = fit->seen;
        }
}

// ---------------------------------------------------------------------------------------------
// After changes of the lattice

void cut_fit_keep(CutFit *fit, const int (*face)[2], const CutCrossing *crossing, int count)
{
    for (int f = 0; f < count; f++) {
        const int cell = face[f][0], axis = face[f][1];
        fit->crossing[cell][axis] = crossing != NULL ? crossing[f] : cut_crossing_middle(axis);
    }
}

// Points without a node have no offset until they get one.
static void list_point(CutFit *fit, const int point[3])
{
    const CutScratch *scratch = fit->lattice->scratch;
    const int index = cut_parts_index(scratch, point);
    if (fit->is_listed[index])
        return;
    bool shown = false;
    for (int v = cut_parts_first(scratch, index); v >= 0; v = scratch->next[v])
        shown |= cut_fit_is_node(fit, v);
    if (!shown)
        return;
    fit->is_listed[index] = 1;
    CutMoved *at = &fit->moved[fit->moved_count++];
    at->index = index;
    memcpy(at->point, point, sizeof at->point);
    cut_fit_around(fit, at);
}

// Lists the corners of cells that went, and those of broken faces; after divisions also those of
// changed cells.
static void list_points(CutFit *fit, bool divided)
{
    const CutLattice *lattice = fit->lattice;
    const CutChanges *changes = &lattice->changes;
    fit->moved_count = 0;
    for (int f = 0; f < changes->face_count; f++) {
        const short *cell = lattice->element[changes->face[f][0]].cell;
        const int axis = changes->face[f][1];
        if (!cut_lattice_is_open(lattice, changes->face[f][0], axis))
            continue; // it is listed again when it opens, or its cell has gone
        for (int k = 0; k < 4; k++) {
            int point[3] = {cell[0], cell[1], cell[2]};
            point[axis]++;
            point[(axis + 1) % 3] += k & 1;
            point[(axis + 2) % 3] += k >> 1;
            list_point(fit, point);
        }
    }
    for (int i = 0; i < changes->element_count; i++) {
        const int element = changes->element[i];
        const short *cell = lattice->element[element].cell;
        if (element >= fit->faces->cell_count ||
            !(cut_lattice_is_leaf(lattice, element) ? divided
                                                    : cut_lattice_is_gone(lattice, element)))
            continue;
        for (int k = 0; k < 8; k++)
            list_point(fit,
                       (int[3]){cell[0] + (k & 1), cell[1] + (k >> 1 & 1), cell[2] + (k >> 2)});
    }
    for (int p = 0; p < fit->moved_count; p++)
        fit->is_listed[fit->moved[p].index] = 0;
}

// Enters what clients need of the nodes, and updates the corners of changed cells.
static void enter(CutFit *fit)
{
    const CutChanges *changes = &fit->lattice->changes;
    for (int p = 0; p < fit->moved_count; p++) {
        enter_point(fit, &fit->moved[p]);
        set_offsets(fit, fit->moved[p].index);
    }
    for (int i = 0; i < changes->element_count; i++) {
        const int element = changes->element[i];
        if (element >= fit->faces->cell_count || fit->cell_at[element] < 0)
            continue;
        if (cut_lattice_is_gone(fit->lattice, element) ||
            (fit->lattice->adapts && !has_corners(fit->lattice, element)))
            leave_cell(fit, element);
        else
            enter_cell(fit, element);
    }
    const int slots = (int)*fit->faces->slot_count;
    for (; fit->slots < slots; fit->slots++)
        fit->row[fit->slots] = row_for(fit, fit->faces->slot_vertex[fit->slots]);
    fit->seen++;
    for (int p = 0; p < fit->moved_count; p++)
        choose_diagonals(fit, fit->moved[p].index);
}

static void note_births(CutFit *fit, bool born)
{
    const CutChanges *changes = &fit->lattice->changes;
    for (int b = 0; b < changes->birth_count; b++)
        fit->origin[changes->birth[b].vertex] = born ? cut_birth_origin(&changes->birth[b]) : -1;
}

bool cut_fit_follow(CutFit *fit, bool divided, Body *body)
{
    const void *row = vertices_row(fit->vertices);
    bool moved = false;
    fit->stamp++;
    fit->step = body->step + 1; // that of the frame after this tick
    list_points(fit, divided);
    for (int p = 0; p < fit->moved_count; p++) {
        find_offset(fit, &fit->moved[p]);
        moved |= fit->moved[p].moved;
    }
    note_births(fit, true);
    for (int p = 0; p < fit->moved_count; p++)
        cut_fit_start_fades(fit, row, &fit->moved[p]);
    note_births(fit, false);
    if (fit->faces->masses->carry != NULL)
        cut_fit_fade_moves(fit, row);
    enter(fit);
    cut_fit_write_fades(fit);
    body->mesh.fit = fit->fitted.fit;
    return moved;
}

// ---------------------------------------------------------------------------------------------
// From scratch

// True if a fade can be shown; a file may hold anything.
static bool fade_is_valid(const CutFade *fade)
{
    return fade->step > 0 && isfinite(fade->from[0]) && isfinite(fade->from[1]) &&
           isfinite(fade->from[2]);
}

// Lists the fades that the newest change may have left.
static void derive_fades(CutFit *fit)
{
    const int vertices = fit->faces->vertex_count, steps = fit->fitted.fit.fade_steps;
    int newest = 0;
    memset(fit->is_fading, 0, (size_t)fit->lattice->vertex_capacity);
    fit->fading_count = 0;
    for (int v = 0; v < vertices; v++) {
        if (!fade_is_valid(&fit->fade[v]))
            fit->fade[v] = (CutFade){.step = 0};
        newest = fit->fade[v].step > newest ? fit->fade[v].step : newest;
    }
    fit->step = newest;
    cut_fit_count_newest(fit);
    for (int v = 0; v < vertices; v++)
        if (fit->fade[v].step > 0 && newest - fit->fade[v].step < steps && cut_fit_is_node(fit, v))
            cut_fit_list_fade(fit, v);
    cut_fit_write_fades(fit);
}

void cut_fit_derive(CutFit *fit, Body *body)
{
    const CutScratch *scratch = fit->lattice->scratch;
    const int points = scratch->points[0] * scratch->points[1] * scratch->points[2];
    BodyFit *out = &fit->fitted.fit;
    out->row_count = out->cell_count = 0;
    fit->stamp++;
    memset(fit->row_of, -1, (size_t)fit->lattice->vertex_capacity * sizeof *fit->row_of);
    memset(fit->cell_at, -1, (size_t)fit->faces->cell_count * sizeof *fit->cell_at);
    for (fit->slots = 0; fit->slots < (int)*fit->faces->slot_count; fit->slots++)
        fit->row[fit->slots] = row_for(fit, fit->faces->slot_vertex[fit->slots]);
    memset(fit->point_offset, 0, (size_t)points * sizeof *fit->point_offset);
    fit->moved_count = 0;
    for (int s = 0; s < *fit->faces->slot_count; s++) {
        int point[3];
        if (!cut_fit_is_node(fit, fit->faces->slot_vertex[s]))
            continue;
        cut_lattice_point(fit->lattice, fit->faces->slot_vertex[s], point);
        list_point(fit, point);
    }
    for (int p = 0; p < fit->moved_count; p++) {
        CutMoved *at = &fit->moved[p];
        fit->is_listed[at->index] = 0;
        find_offset(fit, at);
        enter_point(fit, at);
        set_offsets(fit, at->index);
    }
    for (int s = 0; s < *fit->faces->shown; s++)
        if (fit->faces->square[s] >= 0)
            choose_diagonal(fit, s);
    derive_fades(fit);
    body->mesh.fit = *out;
}

// ---------------------------------------------------------------------------------------------
// Load time

// Spreads the offsets of the outer vertices over the lattice points.
static void create_outer(CutFit *fit, const VoxelMaking *making, const char *name, Arena *arena)
{
    const LatticeMesh *mesh = &making->mesh;
    const int *n = fit->lattice->scratch->points, points = n[0] * n[1] * n[2];
    float(*outer)[3] = arena_allocate(arena, ARENA_OUTPUT, (size_t)points, sizeof *outer, "%s/%s",
                                      name, "outer offsets");
    unsigned char *is_outer = ALLOCATE(ARENA_OUTPUT, points, unsigned char, "outer points");
    float(*found)[3] = fitted_offsets(mesh, &making->layout, making->options->field, &fit->level);
    for (int v = 0; v < mesh->surface_count; v++) {
        const int index = cut_parts_index(fit->lattice->scratch, mesh->point[v]);
        memcpy(outer[index], found[v], sizeof outer[index]);
        is_outer[index] = 1;
    }
    free(found);
    fit->outer = (const float(*)[3])outer;
    fit->is_outer = is_outer;
    const SurfaceField *field = making->options->field;
    const size_t samples =
        (size_t)field->count[0] * (size_t)field->count[1] * (size_t)field->count[2];
    fit->field = *field;
    fit->field.value = ALLOCATE(ARENA_OUTPUT, samples, float, "surface field");
    memcpy(fit->field.value, field->value, samples * sizeof *field->value);
}

static void create_rows(CutFit *fit, const char *name, Arena *arena)
{
    const size_t vertices = (size_t)fit->lattice->vertex_capacity;
    const size_t cells = (size_t)fit->faces->cell_count;
    fit->vertex = ALLOCATE(ARENA_OUTPUT, vertices, int, "fitted vertices");
    fit->row_of = ALLOCATE(ARENA_OUTPUT, vertices, int, "fitted rows of vertices");
    fit->row = ALLOCATE(ARENA_OUTPUT, vertices, int, "fitted rows");
    fit->offset = arena_allocate(arena, ARENA_OUTPUT, vertices, sizeof *fit->offset,
                                 "%s/fitted offsets", name);
    fit->cell_at = ALLOCATE(ARENA_OUTPUT, cells, int, "fitted cells of cells");
    fit->cell =
        arena_allocate(arena, ARENA_OUTPUT, cells, sizeof *fit->cell, "%s/fitted cells", name);
    const int fades = (int)vertices / 4 + 64;
    fit->fading = ALLOCATE(ARENA_OUTPUT, fades, FitFade, "fades");
    fit->fading_vertex = ALLOCATE(ARENA_OUTPUT, fades, int, "fading vertices");
    fit->is_fading = ALLOCATE(ARENA_OUTPUT, vertices, unsigned char, "fading");
    if (fit->lattice->removable || fit->lattice->adapts)
        fit->of_cell = ALLOCATE(ARENA_OUTPUT, cells, int, "cells of fitted cells");
    fit->fitted.vertex = fit->vertex;
    fit->fitted.fit = (BodyFit){.row_capacity = (int)vertices,
                                .cell_capacity = (int)cells,
                                .fade_capacity = fades,
                                .row = fit->row,
                                .offset = (const float(*)[3])fit->offset,
                                .cell = (const int(*)[FIT_CORNERS])fit->cell,
                                .fade = fit->fading};
    fitted_reserve(&fit->fitted, name, arena);
}

static void create_scratch(CutFit *fit, const char *name, Arena *arena)
{
    const int *n = fit->lattice->scratch->points, points = n[0] * n[1] * n[2];
    const size_t cells = (size_t)fit->faces->cell_count;
    fit->point_offset = arena_allocate(arena, ARENA_OUTPUT, (size_t)points,
                                       sizeof *fit->point_offset, "%s/point offsets", name);
    fit->moved = ALLOCATE(ARENA_OUTPUT, points, CutMoved, "moved points");
    fit->is_listed = ALLOCATE(ARENA_OUTPUT, points, unsigned char, "listed points");
    fit->origin = ALLOCATE(ARENA_OUTPUT, fit->lattice->vertex_capacity, int, "fitted births");
    memset(fit->origin, -1, (size_t)fit->lattice->vertex_capacity * sizeof *fit->origin);
    fit->gradient = arena_allocate(arena, ARENA_OUTPUT, cells, sizeof *fit->gradient,
                                   "%s/fitted gradients", name);
    fit->entered = ALLOCATE(ARENA_OUTPUT, cells, int, "entered cells");
    fit->known = ALLOCATE(ARENA_OUTPUT, cells, int, "known gradients");
    fit->seen_square = ALLOCATE(ARENA_OUTPUT, fit->faces->square_capacity, int, "seen squares");
}

void cut_fit_create(CutFit *fit, CutFaces *faces, CutLattice *lattice, const VoxelMaking *making,
                    Body *body, Arena *arena, StateList *state)
{
    const char *name = making->options->body.name;
    const size_t cells = (size_t)faces->cell_count, vertices = (size_t)lattice->vertex_capacity;
    *fit = (CutFit){.faces = faces, .lattice = lattice, .vertices = faces->vertices};
    fit->fitted.size = making->options->lattice->size;
    create_outer(fit, making, name, arena);
    create_rows(fit, name, arena);
    create_scratch(fit, name, arena);
    fit->fitted.fit.reach = FITTED_REACH * fit->fitted.size;
    fit->fitted.fit.fade_steps = (int)fmax(1.0, ceil(FIT_FADE_TIME / making->options->tick));
    fit->crossing =
        arena_allocate(arena, ARENA_TOPOLOGY, cells, sizeof *fit->crossing, "%s/crossings", name);
    fit->fade = ALLOCATE(ARENA_TOPOLOGY, vertices, CutFade, "fades of vertices");
    // Tools feel the surface that is shown.
    void (*add)(StateList *, void *, size_t, const char *, ...) =
        making->options->body.without_contacts ? state_add_shown : state_add_rare;
    add(state, fit->crossing, cells * sizeof *fit->crossing, "%s/crossings", name);
    add(state, fit->fade, vertices * sizeof *fit->fade, "%s/fades", name);
    cut_fit_derive(fit, body);
}
