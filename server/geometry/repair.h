// The steps of mesh_repair, one source file each. Load time only, private to geometry.
#ifndef PLIANT_GEOMETRY_REPAIR_H
#define PLIANT_GEOMETRY_REPAIR_H

#include "geometry/half_edge.h"
#include "geometry/mesh_repair.h"

// A mesh under repair. Its nodes keep the numbers of the draft until the end, so that elements can
// be named at any time; nodes that are no longer used stay.
typedef struct Repair {
    const MeshDraft *draft;
    MeshRepairs *repairs;
    MeshFault *fault;
    TriMesh mesh;        // nodes: the draft's, then mesh.copy_count copies
    int (*corner)[3];    // [triangle] corner of the draft that each corner came from
    int *polygon;        // [triangle] of the draft; -1: to be dropped by repair_compact
    int *kept;           // [draft nodes] what stands for a node: see repair_node
    bool ties_borders;   // weld only what closes a gap
    bool edges_overfull; // refused because of an edge with more than two faces
} Repair;

// The node that now stands for a node of the draft.
static inline int repair_node(const Repair *repair, int node)
{
    int *kept = repair->kept;
    while (kept[node] != node)
        node = kept[node] = kept[kept[node]]; // shorter for the next who asks
    return node;
}

// Fills the fault and returns false; node or triangle (of repair->mesh) may be -1.
bool repair_fail(const Repair *repair, int node, int triangle, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
// Removes triangles whose polygon is -1, order kept.
void repair_compact(Repair *repair);

// --- in this order ---
// repair_faces.c: which nodes are one, and the triangles of all polygons.
bool repair_faces(Repair *repair);
// repair_edges.c: at most two faces an edge.
bool repair_edges(Repair *repair);
// repair_orientation.c: one orientation a component, closed ones outward.
bool repair_orientation(Repair *repair);
// repair_fans.c: one fan a node.
void repair_fans(Repair *repair);
// repair_flat.c: no triangle without area. Wants an oriented mesh with one fan a node, and may
// leave nodes with more at borders.
bool repair_flat_faces(Repair *repair);

#endif
