// SPDX-License-Identifier: MIT
// Assembles chunked frames of node positions, rest positions and texture coordinates. One thread.
#include "frames_parts.h"

#include "wire.h"

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

// A chunk or a packet: nodes from `first` on, of one frame.
typedef struct NodesPart {
    int64_t utime, step;
    double time;
    int32_t sequence, topology, node_count, first, count;
    int32_t chunk_count; // 0: a packet
    const float *position;
} NodesPart;

static bool nodes_valid(const pliant_nodes_t *chunk)
{
    return chunk->node_count >= 1 && chunk->node_count <= FRAMES_NODES_MAX && chunk->chunk >= 0 &&
           chunk->chunk < chunk->chunk_count && chunk->chunk_count <= chunk->node_count &&
           chunk->num_values >= 3 && chunk->num_values % 3 == 0 &&
           range_inside(chunk->first, chunk->num_values / 3, chunk->node_count);
}

enum { LOST_MOST = 1 << 16 };

// Forgets the nodes and takes memory for others; the counts stay.
static bool nodes_resize(NodesFrame *frame, int count)
{
    const NodesFrame old = *frame;
    const size_t nodes = (size_t)count;
    nodes_frame_destroy(frame);
    *frame = (NodesFrame){.lost = old.lost, .refused = old.refused, .mesh_nodes = old.mesh_nodes};
    if (!frames_claim(&frame->held, nodes * (3 * sizeof(float) + sizeof(int32_t) + 2)))
        return false;
    frame->position = frames_allocate(3 * nodes, sizeof(float));
    frame->frame = frames_allocate(nodes, sizeof(int32_t));
    return frame->position && frame->frame;
}

// False if there is no memory: the frame is empty then.
static bool nodes_begin(NodesFrame *frame, const NodesPart *part)
{
    // Count missing frames too; after a longer silence the daemon is another one.
    int32_t ahead = (int32_t)((uint32_t)part->sequence - (uint32_t)frame->sequence);
    if (frame->started)
        frame->lost += !frame->whole + (ahead > 1 && ahead <= LOST_MOST ? ahead - 1 : 0);
    // Memory only when the size changes. Another mesh, or another daemon: what was known is of
    // other nodes.
    bool resized = !frame->position || frame->node_count != part->node_count;
    bool other = resized || frame->topology != part->topology || ahead <= 0 || ahead > LOST_MOST;
    if ((resized && !nodes_resize(frame, part->node_count)) ||
        (other && !parts_begin(&frame->known, part->node_count)) ||
        !parts_begin(&frame->nodes, part->node_count)) {
        nodes_resize(frame, 0);
        return false;
    }
    // What all its parts must say alike.
    frame->utime = part->utime;
    frame->step = part->step;
    frame->time = part->time;
    frame->sequence = part->sequence;
    frame->topology = part->topology;
    frame->chunk_count = 0;
    frame->node_count = part->node_count;
    frame->started = true;
    frame->whole = frame->ready = false;
    return true;
}

// Copies the nodes that the frame does not have yet, or all.
static void nodes_copy(NodesFrame *frame, const NodesPart *part, bool all)
{
    for (int k = 0; k < part->count; k++) {
        int i = part->first + k;
        if (!all && frame->nodes.seen[i])
            continue;
        memcpy(frame->position + 3 * (size_t)i, part->position + 3 * (size_t)k, 3 * sizeof(float));
        frame->frame[i] = part->sequence;
    }
    parts_mark(&frame->nodes, part->first, part->count);
    parts_mark(&frame->known, part->first, part->count);
}

