// A mesh as a file says it: polygons over nodes, nothing checked or repaired yet. Filled by the
// readers of the files room, turned into a TriMesh by mesh_repair. Load time only.
#ifndef PLIANT_GEOMETRY_MESH_DRAFT_H
#define PLIANT_GEOMETRY_MESH_DRAFT_H

#include "geometry/mesh.h"

// Zero to begin with.
typedef struct MeshDraft {
    Vec3 *position; // [node_count]; may hold numbers that are not finite
    int node_count, node_capacity;
    int *corner;    // [corner_count] nodes of all polygons, one polygon after the other
    int *corner_uv; // [corner_count] index in `uv`, whatever the file says, or -1; NULL without uv
    int corner_count, corner_capacity;
    int *end;  // [polygon_count] past the last corner of each
    int *line; // [polygon_count] of the file where it was read; 0 in binary files
    int polygon_count, polygon_capacity;
    double (*uv)[2]; // [uv_count] texture coordinates
    int uv_count, uv_capacity;
    bool keeps_uv; // set before the first corner by readers of formats that have uv
    bool full;     // more was added than MESH_COUNT_MAX of a kind: what followed was left out
} MeshDraft;

void mesh_draft_add_node(MeshDraft *draft, Vec3 position);
void mesh_draft_add_uv(MeshDraft *draft, double u, double v);
// Corners belong to the polygon that ends next; any number of them, in any order of nodes.
void mesh_draft_add_corner(MeshDraft *draft, int node, int uv);
void mesh_draft_end_polygon(MeshDraft *draft, int line);
void mesh_draft_destroy(MeshDraft *draft);

// The first corner of a polygon.
static inline int mesh_draft_start(const MeshDraft *draft, int polygon)
{
    return polygon == 0 ? 0 : draft->end[polygon - 1];
}

#endif
