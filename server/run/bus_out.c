// Frames, meshes and contacts out, in chunks below one datagram that are spread over their period:
// a receiver's kernel buffer holds a few chunks, not a burst.
#include "run/bus_parts.h"

#include "base/clock.h"

#include "pliant_contact_t.h"
#include "pliant_mesh_t.h"
#include "pliant_nodes_t.h"

#include <stdio.h>
#include <string.h>

static const int64_t SECOND = 1000000000;

static bool pace_is_due(const Pace *pace, int64_t now_ns)
{
    return pace->next < pace->count && now_ns >= pace->start_ns + pace->next * pace->interval_ns;
}

static int64_t pace_next_ns(const Pace *pace)
{
    return pace->next < pace->count ? pace->start_ns + pace->next * pace->interval_ns : INT64_MAX;
}

// Evenly over a period of 1/hz, or 10 ms a chunk, whichever is faster.
static void pace_start(Pace *pace, int count, double hz, int64_t now_ns)
{
    int64_t interval = 10000000;
    if (hz > 0.0 && (double)SECOND / hz / count < (double)interval)
        interval = (int64_t)((double)SECOND / hz / count);
    *pace = (Pace){.count = count, .start_ns = now_ns, .interval_ns = interval};
}

static int chunks_of(int count, int size)
{
    return count > 0 ? (count + size - 1) / size : 1;
}

// Where chunk `chunk` of `count` begins among `total` things.
static int split(int total, int chunk, int count)
{
    return (int)((int64_t)total * chunk / count);
}

void bus_create_streams(Bus *bus, Arena *arena)
{
    int bodies = sim_body_count(bus->sim);
    const char *prefix = bus->scene->prefix;
    bus->body =
        arena_allocate(arena, ARENA_OUTPUT, (size_t)bodies, sizeof *bus->body, "run/body_streams");
    bus->contact_sequence = arena_allocate(arena, ARENA_OUTPUT, (size_t)sim_tool_count(bus->sim),
                                           sizeof *bus->contact_sequence, "run/contact_sequences");
    for (int i = 0; i < bodies; i++) {
        BodyStream *stream = &bus->body[i];
        const char *name = sim_body(bus->sim, i)->name;
        snprintf(stream->nodes_channel, 2 * CHANNEL_MAX, "%s_NODES_%s", prefix, name);
        snprintf(stream->velocity_channel, 2 * CHANNEL_MAX, "%s_VELOCITY_%s", prefix, name);
        snprintf(stream->mesh_channel, 2 * CHANNEL_MAX, "%s_MESH_%s", prefix, name);
    }
}

// --- nodes ---

static void send_nodes_chunk(Bus *bus, int index)
{
    BodyStream *stream = &bus->body[index];
    const Body *body = sim_body(bus->sim, index);
    const Frame *frame = stream->frame;
    Pace *pace = &stream->nodes;
    int nodes = body->mesh.node_count;
    int first = split(nodes, pace->next, pace->count);
    int end = split(nodes, pace->next + 1, pace->count);
    pliant_nodes_t message = {.utime = frame->utime,
                              .sequence = stream->nodes_sequence,
                              .step = frame->step,
                              .time = frame->time,
                              .topology = body->mesh.topology,
                              .node_count = nodes,
                              .chunk = pace->next,
                              .chunk_count = pace->count,
                              .first = first,
                              .num_values = 3 * (end - first)};
    const float *positions = frame->value, *velocities = frame->value + 3 * nodes;
    message.position = (float *)(uintptr_t)(positions + 3 * first);
    bus_count_published(bus, pliant_nodes_t_publish(bus->lcm, stream->nodes_channel, &message));
    if (bus->exchange->velocity) {
        message.position = (float *)(uintptr_t)(velocities + 3 * first);
        bus_count_published(bus,
                            pliant_nodes_t_publish(bus->lcm, stream->velocity_channel, &message));
    }
    pace->next++;
}

// The newest frame of a body, unless chunks of the last one are still to go.
static void take_frame(Bus *bus, int index, int64_t now_ns)
{
    BodyStream *stream = &bus->body[index];
    if (stream->nodes.next < stream->nodes.count)
        return;
    const Frame *frame = slot_take(&bus->exchange->frame[index]);
    if (frame == NULL)
        return;
    stream->frame = frame;
    stream->nodes_sequence++;
    int nodes = sim_body(bus->sim, index)->mesh.node_count;
    pace_start(&stream->nodes, chunks_of(nodes, NODES_IN_CHUNK), bus->scene->publish.nodes_hz,
               now_ns);
}

void bus_send_frames(Bus *bus, int64_t now_ns, bool at_once)
{
    for (int i = 0; i < sim_body_count(bus->sim); i++) {
        BodyStream *stream = &bus->body[i];
        // At once: the rest of the last frame first, then the whole newest one.
        for (int pass = 0; pass < (at_once ? 2 : 1); pass++) {
            take_frame(bus, i, now_ns);
            while (
                pace_is_due(&stream->nodes, now_ns) ||
                (stream->nodes.next < stream->nodes.count && (at_once || stream->frame->at_once)))
                send_nodes_chunk(bus, i);
        }
    }
}

// --- meshes ---

