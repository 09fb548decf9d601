// SPDX-License-Identifier: MIT
// Assembles looks: colours of a body or of its nodes. One thread.
#include "frames_parts.h"

#include "wire.h"

#include "pliant_look_t.h"

#include <stdlib.h>
#include <string.h>

static bool look_valid(const pliant_look_t *chunk)
{
    return chunk->node_count >= 0 && chunk->node_count <= FRAMES_NODES_MAX &&
           chunk->chunk_count >= 1 && chunk->chunk_count <= FRAMES_CHUNKS_MAX &&
           chunk->chunk >= 0 && chunk->chunk < chunk->chunk_count && chunk->num_values % 3 == 0 &&
           range_inside(chunk->first, chunk->num_values / 3, chunk->node_count) &&
           (chunk->num_values > 0 || chunk->chunk_count == 1) &&
           strlen(chunk->texture) < LOOK_TEXTURE_MAX;
}

// Takes memory for so many nodes, zeroed. False if there is none.
static bool look_allocate(LookFrame *frame, int count)
{
    const LookFrame old = *frame;
    const size_t nodes = (size_t)count;
    look_frame_destroy(frame);
    *frame = (LookFrame){.lost = old.lost, .refused = old.refused, .mesh_nodes = old.mesh_nodes};
    if (count == 0)
        return true;
    if (!frames_claim(&frame->held, 7 * nodes))
        return false;
    frame->outside = frames_allocate(3 * nodes, 1);
    frame->inside = frames_allocate(3 * nodes, 1);
    return frame->outside && frame->inside && parts_begin(&frame->nodes, count);
}

static bool look_begin(LookFrame *frame, const pliant_look_t *chunk)
{
    // Given up for a newer one, if it was not whole.
    frame->lost += frame->started && !frame->whole;
    const int count = chunk->num_values > 0 ? chunk->node_count : 0;
    if (!look_allocate(frame, count)) {
        look_allocate(frame, 0);
        return false;
    }
    frame->utime = chunk->utime;
    frame->sequence = chunk->sequence;
    frame->topology = chunk->topology;
    frame->chunk_count = chunk->chunk_count;
    frame->node_count = chunk->node_count;
    frame->varies = count > 0;
    frame->started = true;
    frame->whole = count == 0;
    memcpy(frame->color, chunk->color, sizeof frame->color);
    memcpy(frame->wall, chunk->inside, sizeof frame->wall);
    strcpy(frame->texture, chunk->texture);
    return true;
}

static FramesResult look_take(LookFrame *frame, const pliant_look_t *chunk)
{
    // What contradicts itself or is old is refused.
    if (!look_valid(chunk))
        return FRAMES_REFUSED;
    if (frame->started &&
        frames_stale(chunk->sequence, chunk->utime, frame->sequence, frame->utime, STALE_MESHES))
        return FRAMES_STALE;
    // The first chunk of another message, or one more of this.
    if (!frame->started || chunk->sequence != frame->sequence) {
        if (!nodes_paid(chunk->node_count, frame->mesh_nodes) || !look_begin(frame, chunk))
            return FRAMES_REFUSED;
    } else if (chunk->node_count != frame->node_count || chunk->topology != frame->topology ||
               chunk->chunk_count != frame->chunk_count ||
               (chunk->num_values > 0) != frame->varies) {
        return FRAMES_REFUSED;
    } else if (frame->whole) {
        return FRAMES_STALE; // a repeated chunk must not change completed data
    }
    if (!frame->varies)
        return FRAMES_WHOLE;
    const size_t first = 3 * (size_t)chunk->first, values = (size_t)chunk->num_values;
    memcpy(frame->outside + first, chunk->node_color, values);
    memcpy(frame->inside + first, chunk->node_inside, values);
    parts_mark(&frame->nodes, chunk->first, chunk->num_values / 3);
    frame->whole = parts_whole(&frame->nodes);
    return frame->whole ? FRAMES_WHOLE : FRAMES_MORE;
}

FramesResult look_frame_add(LookFrame *frame, const void *data, size_t size)
{
    pliant_look_t chunk;
    FramesResult result = FRAMES_REFUSED;
    if (wire_check(&WIRE_LOOK, data, size) &&
        pliant_look_t_decode(data, 0, (int)size, &chunk) >= 0) {
        result = look_take(frame, &chunk);
        pliant_look_t_decode_cleanup(&chunk);
    }
    frame->refused += result == FRAMES_REFUSED;
    return result;
}

void look_frame_destroy(LookFrame *frame)
{
    free(frame->outside);
    free(frame->inside);
    free(frame->nodes.seen);
    frames_claim(&frame->held, 0);
    *frame = (LookFrame){0};
}
