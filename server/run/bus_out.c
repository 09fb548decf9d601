// Frames and contacts out. The mesh of a topology always leaves before its nodes.
#include "run/bus_parts.h"

#include "pliant_contact_t.h"
#include "pliant_nodes_t.h"

#include <stdio.h>
#include <string.h>

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
        bus_create_mesh_stream(bus, i, arena);
        bus_create_rest_stream(bus, i, arena);
    }
}

// --- nodes ---

static void send_nodes_chunk(Bus *bus, int index)
{
    BodyStream *stream = &bus->body[index];
    const Frame *frame = stream->frame;
    Pace *pace = &stream->nodes;
    int nodes = frame->node_count;
    int first = chunk_begin(nodes, pace->next, pace->count);
    int end = chunk_begin(nodes, pace->next + 1, pace->count);
    // Positions and velocities share a message type; they differ in channel and array.
    pliant_nodes_t message = {.utime = frame->utime,
                              .sequence = (int32_t)stream->nodes_sequence,
                              .step = frame->step,
                              .time = frame->time,
                              .topology = frame->topology,
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

// Takes the newest frame of a body unless chunks of the last one are left to send. A frame of a new
// topology waits until the whole mesh being sent has left, and its own mesh goes first.
static void take_frame(Bus *bus, int index, int64_t now_ns, bool at_once)
{
    BodyStream *stream = &bus->body[index];
    if (pace_is_under_way(&stream->nodes))
        return;
    const Frame *frame = slot_take(&bus->exchange->frame[index]);
    if (frame != NULL) {
        stream->frame = frame;
        stream->frame_waits = true;
    }
    const bool again = stream->frame_wanted && stream->frame != NULL && !stream->frame_waits &&
                       now_ns >= stream->frame_next_ns;
    if (!again && (!stream->frame_waits ||
                   !bus_follow_mesh(bus, index, now_ns, at_once || stream->frame->at_once)))
        return;
    stream->nodes_sequence += stream->frame_waits;
    stream->frame_waits = stream->frame_wanted = false;
    pace_start(&stream->nodes, chunks_of(stream->frame->node_count, NODES_IN_CHUNK),
               bus->scene->publish.nodes_hz, pace_end_ns(&stream->delta_pace, now_ns));
    stream->frame_next_ns = pace_end_ns(&stream->nodes, now_ns) + BUS_AGAIN_NS;
}

void bus_send_frames(Bus *bus, int64_t now_ns, bool at_once)
{
    for (int i = 0; i < sim_body_count(bus->sim); i++) {
        BodyStream *stream = &bus->body[i];
        // First pass: the rest of the last frame. Second pass: the newest one.
        for (int pass = 0; pass < 2; pass++) {
            take_frame(bus, i, now_ns, at_once);
            bool now = at_once || (stream->frame != NULL && stream->frame->at_once);
            if (!bus_send_delta(bus, i, now_ns, now))
                continue;
            while (pace_is_due(&stream->nodes, now_ns) ||
                   (pace_is_under_way(&stream->nodes) && now))
                send_nodes_chunk(bus, i);
        }
    }
}

void bus_restart_streams(Bus *bus)
{
    bus_restart_meshes(bus);
    for (int i = 0; i < sim_body_count(bus->sim); i++)
        bus->body[i].frame_wanted = true;
}

int64_t bus_next_chunk_ns(const Bus *bus)
{
    int64_t next = INT64_MAX;
    if (bus->scene->publish.mesh_hz > 0.0)
        next = bus->next_mesh_ns;
    for (int i = 0; i < sim_body_count(bus->sim); i++) {
        const BodyStream *stream = &bus->body[i];
        const Pace *pace[] = {&stream->nodes, &stream->whole, &stream->delta_pace};
        for (int k = 0; k < 3; k++) {
            int64_t due = pace_next_ns(pace[k]);
            next = due < next ? due : next;
        }
        if (stream->whole_wanted && pace_next_ns(&stream->whole) == INT64_MAX &&
            pace_next_ns(&stream->delta_pace) == INT64_MAX && stream->whole_next_ns < next)
            next = stream->whole_next_ns;
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
    // Valid long enough for a few lost messages, briefly enough to drop a stale force soon.
    double hz = bus->scene->publish.contact_hz;
    int64_t valid_us = 20000;
    if (hz > 0.0 && 3e6 / hz > (double)valid_us)
        valid_us = (int64_t)(3e6 / hz);
    const ToolWrench *wrench = &contact->wrench;
    pliant_contact_t message = {.utime = contact->utime,
                                .sequence = (int32_t)++bus->contact_sequence[contact->tool],
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
        // Voigt order (xx yy zz yz xz xy) to a full 3 x 3 matrix.
        const double *k = wrench->stiffness;
        const double all[9] = {k[0], k[5], k[4], k[5], k[1], k[3], k[4], k[3], k[2]};
        memcpy(message.stiffness, all, sizeof message.stiffness);
        message.damping = wrench->damping;
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
