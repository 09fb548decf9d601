// SPDX-License-Identifier: MIT
// Looks: before each whole mesh, and soon after the mesh changed where nodes differ in colour.
#include "run/bus_parts.h"

#include "base/clock.h"

#include "pliant_look_t.h"

#include <string.h>

// The memory of one chunk's message.
struct LookChunk {
    unsigned char outside[NODES_IN_LOOK_CHUNK][3], inside[NODES_IN_LOOK_CHUNK][3];
};

// Between two looks of a mesh that changes all the time: half the bytes of its positions at 60 Hz.
static const int64_t AGAIN_NS = 100000000;

void bus_create_look_stream(Bus *bus, int index, Arena *arena)
{
    const Body *body = sim_body(bus->sim, index);
    // One scratch message serves all bodies.
    if (look_is_by_node(body) && bus->look_chunk == NULL)
        bus->look_chunk =
            arena_allocate(arena, ARENA_OUTPUT, 1, sizeof *bus->look_chunk, "run/look_chunk");
}

// Returns the nodes that have colours of their own.
static int coloured_nodes(const Bus *bus, int index)
{
    const BodyStream *stream = &bus->body[index];
    return look_is_by_node(sim_body(bus->sim, index)) && stream->rest != NULL
               ? stream->mesh.node_count
               : 0;
}

int bus_look_chunks(const Bus *bus, int index)
{
    if (sim_body(bus->sim, index)->look == NULL)
        return 0;
    const int nodes = coloured_nodes(bus, index);
    return nodes > 0 ? chunks_of(nodes, NODES_IN_LOOK_CHUNK) : 1;
}

void bus_start_look(Bus *bus, int index)
{
    BodyStream *stream = &bus->body[index];
    stream->look = (Pace){0};
    stream->look_wanted = false;
    bus->channel[OUT_LOOK][index].sequence++;
}

void bus_send_look_chunk(Bus *bus, int index, int chunk)
{
    const BodyStream *stream = &bus->body[index];
    const BodyLook *look = sim_body(bus->sim, index)->look;
    const int chunks = bus_look_chunks(bus, index), nodes = coloured_nodes(bus, index);
    const int first = chunk_begin(nodes, chunk, chunks),
              end = chunk_begin(nodes, chunk + 1, chunks);
    pliant_look_t message = {.utime = clock_utime(),
                             .sequence = (int32_t)bus->channel[OUT_LOOK][index].sequence,
                             .topology = stream->mesh.topology,
                             .node_count = stream->mesh.node_count,
                             .chunk = chunk,
                             .chunk_count = chunks,
                             .texture = (char *)(uintptr_t)look->texture,
                             .first = first,
                             .num_values = 3 * (end - first)};
    memcpy(message.color, look->usual.outside, sizeof message.color);
    memcpy(message.inside, look->usual.inside, sizeof message.inside);
    if (nodes > 0) {
        LookChunk *memory = bus->look_chunk;
        for (int i = first; i < end; i++) {
            const LookColours colours =
                stream->mesh.id[i] < 0 ? look->usual : rest_colours(stream->rest, look, i);
            memcpy(memory->outside[i - first], colours.outside, sizeof *memory->outside);
            memcpy(memory->inside[i - first], colours.inside, sizeof *memory->inside);
        }
        message.node_color = *memory->outside;
        message.node_inside = *memory->inside;
    }
    bus_publish(bus, OUT_LOOK, index, &message);
}

void bus_renew_look(Bus *bus, int index)
{
    BodyStream *stream = &bus->body[index];
    if (bus->look_chunk == NULL || coloured_nodes(bus, index) == 0)
        return;
    // What is under way is of the mesh before.
    stream->look = (Pace){0};
    stream->look_wanted = true;
}

void bus_send_looks(Bus *bus, int64_t now_ns)
{
    if (bus->look_chunk == NULL)
        return;
    for (int i = 0; i < sim_body_count(bus->sim); i++) {
        BodyStream *stream = &bus->body[i];
        // Behind the mesh that it is of; a whole one brings its own.
        if (stream->look_wanted && !pace_is_under_way(&stream->delta_pace) &&
            !pace_is_under_way(&stream->whole) && now_ns >= stream->look_next_ns) {
            bus_start_look(bus, i);
            stream->look_next_ns = now_ns + AGAIN_NS;
            // Before the next mesh, as a delta.
            pace_start(&stream->look, bus_look_chunks(bus, i), 4.0 * bus->scene->publish.nodes_hz,
                       now_ns);
        }
        while (pace_is_due(&stream->look, now_ns)) {
            bus_send_look_chunk(bus, i, stream->look.next);
            stream->look.next++;
        }
    }
}

int64_t bus_next_look_ns(const BodyStream *stream)
{
    const bool waits = stream->look_wanted && !pace_is_under_way(&stream->delta_pace) &&
                       !pace_is_under_way(&stream->whole);
    return waits ? stream->look_next_ns : pace_next_ns(&stream->look);
}
