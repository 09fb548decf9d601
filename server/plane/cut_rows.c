// SPDX-License-Identifier: MIT
// The vertices of a plane body after a change: rows, new vertices, masses, momentum. Step thread.
#include "plane/cut.h"

#include "base/check.h"

#include <string.h>

// ---------------------------------------------------------------------------------------------
// New vertices

// The rows whose mean an element's place was before the change.
typedef struct PlaneSource {
    int count;
    int row[4];
} PlaneSource;

static PlaneSource source_of(const PlaneCut *cut, int element, int place)
{
    const int *before = cut->before[element];
    const unsigned quarters = cut->quarters_before[element];
    if (before[place] >= 0)
        return (PlaneSource){1, {before[place]}};
    if (plane_passing(quarters, place) == PLANE_ABSENT) // the middle of a whole square
        return (PlaneSource){4, {before[0], before[2], before[6], before[8]}};
    int outline[PLANE_PLACES], count = plane_outline(quarters, outline), end[2] = {-1, -1};
    for (int k = 0; k < count; k++)
        if (outline[k] == place) {
            end[0] = before[outline[(k + count - 1) % count]];
            end[1] = before[outline[(k + 1) % count]];
        }
    // The neighbours on the outline may be absent middles too, along two quarters in a row; but a
    // place between two that turn has these as ends.
    ASSERT(end[0] >= 0 && end[1] >= 0);
    return (PlaneSource){2, {end[0], end[1]}};
}

// Returns the place of an element's corner in the enclosing square of which the element was a
// quarter.
static PlaneSource inherited(const PlaneCut *cut, int element, int place)
{
    if (cut->quarters_before[element] != 0)
        return source_of(cut, element, place);
    const PlaneElement *own = &cut->layout.element[element];
    const int level = own->level + 1, size = 1 << level;
    ASSERT(level <= cut->layout.levels);
    const int wide = cut->layout.count[0] / size;
    const int around = cut->layout.lut[level][own->cell[1] / size * wide + own->cell[0] / size];
    const int x = (own->cell[0] & (size - 1)) != 0, y = (own->cell[1] & (size - 1)) != 0;
    return source_of(cut, around, x + place % 3 / 2 + 3 * (y + place / 3 / 2));
}

static bool is_corner_place(int place)
{
    return place % 2 == 0 && place != PLANE_CENTER;
}

static PlaneSource source_of_vertex(const PlaneCut *cut, const int *element, const int *place,
                                    int count)
{
    // An element that had a vertex there is the best source; else one of which it is a corner.
    for (int k = 0; k < count; k++)
        if (cut->quarters_before[element[k]] != 0 && cut->before[element[k]][place[k]] >= 0)
            return (PlaneSource){1, {cut->before[element[k]][place[k]]}};
    for (int k = 0; k < count; k++)
        if (is_corner_place(place[k]) || cut->quarters_before[element[k]] != 0)
            return inherited(cut, element[k], place[k]);
    ASSERT(false);
    return (PlaneSource){0};
}

// Lists the elements around a vertex of the mesh, and which of their places it is.
static int around_vertex(const PlaneCut *cut, int v, int element[4], int place[4])
{
    int count = 0;
    for (int s = 0; s < 4; s++) {
        int e = plane_layout_at(&cut->layout, cut->mesh.point[v][0] - 1 + (s & 1),
                                cut->mesh.point[v][1] - 1 + (s >> 1));
        // An element may cover several of the four cells.
        bool again = false;
        for (int k = 0; k < count; k++)
            again |= element[k] == e;
        for (int p = 0; e >= 0 && !again && p < PLANE_PLACES; p++)
            if (cut->mesh.vertex[e][p] == v) {
                element[count] = e;
                place[count++] = p;
            }
    }
    return count;
}

static void bear(PlaneModel *model, int v, int row, TopologyChange *change)
{
    PlaneCut *cut = model->cut;
    Vertices *vertices = &model->vertices;
    Rows *rows = &vertices->rows;
    int element[4], place[4], count = around_vertex(cut, v, element, place);
    const PlaneSource source = source_of_vertex(cut, element, place, count);
    void *present = vertices->row[vertices->current];
    // Position and velocity are the means of its sources.
    for (int k = 0; k < ROW; k++) {
        double sum = 0.0;
        for (int i = 0; i < source.count; i++)
            sum += rows_get(rows, present, (long)source.row[i] * ROW + k);
        // A new vertex where vertices are fixed would keep its velocity.
        const bool stops = k >= 4 && cut->fixed_point[cut->mesh.id[v] % cut->points];
        rows_put(rows, present, (long)row * ROW + k, stops ? 0.0 : sum / source.count);
    }
    // Whoever holds a node of the strip follows it to these.
    const int a = source.row[0], b = source.row[source.count - 1];
    cut->origin_id[row] = source.count == 1 ? cut->origin_id[a] : cut->mesh.id[v];
    for (int n = 0; n < 2; n++)
        cut->birth[change->born_count++] = (NodeBirth){2 * row + n, {2 * a + n, 2 * b + n}};
}

