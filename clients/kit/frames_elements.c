// SPDX-License-Identifier: MIT
// Assembles the elements at the surface of a body: two numbers for each square. One thread.
#include "frames_parts.h"

#include "wire.h"

#include "pliant_elements_t.h"

#include <stdlib.h>
#include <string.h>

static bool chunk_valid(const pliant_elements_t *chunk)
{
    return chunk->square_count >= 1 && chunk->square_count <= FRAMES_NODES_MAX &&
           chunk->chunk_count >= 1 && chunk->chunk_count <= FRAMES_CHUNKS_MAX &&
           chunk->chunk >= 0 && chunk->chunk < chunk->chunk_count && chunk->num_squares >= 1 &&
           chunk->num_levels >= 1 && chunk->num_levels <= FRAMES_LEVELS_MAX &&
           range_inside(chunk->first, chunk->num_squares, chunk->square_count);
}

static bool begin(ElementsFrame *frame, const pliant_elements_t *chunk)
{
    const ElementsFrame old = *frame;
    // Given up for a newer one, if it was not whole.
    const int64_t lost = old.lost + (old.started && !old.whole);
    const size_t squares = (size_t)chunk->square_count;
    elements_frame_destroy(frame);
    *frame = (ElementsFrame){.lost = lost, .refused = old.refused, .mesh_nodes = old.mesh_nodes};
    if (!frames_claim(&frame->held, 4 * squares))
        return false;
    frame->level = frames_allocate(squares, sizeof *frame->level);
    frame->tag = frames_allocate(squares, sizeof *frame->tag);
    if (!frame->level || !frame->tag || !parts_begin(&frame->squares, chunk->square_count))
        return false;
    frame->utime = chunk->utime;
    frame->sequence = chunk->sequence;
    frame->topology = chunk->topology;
    frame->chunk_count = chunk->chunk_count;
    frame->square_count = chunk->square_count;
    frame->level_count = chunk->num_levels;
    memcpy(frame->at_level, chunk->elements, (size_t)chunk->num_levels * sizeof *frame->at_level);
    frame->started = true;
    return true;
}

static FramesResult take(ElementsFrame *frame, const pliant_elements_t *chunk)
{
    // What contradicts itself or is old is refused.
    if (!chunk_valid(chunk))
        return FRAMES_REFUSED;
    if (frame->started &&
        frames_stale(chunk->sequence, chunk->utime, frame->sequence, frame->utime, STALE_MESHES))
        return FRAMES_STALE;
    // The first chunk of another message, or one more of this. A mesh has about as many squares as
    // nodes.
    if (!frame->started || chunk->sequence != frame->sequence) {
        if (!nodes_paid(chunk->square_count / 2, frame->mesh_nodes) || !begin(frame, chunk))
            return FRAMES_REFUSED;
    } else if (chunk->square_count != frame->square_count || chunk->topology != frame->topology ||
               chunk->chunk_count != frame->chunk_count ||
               chunk->num_levels != frame->level_count) {
        return FRAMES_REFUSED;
    } else if (frame->whole) {
        return FRAMES_STALE; // a repeated chunk must not change completed data
    }
    const size_t count = (size_t)chunk->num_squares;
    memcpy(frame->level + chunk->first, chunk->level, count * sizeof *frame->level);
    memcpy(frame->tag + chunk->first, chunk->tag, count * sizeof *frame->tag);
    parts_mark(&frame->squares, chunk->first, chunk->num_squares);
    frame->whole = parts_whole(&frame->squares);
    return frame->whole ? FRAMES_WHOLE : FRAMES_MORE;
}

FramesResult elements_frame_add(ElementsFrame *frame, const void *data, size_t size)
{
    pliant_elements_t chunk;
    FramesResult result = FRAMES_REFUSED;
    if (wire_check(&WIRE_ELEMENTS, data, size) &&
        pliant_elements_t_decode(data, 0, (int)size, &chunk) >= 0) {
        result = take(frame, &chunk);
        pliant_elements_t_decode_cleanup(&chunk);
    }
    frame->refused += result == FRAMES_REFUSED;
    return result;
}

void elements_frame_destroy(ElementsFrame *frame)
{
    free(frame->level);
    free(frame->tag);
    free(frame->squares.seen);
    frames_claim(&frame->held, 0);
    *frame = (ElementsFrame){0};
}
