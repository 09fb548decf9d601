#include "geometry/half_edge.h"

#include "base/check.h"

#include <stdlib.h>

static int smaller_node(const TriMesh *mesh, int h)
{
    int a = half_edge_from(mesh, h), b = half_edge_to(mesh, h);
    return a < b ? a : b;
}

static int larger_node(const TriMesh *mesh, int h)
{
    int a = half_edge_from(mesh, h), b = half_edge_to(mesh, h);
    return a > b ? a : b;
}

// Counting sort by a key in [0, node_count), stable; `start` has node_count + 1 entries.
static void sort_by(const TriMesh *mesh, int (*key)(const TriMesh *, int), int count,
                    const int *from, int *to, int *start)
{
    for (int i = 0; i <= mesh->node_count; i++)
        start[i] = 0;
    for (int h = 0; h < count; h++)
        start[key(mesh, h) + 1]++;
    for (int i = 0; i < mesh->node_count; i++)
        start[i + 1] += start[i];
    for (int i = 0; i < count; i++) {
        int h = from == NULL ? i : from[i];
        to[start[key(mesh, h)]++] = h;
    }
}

int half_edge_group_end(const HalfEdges *half, const TriMesh *mesh, int first)
{
    int a = smaller_node(mesh, half->order[first]), b = larger_node(mesh, half->order[first]);
    int end = first + 1;
    while (end < half->count && smaller_node(mesh, half->order[end]) == a &&
           larger_node(mesh, half->order[end]) == b)
        end++;
    return end;
}

void half_edge_create(HalfEdges *half, const TriMesh *mesh)
{
    size_t count = (size_t)mesh->triangle_count * 3;
    half->count = (int)count;
    half->order = malloc((count + 1) * sizeof *half->order);
    half->twin = malloc((count + 1) * sizeof *half->twin);
    int *start = malloc(((size_t)mesh->node_count + 1) * sizeof *start);
    ASSERT(half->order != NULL && half->twin != NULL && start != NULL);

    // Two counting sorts in place of a comparison sort: linear even for a node with a million
    // edges.
    sort_by(mesh, larger_node, half->count, NULL, half->twin, start);
    sort_by(mesh, smaller_node, half->count, half->twin, half->order, start);
    free(start);

    for (int first = 0; first < half->count;) {
        int end = half_edge_group_end(half, mesh, first);
        for (int i = first; i < end; i++)
            half->twin[half->order[i]] = end - first == 2 ? half->order[2 * first + 1 - i] : -1;
        first = end;
    }
}

void half_edge_destroy(HalfEdges *half)
{
    free(half->order);
    free(half->twin);
    *half = (HalfEdges){0};
}
