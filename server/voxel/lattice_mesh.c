// SPDX-License-Identifier: MIT
// Vertices of elements from the parts around each lattice point. Load time only.
#include "voxel/lattice_mesh.h"

#include "base/check.h"
#include "base/sets.h"
#include "voxel/lattice_faces.h"
#include "voxel/point_parts.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

static void *sized(size_t count, size_t size)
{
    void *memory = malloc((count + 1) * size);
    ASSERT(memory != NULL);
    return memory;
}

// --- the sweep over all points ---

// Vertices are found in the order of their points and get their final numbers at the end.
typedef struct Sweep {
    const Layout *layout;
    LatticeMesh *mesh;
    int points[3];
    int capacity;
    bool *outer; // [found vertex]
    int *parent; // [element] sets.h: connected elements
} Sweep;

static void reserve(Sweep *sweep)
{
    LatticeMesh *mesh = sweep->mesh;
    if (mesh->vertex_count < sweep->capacity)
        return;
    sweep->capacity = 2 * sweep->capacity + 64;
    size_t count = (size_t)sweep->capacity;
    mesh->point = realloc(mesh->point, count * sizeof *mesh->point);
    mesh->id = realloc(mesh->id, count * sizeof *mesh->id);
    sweep->outer = realloc(sweep->outer, count * sizeof *sweep->outer);
    ASSERT(mesh->point != NULL && mesh->id != NULL && sweep->outer != NULL);
}

static int add_vertex(Sweep *sweep, const int point[3], int rank, bool outer)
{
    reserve(sweep);
    LatticeMesh *mesh = sweep->mesh;
    int v = mesh->vertex_count++, points = sweep->points[0] * sweep->points[1] * sweep->points[2];
    memcpy(mesh->point[v], point, sizeof mesh->point[v]);
    mesh->id[v] =
        (point[2] * sweep->points[1] + point[1]) * sweep->points[0] + point[0] + points * rank;
    sweep->outer[v] = outer;
    return v;
}

// Returns the node of a leaf that a point on it is.
static int node_of_point(const Leaf *leaf, const int point[3])
{
    int offset[3];
    for (int d = 0; d < 3; d++) {
        int twice = 2 * (point[d] - leaf->cell[d]);
        offset[d] = twice >> leaf->level;
        ASSERT(offset[d] << leaf->level == twice);
    }
    return node_at_offset(offset[0], offset[1], offset[2]);
}

static void visit_point(Sweep *sweep, const int point[3], const int slot[8])
{
    unsigned corners = 0;
    int all = point[0] | point[1] | point[2];
    for (int s = 0; s < 8; s++)
        if (slot[s] >= 0 && (all & ((1 << sweep->layout->leaf[slot[s]].level) - 1)) == 0)
            corners |= 1u << s;
    PointParts parts = point_parts(slot, corners, 0);

    int vertex[8];
    for (int s = 0; s < 8; s++)
        if (parts.owns >> s & 1)
            vertex[s] = add_vertex(sweep, point, point_parts_rank(&parts, s), parts.outer >> s & 1);
    for (int s = 0; s < 8; s++) {
        int part = parts.part[s];
        if (part < 0)
            continue;
        union_find_join(sweep->parent, slot[s], slot[part]);
        if (parts.owns >> part & 1)
            sweep->mesh->vertex[slot[s]][node_of_point(&sweep->layout->leaf[slot[s]], point)] =
                vertex[part];
    }
}

static bool same_leaf(const int slot[8])
{
    for (int s = 1; s < 8; s++)
        if (slot[s] != slot[0])
            return false;
    return true;
}

static void visit_row(Sweep *sweep, int y, int z)
{
    int slot[8];
    for (int s = 0; s < 8; s++)
        slot[s] = -1;
    for (int x = 0; x < sweep->points[0]; x++) {
        for (int s = 0; s < 8; s += 2) {
            slot[s] = slot[s + 1];
            slot[s + 1] = layout_leaf_at(sweep->layout, x, y - 1 + (s >> 1 & 1), z - 1 + (s >> 2));
        }
        if (!same_leaf(slot))
            visit_point(sweep, (int[3]){x, y, z}, slot);
    }
}

// --- final numbers ---

// Renumbers: those on the outer faces first, otherwise in the order found.
static void number_vertices(Sweep *sweep)
{
    LatticeMesh *mesh = sweep->mesh;
    size_t count = (size_t)mesh->vertex_count;
    int *number = sized(count, sizeof *number);
    int next = 0;
    for (int outer = 1; outer >= 0; outer--) {
        for (int v = 0; v < mesh->vertex_count; v++)
            if (sweep->outer[v] == outer)
                number[v] = next++;
        if (outer)
            mesh->surface_count = next;
    }
    // Permute points and ids, then rename in the elements.
    int(*point)[3] = sized(count, sizeof *point);
    int *id = sized(count, sizeof *id);
    for (int v = 0; v < mesh->vertex_count; v++) {
        memcpy(point[number[v]], mesh->point[v], sizeof point[0]);
        id[number[v]] = mesh->id[v];
    }
    free(mesh->point);
    free(mesh->id);
    mesh->point = point;
    mesh->id = id;
    for (int e = 0; e < mesh->element_count; e++)
        for (int n = 0; n < NODE_COUNT; n++)
            if (mesh->vertex[e][n] >= 0)
                mesh->vertex[e][n] = number[mesh->vertex[e][n]];
    free(number);
}

