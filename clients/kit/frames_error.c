// SPDX-License-Identifier: MIT
// Assembles maps of errors: one number for each node. One thread.
#include "frames_parts.h"

#include "pliant_error_map_t.h"

static FramesResult error_map_take(ErrorMapFrame *frame, const pliant_error_map_t *chunk)
{
    const FrameChunk from = {
        CHUNK_SAYS(chunk, node_count), .rows = chunk->num_values,      .nodes = chunk->node_count,
        .from = {chunk->share},        .size = {sizeof *frame->share},
    };
    const bool first = frame_changes(&frame->head, &from);
    // What contradicts itself is refused.
    if (!chunk_is_one_of(chunk->chunk, chunk->chunk_count, FRAMES_CHUNKS_MAX) ||
        chunk->num_values < 1)
        return FRAMES_REFUSED;
    const FramesResult result = frame_take(&frame->head, &from);
    frame->share = frame->head.array[0];
    if (first && (result == FRAMES_MORE || result == FRAMES_WHOLE))
        frame->step = chunk->step;
    return result;
}

FRAME_FUNCTIONS(error_map, ErrorMapFrame, WIRE_ERROR_MAP, error_map_take)
