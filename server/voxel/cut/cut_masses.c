// SPDX-License-Identifier: MIT
#include "voxel/cut/cut_masses.h"

#include "base/check.h"
#include "base/sets.h"
#include "base/sym3.h"
#include "voxel/cut/cut_shape.h"
#include "voxel/rotation.h"

#include <math.h>
#include <string.h>

void cut_masses_create(CutMasses *masses, const char *name, Arena *arena)
{
    const CutLattice *lattice = masses->lattice;
    const int vertices = lattice->vertex_capacity;
    masses->share = arena_allocate(arena, ARENA_TOPOLOGY,
                                   (size_t)(lattice->element_count - lattice->level_first[1]),
                                   sizeof *masses->share, "%s/shares of mass", name);
    // Scratch of a change.
    masses->touched = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "touched vertices");
    masses->group = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "groups of vertices");
    masses->next = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "next in group");
    masses->last = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "last in group");
    masses->mass_before = ALLOCATE(ARENA_TOPOLOGY, vertices, double, "masses before");
    memset(masses->group, -1, (size_t)vertices * sizeof *masses->group);
    if (lattice->removable)
        masses->retired = ALLOCATE(ARENA_TOPOLOGY, vertices, int, "vertices without elements");
}

// ---------------------------------------------------------------------------------------------
// One vertex

static void set_rest(CutMasses *masses, int vertex, const int point[3])
{
    for (int c = 0; c < 3; c++)
        masses->vertices->rows.rest[vertex][c] = masses->size * (point[c] - masses->middle[c]);
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
    double *share = masses->share[element - lattice->level_first[1]];
    for (int i = 0; i < shape->count; i++)
        share[shape->node[i]] = masses->law == VOXEL_MIYAZAKI2004 ? mass / shape->count
                                                                  : 0.125 * shape->weight[i] * mass;
}

// Computes a mass from scratch, so that it is a function of the bits alone.
static void set_mass(CutMasses *masses, int vertex)
{
    const CutLattice *lattice = masses->lattice;
    const int cells = lattice->level_first[1];
    if (lattice->anchor[vertex] < 0) { // all its elements are gone: it stays at its place
        vertices_retire(masses->vertices, vertex);
        masses->retired[masses->retired_count++] = vertex;
        return;
    }
    // The eight slots around its point, some of the same leaf.
    int point[3], leaf[8];
    cut_lattice_point(lattice, vertex, point);
    cut_lattice_around(lattice, point, leaf);
    // Sum the shares of the elements that have this vertex.
    double mass = 0.0;
    int lowest = -1; // lowest slot of its part
    for (int s = 0; s < 8; s++) {
        if (leaf[s] < 0)
            continue;
        if (leaf[s] < cells) { // has the point at the opposite corner
            if (lattice->corner[leaf[s]][7 - s] != vertex)
                continue;
            mass += 0.125 * mass_of(masses, leaf[s]);
        } else {
            bool counted = false; // an element may be in several slots
            for (int t = 0; t < s; t++)
                counted |= leaf[t] == leaf[s];
            const int node = counted ? -1 : cut_lattice_node_at(lattice, leaf[s], point);
            if (counted || lattice->node[leaf[s] - cells][node] != vertex)
                continue;
            mass += masses->share[leaf[s] - cells][node];
        }
        if (lowest < 0)
            lowest = s;
    }
    ASSERT(lowest >= 0);
    // The part is fixed where the uncut body was.
    const long nx = lattice->lattice_count[0] + 1, ny = lattice->lattice_count[1] + 1;
    const unsigned char held = masses->held[(point[2] * ny + point[1]) * nx + point[0]];
    vertices_put_mass(masses->vertices, vertex, mass, held >> lowest & 1);
}

// ---------------------------------------------------------------------------------------------
// Changes