static void number_pieces(Sweep *sweep)
{
    LatticeMesh *mesh = sweep->mesh;
    mesh->piece = sized((size_t)mesh->vertex_count, sizeof *mesh->piece);
    mesh->piece_count = union_find_number(sweep->parent, mesh->element_count);
    for (int e = 0; e < mesh->element_count; e++)
        for (int n = 0; n < NODE_COUNT; n++)
            if (mesh->vertex[e][n] >= 0)
                mesh->piece[mesh->vertex[e][n]] = sweep->parent[e];
}

bool lattice_mesh_create(LatticeMesh *mesh, const Layout *layout, Status *status)
{
    *mesh = (LatticeMesh){.element_count = layout->leaf_count};
    Sweep sweep = {.layout = layout, .mesh = mesh};
    double ids = 8.0;
    for (int d = 0; d < 3; d++) {
        sweep.points[d] = layout->lattice_count[d] + 1;
        ids *= sweep.points[d];
    }
    if (ids > INT_MAX)
        return status_fail(status, STATUS_INVALID, "%d x %d x %d cells are more than %d points",
                           layout->lattice_count[0], layout->lattice_count[1],
                           layout->lattice_count[2], INT_MAX / 8);

    // Every lattice point once; each adds its vertices to the elements around it.
    size_t elements = (size_t)mesh->element_count;
    mesh->vertex = sized(elements, sizeof *mesh->vertex);
    memset(mesh->vertex, -1, elements * sizeof *mesh->vertex);
    sweep.parent = sized(elements, sizeof *sweep.parent);
    union_find_reset(sweep.parent, mesh->element_count);
    reserve(&sweep);
    for (int z = 0; z < sweep.points[2]; z++)
        for (int y = 0; y < sweep.points[1]; y++)
            visit_row(&sweep, y, z);

    number_vertices(&sweep);
    number_pieces(&sweep);
    free(sweep.outer);
    free(sweep.parent);
    lattice_faces_create(mesh, layout);
    return true;
}

void lattice_mesh_destroy(LatticeMesh *mesh)
{
    free(mesh->vertex);
    free(mesh->point);
    free(mesh->id);
    free(mesh->piece);
    free(mesh->face);
    free(mesh->face_neighbor);
    free(mesh->face_element);
    *mesh = (LatticeMesh){0};
}

// ---------------------------------------------------------------------------------------------
// Another order

typedef struct SortedVertex {
    int group, block[3], vertex; // group: outer ones first, then by level, the coarsest first
} SortedVertex;

static int compare_vertices(const void *a, const void *b)
{
    const SortedVertex *x = a, *y = b;
    const int key[2][5] = {{x->group, x->block[2], x->block[1], x->block[0], x->vertex},
                           {y->group, y->block[2], y->block[1], y->block[0], y->vertex}};
    for (int k = 0; k < 5; k++)
        if (key[0][k] != key[1][k])
            return key[0][k] < key[1][k] ? -1 : 1;
    return 0;
}

// Moves items of a size in bytes to an order.
static void permute(void *items, size_t bytes, const int *order, int count)
{
    char *copy = malloc((size_t)count * bytes + 1);
    ASSERT(copy != NULL);
    memcpy(copy, items, (size_t)count * bytes);
    for (int v = 0; v < count; v++)
        memcpy((char *)items + (size_t)v * bytes, copy + (size_t)order[v] * bytes, bytes);
    free(copy);
}

void lattice_mesh_order(LatticeMesh *mesh, const int *order)
{
    const int count = mesh->vertex_count;
    int *now = calloc((size_t)count + 1, sizeof *now); // by what it was
    ASSERT(now != NULL);
    for (int v = 0; v < count; v++)
        now[order[v]] = v;
    permute(mesh->point, sizeof *mesh->point, order, count);
    permute(mesh->id, sizeof *mesh->id, order, count);
    permute(mesh->piece, sizeof *mesh->piece, order, count);
    for (int e = 0; e < mesh->element_count; e++)
        for (int n = 0; n < NODE_COUNT; n++)
            if (mesh->vertex[e][n] >= 0)
                mesh->vertex[e][n] = now[mesh->vertex[e][n]];
    for (int f = 0; f < mesh->face_count; f++)
        for (int c = 0; c < 3; c++)
            mesh->face[f][c] = now[mesh->face[f][c]];
    free(now);
}

void lattice_mesh_sort(LatticeMesh *mesh, int levels)
{
    const int count = mesh->vertex_count;
    SortedVertex *sorted = calloc((size_t)count + 1, sizeof *sorted);
    int *order = calloc((size_t)count + 1, sizeof *order);
    ASSERT(sorted != NULL && order != NULL);
    for (int v = 0; v < count; v++) {
        const int *point = mesh->point[v], all = point[0] | point[1] | point[2];
        int level = 0;
        while (level < levels && (all >> level & 1) == 0)
            level++;
        sorted[v].group = levels - level + (v < mesh->surface_count ? 0 : levels + 1);
        for (int d = 0; d < 3; d++)
            sorted[v].block[d] = point[d] >> levels;
        sorted[v].vertex = v;
    }
    qsort(sorted, (size_t)count, sizeof *sorted, compare_vertices);
    for (int v = 0; v < count; v++)
        order[v] = sorted[v].vertex;
    lattice_mesh_order(mesh, order);
    free(sorted);
    free(order);
}
