// The hierarchy of levels of a triangle mesh: every level divides each face of the one above into
// four (Choi et al. 2005, section 3). It needs no pointers: the midpoint of edge e of level l is
// node level[l].node_count + e, and the children of face f are faces 4 f .. 4 f + 3 of level l + 1:
// child k < 3 keeps corner k of its parent as its own corner k, child 3 lies in the middle. Nodes
// keep their number at every finer level.
#ifndef PLIANT_GEOMETRY_LEVELS_H
#define PLIANT_GEOMETRY_LEVELS_H

#include "base/arena.h"
#include "base/status.h"
#include "geometry/mesh.h"

enum { LEVELS_MAX = 8 }; // finest level that can be asked for

typedef struct Level {
    int node_count; // of this level and all coarser ones
    int edge_count, face_count;
    int (*face)[3];      // [face_count] corners, counter-clockwise seen from outside
    int (*face_edge)[3]; // [face_count] edge k joins corners k and (k + 1) % 3
    int (*edge)[2];      // [edge_count] ends
    int (*edge_face)[2]; // [edge_count] faces in which it runs from its first end to its second,
                         // and the other way; -1: none
} Level;

typedef struct Levels {
    int finest; // level[0] .. level[finest]
    Level level[LEVELS_MAX + 1];
    Vec3 *position; // [level[finest].node_count] rest positions by modified butterfly [m]
} Levels;

// Divides a valid mesh (mesh_validate) `finest` times. Nodes and faces of level 0 are those of the
// mesh, edges of each level sorted by their nodes, the smaller one first: the table of
// winged_create for levels_mesh. Arrays belong to the arena, named "name/...". False with `status`:
// more than MESH_COUNT_MAX nodes or faces, `finest` out of range, or a face that division leaves
// without area (MESH_SMALLEST_HEIGHT).
bool levels_create(Levels *levels, const TriMesh *mesh, int finest, const char *name, Arena *arena,
                   Status *status);

// A hierarchy that was divided before and comes back from outside: levels_reserve makes room for a
// mesh of count = {nodes, edges, faces}; the caller fills positions, and of every level edge,
// edge_face and face_edge with whatever it was given; levels_validate takes level 0 from the mesh,
// derives the other faces, and is false with `status` unless all tables are, number for number,
// what levels_create makes of this mesh, and all faces fit for simulation. Rest positions may be
// others.
bool levels_reserve(Levels *levels, const int count[3], int finest, const char *name, Arena *arena,
                    Status *status);
bool levels_validate(Levels *levels, const TriMesh *mesh, Status *status);

// The face on the other side of an edge of `face`, or -1.
static inline int levels_beyond(const Level *level, int edge, int face)
{
    return level->edge_face[edge][level->edge_face[edge][0] == face];
}

// The level at which a node first exists; 0 for those of the mesh.
int levels_of_node(const Levels *levels, int node);
// The two ends of the edge in whose middle the node lies; the node itself twice at level 0.
void levels_parents(const Levels *levels, int node, int parent[2]);
// The two halves of edge `edge` of `level`, as edges of level + 1: half[k] ends at edge[edge][k].
void levels_halves(const Levels *levels, int level, int edge, int half[2]);

// Fills a field given on level 0, row[nodes of level 0], up to `level`: every midpoint gets the
// mean of its parents.
void levels_spread(const Levels *levels, int level, Vec3 *row);

// All faces of one level as a mesh of its own: node i is node i of the hierarchy. file_index and
// what maps nodes to the source follow `mesh`, from which the hierarchy was made; nodes that the
// source does not have count on from there. Owned by the caller (mesh_destroy).
void levels_mesh(const Levels *levels, int level, const TriMesh *mesh, TriMesh *out);

#endif
