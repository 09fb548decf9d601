// SPDX-License-Identifier: MIT
// Winged-edge tables, built once at load from sorted half-edges, then only read.
#include "geometry/edges.h"

#include "base/check.h"

#include <stdlib.h>

// --- half-edges ---

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
    // One element more, so that an empty mesh has arrays, too.
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

    // Pair the half-edges of edges that have exactly two.
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

// --- winged edges ---

static int *new_ints(size_t count)
{
    int *array = malloc((count + 1) * sizeof *array);
    ASSERT(array != NULL);
    return array;
}

// Links the edges in their order with the faces on both sides, and each face with its edges and
// neighbours.
static void link_edges(WingedMesh *winged, const TriMesh *mesh, const HalfEdges *half)
{
    int(*face_edge)[3] = winged->face_edge;
    for (int first = 0; first < half->count;) {
        int end = first + (half->twin[half->order[first]] >= 0
                               ? 2
                               : 1); // a valid mesh has at most two half-edges per edge
        // The edge runs from its smaller node to its larger one.
        WingedEdge *edge = &winged->edge[winged->edge_count];
        int h = half->order[first];
        int a = half_edge_from(mesh, h), b = half_edge_to(mesh, h);
        *edge = (WingedEdge){.node = {a < b ? a : b, a < b ? b : a},
                             .face = {-1, -1},
                             .previous = {-1, -1},
                             .next = {-1, -1}};
        // Its faces: left where the half-edge runs like the edge, else right.
        for (int i = first; i < end; i++) {
            h = half->order[i];
            edge->face[half_edge_from(mesh, h) == edge->node[0] ? 0 : 1] = h / 3;
            face_edge[h / 3][h % 3] = winged->edge_count;
            winged->face_neighbor[h / 3][h % 3] = half->twin[h] >= 0 ? half->twin[h] / 3 : -1;
        }
        winged->edge_count++;
        first = end;
    }
    // All edges of a face are numbered now: link each with the ones before and after it.
    for (int h = 0; h < half->count; h++) {
        WingedEdge *edge = &winged->edge[face_edge[h / 3][h % 3]];
        int side = half_edge_from(mesh, h) == edge->node[0] ? 0 : 1;
        edge->previous[side] = face_edge[h / 3][half_edge_previous(h) % 3];
        edge->next[side] = face_edge[h / 3][half_edge_next(h) % 3];
    }
}

static void link_node_faces(WingedMesh *winged, const TriMesh *mesh)
{
    // Count the faces of each node; sums of the counts are where their lists begin.
    int *start = winged->node_face_start;
    for (int i = 0; i <= mesh->node_count; i++)
        start[i] = 0;
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            start[mesh->triangle[t][k] + 1]++;
    for (int i = 0; i < mesh->node_count; i++)
        start[i + 1] += start[i];
    // Filling moves each start to its end; shifting back is cheaper than a second array.
    for (int t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            winged->node_face[start[mesh->triangle[t][k]]++] = t;
    for (int i = mesh->node_count; i > 0; i--)
        start[i] = start[i - 1];
    start[0] = 0;
}

// Lists the edges round each node. A border node starts at its border edge, any other at its first
// edge.
static void link_node_edges(WingedMesh *winged, const TriMesh *mesh, const HalfEdges *half)
{
    int *first = new_ints((size_t)mesh->node_count); // half-edge where the turn starts
    // Choose the start: a half-edge without a twin starts at a border.
    for (int i = 0; i < mesh->node_count; i++)
        first[i] = -1;
    for (int i = 0; i < half->count; i++) {
        int h = half->order[i], from = half_edge_from(mesh, h);
        if (first[from] < 0 || half->twin[h] < 0)
            first[from] = h;
    }
    // Walk round each node, from face to face.
    int count = 0;
    for (int i = 0; i < mesh->node_count; i++) {
        winged->node_edge_start[i] = count;
        int h = first[i];
        while (h >= 0) {
            winged->node_edge[count++] = winged->face_edge[h / 3][h % 3];
            int back =
                half_edge_previous(h); // ends at the node: its twin is the next edge round the node
            h = half->twin[back];
            // The walk ends at a border: its last edge is that of the last face.
            if (h < 0)
                winged->node_edge[count++] = winged->face_edge[back / 3][back % 3];
            if (h == first[i])
                break;
        }
    }
    winged->node_edge_start[mesh->node_count] = count;
    ASSERT(count == 2 * winged->edge_count);
    free(first);
}

void winged_create(WingedMesh *winged, const TriMesh *mesh)
{
    HalfEdges half;
    half_edge_create(&half, mesh);
    size_t edge_count = 0; // in a valid mesh each half-edge is an edge, or half of one
    for (int h = 0; h < half.count; h++)
        edge_count += half.twin[h] < h;
    size_t faces = (size_t)mesh->triangle_count, nodes = (size_t)mesh->node_count;
    *winged = (WingedMesh){.node_count = mesh->node_count,
                           .face_count = mesh->triangle_count,
                           .edge = malloc((edge_count + 1) * sizeof *winged->edge),
                           .face_edge = malloc((faces + 1) * sizeof *winged->face_edge),
                           .face_neighbor = malloc((faces + 1) * sizeof *winged->face_neighbor),
                           .node_edge_start = new_ints(nodes + 1),
                           .node_edge = new_ints(2 * edge_count),
                           .node_face_start = new_ints(nodes + 1),
                           .node_face = new_ints(3 * faces)};
    ASSERT(winged->edge != NULL && winged->face_edge != NULL && winged->face_neighbor != NULL);
    // Edges first: the lists of nodes refer to them.
    link_edges(winged, mesh, &half);
    link_node_faces(winged, mesh);
    link_node_edges(winged, mesh, &half);
    half_edge_destroy(&half);
}

void winged_destroy(WingedMesh *winged)
{
    free(winged->edge);
    free(winged->face_edge);
    free(winged->face_neighbor);
    free(winged->node_edge_start);
    free(winged->node_edge);
    free(winged->node_face_start);
    free(winged->node_face);
    *winged = (WingedMesh){0};
}

int winged_valence(const WingedMesh *winged, int node)
{
    return winged->node_edge_start[node + 1] - winged->node_edge_start[node];
}

int winged_other(const WingedMesh *winged, int edge, int node)
{
    const int *end = winged->edge[edge].node;
    return end[0] == node ? end[1] : end[0];
}

bool winged_is_boundary_edge(const WingedMesh *winged, int edge)
{
    return winged->edge[edge].face[0] < 0 || winged->edge[edge].face[1] < 0;
}

bool winged_is_boundary_node(const WingedMesh *winged, int node)
{
    // The edges round a border node start at the border.
    int start = winged->node_edge_start[node];
    return start < winged->node_edge_start[node + 1] &&
           winged_is_boundary_edge(winged, winged->node_edge[start]);
}
