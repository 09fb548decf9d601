// Rest positions and texture coordinates of the published mesh; they follow each whole mesh in
// scenes with publish.rest.
#include "run/bus_parts.h"

#include "base/clock.h"

#include "pliant_rest_t.h"

#include <stdio.h>

void bus_create_rest_stream(Bus *bus, int index, Arena *arena)
{
    BodyStream *stream = &bus->body[index];
    const Body *body = sim_body(bus->sim, index);
    if (!bus->scene->publish.rest || !rest_is_known(body))
        return;
    snprintf(stream->rest_channel, 2 * CHANNEL_MAX, "%s_REST_%s", bus->scene->prefix, body->name);
    stream->rest = arena_allocate(arena, ARENA_OUTPUT, 1, rest_copy_bytes(&body->mesh),
                                  "run/rest_%s", body->name);
    rest_copy_follow(stream->rest, body);
    if (body->texture != NULL && bus->texture == NULL)
        bus->texture = arena_allocate(arena, ARENA_OUTPUT, 2 * (size_t)NODES_IN_REST_CHUNK,
                                      sizeof *bus->texture, "run/texture_chunk");
}

int bus_rest_chunks(const BodyStream *stream)
{
    return stream->rest == NULL ? 0 : chunks_of(stream->mesh.node_count, NODES_IN_REST_CHUNK);
}

void bus_send_rest_chunk(Bus *bus, int index, int chunk)
{
    const BodyStream *stream = &bus->body[index];
    const Body *body = sim_body(bus->sim, index); // only its constant members are read
    const RestCopy *rest = stream->rest;
    const int chunks = bus_rest_chunks(stream);
    const int first = chunk_begin(rest->node_count, chunk, chunks);
    const int end = chunk_begin(rest->node_count, chunk + 1, chunks);
    pliant_rest_t message = {.utime = clock_utime(),
                             .sequence = (int32_t)stream->mesh_sequence,
                             .topology = rest->topology,
                             .node_count = rest->node_count,
                             .chunk = chunk,
                             .chunk_count = chunks,
                             .first = first,
                             .num_values = 3 * (end - first),
                             .position = (float *)(uintptr_t)(rest->position + 3L * first)};
    if (body->texture != NULL) {
        rest_texture(body, &stream->mesh, first, end, bus->texture);
        message.num_coordinates = 2 * (end - first);
        message.texture = bus->texture;
    }
    bus_count_published(bus, pliant_rest_t_publish(bus->lcm, stream->rest_channel, &message));
}
