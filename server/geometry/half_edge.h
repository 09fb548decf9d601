// The three directed edges of every triangle, sorted so that those of one undirected edge are
// neighbours: the common basis of mesh_check and winged_create. Load time only, private to
// geometry.
#ifndef PLIANT_GEOMETRY_HALF_EDGE_H
#define PLIANT_GEOMETRY_HALF_EDGE_H

#include "geometry/mesh.h"

// Half-edge h = 3 * triangle + k runs from corner k to corner (k + 1) % 3.
typedef struct HalfEdges {
    int count;  // 3 triangle_count
    int *order; // [count] half-edges sorted by (smaller node, larger node, half-edge)
    int *twin;  // [count] the other half-edge of an edge with exactly two, else -1
} HalfEdges;

// Fills `half`, which owns its arrays. Indices of the mesh must be in range. Takes O(nodes +
// triangles) for any mesh.
void half_edge_create(HalfEdges *half, const TriMesh *mesh);
void half_edge_destroy(HalfEdges *half);

static inline int half_edge_from(const TriMesh *mesh, int h)
{
    return mesh->triangle[h / 3][h % 3];
}

static inline int half_edge_to(const TriMesh *mesh, int h)
{
    return mesh->triangle[h / 3][(h + 1) % 3];
}

// The half-edges after and before h in its triangle.
static inline int half_edge_next(int h)
{
    return h % 3 == 2 ? h - 2 : h + 1;
}

static inline int half_edge_previous(int h)
{
    return h % 3 == 0 ? h + 2 : h - 1;
}

// Returns the index after the last entry of `order` that belongs to the same undirected edge as
// order[first].
int half_edge_group_end(const HalfEdges *half, const TriMesh *mesh, int first);

#endif
