// Puts chunked meshes and frames of node positions together again. One thread.
#include "frames.h"
#include "wire.h"

#include <stdlib.h>
#include <string.h>

#include "pliant_mesh_t.h"
#include "pliant_nodes_t.h"

// How far behind a sequence may be to count as late.
enum { STALE_FRAMES = 64 };

static void *allocate(size_t count, size_t size)
{
    void *memory = calloc(count ? count : 1, size);
    if (!memory)
        abort(); // the counts are bounded: the machine itself is out of memory
    return memory;
}

static void parts_begin(FramesParts *parts, int count)
{
    free(parts->seen);
    *parts = (FramesParts){.seen = allocate((size_t)count, 1), .count = count};
}

static void parts_mark(FramesParts *parts, int first, int count)
{
    for (int i = first; i < first + count; i++) {
        parts->arrived += !parts->seen[i];
        parts->seen[i] = 1;
    }
}

static bool parts_whole(const FramesParts *parts)
{
    return parts->arrived == parts->count;
}

static bool range_inside(int32_t first, int32_t count, int32_t limit)
{
    return first >= 0 && count >= 0 && first <= limit && count <= limit - first;
}

// Older by number and by clock: a daemon that starts anew counts from 0 with a later clock.
static bool is_stale(int32_t sequence, int64_t utime, int32_t newest, int64_t newest_utime)
{
    int32_t ahead = (int32_t)((uint32_t)sequence - (uint32_t)newest);
    return ahead < 0 && ahead >= -STALE_FRAMES && utime <= newest_utime;
}

static bool nodes_valid(const pliant_nodes_t *chunk)
{
    return chunk->node_count >= 1 && chunk->node_count <= FRAMES_NODES_MAX && chunk->chunk >= 0 &&
           chunk->chunk < chunk->chunk_count && chunk->chunk_count <= chunk->node_count &&
           chunk->num_values >= 3 && chunk->num_values % 3 == 0 &&
           range_inside(chunk->first, chunk->num_values / 3, chunk->node_count);
}

static void nodes_begin(NodesFrame *frame, const pliant_nodes_t *chunk)
{
    frame->lost += frame->started && !frame->whole;
    if (!frame->position || frame->node_count != chunk->node_count) {
        free(frame->position);
        frame->position = allocate(3 * (size_t)chunk->node_count, sizeof(float));
    }
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
    if (!nodes_valid(chunk))
        return FRAMES_REFUSED;
    if (frame->started && is_stale(chunk->sequence, chunk->utime, frame->sequence, frame->utime))
        return FRAMES_STALE;
    if (!frame->started || chunk->sequence != frame->sequence)
        nodes_begin(frame, chunk);
    else if (chunk->node_count != frame->node_count || chunk->topology != frame->topology ||
             chunk->chunk_count != frame->chunk_count || chunk->step != frame->step)
        return FRAMES_REFUSED;
    else if (frame->whole)
        return FRAMES_STALE; // a repeated chunk must not change a frame already handed out
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

static bool mesh_valid(const pliant_mesh_t *chunk)
{
    if (chunk->node_count < 1 || chunk->node_count > FRAMES_NODES_MAX ||
        chunk->triangle_count < 0 || chunk->triangle_count > FRAMES_TRIANGLES_MAX ||
        chunk->chunk < 0 || chunk->chunk >= chunk->chunk_count ||
        chunk->chunk_count > chunk->node_count + chunk->triangle_count ||
        chunk->num_indices % 3 != 0 || chunk->num_parents != 2 * (int64_t)chunk->num_nodes ||
        !range_inside(chunk->first_triangle, chunk->num_indices / 3, chunk->triangle_count) ||
        !range_inside(chunk->first_node, chunk->num_nodes, chunk->node_count))
        return false;
    for (int k = 0; k < chunk->num_indices; k++) {
        if (chunk->triangle[k] < 0 || chunk->triangle[k] >= chunk->node_count)
            return false;
    }
    return true;
}

static void mesh_begin(MeshFrame *frame, const pliant_mesh_t *chunk)
{
    frame->lost += frame->started && !frame->whole;
    free(frame->triangle);
    free(frame->id);
    frame->triangle = allocate(3 * (size_t)chunk->triangle_count, sizeof(int32_t));
    frame->id = allocate((size_t)chunk->node_count, sizeof(int32_t));
    parts_begin(&frame->nodes, chunk->node_count);
    parts_begin(&frame->triangles, chunk->triangle_count);
    frame->utime = chunk->utime;
    frame->sequence = chunk->sequence;
    frame->topology = chunk->topology;
    frame->chunk_count = chunk->chunk_count;
    frame->node_count = chunk->node_count;
    frame->triangle_count = chunk->triangle_count;
    frame->started = true;
    frame->whole = false;
}

static FramesResult mesh_take(MeshFrame *frame, const pliant_mesh_t *chunk)
{
    if (!mesh_valid(chunk))
        return FRAMES_REFUSED;
    if (frame->started && is_stale(chunk->sequence, chunk->utime, frame->sequence, frame->utime))
        return FRAMES_STALE;
    if (!frame->started || chunk->sequence != frame->sequence)
        mesh_begin(frame, chunk);
    else if (chunk->node_count != frame->node_count ||
             chunk->triangle_count != frame->triangle_count || chunk->topology != frame->topology ||
             chunk->chunk_count != frame->chunk_count)
        return FRAMES_REFUSED;
    else if (frame->whole)
        return FRAMES_STALE;
    // An empty array's pointer may be null, which memcpy must not see.
    if (chunk->num_indices)
        memcpy(frame->triangle + 3 * (size_t)chunk->first_triangle, chunk->triangle,
               sizeof(int32_t) * (size_t)chunk->num_indices);
    if (chunk->num_nodes)
        memcpy(frame->id + chunk->first_node, chunk->id,
               sizeof(int32_t) * (size_t)chunk->num_nodes);
    parts_mark(&frame->triangles, chunk->first_triangle, chunk->num_indices / 3);
    parts_mark(&frame->nodes, chunk->first_node, chunk->num_nodes);
    frame->whole = parts_whole(&frame->nodes) && parts_whole(&frame->triangles);
    return frame->whole ? FRAMES_WHOLE : FRAMES_MORE;
}

FramesResult mesh_frame_add(MeshFrame *frame, const void *data, size_t size)
{
    pliant_mesh_t chunk;
    FramesResult result = FRAMES_REFUSED;
    if (wire_check(&WIRE_MESH, data, size) &&
        pliant_mesh_t_decode(data, 0, (int)size, &chunk) >= 0) {
        result = mesh_take(frame, &chunk);
        pliant_mesh_t_decode_cleanup(&chunk);
    }
    frame->refused += result == FRAMES_REFUSED;
    return result;
}

void mesh_frame_destroy(MeshFrame *frame)
{
    free(frame->triangle);
    free(frame->id);
    free(frame->nodes.seen);
    free(frame->triangles.seen);
    *frame = (MeshFrame){0};
}
