// A mesh exactly as a file gives it: polygons over nodes, neither checked nor repaired. The mesh
// readers fill it, mesh_repair turns it into a TriMesh. Load time only.
#ifndef PLIANT_GEOMETRY_MESH_DRAFT_H
#define PLIANT_GEOMETRY_MESH_DRAFT_H

#include "geometry/mesh.h"

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

#endif
