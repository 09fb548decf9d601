// SPDX-License-Identifier: MIT
// Assembles maps of errors: one number for each node. One thread.
#include "frames_parts.h"

#include "wire.h"

#include "pliant_error_map_t.h"

#include <stdlib.h>
#include <string.h>

static bool map_valid(const pliant_error_map_t *chunk)
{
    return chunk->node_count >= 1 && chunk->node_count <= FRAMES_NODES_MAX &&
           chunk->chunk_count >= 1 && chunk->chunk_count <= FRAMES_CHUNKS_MAX &&
           chunk->chunk >= 0 && chunk->chunk < chunk->chunk_count && chunk->num_values >= 1 &&
           range_inside(chunk->first, chunk->num_values, chunk->node_count);
}

static bool map_begin(ErrorMapFrame *frame, const pliant_error_map_t *chunk)
{
    const ErrorMapFrame old = *frame;
    // Given up for a newer one, if it was not whole.
    const int64_t lost = old.lost + (old.started && !old.whole);
    const size_t nodes = (size_t)chunk->node_count;
    error_map_frame_destroy(frame);
    *frame = (ErrorMapFrame){.lost = lost, .refused = old.refused, .mesh_nodes = old.mesh_nodes};
    if (!frames_claim(&frame->held, 2 * nodes))
        return false;
    frame->share = frames_allocate(nodes, 1);
    if (!frame->share || !parts_begin(&frame->nodes, chunk->node_count))
        return false;
    frame->utime = chunk->utime;
    frame->sequence = chunk->sequence;
    frame->topology = chunk->topology;
    frame->chunk_count = chunk->chunk_count;
    frame->node_count = chunk->node_count;
    frame->started = true;
    return true;
}

static FramesResult map_take(ErrorMapFrame *frame, const pliant_error_map_t *chunk)
{
    // What contradicts itself or is old is refused.
    if (!map_valid(chunk))
        return FRAMES_REFUSED;
    if (frame->started &&
        frames_stale(chunk->sequence, chunk->utime, frame->sequence, frame->utime, STALE_MESHES))
        return FRAMES_STALE;
    // The first chunk of another message, or one more of this.
    if (!frame->started || chunk->sequence != frame->sequence) {
        if (!nodes_paid(chunk->node_count, frame->mesh_nodes) || !map_begin(frame, chunk))
            return FRAMES_REFUSED;
    } else if (chunk->node_count != frame->node_count || chunk->topology != frame->topology ||
               chunk->chunk_count != frame->chunk_count) {
        return FRAMES_REFUSED;
    } else if (frame->whole) {
        return FRAMES_STALE; // a repeated chunk must not change completed data
    }
    memcpy(frame->share + chunk->first, chunk->share, (size_t)chunk->num_values);
    parts_mark(&frame->nodes, chunk->first, chunk->num_values);
    frame->whole = parts_whole(&frame->nodes);
    return frame->whole ? FRAMES_WHOLE : FRAMES_MORE;
}

FramesResult error_map_frame_add(ErrorMapFrame *frame, const void *data, size_t size)
{
    pliant_error_map_t chunk;
    FramesResult result = FRAMES_REFUSED;
    if (wire_check(&WIRE_ERROR_MAP, data, size) &&
        pliant_error_map_t_decode(data, 0, (int)size, &chunk) >= 0) {
        result = map_take(frame, &chunk);
        pliant_error_map_t_decode_cleanup(&chunk);
    }
    frame->refused += result == FRAMES_REFUSED;
    return result;
}

void error_map_frame_destroy(ErrorMapFrame *frame)
{
    free(frame->share);
    free(frame->nodes.seen);
    frames_claim(&frame->held, 0);
    *frame = (ErrorMapFrame){0};
}
