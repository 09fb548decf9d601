// SPDX-License-Identifier: MIT
// Shared by frames.c, frames_elements.c, frames_error.c, frames_mesh.c and frames_look.c.
#ifndef PLIANT_CLIENTS_FRAMES_PARTS_H
#define PLIANT_CLIENTS_FRAMES_PARTS_H

#include "frames.h"

#include "wire.h"

// Allocates zeroed memory; NULL if there is none.
void *frames_allocate(size_t count, size_t size);
// Makes `*held` bytes of the budget of all frames `bytes`; false if that passes FRAMES_BYTES_MAX.
// Less is always granted.
bool frames_claim(size_t *held, size_t bytes);

bool parts_begin(FramesParts *parts, int count);
void parts_mark(FramesParts *parts, int first, int count);

static inline bool parts_whole(const FramesParts *parts)
{
    return parts->arrived == parts->count;
}

static inline bool range_inside(int32_t first, int32_t count, int32_t limit)
{
    return first >= 0 && count >= 0 && first <= limit && count <= limit - first;
}

// True if the memory of so many nodes is paid for by the rows of a mesh that came: a packet of 100
// bytes must not make its receiver take that of the largest.
static inline bool nodes_paid(int count, int mesh_nodes)
{
    return count <= FRAMES_NODES_FREE || count <= mesh_nodes;
}

static inline bool chunk_is_one_of(int32_t chunk, int32_t chunk_count, int32_t most)
{
    return chunk >= 0 && chunk < chunk_count && chunk_count <= most;
}

// How far a sequence may be behind and still count as late. Many frames come per second. Whole
// meshes come seconds apart, and a daemon that restarts with its clock set back must not wait long.
enum { STALE_FRAMES = 64, STALE_MESHES = 2 };

// True if older by number, by `most` at most, and by clock: a daemon that restarts counts from 0
// with a later clock.
bool frames_stale(int32_t sequence, int64_t utime, int32_t newest, int64_t newest_utime, int most);

// --- frames with a row for each node or square ---

// What a chunk says of its message, and its rows.
typedef struct FrameChunk {
    int64_t utime;
    int32_t sequence, topology, chunk_count; // 0 chunks: a packet, which does not say
    int32_t count;                           // rows of the message
    int32_t first, rows;                     // of the chunk; none if its message has no arrays
    int64_t alike;                           // what else the chunks of a message say alike
    int nodes;                               // of its mesh, about: what must be paid for
    int late;                                // STALE_FRAMES or STALE_MESHES
    const void *from[2];                     // for each array; NULL: it stays zero
    size_t size[2];                          // bytes of a row of each array, 0: none
} FrameChunk;

// What the types of messages have alike that are whole by chunks only; `rows_of`: the field that
// has their count.
#define CHUNK_SAYS(chunk, rows_of)                                                                 \
    .utime = (chunk)->utime, .sequence = (chunk)->sequence, .topology = (chunk)->topology,         \
    .chunk_count = (chunk)->chunk_count, .count = (chunk)->rows_of, .first = (chunk)->first,       \
    .late = STALE_MESHES

// True if a chunk is of another message than the frame.
static inline bool frame_changes(const FrameHead *head, const FrameChunk *chunk)
{
    return !head->started || chunk->sequence != head->sequence;
}

// Decides on a chunk whose own counts agree. FRAMES_MORE: take it, as the first of another message
// if `frame_changes`.
FramesResult frame_judge(const FrameHead *head, const FrameChunk *chunk);
// Forgets the message and takes memory for the arrays of another, zeroed, with `marks` bytes more
// of the budget for each row.
bool frame_resize(FrameHead *head, const FrameChunk *chunk, size_t marks);
// Makes the frame that of the chunk's message, of which nothing has come. These two return false if
// there is no memory: frame_forget then.
bool frame_begin(FrameHead *head, const FrameChunk *chunk);
// Forgets the message and its memory. What was counted stays.
void frame_forget(FrameHead *head);
// Takes a chunk as frame_judge decides. The arrays may be others after it.
FramesResult frame_take(FrameHead *head, const FrameChunk *chunk);

// Defines the functions of frames.h for a type of message: `take` gets it decoded.
#define FRAME_FUNCTIONS(name, Frame, WIRE, take)                                                   \
    FramesResult name##_frame_add(Frame *frame, const void *data, size_t size)                     \
    {                                                                                              \
        pliant_##name##_t chunk;                                                                   \
        FramesResult result = FRAMES_REFUSED;                                                      \
        if (wire_check(&(WIRE), data, size) &&                                                     \
            pliant_##name##_t_decode(data, 0, (int)size, &chunk) >= 0) {                           \
            result = take(frame, &chunk);                                                          \
            pliant_##name##_t_decode_cleanup(&chunk);                                              \
        }                                                                                          \
        frame->head.refused += result == FRAMES_REFUSED;                                           \
        return result;                                                                             \
    }                                                                                              \
                                                                                                   \
    void name##_frame_destroy(Frame *frame)                                                        \
    {                                                                                              \
        frame_forget(&frame->head);                                                                \
        *frame = (Frame){0};                                                                       \
    }

#endif
