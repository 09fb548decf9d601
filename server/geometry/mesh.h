// SPDX-License-Identifier: MIT
// A triangle mesh as read from a file or generated: nodes, triangles, and their numbers in the
// source.
#ifndef PLIANT_GEOMETRY_MESH_H
#define PLIANT_GEOMETRY_MESH_H

#include "base/vec.h"
#include "geometry/box.h"

#include <stdbool.h>

enum { MESH_COUNT_MAX = 1 << 28 }; // most nodes or triangles: 3 triangles still count in an int

typedef struct TriMesh {
    int node_count;
    int triangle_count;
    Vec3 *position;     // [node_count], m
    int (*triangle)[3]; // [triangle_count], counter-clockwise seen from outside
    int *file_index; // [node_count], index in the source before any repair, ascending; a copy has
                     // file_node_count + k
    int file_node_count; // nodes in the source before any repair
    int *file_node;      // [file_node_count] the node that replaces each node of the source, or -1;
                         // NULL: nodes are those of the source
    int copy_count;      // nodes that were split off, where surfaces met in a single point
    int *copy_of;        // [copy_count] index in the source of the node from which each was split
    double (*uv)[2]; // [node_count] texture coordinates, or NULL; of a node on a seam those of its
                     // first corner
} TriMesh;

// Allocates zeroed arrays owned by the mesh; file_index is the identity, optional arrays are NULL.
// Counts must be in [0, MESH_COUNT_MAX].
void mesh_create(TriMesh *mesh, int node_count, int triangle_count);
void mesh_destroy(TriMesh *mesh);

// Multiplies every position by `scale`, rotates it by the rotation vector `rotation` [rad], then
// adds `translation` [m].
void mesh_place(TriMesh *mesh, double scale, Vec3 rotation, Vec3 translation);

// Fills first[count] with the index of the first position that is bit-equal to position i (-0
// equals 0); i itself if there is none before it.
void mesh_find_equal(const Vec3 *position, int count, int *first);

// Returns the node that replaces a node of the source, or -1 if it was dropped or does not exist.
int mesh_node_of_file(const TriMesh *mesh, int file_index);
// Returns the index in the source of the node whose data (a row of positions, say) belong to
// `node`.
int mesh_file_row(const TriMesh *mesh, int node);

// Returns the volume enclosed by a closed, outward oriented mesh [m3].
double mesh_volume(const TriMesh *mesh);
// Returns the area of all triangles [m2].
double mesh_area(const TriMesh *mesh);
// Returns the bounding box of all nodes [m]; the mesh is not empty.
Box mesh_box(const TriMesh *mesh);
// Returns the largest side of the bounding box [m].
double mesh_extent(const TriMesh *mesh);

// Allowed extents of a mesh in a scene [m]: anything else is an error of units.
#define MESH_SMALLEST_EXTENT 1e-6
#define MESH_LARGEST_EXTENT  1e4

static inline bool mesh_extent_fits(double extent)
{
    return extent >= MESH_SMALLEST_EXTENT && extent <= MESH_LARGEST_EXTENT;
}

// A triangle whose height is at most this fraction of its longest edge has no area: its normal
// would be rounding error. Coordinates in a file carry at least 6 digits, so that a real sliver is
// far above.
#define MESH_SMALLEST_HEIGHT 1e-9

// Returns the height of a triangle over its longest edge, relative to that edge; 0 without area,
// NaN when a coordinate is not finite. Accurate for tiny and huge triangles too.
double mesh_relative_height(const Vec3 *position, const int corner[3]);

// The first fault of a mesh, in element order.
typedef struct MeshFault {
    int node;     // or -1
    int triangle; // or -1
    // "edge between nodes 3 and 7 belongs to 3 triangles, more than two": nodes by their file_index
    char text[200];
} MeshFault;

// True if a mesh is fit for simulation: at least one triangle, finite positions, indices in range,
// no triangle with a repeated node or without area, every node used, every edge in at most two
// triangles with opposite directions and another third node, every node with a single fan of
// triangles. Otherwise false with `fault`.
bool mesh_check(const TriMesh *mesh, MeshFault *fault);

// --- mesh_quality.c ---
// Statistics: components, borders, angles and lengths, with the worst elements.

// One component: triangles that are connected across edges.
typedef struct MeshComponent {
    int node_count, edge_count, triangle_count;
    int border_loops; // 0: closed
    int genus;        // handles: (2 - border loops - (V - E + F)) / 2
    double area;      // [m2]
    double volume;    // enclosed, for a closed component; else 0 [m3]
} MeshComponent;

typedef struct MeshQuality {
    int edge_count, border_edges, border_loops;
    int component_count;
    MeshComponent *component;    // [component_count], in the order of their first triangles
    double area, volume;         // sums; volume of the closed components only
    Box box;                     // of all nodes [m]
    double angle_min, angle_max; // of triangles [rad]
    double angle_mean;           // mean over the triangles of their smallest angle [rad]
    int sharpest;                // triangle with the smallest angle
    int sharp_triangles;         // with an angle below MESH_SHARP_ANGLE
    double edge_min, edge_mean, edge_max; // lengths [m]
    int shortest[2], longest[2];          // their nodes
} MeshQuality;

// Triangles with smaller angles are slivers: stiff, and of little use to the simulation.
#define MESH_SHARP_ANGLE (20.0 / 180.0 * 3.14159265358979323846)

// Measures a mesh that passes mesh_check. `quality` owns its arrays.
void mesh_quality_measure(const TriMesh *mesh, MeshQuality *quality);
void mesh_quality_destroy(MeshQuality *quality);

// --- crossings.c ---

// Triangles without a common node that pass through each other; those that only touch do not.
typedef struct MeshCrossings {
    long pairs;
    int first, second; // triangles of one pair, or -1
    bool all;          // else there were too many beside each other to look at all of them
} MeshCrossings;

// Requires a mesh that passes mesh_check.
MeshCrossings mesh_find_crossings(const TriMesh *mesh);

#endif
