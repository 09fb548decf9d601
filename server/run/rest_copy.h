// Where the nodes of a published mesh are at rest, and their texture coordinates: what the step
// thread hands to the bus with the mesh, once a topology, for scenes that publish it. Plain memory.
#ifndef PLIANT_RUN_REST_COPY_H
#define PLIANT_RUN_REST_COPY_H

#include "dynamics/body.h"

#include <stddef.h>

typedef struct RestCopy {
    int topology, node_count; // of the mesh; node_count 0: nothing copied yet
    float position[];         // [3 node_count] in the world [m]; of free slots zero
} RestCopy;

// Whether the body knows where its nodes rest.
static inline bool rest_is_known(const Body *body)
{
    return body->ops->snapshot_rest != NULL;
}

// Bytes of a copy of the largest mesh, a multiple of 8.
size_t rest_copy_bytes(const BodyMesh *mesh);
// Takes the places from the body, or those of another copy, unless they are there already. No
// allocation.
void rest_copy_follow(RestCopy *copy, const Body *body);
void rest_copy_take(RestCopy *copy, const RestCopy *from);
// Texture coordinates of the node slots [first, end) of a mesh of the body; zero where the body
// knows none, and in free slots.
void rest_texture(const Body *body, const BodyMesh *mesh, int first, int end, float *uv);

#endif
