// SPDX-License-Identifier: MIT
#include "voxel/cut/cut_masses.h"

#include "base/check.h"
#include "base/sets.h"
#include "base/sym3.h"
#include "voxel/cut/cut_carry.h"
#include "voxel/cut/cut_centre.h"
#include "voxel/cut/cut_parts.h"
#include "voxel/cut/cut_shape.h"
#include "voxel/rotation.h"

#include <math.h>
#include <string.h>

void cut_masses_create(CutMasses *masses, const char *name, Arena *arena)
{
    const CutLattice *lattice = masses->lattice;
    const int vertices = lattice->vertex_capacity;
    masses->share = arena_allocate(arena, ARENA_TOPOLOGY, (size_t)lattice->most_larger,
                                   sizeof *masses->share, "%s/shares of mass", name);
    // Scratch of a change.
    masses->touched = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "touched vertices");
    masses->group = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "groups of vertices");
    masses->next = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "next in group");
    masses->last = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "last in group");
    masses->mass_before = ALLOCATE(ARENA_TOPOLOGY, vertices, double, "masses before");
    memset(masses->group, -1, (size_t)vertices * sizeof *masses->group);
    masses->node_mass = masses->vertices->mass;
    if (lattice->adapts) // constant where nothing is cut
        masses->node_mass = ALLOCATE(ARENA_CONTACT, vertices, double, "masses of finest cells");
    if (lattice->adapts) {
        const int blocks = vertices / RUN_ROWS + 1;
        masses->busy = ALLOCATE(ARENA_TOPOLOGY, blocks, int, "busy rows");
        masses->run = arena_allocate(arena, ARENA_STEP, (size_t)(blocks / 2 + 1),
                                     sizeof *masses->run, "%s/runs of rows", name);
    }
    if (lattice->removable)
        masses->retired = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "vertices without elements");
}

// ---------------------------------------------------------------------------------------------
// One vertex

static void set_rest(CutMasses *masses, int vertex, const int point[3])
{
    for (int c = 0; c < 3; c++)
        masses->vertices->rows.rest[vertex][c] = cut_masses_rest(masses, c, point[c]);
}

static double mass_of(const CutMasses *masses, int element)
{
    if (masses->material_count == 1 && element < masses->lattice->level_first[1])
        return masses->mass[0];
    const CutElement *of = &masses->lattice->element[element];
    return masses->mass[of->level * masses->material_count + of->material - 1];
}

// Computes the part of an element's mass that each node's vertex gets. Total and first moment are
// those of the solid cubes.
static void set_shares(CutMasses *masses, int element)
{
    const CutLattice *lattice = masses->lattice;
    if (element < lattice->level_first[1] || !cut_lattice_is_leaf(lattice, element))
        return;
    const Template *shape =
        template_cache_shape(masses->templates, cut_shape_key(lattice, element));
    const double mass = shape->share * mass_of(masses, element);
    double *share = masses->share[cut_lattice_row(lattice, element)];
    for (int i = 0; i < shape->count; i++)
        share[shape->node[i]] = masses->law == VOXEL_MIYAZAKI2004 ? mass / shape->count
                                                                  : 0.125 * shape->weight[i] * mass;
}

// True if the part of a vertex is fixed: where the uncut body was. A corner in void, perhaps beyond
// the lattice, is held like all of its element.
static bool is_held(const CutMasses *masses, int vertex)
{
    const CutLattice *lattice = masses->lattice;
    int point[3];
    cut_lattice_point(lattice, vertex, point);
    for (int d = 0; d < 3; d++)
        point[d] = point[d] < lattice->lattice_count[d] ? point[d] : lattice->lattice_count[d];
    const long nx = lattice->lattice_count[0] + 1, ny = lattice->lattice_count[1] + 1;
    return masses->held[(point[2] * ny + point[1]) * nx + point[0]] >>
               (lattice->anchor[vertex] & 7) &
           1;
}

bool cut_masses_is_fixed(const CutMasses *masses, int vertex)
{
    return cut_lattice_is_carried(masses->lattice, vertex)
               ? is_held(masses, vertex)
               : vertices_is_fixed(masses->vertices, vertex);
}

// Computes the mass of the finest cells of a vertex's part, whatever the leaves.
static void set_node_mass(CutMasses *masses, int vertex)
{
    const CutLattice *lattice = masses->lattice;
    const int anchor = lattice->anchor[vertex];
    double mass = 0.0;
    int point[3], cell[8];
    if (anchor >= 0 && anchor < 8) {
        cut_lattice_point(lattice, vertex, point);
        const unsigned cells = cut_carry_cells(lattice, point, anchor, cell);
        for (int s = 0; s < 8; s++)
            if (cells >> s & 1)
                mass += 0.125 * mass_of(masses, cell[s]);
    }
    masses->node_mass[vertex] = mass;
}

