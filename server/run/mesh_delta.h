// The differences between two published meshes of one body, slot by slot, and their messages
// (mesh_delta_t). Pure functions without thread, clock or socket.
#ifndef PLIANT_RUN_MESH_DELTA_H
#define PLIANT_RUN_MESH_DELTA_H

#include "dynamics/body.h"

#include "pliant_mesh_delta_t.h"

enum {
    DELTA_NODES_IN_CHUNK = 1024, // with DELTA_TRIANGLES_IN_CHUNK 50 kB: below one datagram
    DELTA_TRIANGLES_IN_CHUNK = 1536,
};

typedef struct MeshDelta {
    int from_topology;
    int node_count, triangle_count; // slots that changed
    int *node, *triangle;           // [capacity] those slots, ascending; owned by the caller
} MeshDelta;

// The memory of one chunk's message.
typedef struct MeshDeltaChunk {
    int32_t triangle_slot[DELTA_TRIANGLES_IN_CHUNK], triangle[3 * DELTA_TRIANGLES_IN_CHUNK];
    int32_t node_slot[DELTA_NODES_IN_CHUNK], id[DELTA_NODES_IN_CHUNK];
    int32_t origin[DELTA_NODES_IN_CHUNK], parent[2 * DELTA_NODES_IN_CHUNK];
    int32_t piece[DELTA_NODES_IN_CHUNK];
    int8_t level[DELTA_NODES_IN_CHUNK];
} MeshDeltaChunk;

// Lists the slots of `after` that differ from `before`. Slots beyond the counts of `before` were
// free; two free slots are equal whatever else they contain.
void mesh_delta_find(MeshDelta *delta, const BodyMesh *before, const BodyMesh *after);
// Returns the number of chunks: at least one, even if only the topology number changed.
int mesh_delta_chunks(const MeshDelta *delta);
// Returns chunk `chunk` as a message without utime and sequence. `after` as in mesh_delta_find; the
// arrays of the message are those of `memory`.
pliant_mesh_delta_t mesh_delta_chunk(const MeshDelta *delta, const BodyMesh *after, int chunk,
                                     MeshDeltaChunk *memory);

#endif
