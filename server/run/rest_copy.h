// Rest positions of the nodes of a published mesh, and their texture coordinates. The step thread
// hands them to the bus with the mesh, once per topology, in scenes that publish them. Plain
// memory.
#ifndef PLIANT_RUN_REST_COPY_H
#define PLIANT_RUN_REST_COPY_H

#include "dynamics/body.h"

#include <stddef.h>

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
