// SPDX-License-Identifier: MIT
// Assembles looks: colours of a body or of its nodes. One thread.
#include "frames_parts.h"

#include "pliant_look_t.h"

#include <string.h>

static FramesResult look_take(LookFrame *frame, const pliant_look_t *chunk)
{
    const FrameChunk from = {CHUNK_SAYS(chunk, node_count),
                             .rows = chunk->num_values / 3,
                             .alike = chunk->num_values > 0,
                             .nodes = chunk->node_count,
                             .from = {chunk->node_color, chunk->node_inside},
                             .size = {3, 3}};
    const bool first = frame_changes(&frame->head, &from);
    // What contradicts itself is refused.
    if (!chunk_is_one_of(chunk->chunk, chunk->chunk_count, FRAMES_CHUNKS_MAX) ||
        chunk->num_values % 3 != 0 || (chunk->num_values == 0 && chunk->chunk_count != 1) ||
        strlen(chunk->texture) >= LOOK_TEXTURE_MAX)
        return FRAMES_REFUSED;
    const FramesResult result = frame_take(&frame->head, &from);
    if (first && (result == FRAMES_MORE || result == FRAMES_WHOLE)) {
        memcpy(frame->color, chunk->color, sizeof frame->color);
        memcpy(frame->wall, chunk->inside, sizeof frame->wall);
        strcpy(frame->texture, chunk->texture);
    } else if (!frame->head.started) { // no memory
        *frame = (LookFrame){.head = frame->head};
    }
    frame->outside = frame->head.array[0];
    frame->inside = frame->head.array[1];
    frame->varies = frame->head.alike;
    return result;
}

FRAME_FUNCTIONS(look, LookFrame, WIRE_LOOK, look_take)
