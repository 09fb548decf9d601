// SPDX-License-Identifier: MIT
// The levels of a triangle mesh: each level divides every face of the one above into four (Choi et
// al. 2005, section 3). Indices replace pointers: the midpoint of edge e of level l is node
// level[l].node_count + e, and the children of face f are faces 4 f .. 4 f + 3 of level l + 1.
// Child k < 3 keeps corner k of its parent as its own corner k, child 3 lies in the middle. Nodes
// keep their number at every finer level.
#ifndef PLIANT_GEOMETRY_LEVELS_H
#define PLIANT_GEOMETRY_LEVELS_H

#include "base/check.h"
#include "base/memory.h"
#include "geometry/edges.h"
#include "geometry/mesh.h"

enum { LEVELS_MAX = 8 }; // finest level that a scene may set

typedef struct Level {
    int node_count; // of this level and all coarser ones
    int edge_count, face_count;
    int (*face)[3];      // [face_count] corners, counter-clockwise seen from outside
    int (*face_edge)[3]; // [face_count] edge k joins corners k and (k + 1) % 3
    int (*edge)[2];      // [edge_count] ends
    int (*edge_face)[2]; // faces in which the edge runs from its first end to its second, and in
                         // the opposite direction; -1: none
} Level;

typedef struct Levels {
    int finest; // level[0] .. level[finest]
    Level level[LEVELS_MAX + 1];
    Vec3 *position; // [level[finest].node_count] rest positions by modified butterfly [m]
} Levels;

// Divides a valid mesh (mesh_check) `finest` times. Nodes and faces of level 0 are those of the
// mesh. The edges of each level are sorted by their nodes, the smaller one first, as winged_create
// numbers those of levels_mesh. The arena owns the arrays, named "name/...". False with `status`:
// more than MESH_COUNT_MAX nodes or faces, `finest` out of range, or a face without area after
// division (MESH_SMALLEST_HEIGHT).
bool levels_create(Levels *levels, const TriMesh *mesh, int finest, const char *name, Arena *arena,
                   Status *status);

// Two functions read back levels that were divided before, from untrusted data. levels_reserve
// allocates for a mesh of count = {nodes, edges, faces}. The caller fills the positions and, of
// every level, edge, edge_face and face_edge. levels_check takes the faces of level 0 from the
// mesh and derives all others; it is false with `status` unless all tables equal those of
// levels_create for this mesh and all faces are fit for simulation. Rest positions may differ.
bool levels_reserve(Levels *levels, const int count[3], int finest, const char *name, Arena *arena,
                    Status *status);
bool levels_check(Levels *levels, const TriMesh *mesh, Status *status);

// Returns the face on the other side of an edge of `face`, or -1.
static inline int levels_beyond(const Level *level, int edge, int face)
{
    return level->edge_face[edge][level->edge_face[edge][0] == face];
}

// Returns the level at which a node first exists; 0 for nodes of the mesh.
int levels_of_node(const Levels *levels, int node);
// Writes the two ends of the edge whose midpoint the node is; twice the node itself at level 0.
void levels_parents(const Levels *levels, int node, int parent[2]);
// Writes the two halves of edge `edge` of `level`, as edges of level + 1: half[k] ends at
// edge[edge][k].
void levels_halves(const Levels *levels, int level, int edge, int half[2]);

// Extends a field from level 0, row[nodes of level 0], up to `level`: each midpoint gets the mean
// of its parents.
void levels_spread(const Levels *levels, int level, Vec3 *row);

// Creates the mesh of all faces of one level; node i is node i of the levels. file_index and the
// maps to the source follow `mesh`, from which the levels were made; nodes that the source lacks
// are numbered on from there. Owned by the caller (mesh_destroy).
void levels_mesh(const Levels *levels, int level, const TriMesh *mesh, TriMesh *out);

// --- where midpoints lie ---
// Modified butterfly subdivision: moves the midpoints of edges to the smooth surface that
// interpolates a mesh (Zorin, Schroeder, Sweldens 1996; Choi et al. 2005, eqs 4 and 5, with two
// corrections: weight 3/4 for an extraordinary node itself, and the sign in the boundary rule).

// A border has a corner where it turns by more than 60 degrees: the cosine of the turn is below
// 1/2, less the rounding error of a regular hexagon, so that all its corners are treated alike.
#define BUTTERFLY_CORNER (0.5 - 1e-9)

// Returns s_j of an extraordinary node v with `valence` edges: the new point of its edge 0 is v +
// sum s_j (p_j - v).
double butterfly_weight(int valence, int j);

// Fills middle[edge_count] with the new point of every edge [m]. `position` [node_count] are the
// nodes [m]; `face` [face_count] the triangles from which the table was made. A node is regular
// when it has 6 edges or lies on the boundary. Then, for the edge (a, b):
//  - on the boundary: 9/16 (a + b) - 1/16 (the next nodes along the boundary on either side). Where
//   the boundary turns by more than 60 degrees, the node beyond is the reflection 2 a - b, so that
//   corners stay sharp and straight sides straight;
//  - both ends regular: 1/2 (a + b) + 1/8 (the two nodes opposite) - 1/16 (the four wings). A wing
//   missing across a boundary edge (u, v), seen from w, is u + v - w;
//  - one end v extraordinary, K edges: 3/4 v + sum s_j p_j over its neighbours in order, p_0 the
//   other end: s = (5, -1, -1)/12 for K = 3, (3, 0, -1, 0)/8 for K = 4, else s_j = (1/4 + cos(2 pi
//   j/K) + 1/2 cos(4 pi j/K))/K. K = 2: the middle;
//  - both extraordinary: the mean of the two.
// Takes O(nodes + edges) for any valences. Each coordinate is computed independently of the others,
// so that a plane z = 0 stays one.
void butterfly_midpoints(const WingedMesh *winged, const int (*face)[3], const Vec3 *position,
                         Vec3 *middle);

#endif
