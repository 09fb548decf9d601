// Assembles chunked rest positions and texture coordinates. One thread.
#include "frames_parts.h"
#include "wire.h"

#include <stdlib.h>
#include <string.h>

#include "pliant_rest_t.h"

static bool rest_valid(const pliant_rest_t *chunk)
{
    return chunk->node_count >= 1 && chunk->node_count <= FRAMES_NODES_MAX && chunk->chunk >= 0 &&
           chunk->chunk < chunk->chunk_count && chunk->chunk_count <= chunk->node_count &&
           chunk->num_values >= 3 && chunk->num_values % 3 == 0 &&
           (chunk->num_coordinates == 0 ||
            3 * (int64_t)chunk->num_coordinates == 2 * (int64_t)chunk->num_values) &&
           range_inside(chunk->first, chunk->num_values / 3, chunk->node_count);
}

static void rest_begin(RestFrame *frame, const pliant_rest_t *chunk)
{
    frame->lost += frame->started && !frame->whole;
    size_t nodes = (size_t)chunk->node_count;
    if (!frame->position || frame->node_count != chunk->node_count) {
        free(frame->position);
        free(frame->texture);
        frame->position = frames_allocate(3 * nodes, sizeof(float));
        frame->texture = frames_allocate(2 * nodes, sizeof(float));
    }
    memset(frame->texture, 0, 2 * nodes * sizeof(float));
    parts_begin(&frame->nodes, chunk->node_count);
    frame->utime = chunk->utime;
    frame->sequence = chunk->sequence;
    frame->topology = chunk->topology;
    frame->chunk_count = chunk->chunk_count;
    frame->node_count = chunk->node_count;
    frame->textured = chunk->num_coordinates > 0;
    frame->started = true;
    frame->whole = false;
}

static FramesResult rest_take(RestFrame *frame, const pliant_rest_t *chunk)
{
    if (!rest_valid(chunk))
        return FRAMES_REFUSED;
    if (frame->started &&
        frames_stale(chunk->sequence, chunk->utime, frame->sequence, frame->utime, STALE_MESHES))
        return FRAMES_STALE;
    if (!frame->started || chunk->sequence != frame->sequence)
        rest_begin(frame, chunk);
    else if (chunk->node_count != frame->node_count || chunk->topology != frame->topology ||
             chunk->chunk_count != frame->chunk_count ||
             (chunk->num_coordinates > 0) != frame->textured)
        return FRAMES_REFUSED;
    else if (frame->whole)
        return FRAMES_STALE; // a repeated chunk must not change completed data
    memcpy(frame->position + 3 * (size_t)chunk->first, chunk->position,
           sizeof(float) * (size_t)chunk->num_values);
    if (frame->textured)
        memcpy(frame->texture + 2 * (size_t)chunk->first, chunk->texture,
               sizeof(float) * (size_t)chunk->num_coordinates);
    parts_mark(&frame->nodes, chunk->first, chunk->num_values / 3);
    frame->whole = parts_whole(&frame->nodes);
    return frame->whole ? FRAMES_WHOLE : FRAMES_MORE;
}

FramesResult rest_frame_add(RestFrame *frame, const void *data, size_t size)
{
    pliant_rest_t chunk;
    FramesResult result = FRAMES_REFUSED;
    if (wire_check(&WIRE_REST, data, size) &&
        pliant_rest_t_decode(data, 0, (int)size, &chunk) >= 0) {
        result = rest_take(frame, &chunk);
        pliant_rest_t_decode_cleanup(&chunk);
    }
    frame->refused += result == FRAMES_REFUSED;
    return result;
}

void rest_frame_destroy(RestFrame *frame)
{
    free(frame->position);
    free(frame->texture);
    free(frame->nodes.seen);
    *frame = (RestFrame){0};
}
