// A mesh being read whose size is not known before its end. Load time only; private to files.
#ifndef PLIANT_FILES_MESH_DRAFT_H
#define PLIANT_FILES_MESH_DRAFT_H

#include "geometry/mesh.h"

// Zero to begin with. A file of at most INT_MAX bytes holds no more elements than MESH_COUNT_MAX.
typedef struct MeshDraft {
    Vec3 *position; // [node_count]
    int node_count, node_capacity;
    int (*triangle)[3]; // [triangle_count]
    int *line;          // [triangle_count] where each triangle was read
    int triangle_count, triangle_capacity;
} MeshDraft;

void mesh_draft_add_node(MeshDraft *draft, Vec3 position);
void mesh_draft_add_triangle(MeshDraft *draft, const int corner[3], int line);
// Creates the mesh, unwelded.
void mesh_draft_finish(const MeshDraft *draft, TriMesh *mesh);
void mesh_draft_destroy(MeshDraft *draft);

#endif
