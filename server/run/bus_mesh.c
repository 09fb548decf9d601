// SPDX-License-Identifier: MIT
// Meshes out, whole and as deltas. A whole mesh is sent over time, so its memory must not change
// meanwhile: the body's own mesh if it never changes, else the bus's copy of the mesh last
// published.
#include "run/bus_parts.h"

#include "base/clock.h"

#include "pliant_mesh_t.h"
#include "pliant_rest_t.h"
#include "pliant_walls_t.h"

#include <stdio.h>
#include <string.h>

// --- the differences between two meshes ----------------------------------------------------------

static bool node_differs(const BodyMesh *before, const BodyMesh *after, int i)
{
    // All new slots are told, free ones too: clients let a mesh grow by what came only.
    if (i >= before->node_count)
        return true;
    if (before->id[i] != after->id[i] || after->id[i] < 0)
        return before->id[i] != after->id[i];
    bool differs = false;
#define COMPARE(name, type, width, of, ...)                                                        \
    MESH_IF_NODE(of,                                                                               \
                 differs |= memcmp(before->name + i, after->name + i, sizeof *after->name) != 0;)
    MESH_COLUMNS(COMPARE)
    return differs;
}

static bool triangle_differs(const BodyMesh *before, const BodyMesh *after, int t)
{
    return t >= before->triangle_count ||
           memcmp(before->triangle[t], after->triangle[t], sizeof *after->triangle) != 0;
}

void mesh_delta_find(MeshDelta *delta, const BodyMesh *before, const BodyMesh *after)
{
    delta->from_topology = before->topology;
    delta->node_count = delta->triangle_count = 0;
    for (int i = 0; i < after->node_count; i++)
        if (node_differs(before, after, i))
            delta->node[delta->node_count++] = i;
    for (int t = 0; t < after->triangle_count; t++)
        if (triangle_differs(before, after, t))
            delta->triangle[delta->triangle_count++] = t;
}

int mesh_delta_chunks(const MeshDelta *delta)
{
    int by_nodes = chunks_of(delta->node_count, DELTA_NODES_IN_CHUNK);
    int by_triangles = chunks_of(delta->triangle_count, DELTA_TRIANGLES_IN_CHUNK);
    return by_nodes > by_triangles ? by_nodes : by_triangles;
}

// Takes row `slot` of the columns as row k of the message's arrays.
#define GATHER(name, width)                                                                        \
    memcpy(memory->name + (width)*k, after->name + slot, sizeof *after->name);
#define GATHER_NODE(name, type, width, of, empty, sent, ...)                                       \
    MESH_IF_SENT(sent, MESH_IF_NODE(of, GATHER(name, width)))
#define GATHER_TRIANGLE(name, type, width, of, empty, sent, ...)                                   \
    MESH_IF_SENT(sent, MESH_IF_TRIANGLE(of, GATHER(name, width)))

pliant_mesh_delta_t mesh_delta_chunk(const MeshDelta *delta, const BodyMesh *after, int chunk,
                                     MeshDeltaChunk *memory)
{
#define POINT_AT_MEMORY(name, type, width, of, empty, sent, ...)                                   \
    MESH_IF_SENT(sent, .name = memory->name, )
    // This chunk's share of the changed triangles and nodes, gathered into the message's arrays.
    int count = mesh_delta_chunks(delta);
    int triangle = chunk_begin(delta->triangle_count, chunk, count);
    int node = chunk_begin(delta->node_count, chunk, count);
    int triangles = chunk_begin(delta->triangle_count, chunk + 1, count) - triangle;
    int nodes = chunk_begin(delta->node_count, chunk + 1, count) - node;
    for (int k = 0; k < triangles; k++) {
        int slot = memory->triangle_slot[k] = delta->triangle[triangle + k];
        MESH_COLUMNS(GATHER_TRIANGLE)
    }
    for (int k = 0; k < nodes; k++) {
        int slot = memory->node_slot[k] = delta->node[node + k];
        MESH_COLUMNS(GATHER_NODE)
    }
    return (pliant_mesh_delta_t){.from_topology = delta->from_topology,
                                 .topology = after->topology,
                                 .node_count = after->node_count,
                                 .triangle_count = after->triangle_count,
                                 .chunk = chunk,
                                 .chunk_count = count,
                                 .num_triangles = triangles,
                                 .num_indices = 3 * triangles,
                                 .triangle_slot = memory->triangle_slot,
                                 .num_nodes = nodes,
                                 .num_parents = 2 * nodes,
                                 .node_slot = memory->node_slot,
                                 MESH_COLUMNS(POINT_AT_MEMORY)};
}