// Computes a mass from scratch, so that it is a function of the bits alone.
static void set_mass(CutMasses *masses, int vertex)
{
    const CutLattice *lattice = masses->lattice;
    const int cells = lattice->level_first[1];
    const bool gone = lattice->anchor[vertex] < 0 && lattice->vertex_id[vertex] >= 0;
    if (gone) { // all its elements are: it stays at its place
        masses->node_mass[vertex] = 0.0;
        vertices_retire(masses->vertices, vertex);
        masses->retired[masses->retired_count++] = vertex;
        return;
    }
    // A free row, or a vertex that others carry.
    if (lattice->vertex_id[vertex] < 0 || cut_lattice_is_carried(lattice, vertex)) {
        vertices_put_mass(masses->vertices, vertex, 0.0, true);
        return;
    }
    // The eight slots around its point, some of the same leaf.
    int point[3], leaf[8];
    cut_lattice_point(lattice, vertex, point);
    cut_lattice_around(lattice, point, leaf);
    // Sum the shares of the elements that have this vertex.
    double mass = 0.0;
    for (int s = 0; s < 8; s++) {
        if (leaf[s] < 0)
            continue;
        if (leaf[s] < cells) { // has the point at the opposite corner
            if (cut_lattice_nodes(lattice, leaf[s])[7 - s] != vertex)
                continue;
            mass += 0.125 * mass_of(masses, leaf[s]);
        } else {
            // An element may be in several slots, then also in one beside this.
            if (((s & 1) && leaf[s - 1] == leaf[s]) || ((s & 2) && leaf[s - 2] == leaf[s]) ||
                ((s & 4) && leaf[s - 4] == leaf[s]))
                continue;
            const int row = cut_lattice_row(lattice, leaf[s]),
                      node = cut_lattice_node_at(lattice, leaf[s], point);
            if (lattice->node[row][node] == vertex)
                mass += masses->share[row][node];
        }
    }
    ASSERT(mass > 0.0);
    vertices_put_mass(masses->vertices, vertex, mass, is_held(masses, vertex));
}

// ---------------------------------------------------------------------------------------------
// Changes

// Fetches what set_mass reads for the next touched vertices: it is all over the tables, which a
// tick has displaced from the caches.
static void fetch_around(const CutMasses *masses, int t)
{
    enum { SOON = 8 };
    const CutLattice *lattice = masses->lattice;
    const int(*of)[3] = (const int(*)[3])lattice->scratch->point;
    if (t + 2 * SOON < masses->touched_count)
        __builtin_prefetch(of[masses->touched[t + 2 * SOON]]);
    if (t + SOON >= masses->touched_count)
        return;
    const int *point = of[masses->touched[t + SOON]];
    for (int s = 0; s < 4; s++) { // along x they are next to each other
        int cell[3] = {point[0] - 1, point[1] - 1 + (s & 1), point[2] - 1 + (s >> 1)};
        for (int d = 0; d < 3; d++)
            cell[d] = cell[d] > 0 ? cell[d] : 0;
        __builtin_prefetch(
            &lattice->scratch->grid[cut_parts_grid(lattice, cell[0], cell[1], cell[2])]);
        __builtin_prefetch(
            &lattice->lut[0][((long)cell[2] * lattice->count[1] + cell[1]) * lattice->count[0] +
                             cell[0]]);
    }
}

static bool is_free(const CutMasses *masses, int vertex)
{
    return rows_get(&masses->vertices->rows, masses->vertices->inverse_mass, vertex) != 0.0;
}

static void touch(CutMasses *masses, int vertex)
{
    if (masses->group[vertex] >= 0)
        return;
    masses->group[vertex] = vertex;
    masses->mass_before[vertex] = is_free(masses, vertex) ? masses->vertices->mass[vertex] : 0.0;
    masses->touched[masses->touched_count++] = vertex;
    if (masses->carry != NULL && masses->lattice->changes.merged_count > 0)
        cut_carry_note_move(masses->carry, vertex);
}

