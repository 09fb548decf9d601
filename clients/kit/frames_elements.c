// SPDX-License-Identifier: MIT
// Assembles the elements at the surface of a body: two numbers for each square. One thread.
#include "frames_parts.h"

#include "pliant_elements_t.h"

#include <string.h>

static FramesResult elements_take(ElementsFrame *frame, const pliant_elements_t *chunk)
{
    // A mesh has about as many squares as nodes.
    const FrameChunk from = {
        CHUNK_SAYS(chunk, square_count),    .rows = chunk->num_squares,
        .alike = chunk->num_levels,         .nodes = chunk->square_count / 2,
        .from = {chunk->level, chunk->tag}, .size = {sizeof *frame->level, sizeof *frame->tag},
    };
    const bool first = frame_changes(&frame->head, &from);
    // What contradicts itself is refused.
    if (!chunk_is_one_of(chunk->chunk, chunk->chunk_count, FRAMES_CHUNKS_MAX) ||
        chunk->num_squares < 1 || chunk->num_levels < 1 || chunk->num_levels > FRAMES_LEVELS_MAX)
        return FRAMES_REFUSED;
    const FramesResult result = frame_take(&frame->head, &from);
    frame->level = frame->head.array[0];
    frame->tag = frame->head.array[1];
    frame->level_count = (int)frame->head.alike;
    if (!first || (result != FRAMES_MORE && result != FRAMES_WHOLE))
        return result;
    frame->step = chunk->step;
    memcpy(frame->at_level, chunk->elements, (size_t)chunk->num_levels * sizeof(int32_t));
    return result;
}

FRAME_FUNCTIONS(elements, ElementsFrame, WIRE_ELEMENTS, elements_take)