// While a whole mesh is being sent, frames of newer topologies wait. It leaves faster then: 46
// MB/s, 5 chunks in the smallest default receive buffer.
enum { CHUNKS_A_SECOND = 1000 };

void bus_create_mesh_stream(Bus *bus, int index, Arena *arena)
{
    BodyStream *stream = &bus->body[index];
    const Body *body = sim_body(bus->sim, index);
    // A mesh that never changes is read from the body itself.
    stream->mesh = body->mesh;
    if (!mesh_changes(body))
        return;
    // Else the bus keeps a copy, so that a mesh stays whole while it is sent,
    stream->copy = arena_allocate(arena, ARENA_OUTPUT, 1, mesh_copy_bytes(&body->mesh),
                                  "run/mesh_%s", body->name);
    mesh_copy_follow(stream->copy, &body->mesh);
    stream->mesh = mesh_copy_view(stream->copy);
    // and lists what changed since the one before.
    stream->delta.node = arena_allocate(arena, ARENA_OUTPUT, (size_t)body->mesh.node_capacity,
                                        sizeof(int), "run/delta_nodes_%s", body->name);
    stream->delta.triangle =
        arena_allocate(arena, ARENA_OUTPUT, (size_t)body->mesh.triangle_capacity, sizeof(int),
                       "run/delta_triangles_%s", body->name);
    // One scratch message serves all bodies.
    if (bus->delta_chunk == NULL)
        bus->delta_chunk =
            arena_allocate(arena, ARENA_OUTPUT, 1, sizeof *bus->delta_chunk, "run/delta_chunk");
}

// --- whole meshes ---