static void touch_element(CutMasses *masses, int element)
{
    const CutLattice *lattice = masses->lattice;
    const int *node = cut_lattice_nodes(lattice, element);
    const int count = element < lattice->level_first[1] ? NODE_CORNERS : NODE_COUNT;
    touch(masses, node[0]);
    for (int n = 1; n < count; n++)
        if (node[n] >= 0) {
            touch(masses, node[n]);
            union_find_join(masses->group, node[0], node[n]);
        }
}

// ---------------------------------------------------------------------------------------------
// The affine motion of an element's children: where a merge takes its corners in void

static void add_to_fit(const CutMasses *masses, AffineFit *fit, int vertex, const int point[3])
{
    const Rows *rows = &masses->vertices->rows;
    const void *row = vertices_row(masses->vertices);
    // From a corner of the element, in cells: exact.
    double x[3];
    for (int c = 0; c < 3; c++)
        x[c] = point[c] - fit->origin[c];
    fit->count += 1.0;
    for (int c = 0; c < 3; c++)
        fit->first[c] += x[c];
    fit->second = sym3_madd(fit->second, 1.0, sym3_outer(1.0, vec3(x[0], x[1], x[2])));
    for (int k = 0; k < ROW; k++) {
        const double value = rows_get(rows, row, (long)vertex * ROW + k);
        fit->sum[k] += value;
        for (int c = 0; c < 3; c++)
            fit->moment[c][k] += x[c] * value;
    }
}

// Solves for the mean and the gradient of each number. False: the points are in a plane.
static bool solve_fit(AffineFit *fit)
{
    const double by = 1.0 / fit->count;
    const Vec3 first = vec3(fit->first[0], fit->first[1], fit->first[2]);
    double determinant;
    const Sym3 inverse =
        sym3_adjugate(sym3_madd(fit->second, -by, sym3_outer(1.0, first)), &determinant);
    if (!(determinant > 1e-6))
        return false;
    for (int k = 0; k < ROW; k++) {
        const Vec3 moment = vec3(fit->moment[0][k] - by * first.x * fit->sum[k],
                                 fit->moment[1][k] - by * first.y * fit->sum[k],
                                 fit->moment[2][k] - by * first.z * fit->sum[k]);
        const Vec3 gradient = vec3_scale(1.0 / determinant, sym3_times(inverse, moment));
        fit->gradient[0][k] = gradient.x;
        fit->gradient[1][k] = gradient.y;
        fit->gradient[2][k] = gradient.z;
        fit->sum[k] *= by;
    }
    for (int c = 0; c < 3; c++)
        fit->first[c] *= by;
    return true;
}

// Returns a number of a row at a point.
static double fit_at(const AffineFit *fit, const int point[3], int k)
{
    double value = fit->sum[k];
    for (int c = 0; c < 3; c++)
        value += fit->gradient[c][k] * (point[c] - fit->origin[c] - fit->first[c]);
    return value;
}

static bool is_in_block(const CutElement *block, const int point[3])
{
    bool in = true;
    for (int d = 0; d < 3; d++)
        in &= point[d] >= block->cell[d] && point[d] <= block->cell[d] + (1 << block->level);
    return in;
}

// Fits the vertices that the children of an element had before it was merged in this change: those
// that it has now, and those that ended.
static void fit_merged(CutMasses *masses, int element)
{
    const CutLattice *lattice = masses->lattice;
    const CutChanges *changes = &lattice->changes;
    const CutElement *block = &lattice->element[element];
    const int *node = cut_lattice_nodes(lattice, element);
    AffineFit *fit = &masses->fit;
    int point[3];
    *fit = (AffineFit){.element = element};
    cut_lattice_place(lattice, element, fit->origin);
    for (int n = 0; n < NODE_COUNT; n++) {
        if (node[n] < 0 || masses->vertices->mass[node[n]] == 0.0) // it is new
            continue;
        cut_lattice_point(lattice, node[n], point);
        add_to_fit(masses, fit, node[n], point);
    }
    for (int i = 0; i < changes->ended_count; i++) {
        cut_lattice_point(lattice, changes->ended[i].vertex, point);
        if (is_in_block(block, point))
            add_to_fit(masses, fit, changes->ended[i].vertex, point);
    }
    const bool solved = solve_fit(fit);
    ASSERT(solved); // a cell has corners off any plane
}

// The points of an element that its children have: where they are, and what a merge leaves of them.
typedef struct MergePoints {
    int vertex[27]; // of the children, x + 3 y + 9 z; -1: none
    bool stays[27]; // at a corner, or needed by a smaller element beside
} MergePoints;

