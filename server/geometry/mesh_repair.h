// From a mesh as a file says it to one fit for simulation: safe repairs are made and counted, the
// rest is refused with the first offending element. Load time only; knows no file.
//
// Made: bit-equal nodes welded; polygons cut into triangles; faces of fewer than three different
// nodes and repeated faces dropped; faces whose nodes lie in a line taken out so that no crack
// stays; faces turned to one orientation, closed surfaces outward; nodes in which surfaces meet
// point to point split; nodes that no face uses dropped.
// Refused: nodes in use that are not finite, edges of more than two faces, surfaces with one side
// only, polygons that cross themselves.
#ifndef PLIANT_GEOMETRY_MESH_REPAIR_H
#define PLIANT_GEOMETRY_MESH_REPAIR_H

#include "geometry/mesh_draft.h"

#include <stddef.h>

// What was found and done, counted in nodes and faces of the source unless said.
typedef struct MeshRepairs {
    int welded_nodes; // that are one with an earlier, bit-equal node
    int merged_nodes; // that are one with a node next to them, the far end of a face without area
    int unused_nodes; // dropped: of no face
    int split_nodes;  // copies made where surfaces met in a single point
    int polygons;     // faces of more than three corners, cut into triangles
    int degenerate_faces; // dropped: fewer than three different nodes
    int flat_faces;       // triangles taken out: three nodes in a line
    int duplicate_faces;  // dropped: of the same nodes as an earlier face
    int turned_faces;     // whose corners were put in the opposite order
    int components;       // surfaces that share no edge
    int seam_nodes;       // with more than one texture coordinate: the first was kept
    int nodes_without_uv; // then the mesh keeps no texture coordinates at all
} MeshRepairs;

// Creates `mesh`, owned by the caller, with nodes in the order of the source; it passes
// mesh_validate. Nodes of closed surfaces that merely touch each other are not welded. False with
// `fault`, nothing created; fault->triangle is then a polygon of the draft, its nodes those of the
// draft. Corners may name nodes out of range: they are refused.
bool mesh_repair(const MeshDraft *draft, TriMesh *mesh, MeshRepairs *repairs, MeshFault *fault);

// "welded 12 nodes, dropped 3 faces without area"; "" when there was nothing to repair. Cut at the
// buffer's end.
void mesh_repairs_text(const MeshRepairs *repairs, char *text, size_t size);

#endif