void plane_cut_assign_row(PlaneModel *model, int v, int row)
{
    const PlaneCut *cut = model->cut;
    for (int d = 0; d < 2; d++)
        model->vertices.rows.rest[row][d] =
            cut->forms.size * (cut->mesh.point[v][d] - 0.5 * cut->layout.lattice_count[d]);
}

// Assigns rows to all vertices of the mesh by their ids; new ones at the end.
void plane_cut_take_rows(PlaneModel *model, TopologyChange *change)
{
    PlaneCut *cut = model->cut;
    Vertices *vertices = &model->vertices;
    int used = vertices->count;
    for (int v = 0; v < cut->mesh.vertex_count; v++) {
        // A known id keeps its row; a new one takes the next.
        int *row = &cut->row_of_id[cut->mesh.id[v]];
        if (*row < 0) {
            ASSERT(used < cut->vertex_capacity);
            *row = used++;
            cut->id[*row] = cut->mesh.id[v];
            plane_cut_assign_row(model, v, *row);
            bear(model, v, *row, change);
        }
        cut->row_of[v] = *row;
        cut->piece[*row] = cut->mesh.piece[v];
    }
    vertices_set_count(vertices, used);
    // Elements refer to rows.
    for (int e = 0; e < cut->layout.element_count; e++)
        for (int p = 0; p < PLANE_PLACES; p++)
            cut->vertex[e][p] =
                cut->mesh.vertex[e][p] < 0 ? -1 : cut->row_of[cut->mesh.vertex[e][p]];
}

// ---------------------------------------------------------------------------------------------
// Masses and momentum

void plane_cut_make_masses(PlaneModel *model)
{
    PlaneCut *cut = model->cut;
    Vertices *vertices = &model->vertices;
    for (int v = 0; v < vertices->count; v++)
        vertices->mass[v] = 0.0;
    plane_forms_add_masses(&cut->forms, model);
    for (int v = 0; v < vertices->count; v++)
        vertices_put_mass(vertices, v, vertices->mass[v],
                          cut->fixed_point[cut->id[v] % cut->points]);
}

// Sums in the plane over the vertices whose mass has changed; masses before or now.
typedef struct PlaneMotion {
    double mass, at[2], momentum[2], spin, inertia;
} PlaneMotion;

static PlaneMotion motion_of(const PlaneModel *model, const double *mass, const double about[2])
{
    const Vertices *vertices = &model->vertices;
    const void *present = vertices_row(vertices);
    PlaneMotion sum = {.mass = 0.0};
    for (int v = 0; v < vertices->count; v++) {
        // Only what has exchanged mass takes part.
        if (vertices->mass[v] == model->cut->mass_before[v] || vertices_is_fixed(vertices, v))
            continue;
        // Position about the given point, and velocity.
        double x[2], u[2];
        for (int d = 0; d < 2; d++) {
            x[d] = vertices->rows.rest[v][d] +
                   rows_get(&vertices->rows, present, (long)v * ROW + d) - about[d];
            u[d] = rows_get(&vertices->rows, present, (long)v * ROW + 4 + d);
        }
        // Sums with the masses asked for.
        sum.mass += mass[v];
        for (int d = 0; d < 2; d++) {
            sum.at[d] += mass[v] * x[d];
            sum.momentum[d] += mass[v] * u[d];
        }
        sum.spin += mass[v] * (x[0] * u[1] - x[1] * u[0]);
        sum.inertia += mass[v] * (x[0] * x[0] + x[1] * x[1]);
    }
    return sum;
}

// Restores the momentum that the redistribution of masses has changed, by a rigid motion of the
// vertices concerned.
void plane_cut_keep_momentum(PlaneModel *model)
{
    PlaneCut *cut = model->cut;
    Vertices *vertices = &model->vertices;
    const double origin[2] = {0.0, 0.0};
    PlaneMotion now = motion_of(model, vertices->mass, origin);
    if (!(now.mass > 0.0))
        return;
    // Momentum with the old and with the new masses, about the new centre.
    const double about[2] = {now.at[0] / now.mass, now.at[1] / now.mass};
    const PlaneMotion before = motion_of(model, cut->mass_before, about);
    now = motion_of(model, vertices->mass, about);
    const double dv[2] = {(before.momentum[0] - now.momentum[0]) / now.mass,
                          (before.momentum[1] - now.momentum[1]) / now.mass};
    const double turn = now.inertia > 0.0 ? (before.spin - now.spin) / now.inertia : 0.0;
    // The rigid motion that takes the difference back.
    void *present = vertices->row[vertices->current];
    for (int v = 0; v < vertices->count; v++) {
        if (vertices->mass[v] == cut->mass_before[v] || vertices_is_fixed(vertices, v))
            continue;
        double x[2];
        for (int d = 0; d < 2; d++)
            x[d] = vertices->rows.rest[v][d] +
                   rows_get(&vertices->rows, present, (long)v * ROW + d) - about[d];
        const double add[2] = {dv[0] - turn * x[1], dv[1] + turn * x[0]};
        for (int d = 0; d < 2; d++) {
            long at = (long)v * ROW + 4 + d;
            rows_put(&vertices->rows, present, at, rows_get(&vertices->rows, present, at) + add[d]);
        }
    }
}