static void find_merge_points(const CutLattice *lattice, int element, MergePoints *out)
{
    const CutElement *block = &lattice->element[element];
    memset(out->vertex, -1, sizeof out->vertex);
    for (int c = 0; c < 8; c++) {
        const int child = cut_lattice_child(lattice, element, c);
        for (int k = 0; k < NODE_CORNERS && child >= 0; k++) {
            int at = 0;
            for (int d = 2; d >= 0; d--)
                at = 3 * at + (c >> d & 1) + (k >> d & 1);
            out->vertex[at] = cut_lattice_nodes(lattice, child)[k];
        }
    }
    for (int at = 0; at < 27; at++) {
        int point[3], leaf[8], step[3] = {at % 3, at / 3 % 3, at / 9};
        out->stays[at] = step[0] != 1 && step[1] != 1 && step[2] != 1;
        if (out->vertex[at] < 0 || out->stays[at])
            continue;
        for (int d = 0; d < 3; d++)
            point[d] = block->cell[d] + (step[d] << block->level >> 1);
        cut_lattice_around(lattice, point, leaf);
        // Smaller ones beside may have another vertex there: a part of their own.
        for (int s = 0; s < 8; s++)
            out->stays[at] |=
                leaf[s] >= 0 && lattice->element[leaf[s]].level < block->level &&
                cut_lattice_parent(lattice, leaf[s]) != element &&
                cut_lattice_nodes(lattice, leaf[s])[cut_lattice_node_at(lattice, leaf[s], point)] ==
                    out->vertex[at];
    }
}

static Vec3 displacement_of(const CutMasses *masses, int vertex)
{
    const void *row = vertices_row(masses->vertices);
    return rows_vector(&masses->vertices->rows, cut_carry_rows(masses->carry, row, vertex), vertex,
                       0);
}

double cut_masses_residual(const CutMasses *masses, int element)
{
    const CutLattice *lattice = masses->lattice;
    const CutElement *block = &lattice->element[element];
    MergePoints points;
    AffineFit fit = {.element = element};
    Vec3 map[27];
    int point[27][3], corner[27];
    unsigned there = 0;
    cut_lattice_place(lattice, element, fit.origin);
    find_merge_points(lattice, element, &points);
    for (int at = 0; at < 27; at++) {
        const int step[3] = {at % 3, at / 3 % 3, at / 9}, vertex = points.vertex[at];
        for (int d = 0; d < 3; d++)
            point[at][d] = block->cell[d] + (step[d] << block->level >> 1);
        if (vertex >= 0)
            add_to_fit(masses, &fit, vertex, point[at]);
        corner[at] = -1;
        if (step[0] == 1 || step[1] == 1 || step[2] == 1) {
            there |= (unsigned)(points.stays[at] && vertex >= 0) << at;
            if (vertex >= 0)
                map[at] = displacement_of(masses, vertex);
            continue;
        }
        // What it will have at a corner: in void also a vertex that elements beside have.
        if (!block->whole)
            corner[at] = cut_points_corner(lattice, element, point[at]);
        if (corner[at] < 0)
            corner[at] = vertex;
        else if (corner[at] != vertex && !cut_lattice_is_carried(lattice, corner[at]))
            add_to_fit(masses, &fit, corner[at], point[at]);
        if (corner[at] >= 0)
            map[at] = displacement_of(masses, corner[at]);
        points.stays[at] = corner[at] == vertex;
        there |= (unsigned)(corner[at] >= 0) << at;
    }
    if (!solve_fit(&fit))
        return (double)INFINITY;
    for (int at = 0; at < 27; at++)
        if (points.vertex[at] < 0 && corner[at] < 0) // in void: a corner, or filled below
            map[at] = vec3(fit_at(&fit, point[at], 0), fit_at(&fit, point[at], 1),
                           fit_at(&fit, point[at], 2));
    cut_fill_middles(map, there);
    double most = 0.0;
    for (int at = 0; at < 27; at++)
        if (points.vertex[at] >= 0 && !points.stays[at]) {
            const Vec3 away = vec3_sub(displacement_of(masses, points.vertex[at]), map[at]);
            most = fmax(most, vec3_dot(away, away));
        }
    return sqrt(most) / masses->size;
}

static void extrapolate(CutMasses *masses, const CutBirth *birth, const int point[3])
{
    Vertices *vertices = masses->vertices;
    if (masses->fit.element != birth->parent[0])
        fit_merged(masses, birth->parent[0]);
    for (int k = 0; k < ROW; k++)
        rows_put(&vertices->rows, vertices->row[vertices->current], (long)birth->vertex * ROW + k,
                 fit_at(&masses->fit, point, k));
}