static void touch(CutMasses *masses, int vertex)
{
    if (masses->group[vertex] >= 0)
        return;
    masses->group[vertex] = vertex;
    masses->mass_before[vertex] = masses->vertices->mass[vertex];
    masses->touched[masses->touched_count++] = vertex;
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

// Sets the row of a new vertex to the mean of its parents: displacements are interpolated like
// positions.
static void bear(CutMasses *masses, const CutBirth *birth)
{
    Vertices *vertices = masses->vertices;
    const Rows *rows = &vertices->rows;
    void *row = vertices->row[vertices->current];
    int point[3];
    cut_lattice_point(masses->lattice, birth->vertex, point);
    set_rest(masses, birth->vertex, point);
    vertices->mass[birth->vertex] = 0.0;
    // Position and velocity are the parents' means.
    const double share = 1.0 / birth->parent_count;
    for (int c = 0; c < ROW; c++) {
        double sum = 0.0;
        for (int p = 0; p < birth->parent_count; p++)
            sum += rows_get(rows, row, (long)birth->parent[p] * ROW + c);
        rows_put(rows, row, (long)birth->vertex * ROW + c, share * sum);
    }
}

static bool is_free(const CutMasses *masses, int vertex)
{
    return rows_get(&masses->vertices->rows, masses->vertices->inverse_mass, vertex) != 0.0;
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

static Momentum momentum_of(const CutMasses *masses, const void *row, int group)
{
    Momentum sum = {.mass = 0.0};
    for (int i = group; i >= 0; i = masses->next[i]) {
        if (!is_free(masses, i))
            continue;
        // About the first vertex, against cancellation far from the origin.
        if (sum.mass == 0.0)
            sum.origin = position_of(masses, row, i);
        // What the exchange of masses has added counts.
        const Vec3 x = vec3_sub(position_of(masses, row, i), sum.origin);
        const Vec3 v = rows_vector(&masses->vertices->rows, row, i, 4);
        const double mass = masses->vertices->mass[i], more = mass - masses->mass_before[i];
        sum.mass += mass;
        sum.first = vec3_madd(sum.first, mass, x);
        sum.second = sym3_madd(sum.second, mass, sym3_outer(1.0, x));
        sum.linear = vec3_madd(sum.linear, more, v);
        sum.angular = vec3_madd(sum.angular, more, vec3_cross(x, v));
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

// Restores the momentum of a group. A division interpolates velocities and redistributes masses:
// linear momentum changes slightly where elements have hanging vertices, angular momentum too. The
// difference is returned to the same vertices as a rigid motion, which deforms nothing.
static void repair_momentum(const CutMasses *masses, int group)
{
    const Rows *rows = &masses->vertices->rows;
    void *row = masses->vertices->row[masses->vertices->current];
    const Momentum sum = momentum_of(masses, row, group);
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
    for (int t = 0; t < masses->touched_count; t++)
        if (masses->group[masses->touched[t]] == masses->touched[t])
            repair_momentum(masses, masses->touched[t]);
}

// ---------------------------------------------------------------------------------------------

void cut_masses_follow(CutMasses *masses, bool divided)
{
    const CutLattice *lattice = masses->lattice;
    const CutChanges *changes = &lattice->changes;
    // Births first: parents come before children.
    vertices_set_count(masses->vertices, cut_lattice_used(lattice));
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
        if (changes->birth[b].origin >= 0) {
            touch(masses, changes->birth[b].vertex);
            touch(masses, changes->birth[b].origin);
            union_find_join(masses->group, changes->birth[b].vertex, changes->birth[b].origin);
        }
    for (int i = 0; i < changes->lost_count; i++)
        touch(masses, changes->lost[i]);
    // All shares are known now.
    for (int t = 0; t < masses->touched_count; t++)
        set_mass(masses, masses->touched[t]);
    stop_fixed(masses);
    // Only divisions interpolate, and so change momentum.
    if (divided)
        repair_groups(masses);
    for (int t = 0; t < masses->touched_count; t++)
        masses->group[masses->touched[t]] = -1;
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
        cut_lattice_point(lattice, v, point);
        set_rest(masses, v, point);
        set_mass(masses, v);
    }
}