static FramesResult nodes_take(NodesFrame *frame, const NodesPart *part)
{
    const bool packet = part->chunk_count == 0;
    if (frame->started &&
        frames_stale(part->sequence, part->utime, frame->sequence, frame->utime, STALE_FRAMES))
        return FRAMES_STALE;
    // The first part of another frame, or one more of this.
    if (!frame->started || part->sequence != frame->sequence) {
        if (!nodes_paid(part->node_count, frame->mesh_nodes) || !nodes_begin(frame, part))
            return FRAMES_REFUSED;
    } else if (part->node_count != frame->node_count || part->topology != frame->topology ||
               part->step != frame->step ||
               (!packet && frame->chunk_count != 0 && part->chunk_count != frame->chunk_count)) {
        return FRAMES_REFUSED;
    } else if (frame->whole) {
        return FRAMES_STALE; // a repeated part must not change a completed frame
    }
    if (!packet)
        frame->chunk_count = part->chunk_count;
    nodes_copy(frame, part, !packet);
    frame->whole = parts_whole(&frame->nodes);
    // The last packet ends a frame whether or not all have come.
    bool last = packet && part->first + part->count == part->node_count;
    frame->ready |= frame->whole || (last && parts_whole(&frame->known));
    if (frame->whole)
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
    if (nodes_valid(&chunk)) {
        const NodesPart part = {.utime = chunk.utime,
                                .step = chunk.step,
                                .time = chunk.time,
                                .sequence = chunk.sequence,
                                .topology = chunk.topology,
                                .node_count = chunk.node_count,
                                .first = chunk.first,
                                .count = chunk.num_values / 3,
                                .chunk_count = chunk.chunk_count,
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
    if (packet.node_count >= 1 && packet.node_count <= FRAMES_NODES_MAX && packet.count >= 1 &&
        packet.count <= PACKET_NODES &&
        range_inside(packet.first, packet.count, packet.node_count) && packet.grid > 0.0f &&
        points_read(&packet, position)) {
        const NodesPart part = {.utime = packet.utime,
                                .step = packet.step,
                                .time = packet.time,
                                .sequence = packet.sequence,
                                .topology = packet.topology,
                                .node_count = packet.node_count,
                                .first = packet.first,
                                .count = packet.count,
                                .position = position};
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
    frame->refused += result == FRAMES_REFUSED;
    return result;
}

void nodes_frame_destroy(NodesFrame *frame)
{
    free(frame->position);
    free(frame->frame);
    free(frame->nodes.seen);
    free(frame->known.seen);
    frames_claim(&frame->held, 0);
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

// Takes memory for a message, zeroed: nodes without texture have zeros. False if there is none.
static bool rest_allocate(RestFrame *frame, int count)
{
    const RestFrame old = *frame;
    const size_t nodes = (size_t)count;
    rest_frame_destroy(frame);
    *frame = (RestFrame){.lost = old.lost, .refused = old.refused, .mesh_nodes = old.mesh_nodes};
    if (!frames_claim(&frame->held, nodes * (5 * sizeof(float) + 1)))
        return false;
    frame->position = frames_allocate(3 * nodes, sizeof(float));
    frame->texture = frames_allocate(2 * nodes, sizeof(float));
    return frame->position && frame->texture && parts_begin(&frame->nodes, count);
}

static bool rest_begin(RestFrame *frame, const pliant_rest_t *chunk)
{
    // Given up for a newer one, if it was not whole.
    frame->lost += frame->started && !frame->whole;
    if (!rest_allocate(frame, chunk->node_count)) {
        rest_allocate(frame, 0);
        return false;
    }
    frame->utime = chunk->utime;
    frame->sequence = chunk->sequence;
    frame->topology = chunk->topology;
    frame->chunk_count = chunk->chunk_count;
    frame->node_count = chunk->node_count;
    frame->textured = chunk->num_coordinates > 0;
    frame->started = true;
    frame->whole = false;
    return true;
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
    if (!frame->started || chunk->sequence != frame->sequence) {
        if (!nodes_paid(chunk->node_count, frame->mesh_nodes) || !rest_begin(frame, chunk))
            return FRAMES_REFUSED;
    } else if (chunk->node_count != frame->node_count || chunk->topology != frame->topology ||
               chunk->chunk_count != frame->chunk_count ||
               (chunk->num_coordinates > 0) != frame->textured) {
        return FRAMES_REFUSED;
    } else if (frame->whole) {
        return FRAMES_STALE; // a repeated chunk must not change completed data
    }
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
    frames_claim(&frame->held, 0);
    *frame = (RestFrame){0};
}