// A vertex that ended belongs to the group of the element that was around it.
static void touch_ended(CutMasses *masses, const CutEnd *end)
{
    const CutLattice *lattice = masses->lattice;
    int leaf = end->element;
    // Of what was divided, a part may have been divided again in this change.
    while (lattice->divided[leaf] && !cut_parts_is_cell(lattice, leaf))
        leaf = cut_lattice_first_child(lattice, leaf);
    const int near = cut_lattice_nodes(lattice, leaf)[0];
    touch(masses, end->vertex);
    if (near >= 0 && masses->group[near] >= 0)
        union_find_join(masses->group, near, end->vertex);
}

// Sets the row of a new vertex to the mean of its parents: displacements are interpolated like
// positions. One that was carried is where it was.
static void bear(CutMasses *masses, const CutBirth *birth)
{
    Vertices *vertices = masses->vertices;
    const Rows *rows = &vertices->rows;
    void *row = vertices->row[vertices->current];
    int point[3];
    cut_lattice_point(masses->lattice, birth->vertex, point);
    set_rest(masses, birth->vertex, point);
    vertices->mass[birth->vertex] = 0.0;
    if (birth->carried && cut_carry_give_back(masses->carry, birth->vertex))
        return;
    if (birth->parent_count == 0) {
        extrapolate(masses, birth, point);
        return;
    }
    // Position and velocity are the parents' means.
    const double share = 1.0 / birth->parent_count;
    for (int c = 0; c < ROW; c++) {
        double sum = 0.0;
        for (int p = 0; p < birth->parent_count; p++)
            sum += rows_get(rows, row, (long)birth->parent[p] * ROW + c);
        rows_put(rows, row, (long)birth->vertex * ROW + c, share * sum);
    }
}

// Stops new vertices where vertices are fixed: they would keep their parents' velocity for ever.
static void stop_fixed(CutMasses *masses)
{
    const CutChanges *changes = &masses->lattice->changes;
    Vertices *vertices = masses->vertices;
    for (int b = 0; b < changes->birth_count; b++) {
        const int vertex = changes->birth[b].vertex;
        for (int c = 4; c < ROW && !is_free(masses, vertex); c++)
            rows_put(&vertices->rows, vertices->row[vertices->current], (long)vertex * ROW + c,
                     0.0);
    }
}

// ---------------------------------------------------------------------------------------------
// Momentum

// Sums over the vertices of a group that may move, in the rows' coordinates, x relative to the
// first of them.
typedef struct Momentum {
    double mass;
    Vec3 origin;
    Vec3 first;           // sum m x
    Sym3 second;          // sum m x x^T
    Vec3 linear, angular; // gained by the change of masses: sum dm v, sum dm x cross v
} Momentum;

static Vec3 position_of(const CutMasses *masses, const void *row, int vertex)
{
    const Rows *rows = &masses->vertices->rows;
    const double *rest = rows->rest[vertex];
    return vec3_add(vec3(rest[0], rest[1], rest[2]), rows_vector(rows, row, vertex, 0));
}

// True if a vertex that could move has ended in this change.
static bool has_ended(const CutMasses *masses, int vertex)
{
    return masses->vertices->mass[vertex] == 0.0 && masses->mass_before[vertex] > 0.0;
}

// Begins the sums of a group about its first vertex, against cancellation far from the origin.
static Momentum begin_momentum(const CutMasses *masses, const void *row, int group)
{
    int first = group;
    while (first >= 0 && !is_free(masses, first) && !has_ended(masses, first))
        first = masses->next[first];
    return (Momentum){.origin =
                          first < 0 ? (Vec3){0.0, 0.0, 0.0} : position_of(masses, row, first)};
}

// Adds a vertex: its mass, and the mass whose momentum was gained.
static void add_momentum(Momentum *sum, const CutMasses *masses, const void *row, int vertex,
                         double mass, double gained)
{
    const Vec3 x = vec3_sub(position_of(masses, row, vertex), sum->origin);
    const Vec3 v = rows_vector(&masses->vertices->rows, row, vertex, 4);
    sum->mass += mass;
    sum->first = vec3_madd(sum->first, mass, x);
    sum->second = sym3_madd(sum->second, mass, sym3_outer(1.0, x));
    sum->linear = vec3_madd(sum->linear, gained, v);
    sum->angular = vec3_madd(sum->angular, gained, vec3_cross(x, v));
}

