// SPDX-License-Identifier: MIT
// Turns a mesh as read from a file into one fit for simulation: makes safe repairs and counts them,
// and refuses everything else with the first offending element. Load time only; does not read
// files.
//
// Repairs: weld bit-equal nodes; join borders that are one but for rounding; cut polygons into
// triangles; drop faces of fewer than three different nodes and repeated faces; remove faces whose
// nodes are collinear without leaving a crack; turn faces to one orientation, closed surfaces
// outward; split nodes in which surfaces meet point to point; drop nodes that no face uses.
// Refusals: nodes in use that are not finite, edges of more than two faces, one-sided surfaces,
// polygons that cross themselves.
#ifndef PLIANT_GEOMETRY_MESH_REPAIR_H
#define PLIANT_GEOMETRY_MESH_REPAIR_H

#include "geometry/mesh.h"

#include <stddef.h>

// --- draft ---
// A mesh exactly as a file gives it: polygons over nodes, neither checked nor repaired. The mesh
// readers fill it, mesh_repair turns it into a TriMesh. Load time only.

// Initialize to zero; mesh_draft_destroy frees the arrays.
typedef struct MeshDraft {
    Vec3 *position; // [node_count] in units of the file; may hold numbers that are not finite
    int node_count, node_capacity;
    int *corner;    // [corner_count] nodes of all polygons, one polygon after the other
    int *corner_uv; // [corner_count] index in `uv`, unchecked, or -1; NULL without uv
    int corner_count, corner_capacity;
    int *end;  // [polygon_count] index after the last corner of each
    int *line; // [polygon_count] line of the file; 0 in binary files
    int polygon_count, polygon_capacity;
    double (*uv)[2]; // [uv_count] texture coordinates
    int uv_count, uv_capacity;
    double weld;   // borders so far apart are joined; 0: those that are one but for rounding
    bool keeps_uv; // set before the first corner by readers of formats that have uv
    bool full;     // more than MESH_COUNT_MAX of a kind were added; the rest was dropped
} MeshDraft;

void mesh_draft_add_node(MeshDraft *draft, Vec3 position);
void mesh_draft_add_uv(MeshDraft *draft, double u, double v);
// Adds a corner to the polygon that the next mesh_draft_end_polygon ends; any number, nodes in any
// order.
void mesh_draft_add_corner(MeshDraft *draft, int node, int uv);
void mesh_draft_end_polygon(MeshDraft *draft, int line);
void mesh_draft_destroy(MeshDraft *draft);

// Returns the first corner of a polygon.
static inline int mesh_draft_start(const MeshDraft *draft, int polygon)
{
    return polygon == 0 ? 0 : draft->end[polygon - 1];
}

// --- repair ---

// Counts of faults and repairs, in nodes and faces of the source unless noted.
typedef struct MeshRepairs {
    int welded_nodes;     // equal to an earlier, bit-equal node
    int joined_edges;     // border edges that ran beside each other, joined pair by pair
    double joined_apart;  // their largest distance [units of the file]
    int near_edges;       // border edges that would be with a larger `weld`, ...
    double near_apart;    // ... of this
    int merged_nodes;     // merged with an adjacent node, the far end of a face without area
    int unused_nodes;     // dropped: not part of any face
    int split_nodes;      // copies made where surfaces met in a single point
    int polygons;         // faces of more than three corners, cut into triangles
    int degenerate_faces; // dropped: fewer than three different nodes
    int flat_faces;       // triangles removed: three collinear nodes
    int duplicate_faces;  // dropped: same nodes as an earlier face
    int turned_faces;     // faces whose corners were reversed
    int components;       // surfaces that share no edge
    int seam_nodes;       // nodes with several texture coordinates, of which the first is kept
    int nodes_without_uv; // if any, the mesh keeps no texture coordinates at all
} MeshRepairs;

// Creates `mesh`, owned by the caller, with nodes in the order of the source; it passes
// mesh_check. Nodes of closed surfaces that merely touch each other are not welded. On failure
// false with `fault` and no mesh; fault->triangle is then a polygon of the draft, fault->node a
// node of the draft. Corners with nodes out of range are refused.
bool mesh_repair(const MeshDraft *draft, TriMesh *mesh, MeshRepairs *repairs, MeshFault *fault);

// Writes a summary, "welded 12 nodes, dropped 3 faces without area", or "" without repairs.
// Truncated at the buffer's end.
void mesh_repairs_text(const MeshRepairs *repairs, char *text, size_t size);

#endif
