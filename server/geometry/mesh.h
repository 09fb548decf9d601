// A triangle mesh as it comes from a file or a generator: nodes, triangles, and where they came
// from.
#ifndef PLIANT_GEOMETRY_MESH_H
#define PLIANT_GEOMETRY_MESH_H

#include "base/vec.h"

#include <stdbool.h>

enum { MESH_COUNT_MAX = 1 << 28 }; // most nodes or triangles: 3 triangles still count in an int

typedef struct TriMesh {
    int node_count;
    int triangle_count;
    Vec3 *position;      // [node_count], m
    int (*triangle)[3];  // [triangle_count], counter-clockwise seen from outside
    int *file_index;     // [node_count], index in the source before welding, ascending
    int file_node_count; // nodes in the source before welding
} TriMesh;

// Zero-filled arrays owned by the mesh; file_index is the identity. Counts must be in
// [0, MESH_COUNT_MAX].
void mesh_create(TriMesh *mesh, int node_count, int triangle_count);
void mesh_destroy(TriMesh *mesh);

// Multiplies every position by `scale`, then rotates by the rotation vector `rotation` [rad], then
// moves by `translation` [m].
void mesh_place(TriMesh *mesh, double scale, Vec3 rotation, Vec3 translation);

// Merges nodes with bit-equal positions (-0 equals 0): the first of them stays, order kept, and
// file_index remembers it. Triangles are renumbered; nothing else changes.
void mesh_weld(TriMesh *mesh);

// Volume enclosed by a closed, outward oriented mesh [m3].
double mesh_volume(const TriMesh *mesh);
double mesh_area(const TriMesh *mesh);

// What is wrong with a mesh: the first fault found, in element order.
typedef struct MeshFault {
    int node;     // or -1
    int triangle; // or -1
    // "edge between nodes 3 and 7 belongs to 3 triangles, more than two": nodes by their file_index
    char text[160];
} MeshFault;

// A mesh fit for simulation: at least one triangle, finite positions, indices in range, no triangle
// with a repeated node or without area, every node used, every edge in at most two triangles with
// opposite directions, every node with a single fan of triangles. False with `fault` filled.
bool mesh_validate(const TriMesh *mesh, MeshFault *fault);

#endif
