#include "voxel/cut/cut_masses.h"

#include "base/check.h"
#include "voxel/jacobi.h"

#include <math.h>
#include <string.h>

#define ALLOCATE(count, type, label)                                                               \
    (type *)arena_allocate(arena, ARENA_TOPOLOGY, (size_t)(count), sizeof(type), "%s/%s", name,    \
                           label)

void cut_masses_create(CutMasses *masses, const char *name, Arena *arena)
{
    const CutLattice *lattice = masses->lattice;
    const int vertices = lattice->vertex_capacity;
    masses->mask =
        ALLOCATE(lattice->element_count - lattice->level_first[1], unsigned, "element masks");
    masses->touched = ALLOCATE(vertices, int, "touched vertices");
    masses->group = ALLOCATE(vertices, int, "groups of vertices");
    masses->next = ALLOCATE(vertices, int, "next in group");
    masses->last = ALLOCATE(vertices, int, "last in group");
    masses->mass_before = ALLOCATE(vertices, double, "masses before");
    memset(masses->group, -1, (size_t)vertices * sizeof *masses->group);
}

// ---------------------------------------------------------------------------------------------
// One vertex

static void set_place(CutMasses *masses, int vertex, const int point[3])
{
    for (int c = 0; c < 3; c++)
        masses->vertices->rows.place[vertex][c] = masses->size * (point[c] - masses->middle[c]);
}

static void set_mask(CutMasses *masses, int element)
{
    const CutLattice *lattice = masses->lattice;
    if (element >= lattice->level_first[1])
        masses->mask[element - lattice->level_first[1]] =
            template_mask_of(cut_lattice_nodes(lattice, element));
}

// What of an element's mass the vertex at a node bears. Total and first moment are those of the
// solid cubes.
static double share_of(const CutMasses *masses, int element, int node)
{
    const CutLattice *lattice = masses->lattice;
    const CutElement *of = &lattice->element[element];
    const double mass = masses->mass[of->level * masses->material_count + of->material - 1];
    const unsigned mask =
        element < lattice->level_first[1] ? 0 : masses->mask[element - lattice->level_first[1]];
    if (mask == 0)
        return 0.125 * mass;
    const unsigned present = mask << NODE_CORNERS | 0xff;
    if (masses->law == VOXEL_MIYAZAKI2004)
        return mass / __builtin_popcount(present);
    const Template *shape = template_cache_shape(masses->templates, mask);
    return 0.125 * shape->weight[__builtin_popcount(present & ((1u << node) - 1))] * mass;
}

// From scratch, so that it is a function of the bits alone.
static void set_mass(CutMasses *masses, int vertex)
{
    const CutLattice *lattice = masses->lattice;
    int point[3], leaf[8];
    cut_lattice_point(lattice, vertex, point);
    cut_lattice_around(lattice, point, leaf);
    double mass = 0.0;
    int lowest = -1; // slot of its part
    for (int s = 0; s < 8; s++) {
        if (leaf[s] < 0)
            continue;
        int node = 7 - s; // the corner opposite of a cell
        if (leaf[s] >= lattice->level_first[1]) {
            bool counted = false; // larger leaves may lie in several slots
            for (int t = 0; t < s; t++)
                counted |= leaf[t] == leaf[s];
            if (counted)
                continue;
            node = cut_lattice_node_at(lattice, leaf[s], point);
        }
        if (cut_lattice_nodes(lattice, leaf[s])[node] != vertex)
            continue;
        mass += share_of(masses, leaf[s], node);
        if (lowest < 0)
            lowest = s;
    }
    ASSERT(lowest >= 0);
    const long nx = lattice->lattice_count[0] + 1, ny = lattice->lattice_count[1] + 1;
    const unsigned char held = masses->held[(point[2] * ny + point[1]) * nx + point[0]];
    vertices_put_mass(masses->vertices, vertex, mass, held >> lowest & 1);
}

// ---------------------------------------------------------------------------------------------
// What has changed

static int group_of(CutMasses *masses, int vertex)
{
    int *group = masses->group;
    while (group[vertex] != vertex) {
        group[vertex] = group[group[vertex]];
        vertex = group[vertex];
    }
    return vertex;
}

static void unite(CutMasses *masses, int a, int b)
{
    a = group_of(masses, a);
    b = group_of(masses, b);
    masses->group[a > b ? a : b] = a < b ? a : b;
}

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
    for (int n = 0; n < count; n++)
        if (node[n] >= 0) {
            touch(masses, node[n]);
            unite(masses, node[n], node[0]);
        }
}

// The mean of its parents. Displacements are as linear as places.
static void bear(CutMasses *masses, const CutBirth *birth)
{
    Vertices *vertices = masses->vertices;
    const Rows *rows = &vertices->rows;
    void *row = vertices->row[vertices->current];
    int point[3];
    cut_lattice_point(masses->lattice, birth->vertex, point);
    set_place(masses, birth->vertex, point);
    vertices->mass[birth->vertex] = 0.0;
    const double share = 1.0 / birth->parent_count;
    for (int c = 0; c < ROW; c++) {
        double sum = 0.0;
        for (int p = 0; p < birth->parent_count; p++)
            sum += rows_get(rows, row, (long)birth->parent[p] * ROW + c);
        rows_put(rows, row, (long)birth->vertex * ROW + c, share * sum);
    }
}

// ---------------------------------------------------------------------------------------------
// Momentum

typedef struct Momentum {
    double mass;
    Vec3 first;           // sum m x
    Vec3 linear, angular; // sum m v, sum m x cross v, in the rows' coordinates
} Momentum;

static bool is_free(const CutMasses *masses, int vertex)
{
    return !vertices_is_fixed(masses->vertices, vertex);
}

