// SPDX-License-Identifier: MIT
// The edges of triangle meshes: a table of half-edges, and one of edges with what lies around them
// (the "winged edge" of Choi et al. 2005) that is made from it. Load time only.
#ifndef PLIANT_GEOMETRY_EDGES_H
#define PLIANT_GEOMETRY_EDGES_H

#include "geometry/mesh.h"

// --- half-edges ---
// The three directed edges of every triangle, sorted so that those of one undirected edge are
// neighbours: the common basis of mesh_check and winged_create. Load time only, private to
// geometry.

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

// --- winged edges ---
// Winged-edge table of a valid triangle mesh (Baumgart's structure as in Choi et al. 2005,
// implementation section): each edge has its two nodes, its two faces, and in each face the edges
// before and after it.

typedef struct WingedEdge {
    int node[2];     // start and end; node[0] < node[1]
    int face[2];     // left (where it runs from start to end) and right; -1 at a boundary
    int previous[2]; // edge before this one around face[i]; -1 without a face
    int next[2];     // edge after this one around face[i]; -1 without a face
} WingedEdge;

typedef struct WingedMesh {
    int node_count, edge_count, face_count;
    WingedEdge *edge;        // [edge_count], sorted by (node[0], node[1])
    int (*face_edge)[3];     // [face_count]; edge k joins corners k and (k + 1) % 3
    int (*face_neighbor)[3]; // [face_count]; face across edge k, -1 at a boundary
    int *node_edge_start;    // [node_count + 1]; edges of node i: node_edge[start[i] .. start[i+1])
    int *node_edge;       // [2 edge_count], counter-clockwise seen from outside; from boundary to
                          // boundary at a border node
    int *node_face_start; // [node_count + 1]
    int *node_face;       // [3 face_count], ascending for each node
} WingedMesh;

// Builds the table of a mesh that passes mesh_check. `winged` owns its arrays.
void winged_create(WingedMesh *winged, const TriMesh *mesh);
void winged_destroy(WingedMesh *winged);

// Returns the number of edges of a node.
int winged_valence(const WingedMesh *winged, int node);
// Returns the other end of an edge of `node`.
int winged_other(const WingedMesh *winged, int edge, int node);
bool winged_is_boundary_edge(const WingedMesh *winged, int edge);
bool winged_is_boundary_node(const WingedMesh *winged, int node);

#endif
