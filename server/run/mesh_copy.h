// Copies of a mesh that changes during the run. One thread hands them to another, because only the
// step thread may read such a body's own mesh. Plain memory, used for messages and files.
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

// True if other threads need a copy of this body's mesh.
static inline bool mesh_changes(const Body *body)
{
    return body_changes(body);
}

// Returns the largest number of node slots in a frame of this body.
static inline int mesh_most_nodes(const Body *body)
{
    return mesh_changes(body) ? body->mesh.node_capacity : body->mesh.node_count;
}

// Returns the number of live nodes: slots that are not free.
int mesh_live_nodes(const BodyMesh *mesh);

// Returns the bytes of a copy of the largest mesh, a multiple of 8.
size_t mesh_copy_bytes(const BodyMesh *mesh);
// Copies the mesh unless the copy has the same topology already. Allocates nothing. A topology
// number must name one mesh only during a run.
void mesh_copy_follow(MeshCopy *copy, const BodyMesh *mesh);
// Returns a view of the copy, read like the body's own mesh; valid until the copy changes.
BodyMesh mesh_copy_view(const MeshCopy *copy);

// Rest positions of the nodes of a published mesh, and their texture coordinates. The step thread
// hands them to the bus with the mesh, once per topology, in scenes that publish them. Plain
// memory.

typedef struct RestCopy {
    int topology, node_count; // of the mesh; node_count 0: nothing copied yet
    float position[];         // [3 node_count], world frame [m]; zero in free slots
} RestCopy;

// True if the body has rest positions.
static inline bool rest_is_known(const Body *body)
{
    return body->ops->snapshot_rest != NULL;
}

// Returns the bytes of a copy for the largest mesh, a multiple of 8.
size_t rest_copy_bytes(const BodyMesh *mesh);
// Copy the positions of the body, or of another copy, unless they have them already. No allocation.
void rest_copy_follow(RestCopy *copy, const Body *body);
void rest_copy_take(RestCopy *copy, const RestCopy *from);
// Writes the texture coordinates of the node slots [first, end) of a mesh of the body; zero in free
// slots and if the body has none.
void rest_texture(const Body *body, const BodyMesh *mesh, int first, int end, float *uv);

#endif
