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
    int *file_index;     // [node_count], index in the source before any repair, ascending; a copy
                         // has file_node_count + k
    int file_node_count; // nodes in the source before any repair
    int *file_node;      // [file_node_count] what became of each node of the source: the node that
                         // stands for it, or -1; NULL: nodes are those of the source
    int copy_count;      // nodes split off others, where surfaces met in a single point
    int *copy_of;        // [copy_count] index in the source of the node that each was split from
    double (*uv)[2];     // [node_count] texture coordinates, or NULL; where a seam gives a node
                         // several, those of its first corner
} TriMesh;

// Zero-filled arrays owned by the mesh; file_index is the identity, what is optional NULL. Counts
// must be in [0, MESH_COUNT_MAX].
void mesh_create(TriMesh *mesh, int node_count, int triangle_count);
void mesh_destroy(TriMesh *mesh);

// Multiplies every position by `scale`, then rotates by the rotation vector `rotation` [rad], then
// moves by `translation` [m].
void mesh_place(TriMesh *mesh, double scale, Vec3 rotation, Vec3 translation);

// first[i]: the first of the `count` positions that is bit-equal to position i (-0 equals 0), i
// itself if there is none before it.
void mesh_find_equal(const Vec3 *position, int count, int *first);

// The node that stands for a node of the source, or -1 when it was dropped or never was.
int mesh_node_of_file(const TriMesh *mesh, int file_index);
// The index in the source of the node whose data (a row of positions, say) are those of `node`.
int mesh_file_row(const TriMesh *mesh, int node);

// Volume enclosed by a closed, outward oriented mesh [m3].
double mesh_volume(const TriMesh *mesh);
double mesh_area(const TriMesh *mesh);
// The largest side of the box that holds all nodes [m].
double mesh_extent(const TriMesh *mesh);

// Extents that a scene can be simulated with [m]: beyond them lengths were given in other units.
#define MESH_SMALLEST_EXTENT 1e-6
#define MESH_LARGEST_EXTENT  1e4

static inline bool mesh_extent_fits(double extent)
{
    return extent >= MESH_SMALLEST_EXTENT && extent <= MESH_LARGEST_EXTENT;
}

// A triangle that is no higher than this fraction of its longest edge has no area: its normal would
// be rounding error. Coordinates in a file carry at least 6 digits, so a real sliver is far above.
#define MESH_SMALLEST_HEIGHT 1e-9

// Height of a triangle over its longest edge, relative to that edge; 0 without area, NaN when its
// extent is no number. Right for tiny and huge triangles too.
double mesh_relative_height(const Vec3 *position, const int corner[3]);

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