// Returns what the exchange of masses in a group has added.
static Momentum momentum_of(const CutMasses *masses, const void *row, int group)
{
    Momentum sum = begin_momentum(masses, row, group);
    for (int i = group; i >= 0; i = masses->next[i]) {
        const double mass = masses->vertices->mass[i];
        if (is_free(masses, i) || has_ended(masses, i))
            add_momentum(&sum, masses, row, i, mass, mass - masses->mass_before[i]);
    }
    return sum;
}

// Returns I^-1 moment for the inertia about the centre; no spin about axes without inertia.
static Vec3 spin_for(const Momentum *sum, Vec3 center, Vec3 moment)
{
    double a[JACOBI_MAX][JACOBI_MAX] = {{0.0}}, axes[JACOBI_MAX][JACOBI_MAX];
    // The inertia about the centre, scaled to a trace of 1.
    const double m = sum->mass;
    const Sym3 s = sum->second;
    const double xx = s.xx - m * center.x * center.x, yy = s.yy - m * center.y * center.y;
    const double zz = s.zz - m * center.z * center.z, trace = 2.0 * (xx + yy + zz);
    if (!(trace > 0.0))
        return vec3(0.0, 0.0, 0.0);
    a[0][0] = (yy + zz) / trace;
    a[1][1] = (zz + xx) / trace;
    a[2][2] = (xx + yy) / trace;
    a[1][2] = a[2][1] = -(s.yz - m * center.y * center.z) / trace;
    a[2][0] = a[0][2] = -(s.zx - m * center.z * center.x) / trace;
    a[0][1] = a[1][0] = -(s.xy - m * center.x * center.y) / trace;
    jacobi_diagonalise(3, a, axes);
    // Along its axes; about one without inertia nothing can turn.
    Vec3 spin = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3; k++) {
        const Vec3 axis = vec3(axes[0][k], axes[1][k], axes[2][k]);
        if (a[k][k] > 1e-9)
            spin = vec3_madd(spin, vec3_dot(axis, moment) / (a[k][k] * trace), axis);
    }
    return spin;
}

// Returns the weights by which the vertices of the merged element carry one that ended.
static int weights_of_ended(const CutMasses *masses, int vertex, FitWeight weight[NODE_COUNT])
{
    int point[3];
    cut_lattice_point(masses->lattice, vertex, point);
    return cut_carry_weights_at(masses->lattice, masses->last[vertex], point, weight);
}

// Hands what the ended vertices of a group are beyond the map of the merged elements, in place and
// velocity, to the vertices of these in proportion to their weights: a motion that the elements can
// follow stays, and the centre of mass and its velocity too, as far as the masses are those of the
// map.
static void hand_over(const CutMasses *masses, void *row, int group)
{
    const Vertices *vertices = masses->vertices;
    const Rows *rows = &vertices->rows;
    FitWeight weight[NODE_COUNT];
    // All differences first, in the rows of those that ended.
    for (int i = group; i >= 0; i = masses->next[i]) {
        if (!has_ended(masses, i))
            continue;
        const int count = weights_of_ended(masses, i, weight);
        for (int c = 0; c < ROW; c++) {
            double beyond = rows_get(rows, row, (long)i * ROW + c);
            for (int w = 0; w < count; w++)
                beyond -= weight[w].weight * rows_get(rows, row, (long)weight[w].vertex * ROW + c);
            rows_put(rows, row, (long)i * ROW + c, beyond);
        }
    }
    for (int i = group; i >= 0; i = masses->next[i]) {
        if (!has_ended(masses, i))
            continue;
        const int count = weights_of_ended(masses, i, weight);
        for (int w = 0; w < count; w++) {
            const int to = weight[w].vertex;
            if (!is_free(masses, to))
                continue;
            const double share = weight[w].weight * masses->mass_before[i] / vertices->mass[to];
            for (int c = 0; c < ROW; c++)
                rows_put(rows, row, (long)to * ROW + c,
                         rows_get(rows, row, (long)to * ROW + c) +
                             share * rows_get(rows, row, (long)i * ROW + c));
        }
    }
}

// Hands over what ended in a group; returns the momentum that this and the change of masses added.
static Momentum merge_momentum(const CutMasses *masses, void *row, int group)
{
    Momentum sum = begin_momentum(masses, row, group);
    // Before: new vertices had no mass.
    for (int i = group; i >= 0; i = masses->next[i])
        if (is_free(masses, i) || has_ended(masses, i))
            add_momentum(&sum, masses, row, i, 0.0, -masses->mass_before[i]);
    hand_over(masses, row, group);
    for (int i = group; i >= 0; i = masses->next[i])
        if (is_free(masses, i))
            add_momentum(&sum, masses, row, i, masses->vertices->mass[i],
                         masses->vertices->mass[i]);
    return sum;
}

