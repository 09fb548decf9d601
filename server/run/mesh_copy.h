// Copies of a mesh that changes while it runs: what one thread hands to another, because nobody but
// the step thread may look at such a body's own. Plain memory; the pure part of messages and files.
#ifndef PLIANT_RUN_MESH_COPY_H
#define PLIANT_RUN_MESH_COPY_H

#include "dynamics/body.h"

#include <stddef.h>

// The slots in use of one BodyMesh, array behind array.
typedef struct MeshCopy {
    int topology, node_count, triangle_count; // node_count 0: nothing copied yet
    int node_capacity, triangle_capacity;
    int data[];
} MeshCopy;

// Whether other threads need a copy of this body's mesh.
static inline bool mesh_changes(const Body *body)
{
    return body_changes(body);
}

// Node slots that frames of this body may ever have.
static inline int mesh_most_nodes(const Body *body)
{
    return mesh_changes(body) ? body->mesh.node_capacity : body->mesh.node_count;
}

// Nodes alive: slots that are not free.
int mesh_live_nodes(const BodyMesh *mesh);

// Bytes of a copy of the largest mesh, a multiple of 8.
size_t mesh_copy_bytes(const BodyMesh *mesh);
// Copies the mesh unless the copy has its topology already. No allocation. A topology number must
// never name two meshes in one run.
void mesh_copy_follow(MeshCopy *copy, const BodyMesh *mesh);
// The copy, to be read like the body's own; valid as long as the copy stays what it is.
BodyMesh mesh_copy_view(const MeshCopy *copy);

#endif
