// Edges of more than two faces. A face without area that merely lies along edges of others is
// removed; any other such edge is refused, because nothing says which of its faces belong together.
#include "geometry/repair.h"

#include "base/check.h"

#include <stdlib.h>

// The number of faces at the edge of each half-edge: count[group[h]].
typedef struct EdgeFaces {
    int *group; // [half-edge] its first index in `order`
    int *count; // [index in `order`]
} EdgeFaces;

// True if removing the triangle opens no border: at each of its edges it is either the only face or
// one of more than two.
static bool lies_along_others(const EdgeFaces *faces, int triangle)
{
    bool overfull = false;
    for (int k = 0; k < 3; k++) {
        int count = faces->count[faces->group[3 * triangle + k]];
        if (count == 2)
            return false;
        overfull = overfull || count > 2;
    }
    return overfull;
}

static bool is_overfull(const HalfEdges *half, const TriMesh *mesh)
{
    for (int i = 0; i < half->count;) {
        int end = half_edge_group_end(half, mesh, i);
        if (end - i > 2)
            return true;
        i = end;
    }
    return false;
}

static void drop_flat_fins(Repair *repair, const HalfEdges *half)
{
    TriMesh *mesh = &repair->mesh;
    EdgeFaces faces = {.group = malloc(((size_t)half->count + 1) * sizeof(int)),
                       .count = malloc(((size_t)half->count + 1) * sizeof(int))};
    ASSERT(faces.group != NULL && faces.count != NULL);
    // Group the half-edges of each edge and count its faces.
    for (int i = 0; i < half->count;) {
        int end = half_edge_group_end(half, mesh, i);
        faces.count[i] = end - i;
        for (int k = i; k < end; k++)
            faces.group[half->order[k]] = i;
        i = end;
    }
    // Counts fall with each removal, so that two fins at one edge are not both judged by the old
    // count.
    for (int t = 0; t < mesh->triangle_count; t++) {
        if (!lies_along_others(&faces, t) ||
            mesh_relative_height(mesh->position, mesh->triangle[t]) > MESH_SMALLEST_HEIGHT)
            continue;
        for (int k = 0; k < 3; k++)
            faces.count[faces.group[3 * t + k]]--;
        repair->polygon[t] = -1;
        repair->repairs->flat_faces++;
    }
    free(faces.group);
    free(faces.count);
    repair_compact(repair);
}

static bool check_edges(Repair *repair)
{
    TriMesh *mesh = &repair->mesh;
    HalfEdges half;
    half_edge_create(&half, mesh);
    for (int i = 0; i < half.count && !repair->edges_overfull;) {
        int end = half_edge_group_end(&half, mesh, i), h = half.order[i];
        int a = half_edge_from(mesh, h), b = half_edge_to(mesh, h);
        repair->edges_overfull = end - i > 2;
        if (repair->edges_overfull)
            repair_fail(repair, a, half.order[i + 2] / 3,
                        "edge between nodes %d and %d belongs to %d faces, more than two: %d, %d, "
                        "%d%s",
                        a < b ? a : b, a < b ? b : a, end - i, repair->polygon[h / 3],
                        repair->polygon[half.order[i + 1] / 3],
                        repair->polygon[half.order[i + 2] / 3], end - i > 3 ? " ..." : "");
        i = end;
    }
    half_edge_destroy(&half);
    return !repair->edges_overfull;
}

bool repair_edges(Repair *repair)
{
    HalfEdges half;
    half_edge_create(&half, &repair->mesh);
    bool overfull = is_overfull(&half, &repair->mesh);
    if (overfull)
        drop_flat_fins(repair, &half);
    half_edge_destroy(&half);
    return !overfull || check_edges(repair);
}
