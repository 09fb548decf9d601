// SPDX-License-Identifier: MIT
// The steps of mesh_repair. Load time only, private to geometry.
#ifndef PLIANT_GEOMETRY_REPAIR_H
#define PLIANT_GEOMETRY_REPAIR_H

#include "base/vec.h"
#include "geometry/edges.h"
#include "geometry/mesh_repair.h"

#include <stdbool.h>

// A mesh under repair. Nodes keep the numbers of the draft until the end, so that errors can name
// them at any time; unused nodes stay.
typedef struct Repair {
    const MeshDraft *draft;
    MeshRepairs *repairs;
    MeshFault *fault;
    TriMesh mesh;        // nodes: the draft's, then mesh.copy_count copies
    int (*corner)[3];    // [triangle] the corner of the draft from which each corner came
    int *polygon;        // [triangle] of the draft; -1: to be dropped by repair_compact
    int *kept;           // [draft nodes] the node that replaces it: see repair_node
    bool ties_borders;   // weld only where that closes a gap
    bool edges_overfull; // refused because of an edge with more than two faces
} Repair;

// Returns the node that now replaces a node of the draft (union-find).
static inline int repair_node(const Repair *repair, int node)
{
    int *kept = repair->kept;
    while (kept[node] != node)
        node = kept[node] = kept[kept[node]]; // halve the path for later calls
    return node;
}

// Makes two nodes one: the one with the lower number.
static inline void repair_join(const Repair *repair, int a, int b)
{
    a = repair_node(repair, a);
    b = repair_node(repair, b);
    repair->kept[a > b ? a : b] = a > b ? b : a;
}

// Fills the fault and returns false; node or triangle (of repair->mesh) may be -1.
bool repair_fail(const Repair *repair, int node, int triangle, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
// Removes the triangles whose polygon is -1; keeps the order.
void repair_compact(Repair *repair);

// --- called in this order ---
// repair_faces.c: welds nodes and cuts all polygons into triangles.
bool repair_faces(Repair *repair);
// repair_topology.c, called by repair_faces: turns diagonals along which several polygons were cut.
void repair_diagonals(Repair *repair);
// repair_seams.c: joins borders that are one but for rounding.
void repair_seams(Repair *repair);
// repair_topology.c: leaves at most two faces per edge.
bool repair_edges(Repair *repair);
// repair_topology.c: gives each component one orientation, closed ones outward.
bool repair_orientation(Repair *repair);
// repair_topology.c: leaves one fan per node.
void repair_fans(Repair *repair);
// repair_flat.c: removes triangles without area. Requires an oriented mesh with one fan per node,
// and may leave nodes with more at borders.
bool repair_flat_faces(Repair *repair);

// --- polygons ---

enum { POLYGON_CORNERS = 1024 }; // most corners of a polygon that is not convex

// Writes count - 2 triangles, corners as indices in [0, count), with the orientation of the
// polygon. A concave polygon is cut along inner diagonals; one with collinear corners is cut
// arbitrarily. The cut does not depend on the corner at which the list begins nor on its direction.
// Corners with equal `key` are the same node; count >= 3, no two successive corners have the same
// key. False for a polygon that crosses itself, or is concave and has more than POLYGON_CORNERS
// corners.
bool polygon_triangulate(const Vec3 *corner, const int *key, int count, int (*triangle)[3]);

#endif