static void read_row(const CutMasses *masses, int vertex, Vec3 *x, Vec3 *v)
{
    const Rows *rows = &masses->vertices->rows;
    const void *row = masses->vertices->row[masses->vertices->current];
    *x = rows_local(rows, row, vertex);
    *v = rows_vector(rows, row, vertex, 4);
}

// Of the vertices of a group that may move, now; less what they had before their masses changed.
static Momentum momentum_of(const CutMasses *masses, int group, Momentum *gained)
{
    Momentum sum = {.mass = 0.0};
    *gained = sum;
    for (int i = group; i >= 0; i = masses->next[i]) {
        if (!is_free(masses, i))
            continue;
        Vec3 x, v;
        read_row(masses, i, &x, &v);
        const Vec3 turn = vec3_cross(x, v);
        const double mass = masses->vertices->mass[i], more = mass - masses->mass_before[i];
        sum.mass += mass;
        sum.first = vec3_madd(sum.first, mass, x);
        gained->linear = vec3_madd(gained->linear, more, v);
        gained->angular = vec3_madd(gained->angular, more, turn);
    }
    return sum;
}

// I^-1 moment, of the inertia about `center`; about axes without any nothing can turn.
static Vec3 spin_for(const CutMasses *masses, int group, Vec3 center, Vec3 moment)
{
    double a[JACOBI_MAX][JACOBI_MAX] = {{0.0}}, axes[JACOBI_MAX][JACOBI_MAX], trace = 0.0;
    for (int i = group; i >= 0; i = masses->next[i]) {
        if (!is_free(masses, i))
            continue;
        Vec3 x, v;
        read_row(masses, i, &x, &v);
        x = vec3_sub(x, center);
        const double m = masses->vertices->mass[i];
        a[0][0] += m * (x.y * x.y + x.z * x.z);
        a[1][1] += m * (x.z * x.z + x.x * x.x);
        a[2][2] += m * (x.x * x.x + x.y * x.y);
        a[0][1] -= m * x.x * x.y;
        a[0][2] -= m * x.x * x.z;
        a[1][2] -= m * x.y * x.z;
    }
    a[1][0] = a[0][1], a[2][0] = a[0][2], a[2][1] = a[1][2];
    trace = a[0][0] + a[1][1] + a[2][2];
    if (!(trace > 0.0))
        return vec3(0.0, 0.0, 0.0);
    for (int i = 0; i < 9; i++)
        a[i / 3][i % 3] /= trace;
    jacobi_diagonalise(3, a, axes);
    Vec3 spin = {0.0, 0.0, 0.0};
    for (int k = 0; k < 3; k++) {
        const Vec3 axis = vec3(axes[0][k], axes[1][k], axes[2][k]);
        if (a[k][k] > 1e-9)
            spin = vec3_madd(spin, vec3_dot(axis, moment) / (a[k][k] * trace), axis);
    }
    return spin;
}

// A division interpolates velocities and shares masses anew: the linear momentum changes a little
// where elements have hanging vertices, the angular one too. The difference goes back to the same
// vertices as a rigid motion, which deforms nothing.
static void repair_momentum(const CutMasses *masses, int group)
{
    Momentum gained;
    const Momentum now = momentum_of(masses, group, &gained);
    if (!(now.mass > 0.0))
        return;
    const Vec3 push = vec3_scale(-1.0, gained.linear);
    const Vec3 center = vec3_scale(1.0 / now.mass, now.first);
    const Vec3 moment = vec3_sub(vec3_scale(-1.0, gained.angular), vec3_cross(center, push));
    const Vec3 spin = spin_for(masses, group, center, moment);
    const Rows *rows = &masses->vertices->rows;
    void *row = masses->vertices->row[masses->vertices->current];
    for (int i = group; i >= 0; i = masses->next[i]) {
        if (!is_free(masses, i))
            continue;
        Vec3 x, v;
        read_row(masses, i, &x, &v);
        v = vec3_madd(v, 1.0 / now.mass, push);
        v = vec3_add(v, vec3_cross(spin, vec3_sub(x, center)));
        rows_put(rows, row, (long)i * ROW + 4, v.x);
        rows_put(rows, row, (long)i * ROW + 5, v.y);
        rows_put(rows, row, (long)i * ROW + 6, v.z);
    }
}

static void repair_groups(CutMasses *masses)
{
    for (int t = 0; t < masses->touched_count; t++) {
        const int vertex = masses->touched[t];
        masses->next[vertex] = -1;
        masses->last[vertex] = vertex;
    }
    for (int t = 0; t < masses->touched_count; t++) {
        const int vertex = masses->touched[t], group = group_of(masses, vertex);
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
    vertices_set_count(masses->vertices, cut_lattice_used(lattice));
    for (int b = 0; b < changes->birth_count; b++)
        bear(masses, &changes->birth[b]);
    masses->touched_count = 0;
    for (int i = 0; i < changes->element_count; i++) {
        set_mask(masses, changes->element[i]);
        if (cut_lattice_is_leaf(lattice, changes->element[i]))
            touch_element(masses, changes->element[i]);
    }
    for (int b = 0; b < changes->birth_count; b++) // what a copy bears its origin bore
        if (changes->birth[b].origin >= 0) {
            touch(masses, changes->birth[b].vertex);
            touch(masses, changes->birth[b].origin);
            unite(masses, changes->birth[b].vertex, changes->birth[b].origin);
        }
    for (int t = 0; t < masses->touched_count; t++)
        set_mass(masses, masses->touched[t]);
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
        set_mask(masses, e);
    for (int v = 0; v < cut_lattice_used(lattice); v++) {
        int point[3];
        cut_lattice_point(lattice, v, point);
        set_place(masses, v, point);
        set_mass(masses, v);
    }
}
