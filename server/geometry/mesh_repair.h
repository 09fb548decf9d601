// Turns a mesh as read from a file into one fit for simulation: makes safe repairs and counts them,
// and refuses everything else with the first offending element. Load time only; does not read
// files.
//
// Repairs: weld bit-equal nodes; cut polygons into triangles; drop faces of fewer than three
// different nodes and repeated faces; remove faces whose nodes are collinear without leaving a
// crack; turn faces to one orientation, closed surfaces outward; split nodes in which surfaces meet
// point to point; drop nodes that no face uses.
// Refusals: nodes in use that are not finite, edges of more than two faces, one-sided surfaces,
// polygons that cross themselves.
#ifndef PLIANT_GEOMETRY_MESH_REPAIR_H
#define PLIANT_GEOMETRY_MESH_REPAIR_H

#include "geometry/mesh_draft.h"

#include <stddef.h>

// Counts of faults and repairs, in nodes and faces of the source unless noted.
typedef struct MeshRepairs {
    int welded_nodes;     // equal to an earlier, bit-equal node
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