static void send_mesh_chunk(Bus *bus, int index)
{
    BodyStream *stream = &bus->body[index];
    const BodyMesh *mesh = &sim_body(bus->sim, index)->mesh;
    Pace *pace = &stream->mesh;
    int triangle = split(mesh->triangle_count, pace->next, pace->count);
    int triangle_end = split(mesh->triangle_count, pace->next + 1, pace->count);
    int node = split(mesh->node_count, pace->next, pace->count);
    int node_end = split(mesh->node_count, pace->next + 1, pace->count);
    // The generated type has no const; encoding only reads.
    pliant_mesh_t message = {.utime = clock_utime(),
                             .sequence = stream->mesh_sequence,
                             .topology = mesh->topology,
                             .node_count = mesh->node_count,
                             .triangle_count = mesh->triangle_count,
                             .chunk = pace->next,
                             .chunk_count = pace->count,
                             .first_triangle = triangle,
                             .num_indices = 3 * (triangle_end - triangle),
                             .triangle = (int32_t *)(uintptr_t)mesh->triangle[triangle],
                             .first_node = node,
                             .num_nodes = node_end - node,
                             .num_parents = 2 * (node_end - node),
                             .id = (int32_t *)(uintptr_t)(mesh->id + node),
                             .origin = (int32_t *)(uintptr_t)(mesh->origin + node),
                             .parent = (int32_t *)(uintptr_t)mesh->parent[node],
                             .piece = (int32_t *)(uintptr_t)(mesh->piece + node),
                             .level = (int8_t *)(uintptr_t)(mesh->level + node)};
    bus_count_published(bus, pliant_mesh_t_publish(bus->lcm, stream->mesh_channel, &message));
    pace->next++;
}

static void start_mesh(Bus *bus, int index, int64_t now_ns)
{
    BodyStream *stream = &bus->body[index];
    const BodyMesh *mesh = &sim_body(bus->sim, index)->mesh;
    int by_triangles = chunks_of(mesh->triangle_count, TRIANGLES_IN_CHUNK);
    int by_nodes = chunks_of(mesh->node_count, NODES_IN_MESH_CHUNK);
    stream->mesh_sequence++;
    pace_start(&stream->mesh, by_triangles > by_nodes ? by_triangles : by_nodes,
               bus->scene->publish.mesh_hz, now_ns);
}

void bus_send_meshes(Bus *bus, int64_t now_ns)
{
    double hz = bus->scene->publish.mesh_hz;
    bool all_due = hz > 0.0 && now_ns >= bus->next_mesh_ns;
    if (all_due)
        bus->next_mesh_ns = now_ns + (int64_t)((double)SECOND / hz);
    for (int i = 0; i < sim_body_count(bus->sim); i++) {
        BodyStream *stream = &bus->body[i];
        if (all_due && stream->mesh.next == stream->mesh.count)
            start_mesh(bus, i, now_ns);
        while (pace_is_due(&stream->mesh, now_ns))
            send_mesh_chunk(bus, i);
    }
}

void bus_restart_streams(Bus *bus, int64_t now_ns)
{
    for (int i = 0; i < sim_body_count(bus->sim); i++) {
        start_mesh(bus, i, now_ns);
        BodyStream *stream = &bus->body[i];
        if (stream->frame != NULL)
            stream->nodes.next = 0;
    }
}

int64_t bus_next_chunk_ns(const Bus *bus)
{
    int64_t next = INT64_MAX;
    if (bus->scene->publish.mesh_hz > 0.0)
        next = bus->next_mesh_ns;
    for (int i = 0; i < sim_body_count(bus->sim); i++) {
        int64_t nodes = pace_next_ns(&bus->body[i].nodes);
        int64_t mesh = pace_next_ns(&bus->body[i].mesh);
        next = nodes < next ? nodes : next;
        next = mesh < next ? mesh : next;
    }
    return next;
}

// --- contacts ---

static void set3(double to[3], Vec3 from)
{
    to[0] = from.x;
    to[1] = from.y;
    to[2] = from.z;
}

static void send_contact(Bus *bus, const ContactOut *contact)
{
    // Long enough for a few lost messages, short enough that a stale force is soon dropped.
    double hz = bus->scene->publish.contact_hz;
    int64_t valid_us = 20000;
    if (hz > 0.0 && 3e6 / hz > (double)valid_us)
        valid_us = (int64_t)(3e6 / hz);
    const ToolWrench *wrench = &contact->wrench;
    pliant_contact_t message = {.utime = contact->utime,
                                .sequence = ++bus->contact_sequence[contact->tool],
                                .tool = sim_tool(bus->sim, contact->tool)->id,
                                .step = contact->step,
                                .time = contact->time,
                                .pose_utime = contact->pose_utime,
                                .valid_until = contact->utime + valid_us,
                                .contact = wrench->contact};
    set3(message.position, wrench->position);
    if (wrench->contact) {
        set3(message.force, wrench->force);
        set3(message.torque, wrench->torque);
        set3(message.point, wrench->point);
        set3(message.normal, wrench->normal);
        message.depth = wrench->depth;
    }
    bus_count_published(bus, pliant_contact_t_publish(bus->lcm, bus->contact_channel, &message));
}

void bus_send_contacts(Bus *bus)
{
    const ContactOut *contact;
    while ((contact = ring_peek(&bus->exchange->contact)) != NULL) {
        send_contact(bus, contact);
        ring_pop(&bus->exchange->contact);
    }
}
