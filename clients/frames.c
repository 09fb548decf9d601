// Assembles chunked frames of node positions, rest positions and texture coordinates. One thread.
#include "frames_parts.h"

#include "wire.h"

#include "pliant_nodes_t.h"
#include "pliant_rest_t.h"

#include <stdlib.h>
#include <string.h>

void *frames_allocate(size_t count, size_t size)
{
    void *memory = calloc(count ? count : 1, size);
    if (!memory)
        abort(); // the counts are bounded: the machine itself is out of memory
    return memory;
}

void parts_begin(FramesParts *parts, int count)
{
    free(parts->seen);
    *parts = (FramesParts){.seen = frames_allocate((size_t)count, 1), .count = count};
}

void parts_mark(FramesParts *parts, int first, int count)
{
    for (int i = first; i < first + count; i++) {
        parts->arrived += !parts->seen[i];
        parts->seen[i] = 1;
    }
}

bool frames_stale(int32_t sequence, int64_t utime, int32_t newest, int64_t newest_utime, int most)
{
    int32_t ahead = (int32_t)((uint32_t)sequence - (uint32_t)newest);
    return ahead < 0 && ahead >= -most && utime <= newest_utime;
}

static bool nodes_valid(const pliant_nodes_t *chunk)
{
    return chunk->node_count >= 1 && chunk->node_count <= FRAMES_NODES_MAX && chunk->chunk >= 0 &&
           chunk->chunk < chunk->chunk_count && chunk->chunk_count <= chunk->node_count &&
           chunk->num_values >= 3 && chunk->num_values % 3 == 0 &&
           range_inside(chunk->first, chunk->num_values / 3, chunk->node_count);
}

enum { LOST_MOST = 1 << 16 };

static void nodes_begin(NodesFrame *frame, const pliant_nodes_t *chunk)
{
    // Count missing frames too; after a longer silence the daemon is another one.
    int32_t ahead = (int32_t)((uint32_t)chunk->sequence - (uint32_t)frame->sequence);
    if (frame->started)
        frame->lost += !frame->whole + (ahead > 1 && ahead <= LOST_MOST ? ahead - 1 : 0);
    // Memory only when the size changes.
    if (!frame->position || frame->node_count != chunk->node_count) {
        free(frame->position);
        frame->position = frames_allocate(3 * (size_t)chunk->node_count, sizeof(float));
    }
    // What all its chunks must say alike.
    parts_begin(&frame->nodes, chunk->node_count);
    frame->utime = chunk->utime;
    frame->step = chunk->step;
    frame->time = chunk->time;
    frame->sequence = chunk->sequence;
    frame->topology = chunk->topology;
    frame->chunk_count = chunk->chunk_count;
    frame->node_count = chunk->node_count;
    frame->started = true;
    frame->whole = false;
}

static FramesResult nodes_take(NodesFrame *frame, const pliant_nodes_t *chunk)
{
    // What contradicts itself or is old is refused.
    if (!nodes_valid(chunk))
        return FRAMES_REFUSED;
    if (frame->started &&
        frames_stale(chunk->sequence, chunk->utime, frame->sequence, frame->utime, STALE_FRAMES))
        return FRAMES_STALE;
    // The first chunk of another frame, or one more of this.
    if (!frame->started || chunk->sequence != frame->sequence)
        nodes_begin(frame, chunk);
    else if (chunk->node_count != frame->node_count || chunk->topology != frame->topology ||
             chunk->chunk_count != frame->chunk_count || chunk->step != frame->step)
        return FRAMES_REFUSED;
    else if (frame->whole)
        return FRAMES_STALE; // a repeated chunk must not change a completed frame
    // Copy what it has, wherever it belongs.
    memcpy(frame->position + 3 * (size_t)chunk->first, chunk->position,
           sizeof(float) * (size_t)chunk->num_values);
    parts_mark(&frame->nodes, chunk->first, chunk->num_values / 3);
    frame->whole = parts_whole(&frame->nodes);
    return frame->whole ? FRAMES_WHOLE : FRAMES_MORE;
}

FramesResult nodes_frame_add(NodesFrame *frame, const void *data, size_t size)
{
    pliant_nodes_t chunk;
    FramesResult result = FRAMES_REFUSED;
    if (wire_check(&WIRE_NODES, data, size) &&
        pliant_nodes_t_decode(data, 0, (int)size, &chunk) >= 0) {
        result = nodes_take(frame, &chunk);
        pliant_nodes_t_decode_cleanup(&chunk);
    }
    frame->refused += result == FRAMES_REFUSED;
    return result;
}

void nodes_frame_destroy(NodesFrame *frame)
{
    free(frame->position);
    free(frame->nodes.seen);
    *frame = (NodesFrame){0};
}

// --- rest positions ------------------------------------------------------------------------------

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
    // Given up for a newer one, if it was not whole.
    frame->lost += frame->started && !frame->whole;
    size_t nodes = (size_t)chunk->node_count;
    if (!frame->position || frame->node_count != chunk->node_count) {
        free(frame->position);
        free(frame->texture);
        frame->position = frames_allocate(3 * nodes, sizeof(float));
        frame->texture = frames_allocate(2 * nodes, sizeof(float));
    }
    // Nodes without texture have zeros.
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
    // What contradicts itself or is old is refused.
    if (!rest_valid(chunk))
        return FRAMES_REFUSED;
    if (frame->started &&
        frames_stale(chunk->sequence, chunk->utime, frame->sequence, frame->utime, STALE_MESHES))
        return FRAMES_STALE;
    // The first chunk of another message, or one more of this.
    if (!frame->started || chunk->sequence != frame->sequence)
        rest_begin(frame, chunk);
    else if (chunk->node_count != frame->node_count || chunk->topology != frame->topology ||
             chunk->chunk_count != frame->chunk_count ||
             (chunk->num_coordinates > 0) != frame->textured)
        return FRAMES_REFUSED;
    else if (frame->whole)
        return FRAMES_STALE; // a repeated chunk must not change completed data
    // Copy what it has, wherever it belongs.
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