static void send_mesh_chunk(Bus *bus, int index, int chunk)
{
    BodyStream *stream = &bus->body[index];
    const BodyMesh *mesh = &stream->mesh;
    const int chunks = stream->mesh_chunks;
    // This chunk's share of the triangles and of the nodes.
    int triangle = chunk_begin(mesh->triangle_count, chunk, chunks);
    int triangle_end = chunk_begin(mesh->triangle_count, chunk + 1, chunks);
    int node = chunk_begin(mesh->node_count, chunk, chunks);
    int node_end = chunk_begin(mesh->node_count, chunk + 1, chunks);
    // The generated type has no const; encoding only reads.
#define POINT_AT_MESH(name, type, width, of, empty, sent, ...)                                     \
    MESH_IF_SENT(sent, .name = (type *)(uintptr_t)(mesh->name + MESH_SLOTS_##of(node, triangle)), )
    pliant_mesh_t message = {.utime = clock_utime(),
                             .sequence = (int32_t)bus->channel[OUT_MESH][index].sequence,
                             .topology = mesh->topology,
                             .node_count = mesh->node_count,
                             .triangle_count = mesh->triangle_count,
                             .chunk = chunk,
                             .chunk_count = chunks,
                             .first_triangle = triangle,
                             .num_indices = 3 * (triangle_end - triangle),
                             .first_node = node,
                             .num_nodes = node_end - node,
                             .num_parents = 2 * (node_end - node),
                             MESH_COLUMNS(POINT_AT_MESH)};
    bus_publish(bus, OUT_MESH, index, &message);
}

static void send_walls(Bus *bus, int index)
{
    const BodyStream *stream = &bus->body[index];
    const pliant_walls_t message = {.utime = clock_utime(),
                                    .sequence = (int32_t)bus->channel[OUT_MESH][index].sequence,
                                    .topology = stream->mesh.topology,
                                    .first_wall = stream->mesh.first_wall};
    if (stream->mesh.first_wall > 0)
        bus_publish(bus, OUT_WALLS, index, &message);
}

static void send_whole_chunk(Bus *bus, int index)
{
    BodyStream *stream = &bus->body[index];
    if (stream->whole.next == 0)
        send_walls(bus, index);
    // The look comes first: a mesh is drawn as soon as it is there.
    const int chunk = stream->whole.next - stream->look_chunks;
    if (chunk < 0)
        bus_send_look_chunk(bus, index, stream->whole.next);
    else if (chunk < stream->mesh_chunks)
        send_mesh_chunk(bus, index, chunk);
    else
        bus_send_rest_chunk(bus, index, chunk - stream->mesh_chunks);
    stream->whole.next++;
}

static void start_mesh(Bus *bus, int index, int64_t now_ns)
{
    BodyStream *stream = &bus->body[index];
    // The rest positions follow the mesh.
    stream->look_chunks = bus_look_chunks(bus, index);
    stream->mesh_chunks = chunks_of_mesh(stream->mesh.node_count, stream->mesh.triangle_count);
    int count = stream->look_chunks + stream->mesh_chunks + bus_rest_chunks(bus, index);
    stream->whole_wanted = false;
    bus->channel[OUT_MESH][index].sequence++;
    if (stream->look_chunks > 0)
        bus_start_look(bus, index);
    // A mesh that changes must leave before it changes again.
    pace_start(&stream->whole, count,
               stream->copy == NULL ? bus->scene->publish.mesh_hz : (double)CHUNKS_A_SECOND / count,
               now_ns);
    stream->whole_next_ns = pace_end_ns(&stream->whole, now_ns) + BUS_AGAIN_NS;
}

void bus_send_meshes(Bus *bus, int64_t now_ns)
{
    // Whole meshes for clients that join, at their own rate,
    double hz = bus->scene->publish.mesh_hz;
    bool all_due = hz > 0.0 && now_ns >= bus->next_mesh_ns;
    if (all_due)
        bus->next_mesh_ns = now_ns + (int64_t)(1e9 / hz);
    for (int i = 0; i < sim_body_count(bus->sim); i++) {
        BodyStream *stream = &bus->body[i];
        stream->whole_wanted |= all_due && !pace_is_under_way(&stream->whole);
        // or for one that asked, but never while a delta is under way.
        if (stream->whole_wanted && !pace_is_under_way(&stream->whole) &&
            !pace_is_under_way(&stream->delta_pace) && (all_due || now_ns >= stream->whole_next_ns))
            start_mesh(bus, i, now_ns);
        while (pace_is_due(&stream->whole, now_ns))
            send_whole_chunk(bus, i);
    }
}

// Restarts only after the mesh being sent has left, so that repeated requests delay no chunk and no
// newer topology.
void bus_restart_meshes(Bus *bus)
{
    for (int i = 0; i < sim_body_count(bus->sim); i++)
        bus->body[i].whole_wanted = true;
}

// --- deltas ---

bool bus_follow_mesh(Bus *bus, int index, int64_t now_ns, bool at_once)
{
    BodyStream *stream = &bus->body[index];
    if (stream->frame->topology == stream->mesh.topology)
        return true;
    // The whole mesh before this one must have left, or clients would get parts of two.
    while (at_once && pace_is_under_way(&stream->whole))
        send_whole_chunk(bus, index);
    if (pace_is_under_way(&stream->whole))
        return false;
    // Find what changed, then take the new mesh over.
    const MeshCopy *newest = exchange_frame_mesh(bus->exchange, index, stream->frame);
    BodyMesh mesh = mesh_copy_view(newest);
    mesh_delta_find(&stream->delta, &stream->mesh, &mesh);
    mesh_copy_follow(stream->copy, &mesh);
    stream->mesh = mesh_copy_view(stream->copy);
    if (stream->rest != NULL)
        rest_copy_take(stream->rest, exchange_frame_rest(bus->exchange, index, stream->frame));
    bus_renew_look(bus, index);
    bus->channel[OUT_MESH_DELTA][index].sequence++;
    // Use a quarter of the time to the next frame, so that time is left for the nodes.
    pace_start(&stream->delta_pace, mesh_delta_chunks(&stream->delta),
               4.0 * bus->scene->publish.nodes_hz, now_ns);
    return true;
}

bool bus_send_delta(Bus *bus, int index, int64_t now_ns, bool now)
{
    BodyStream *stream = &bus->body[index];
    Pace *pace = &stream->delta_pace;
    // Each chunk carries the sequence of its delta, so that clients know which belong together.
    while (pace_is_due(pace, now_ns) || (pace_is_under_way(pace) && now)) {
        pliant_mesh_delta_t message =
            mesh_delta_chunk(&stream->delta, &stream->mesh, pace->next, bus->delta_chunk);
        message.utime = clock_utime();
        message.sequence = (int32_t)bus->channel[OUT_MESH_DELTA][index].sequence;
        bus_publish(bus, OUT_MESH_DELTA, index, &message);
        pace->next++;
    }
    return !pace_is_under_way(pace);
}

// --- rest positions ------------------------------------------------------------------------------

// Rest positions and texture coordinates of the published mesh; they follow each whole mesh in
// scenes with publish.rest.

void bus_create_rest_stream(Bus *bus, int index, Arena *arena)
{
    BodyStream *stream = &bus->body[index];
    const Body *body = sim_body(bus->sim, index);
    if (!rest_is_wanted(body, bus->scene->publish.rest))
        return;
    // The bus keeps what it publishes: the step thread goes on.
    stream->rest =
        arena_allocate(arena, ARENA_OUTPUT, 1, rest_copy_bytes(body), "run/rest_%s", body->name);
    rest_copy_follow(stream->rest, body);
    if (body->texture != NULL && bus->texture == NULL)
        bus->texture = arena_allocate(arena, ARENA_OUTPUT, 2 * (size_t)NODES_IN_REST_CHUNK,
                                      sizeof *bus->texture, "run/texture_chunk");
}

int bus_rest_chunks(const Bus *bus, int index)
{
    const BodyStream *stream = &bus->body[index];
    return stream->rest == NULL || !bus->scene->publish.rest
               ? 0
               : chunks_of(stream->mesh.node_count, NODES_IN_REST_CHUNK);
}

void bus_send_rest_chunk(Bus *bus, int index, int chunk)
{
    const BodyStream *stream = &bus->body[index];
    const Body *body = sim_body(bus->sim, index); // only its constant members are read
    const RestCopy *rest = stream->rest;
    // This chunk's share of the nodes.
    const int chunks = bus_rest_chunks(bus, index);
    const int first = chunk_begin(rest->node_count, chunk, chunks);
    const int end = chunk_begin(rest->node_count, chunk + 1, chunks);
    pliant_rest_t message = {.utime = clock_utime(),
                             .sequence = (int32_t)bus->channel[OUT_MESH][index].sequence,
                             .topology = rest->topology,
                             .node_count = rest->node_count,
                             .chunk = chunk,
                             .chunk_count = chunks,
                             .first = first,
                             .num_values = 3 * (end - first),
                             .position = (float *)(uintptr_t)(rest->position + 3L * first)};
    // Texture coordinates only where the body has any.
    if (body->texture != NULL) {
        rest_texture(body, &stream->mesh, first, end, bus->texture);
        message.num_coordinates = 2 * (end - first);
        message.texture = bus->texture;
    }
    bus_publish(bus, OUT_REST, index, &message);
}
