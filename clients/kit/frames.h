// SPDX-License-Identifier: MIT
// Assembles chunked meshes, their deltas, frames of node positions and rest positions. One thread.
// Chunks that contradict their frame are refused, chunks of other frames dropped. The sizes on the
// wire are bounded, a mesh takes the memory of what arrives of it, and all frames of a process
// share a budget: a body that finds no memory is refused, and starts again with its next whole
// message. Nodes, which are of no use without their mesh, may be as many as have come of it.
#ifndef PLIANT_CLIENTS_FRAMES_H
#define PLIANT_CLIENTS_FRAMES_H

#include "base/mesh_columns.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    FRAMES_NODES_MAX = 1 << 22,  // a frame that claims more is refused
    FRAMES_NODES_FREE = 1 << 16, // and one of nodes that claims more than these and its mesh
    FRAMES_TRIANGLES_MAX = 1 << 23,
    FRAMES_LEVELS_MAX = 8,
    FRAMES_CHUNKS_MAX = 1 << 16, // of a mesh; the largest needs 5462 as the server cuts it
    FRAMES_BYTES_MAX = 1 << 30,  // of all frames: the largest mesh with its nodes takes 0.5 GB
};

// The result of a chunk.
typedef enum FramesResult {
    FRAMES_MORE,    // taken, others are missing
    FRAMES_WHOLE,   // taken, and the frame is complete
    FRAMES_PATCHED, // taken, the last packet of its frame (points_t): nodes whose packets did not
                    // come are those of earlier frames
    FRAMES_STALE,   // of an earlier frame: dropped
    FRAMES_MISSED,  // a complete delta of another mesh than ours: wait for a mesh, or send DESCRIBE
    FRAMES_REFUSED, // another type, or it contradicts its own frame or the bounds
} FramesResult;

// Which slots of an array have arrived.
typedef struct FramesParts {
    unsigned char *seen; // [count]
    int count, arrived;
} FramesParts;

// Which message a frame is of, and its memory: the same for all that has a row for each node, or
// for each square, of a body.
typedef struct FrameHead {
    // of the message being assembled, or of the last complete one
    int64_t utime; // of the server [us]
    int32_t sequence, topology, chunk_count;
    int count;      // of rows: nodes, or squares
    int64_t alike;  // what else its chunks must say alike
    int mesh_nodes; // set by the owner: MeshFrame.most_nodes of the body
    // bookkeeping
    bool started, whole;
    void *array[2];    // [count] each, owned; the frame has their names
    FramesParts parts; // rows
    size_t held;       // of the budget [bytes]
    int64_t lost;      // messages given up for a newer one
    int64_t refused;   // chunks
} FrameHead;

// Node positions of one body, from chunks (nodes_t), from packets (points_t), or from both.
typedef struct NodesFrame {
    FrameHead head; // `lost` counts those of which nothing came, too
    int64_t step;
    double time;       // simulated [s]
    float *position;   // [3 count], world frame [m]
    int32_t *frame;    // [count] sequence of the frame that each position is of; valid if `ready`
    bool ready;        // whole, or patched: all positions are of this topology
    FramesParts known; // of this topology
} NodesFrame;

// Rest positions of one body, and its texture coordinates if it has any.
typedef struct RestFrame {
    FrameHead head;
    float *position; // [3 count], world frame [m]
    bool textured;
    float *texture; // [2 count] u v, zero unless textured
} RestFrame;

// Colours of one body (look_t).
enum { LOOK_TEXTURE_MAX = 256 };
typedef struct LookFrame {
    FrameHead head;
    unsigned char color[3], wall[3]; // of the body: outside, and of walls of cuts
    char texture[LOOK_TEXTURE_MAX];
    bool varies;                     // nodes have colours of their own
    unsigned char *outside, *inside; // [3 count] if it varies
} LookFrame;

// Where the error of one body is (error_map_t).
typedef struct ErrorMapFrame {
    FrameHead head;
    int64_t step;         // ticks completed when it was made
    unsigned char *share; // [count] around each node, 0 to 255 of the largest
} ErrorMapFrame;

// The elements at the surface of one body (elements_t).
typedef struct ElementsFrame {
    FrameHead head;
    int64_t step; // ticks completed when they were read
    int level_count;
    int32_t at_level[FRAMES_LEVELS_MAX]; // elements of the whole body
    unsigned char *level;                // [count]
    int16_t *tag;                        // [count]
} ElementsFrame;

// The mesh or delta being assembled: rows in the order of their arrival, so that memory follows
// what has come, not what a message claims. A whole mesh is a change that brings every slot.
typedef struct MeshChange {
    int64_t utime; // of its newest chunk
    int32_t sequence, from_topology, topology, chunk_count;
    int node_count, triangle_count; // of the resulting mesh
    FramesParts chunks;
    int32_t *node_slot, *triangle_slot; // [nodes], [triangles]
    MESH_COLUMNS(MESH_NUMBERS)          // of those slots
    int nodes, triangles, node_capacity, triangle_capacity;
    size_t held;        // of the budget [bytes]
    bool started, done; // done: complete, or given up
} MeshChange;

// Triangles of one body, kept up to date by deltas.
typedef struct MeshFrame {
    // the mesh, once `whole`; it stays valid while the next one arrives
    bool whole;
    int64_t utime; // of the message that last changed it [us], the server's clock
    int32_t topology;
    int node_count, triangle_count;
    MESH_COLUMNS(MESH_NUMBERS) // [3 triangle_count], [node_count], [2 node_count] and so on
    // bookkeeping
    MeshChange next, change;        // whole, delta
    int most_nodes, most_triangles; // so far: what a delta without rows, or nodes, may claim
    size_t held;                    // of the budget [bytes]
    int64_t lost;                   // whole meshes and deltas given up for a newer one
    int64_t missed;                 // deltas of meshes that we do not have
    int64_t refused;                // chunks
} MeshFrame;

// Takes one raw message. After FRAMES_WHOLE the arrays hold the frame until the next call. The
// frame starts zeroed and owns the arrays.
// nodes_t or points_t: where both come, positions that came as floats are kept.
FramesResult nodes_frame_add(NodesFrame *frame, const void *data, size_t size);
FramesResult mesh_frame_add(MeshFrame *frame, const void *data, size_t size);
// Takes a delta: FRAMES_WHOLE when all of it has arrived and the mesh has its topology.
FramesResult mesh_frame_add_delta(MeshFrame *frame, const void *data, size_t size);
FramesResult rest_frame_add(RestFrame *frame, const void *data, size_t size);
FramesResult look_frame_add(LookFrame *frame, const void *data, size_t size);
FramesResult error_map_frame_add(ErrorMapFrame *frame, const void *data, size_t size);
FramesResult elements_frame_add(ElementsFrame *frame, const void *data, size_t size);
void nodes_frame_destroy(NodesFrame *frame);
void mesh_frame_destroy(MeshFrame *frame);
void rest_frame_destroy(RestFrame *frame);
void look_frame_destroy(LookFrame *frame);
void error_map_frame_destroy(ErrorMapFrame *frame);
void elements_frame_destroy(ElementsFrame *frame);

#endif
