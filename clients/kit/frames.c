// SPDX-License-Identifier: MIT
// Assembles chunked frames: what all of them have in common, node positions, rest positions and
// texture coordinates. One thread.
#include "frames_parts.h"

#include "pliant_nodes_t.h"
#include "pliant_points_t.h"
#include "pliant_rest_t.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

void *frames_allocate(size_t count, size_t size)
{
    return calloc(count ? count : 1, size);
}

bool frames_claim(size_t *held, size_t bytes)
{
    static atomic_size_t claimed;      // by all frames of the process, whichever thread has them
    const size_t more = bytes - *held; // wraps if it becomes less, and so does the sum
    if (atomic_fetch_add(&claimed, more) + more > FRAMES_BYTES_MAX && bytes > *held) {
        atomic_fetch_sub(&claimed, more);
        return false;
    }
    *held = bytes;
    return true;
}

bool parts_begin(FramesParts *parts, int count)
{
    free(parts->seen);
    *parts = (FramesParts){.seen = frames_allocate((size_t)count, 1), .count = count};
    return parts->seen != NULL;
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

// --- frames with a row for each node or square ---------------------------------------------------

FramesResult frame_judge(const FrameHead *head, const FrameChunk *chunk)
{
    if (chunk->count > FRAMES_NODES_MAX || !range_inside(chunk->first, chunk->rows, chunk->count))
        return FRAMES_REFUSED;
    if (head->started &&
        frames_stale(chunk->sequence, chunk->utime, head->sequence, head->utime, chunk->late))
        return FRAMES_STALE;
    if (frame_changes(head, chunk))
        return nodes_paid(chunk->nodes, head->mesh_nodes) ? FRAMES_MORE : FRAMES_REFUSED;
    const bool counted = chunk->chunk_count != 0 && head->chunk_count != 0;
    if (chunk->count != head->count || chunk->topology != head->topology ||
        chunk->alike != head->alike || (counted && chunk->chunk_count != head->chunk_count))
        return FRAMES_REFUSED;
    return head->whole ? FRAMES_STALE : FRAMES_MORE; // what is complete must not change
}

void frame_forget(FrameHead *head)
{
    free(head->array[0]);
    free(head->array[1]);
    free(head->parts.seen);
    frames_claim(&head->held, 0);
    *head =
        (FrameHead){.lost = head->lost, .refused = head->refused, .mesh_nodes = head->mesh_nodes};
}

bool frame_resize(FrameHead *head, const FrameChunk *chunk, size_t marks)
{
    const size_t count = chunk->rows > 0 ? (size_t)chunk->count : 0;
    frame_forget(head);
    bool ok = frames_claim(&head->held, count * (chunk->size[0] + chunk->size[1] + marks));
    for (int k = 0; k < 2 && ok && count * chunk->size[k] > 0; k++) {
        head->array[k] = frames_allocate(count, chunk->size[k]);
        ok = head->array[k] != NULL;
    }
    return ok;
}

bool frame_begin(FrameHead *head, const FrameChunk *chunk)
{
    head->utime = chunk->utime;
    head->sequence = chunk->sequence;
    head->topology = chunk->topology;
    head->chunk_count = chunk->chunk_count;
    head->count = chunk->count;
    head->alike = chunk->alike;
    head->started = true;
    head->whole = false;
    return parts_begin(&head->parts, chunk->rows > 0 ? chunk->count : 0);
}

FramesResult frame_take(FrameHead *head, const FrameChunk *chunk)
{
    const FramesResult judged = frame_judge(head, chunk);
    if (judged != FRAMES_MORE)
        return judged;
    if (frame_changes(head, chunk)) {
        // Given up for a newer one, if it was not whole.
        head->lost += head->started && !head->whole;
        if (!frame_resize(head, chunk, 1) || !frame_begin(head, chunk)) {
            frame_forget(head);
            return FRAMES_REFUSED;
        }
    }
    // Copy what it has, wherever it belongs.
    for (int k = 0; k < 2 && chunk->rows > 0; k++) {
        const size_t size = chunk->size[k];
        if (chunk->from[k])
            memcpy((char *)head->array[k] + size * (size_t)chunk->first, chunk->from[k],
                   size * (size_t)chunk->rows);
    }
    parts_mark(&head->parts, chunk->first, chunk->rows);
    head->whole = parts_whole(&head->parts);
    return head->whole ? FRAMES_WHOLE : FRAMES_MORE;
}

// --- positions -----------------------------------------------------------------------------------

// A chunk or a packet: nodes from `first` on, of one frame; `alike` is its step.
typedef struct NodesPart {
    FrameChunk chunk;
    double time;
    const float *position;
} NodesPart;

#define NODES_SAY(message, number)                                                                 \
    .utime = (message)->utime, .sequence = (message)->sequence, .topology = (message)->topology,   \
    .count = (message)->node_count, .nodes = (message)->node_count, .first = (message)->first,     \
    .rows = (number), .alike = (message)->step, .late = STALE_FRAMES,                              \
    .size = {3 * sizeof(float), sizeof(int32_t)}

enum { LOST_MOST = 1 << 16 };

// False if there is no memory: the frame is empty then.
static bool nodes_begin(NodesFrame *frame, const NodesPart *part)
{
    FrameHead *head = &frame->head;
    const FrameChunk *chunk = &part->chunk;
    // Count missing frames too; after a longer silence the daemon is another one.
    int32_t ahead = (int32_t)((uint32_t)chunk->sequence - (uint32_t)head->sequence);
    if (head->started)
        head->lost += !head->whole + (ahead > 1 && ahead <= LOST_MOST ? ahead - 1 : 0);
    // Memory only when the size changes. Another mesh, or another daemon: what was known is of
    // other nodes.
    bool resized = !head->array[0] || head->count != chunk->count;
    bool other = resized || head->topology != chunk->topology || ahead <= 0 || ahead > LOST_MOST;
    if ((resized && !frame_resize(head, chunk, 2)) ||
        (other && !parts_begin(&frame->known, chunk->count)) || !frame_begin(head, chunk)) {
        frame_forget(head);
        free(frame->known.seen);
        *frame = (NodesFrame){.head = *head};
        return false;
    }
    frame->step = chunk->alike;
    frame->time = part->time;
    frame->position = head->array[0];
    frame->frame = head->array[1];
    frame->ready = false;
    return true;
}

// Copies the nodes that the frame does not have yet, or all.
static void nodes_copy(NodesFrame *frame, const NodesPart *part, bool all)
{
    const FrameChunk *chunk = &part->chunk;
    for (int k = 0; k < chunk->rows; k++) {
        int i = chunk->first + k;
        if (!all && frame->head.parts.seen[i])
            continue;
        memcpy(frame->position + 3 * (size_t)i, part->position + 3 * (size_t)k, 3 * sizeof(float));
        frame->frame[i] = chunk->sequence;
    }
    parts_mark(&frame->head.parts, chunk->first, chunk->rows);
    parts_mark(&frame->known, chunk->first, chunk->rows);
}

static FramesResult nodes_take(NodesFrame *frame, const NodesPart *part)
{
    FrameHead *head = &frame->head;
    const FrameChunk *chunk = &part->chunk;
    const bool packet = chunk->chunk_count == 0;
    const FramesResult judged = frame_judge(head, chunk);
    if (judged != FRAMES_MORE)
        return judged;
    if (frame_changes(head, chunk) && !nodes_begin(frame, part))
        return FRAMES_REFUSED;
    if (!packet)
        head->chunk_count = chunk->chunk_count;
    nodes_copy(frame, part, !packet);
    head->whole = parts_whole(&head->parts);
    // The last packet ends a frame whether or not all have come.
    bool last = packet && chunk->first + chunk->rows == chunk->count;
    frame->ready |= head->whole || (last && parts_whole(&frame->known));
    if (head->whole)
        return FRAMES_WHOLE;
    return last && frame->ready ? FRAMES_PATCHED : FRAMES_MORE;
}

static FramesResult nodes_take_chunk(NodesFrame *frame, const void *data, size_t size)
{
    pliant_nodes_t chunk;
    FramesResult result = FRAMES_REFUSED;
    if (pliant_nodes_t_decode(data, 0, (int)size, &chunk) < 0)
        return result;
    // What contradicts itself is refused.
    if (chunk_is_one_of(chunk.chunk, chunk.chunk_count, chunk.node_count) &&
        chunk.num_values >= 3 && chunk.num_values % 3 == 0) {
        const NodesPart part = {
            .chunk = {NODES_SAY(&chunk, chunk.num_values / 3), .chunk_count = chunk.chunk_count},
            .time = chunk.time,
            .position = chunk.position};
        result = nodes_take(frame, &part);
    }
    pliant_nodes_t_decode_cleanup(&chunk);
    return result;
}

// --- packets ---

enum { PACKET_NODES = 1024, GROUP_NODES = 8, WIDTH_BITS = 5 };

typedef struct BitReader {
    const uint8_t *data;
    int64_t size, at; // [bytes]; beyond the end are zeros, and `at` tells that it was passed
    uint64_t held;    // its low bits are not read yet:
    int held_bits;
} BitReader;

// Reads up to 31 bits.
static uint32_t bits_read(BitReader *reader, int width)
{
    while (reader->held_bits < width) {
        uint32_t byte = reader->at < reader->size ? reader->data[reader->at] : 0u;
        reader->held = reader->held << 8 | byte;
        reader->held_bits += 8;
        reader->at++;
    }
    reader->held_bits -= width;
    return (uint32_t)(reader->held >> reader->held_bits & ((UINT64_C(1) << width) - 1));
}

// Reads the positions of a packet; returns false if its bits are not exactly those of its nodes, or
// a position is not finite.
static bool points_read(const pliant_points_t *packet, float *position)
{
    BitReader reader = {.data = (const uint8_t *)packet->data, .size = packet->num_bytes};
    int64_t at[3] = {packet->origin[0], packet->origin[1], packet->origin[2]};
    int width[3] = {0};
    for (int i = 0; i < packet->count; i++) {
        for (int k = 0; k < 3 && i % GROUP_NODES == 0; k++)
            width[k] = (int)bits_read(&reader, WIDTH_BITS);
        for (int k = 0; k < 3; k++) {
            uint32_t u = bits_read(&reader, width[k]);
            at[k] += u & 1u ? -(int64_t)(u / 2u) - 1 : (int64_t)(u / 2u);
            float x = (float)((double)at[k] * (double)packet->grid);
            if (x - x != 0.0f)
                return false;
            position[3 * i + k] = x;
        }
    }
    return reader.at == reader.size;
}

static FramesResult nodes_take_packet(NodesFrame *frame, const void *data, size_t size)
{
    pliant_points_t packet;
    float position[3 * PACKET_NODES];
    FramesResult result = FRAMES_REFUSED;
    if (pliant_points_t_decode(data, 0, (int)size, &packet) < 0)
        return result;
    // What contradicts itself is refused before any of it is used.
    if (packet.count >= 1 && packet.count <= PACKET_NODES && packet.grid > 0.0f &&
        points_read(&packet, position)) {
        const NodesPart part = {
            .chunk = {NODES_SAY(&packet, packet.count)}, .time = packet.time, .position = position};
        result = nodes_take(frame, &part);
    }
    pliant_points_t_decode_cleanup(&packet);
    return result;
}

FramesResult nodes_frame_add(NodesFrame *frame, const void *data, size_t size)
{
    FramesResult result = FRAMES_REFUSED;
    if (wire_check(&WIRE_NODES, data, size))
        result = nodes_take_chunk(frame, data, size);
    else if (wire_check(&WIRE_POINTS, data, size))
        result = nodes_take_packet(frame, data, size);
    frame->head.refused += result == FRAMES_REFUSED;
    return result;
}

void nodes_frame_destroy(NodesFrame *frame)
{
    frame_forget(&frame->head);
    free(frame->known.seen);
    *frame = (NodesFrame){0};
}

// --- rest positions ------------------------------------------------------------------------------

static FramesResult rest_take(RestFrame *frame, const pliant_rest_t *chunk)
{
    const bool textured = chunk->num_coordinates > 0;
    const FrameChunk from = {CHUNK_SAYS(chunk, node_count),
                             .rows = chunk->num_values / 3,
                             .alike = textured,
                             .nodes = chunk->node_count,
                             .from = {chunk->position, textured ? chunk->texture : NULL},
                             .size = {3 * sizeof(float), 2 * sizeof(float)}};
    // What contradicts itself is refused.
    if (!chunk_is_one_of(chunk->chunk, chunk->chunk_count, chunk->node_count) ||
        chunk->num_values < 3 || chunk->num_values % 3 != 0 ||
        (chunk->num_coordinates != 0 &&
         3 * (int64_t)chunk->num_coordinates != 2 * (int64_t)chunk->num_values))
        return FRAMES_REFUSED;
    const FramesResult result = frame_take(&frame->head, &from);
    frame->position = frame->head.array[0];
    frame->texture = frame->head.array[1];
    frame->textured = frame->head.alike;
    return result;
}

FRAME_FUNCTIONS(rest, RestFrame, WIRE_REST, rest_take)