// Restores the momentum of a group. A division interpolates velocities and redistributes masses:
// linear momentum changes slightly where elements have hanging vertices, angular momentum too. The
// difference is returned to the same vertices as a rigid motion, which deforms nothing.
static void repair_momentum(const CutMasses *masses, int group)
{
    const Rows *rows = &masses->vertices->rows;
    void *row = masses->vertices->row[masses->vertices->current];
    const bool merged = masses->lattice->changes.merged_count > 0;
    const Momentum sum =
        merged ? merge_momentum(masses, row, group) : momentum_of(masses, row, group);
    if (!(sum.mass > 0.0))
        return;
    // The rigid motion that takes the difference back.
    const Vec3 push = vec3_scale(-1.0, sum.linear);
    const Vec3 center = vec3_scale(1.0 / sum.mass, sum.first);
    const Vec3 moment = vec3_sub(vec3_scale(-1.0, sum.angular), vec3_cross(center, push));
    const Vec3 spin = spin_for(&sum, center, moment);
    // Add it to all free vertices of the group.
    for (int i = group; i >= 0; i = masses->next[i]) {
        if (!is_free(masses, i))
            continue;
        const Vec3 x = vec3_sub(position_of(masses, row, i), sum.origin);
        Vec3 v = rows_vector(rows, row, i, 4);
        v = vec3_madd(v, 1.0 / sum.mass, push);
        v = vec3_add(v, vec3_cross(spin, vec3_sub(x, center)));
        rows_put(rows, row, (long)i * ROW + 4, v.x);
        rows_put(rows, row, (long)i * ROW + 5, v.y);
        rows_put(rows, row, (long)i * ROW + 6, v.z);
    }
}

static void repair_groups(CutMasses *masses)
{
    // Chain the vertices of each group, in one order.
    for (int t = 0; t < masses->touched_count; t++) {
        const int vertex = masses->touched[t];
        masses->next[vertex] = -1;
        masses->last[vertex] = vertex;
    }
    for (int t = 0; t < masses->touched_count; t++) {
        const int vertex = masses->touched[t], group = union_find_root(masses->group, vertex);
        if (group == vertex)
            continue;
        masses->next[masses->last[group]] = vertex;
        masses->last[group] = vertex;
    }
    // Of ended ones `last` is the element that carries them.
    const CutChanges *changes = &masses->lattice->changes;
    for (int i = 0; i < changes->ended_count; i++)
        masses->last[changes->ended[i].vertex] = changes->ended[i].element;
    for (int t = 0; t < masses->touched_count; t++)
        if (masses->group[masses->touched[t]] == masses->touched[t])
            repair_momentum(masses, masses->touched[t]);
}

// ---------------------------------------------------------------------------------------------
// Rows that move

static void list_runs(CutMasses *masses)
{
    Vertices *vertices = masses->vertices;
    const int used = cut_lattice_used(masses->lattice);
    int count = 0;
    for (int first = 0, block = 0; first < used; first += RUN_ROWS, block++) {
        const int end = first + RUN_ROWS < used ? first + RUN_ROWS : used;
        if (masses->busy[block] == 0)
            continue;
        if (count > 0 && masses->run[count - 1][1] == first) {
            masses->run[count - 1][1] = end;
            continue;
        }
        masses->run[count][0] = first;
        masses->run[count++][1] = end;
    }
    vertices->run = (const int(*)[2])masses->run;
    vertices->run_count = count;
    masses->run_used = used;
}

static void follow_runs(CutMasses *masses)
{
    const CutChanges *changes = &masses->lattice->changes;
    bool others = masses->run_used != cut_lattice_used(masses->lattice);
    for (int b = 0; b < changes->birth_count; b++)
        others |= masses->busy[changes->birth[b].vertex / RUN_ROWS]++ == 0;
    for (int i = 0; i < changes->ended_count; i++)
        others |= --masses->busy[changes->ended[i].vertex / RUN_ROWS] == 0;
    if (others)
        list_runs(masses);
}

static void derive_runs(CutMasses *masses)
{
    const CutLattice *lattice = masses->lattice;
    memset(masses->busy, 0, (size_t)(lattice->vertex_capacity / RUN_ROWS + 1) * sizeof(int));
    for (int v = 0; v < cut_lattice_used(lattice); v++)
        if (lattice->vertex_id[v] >= 0 && !cut_lattice_is_carried(lattice, v))
            masses->busy[v / RUN_ROWS]++;
    list_runs(masses);
}

void cut_masses_clear_free(const CutMasses *masses)
{
    const Vertices *vertices = masses->vertices;
    const int *id = masses->lattice->vertex_id;
    for (int r = 0; r < vertices->run_count; r++)
        for (int v = vertices->run[r][0]; v < vertices->run[r][1]; v++)
            if (id[v] < 0 || rows_is_carried(&vertices->rows, v))
                for (int c = 0; c < ROW; c++)
                    rows_put(&vertices->rows, vertices->row[vertices->current], (long)v * ROW + c,
                             0.0);
}

// ---------------------------------------------------------------------------------------------

void cut_masses_follow(CutMasses *masses, bool divided)
{
    const CutLattice *lattice = masses->lattice;
    const CutChanges *changes = &lattice->changes;
    // Births first: parents come before children.
    vertices_set_count(masses->vertices, cut_lattice_used(lattice));
    masses->fit.element = -1;
    for (int b = 0; b < changes->birth_count; b++)
        bear(masses, &changes->birth[b]);
    masses->touched_count = 0;
    // Masses of all vertices of changed elements.
    for (int i = 0; i < changes->element_count; i++) {
        set_shares(masses, changes->element[i]);
        if (cut_lattice_is_leaf(lattice, changes->element[i]))
            touch_element(masses, changes->element[i]);
    }
    for (int b = 0; b < changes->birth_count; b++) // a copy takes part of its origin's mass
        if (changes->birth[b].parent_count == 1) {
            const int *origin = changes->birth[b].parent;
            touch(masses, changes->birth[b].vertex);
            touch(masses, *origin);
            union_find_join(masses->group, changes->birth[b].vertex, *origin);
        }
    for (int i = 0; i < changes->lost_count; i++)
        touch(masses, changes->lost[i]);
    const int first_ended = masses->touched_count;
    for (int i = 0; i < changes->ended_count; i++)
        touch_ended(masses, &changes->ended[i]);
    // Parts of finest cells change where faces open only.
    for (int b = 0; b < changes->birth_count && lattice->adapts; b++)
        if (!changes->birth[b].carried)
            set_node_mass(masses, changes->birth[b].vertex);
    for (int t = 0; t < first_ended && lattice->adapts && changes->face_count > 0; t++)
        set_node_mass(masses, masses->touched[t]);
    // All shares are known now.
    for (int t = 0; t < first_ended; t++) {
        fetch_around(masses, t);
        set_mass(masses, masses->touched[t]);
    }
    for (int t = first_ended; t < masses->touched_count; t++)
        vertices_put_mass(masses->vertices, masses->touched[t], 0.0, true);
    stop_fixed(masses);
    // Only divisions interpolate, and so change momentum.
    if (divided)
        repair_groups(masses);
    // What is freed or carried has no row.
    for (int i = 0; i < changes->ended_count; i++) {
        const int vertex = changes->ended[i].vertex;
        const bool kept = cut_lattice_is_kept(lattice, vertex);
        if (!kept || cut_lattice_is_carried(lattice, vertex)) // it has not come back
            vertices_clear(masses->vertices, vertex);
        if (!kept)
            masses->node_mass[vertex] = 0.0;
    }
    for (int t = 0; t < masses->touched_count; t++)
        masses->group[masses->touched[t]] = -1;
    if (lattice->adapts)
        follow_runs(masses);
}

void cut_masses_derive(CutMasses *masses)
{
    const CutLattice *lattice = masses->lattice;
    vertices_set_count(masses->vertices, cut_lattice_used(lattice));
    for (int e = lattice->level_first[1]; e < lattice->element_count; e++)
        set_shares(masses, e);
    masses->retired_count = 0;
    for (int v = 0; v < cut_lattice_used(lattice); v++) {
        int point[3];
        if (lattice->vertex_id[v] >= 0) {
            cut_lattice_point(lattice, v, point);
            set_rest(masses, v, point);
        }
        set_mass(masses, v);
        if (lattice->adapts)
            set_node_mass(masses, v);
    }
    // Rows that were in use before have no mass until they are again.
    for (int v = cut_lattice_used(lattice); v < lattice->vertex_capacity && lattice->adapts; v++)
        vertices_put_mass(masses->vertices, v, 0.0, true);
    if (lattice->adapts)
        derive_runs(masses);
}
