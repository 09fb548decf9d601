// SPDX-License-Identifier: MIT
// Frames, contacts, replies, events and status out. The mesh of a topology always leaves before its
// nodes.
#include "run/bus_parts.h"
#include "run/bus_points.h"

#include "base/check.h"
#include "base/clock.h"
#include "base/log.h"
#include "run/loop.h"

#include "pliant_lcmtypes.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Memory for the nodes of a fitted mesh.
static void create_nodes(Bus *bus, int index, Arena *arena)
{
    BodyStream *stream = &bus->body[index];
    const Body *body = sim_body(bus->sim, index);
    if (body->mesh.fit.row_count == 0)
        return;
    const size_t values = (size_t)mesh_most_nodes(body) * (bus->exchange->velocity ? 6 : 3);
    stream->node = arena_allocate(arena, ARENA_OUTPUT, values, sizeof *stream->node, "run/nodes_%s",
                                  body->name);
    stream->scratch = arena_allocate(arena, ARENA_OUTPUT,
                                     (size_t)FIT_SCRATCH * (size_t)body->mesh.fit.row_capacity,
                                     sizeof *stream->scratch, "run/fit_%s", body->name);
}

void bus_create_streams(Bus *bus, Arena *arena)
{
    int bodies = sim_body_count(bus->sim);
    // For the whole run: nothing is allocated later.
    bus->body =
        arena_allocate(arena, ARENA_OUTPUT, (size_t)bodies, sizeof *bus->body, "run/body_streams");
    bus->body_status = arena_allocate(arena, ARENA_OUTPUT, (size_t)bodies, sizeof *bus->body_status,
                                      "run/body_status");
    for (int i = 0; i < bodies; i++) {
        bus_create_mesh_stream(bus, i, arena);
        bus_create_rest_stream(bus, i, arena);
        bus_create_look_stream(bus, i, arena);
        create_nodes(bus, i, arena);
    }
    bus_create_errors(bus, arena);
}

// --- nodes ---

// Sends nodes [first, end) of a frame as packets, one after the other: a receiver's kernel buffer
// holds those of a chunk.
static void send_packets(Bus *bus, int index, const float *positions, int first, int end)
{
    enum { LCM_HEADER = 8 };
    const BodyStream *stream = &bus->body[index];
    const Frame *frame = stream->frame;
    uint8_t data[PACKET_BYTES];
    pliant_points_t message = {
        .utime = frame->utime,
        .sequence = (int32_t)bus->channel[OUT_NODES][index].sequence,
        .step = frame->step,
        .time = frame->time,
        .topology = frame->topology,
        .node_count = frame->node_count,
        .grid = points_grid(positions + 3L * first, stream->mesh.id + first, end - first),
        .data = data};
    const int room = PACKET_BYTES - LCM_HEADER - (int)strlen(bus->channel[OUT_POINTS][index].name) -
                     1 - pliant_points_t_encoded_size(&message);
    while (first < end) {
        int count = points_pack(positions + 3L * first, stream->mesh.id + first, end - first,
                                message.grid, room, message.origin, data, &message.num_bytes);
        message.first = first;
        message.count = (int16_t)count;
        bus_publish(bus, OUT_POINTS, index, &message);
        first += count;
    }
}

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
                              .sequence = (int32_t)bus->channel[OUT_NODES][index].sequence,
                              .step = frame->step,
                              .time = frame->time,
                              .topology = frame->topology,
                              .node_count = nodes,
                              .chunk = pace->next,
                              .chunk_count = pace->count,
                              .first = first,
                              .num_values = 3 * (end - first)};
    const float *positions = stream->node != NULL ? stream->node : frame->value;
    const float *velocities = positions + 3L * nodes;
    message.position = (float *)(uintptr_t)(positions + 3 * first);
    if (bus->scene->publish.positions != POSITIONS_PACKETS)
        bus_publish(bus, OUT_NODES, index, &message);
    if (bus->scene->publish.positions != POSITIONS_FLOATS)
        send_packets(bus, index, positions, first, end);
    // Velocities of the same chunk.
    if (bus->exchange->velocity) {
        message.position = (float *)(uintptr_t)(velocities + 3 * first);
        bus_publish(bus, OUT_VELOCITY, index, &message);
    }
    pace->next++;
}

// Computes the nodes of a fitted mesh from the rows of a frame of its topology.
static void fit_frame(Bus *bus, BodyStream *stream)
{
    const Frame *frame = stream->frame;
    const BodyFit *fit = &stream->mesh.fit;
    if (stream->node == NULL)
        return;
    fit_nodes(fit, frame->node_count, frame->value, stream->scratch, stream->node);
    fit_fade(fit, frame->step, frame->value, stream->node);
    if (bus->exchange->velocity)
        fit_nodes(fit, frame->node_count, frame->value + 3L * frame->row_count, stream->scratch,
                  stream->node + 3L * frame->node_count);
}

// Takes the newest frame of a body unless chunks of the last one are left to send. A frame of a new
// topology waits until the whole mesh being sent has left, and its own mesh goes first.
static void take_frame(Bus *bus, int index, int64_t now_ns, bool at_once)
{
    BodyStream *stream = &bus->body[index];
    // A frame that is leaving is not mixed with the next.
    if (pace_is_under_way(&stream->nodes))
        return;
    const Frame *frame = slot_take(&bus->exchange->frame[index]);
    if (frame != NULL) {
        stream->frame = frame;
        stream->frame_waits = true;
    }
    // A frame goes out when its mesh has, or once more for a client that asked.
    const bool again = stream->frame_wanted && stream->frame != NULL && !stream->frame_waits &&
                       now_ns >= stream->frame_next_ns;
    if (!again && (!stream->frame_waits ||
                   !bus_follow_mesh(bus, index, now_ns, at_once || stream->frame->at_once)))
        return;
    if (stream->frame_waits)
        fit_frame(bus, stream);
    bus->channel[OUT_NODES][index].sequence += stream->frame_waits;
    stream->frame_waits = stream->frame_wanted = false;
    // Its chunks follow the delta, and leave evenly over the period.
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
    bus->ledger_wanted = true;
    bus_restart_errors(bus);
    bus_restart_elements(bus);
    bus_restart_meshes(bus);
    for (int i = 0; i < sim_body_count(bus->sim); i++)
        bus->body[i].frame_wanted = true;
}

int64_t bus_next_chunk_ns(const Bus *bus)
{
    int64_t next = INT64_MAX;
    // The next whole mesh,
    if (bus->scene->publish.mesh_hz > 0.0)
        next = bus->next_mesh_ns;
    for (int i = 0; i < sim_body_count(bus->sim); i++) {
        // chunks that are under way,
        const BodyStream *stream = &bus->body[i];
        const Pace *pace[] = {&stream->nodes, &stream->whole, &stream->delta_pace,
                              &stream->map_pace, &stream->elements_pace};
        for (int k = 0; k < 5; k++) {
            int64_t due = pace_next_ns(pace[k]);
            next = due < next ? due : next;
        }
        const int64_t look_ns = bus_next_look_ns(stream);
        next = look_ns < next ? look_ns : next;
        // and a mesh that somebody waits for.
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
    // Who, when and where, also without contact.
    const ToolWrench *wrench = &contact->wrench;
    pliant_contact_t message = {.utime = contact->utime,
                                .sequence =
                                    (int32_t)++bus->channel[OUT_CONTACT][contact->tool].sequence,
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
        double stiffness[9];
        sym3_full(wrench->stiffness, stiffness);
        memcpy(message.stiffness, stiffness, sizeof message.stiffness);
        message.damping = wrench->damping;
    }
    bus_publish(bus, OUT_CONTACT, contact->tool, &message);
}

void bus_send_contacts(Bus *bus)
{
    const ContactOut *contact;
    while ((contact = ring_peek(&bus->exchange->contact)) != NULL) {
        send_contact(bus, contact);
        ring_pop(&bus->exchange->contact);
    }
}

// --- replies and events, then status -------------------------------------------------------------

enum { REASONS = REFUSAL_COUNT + INPUT_KINDS + 3 + GUARD_REASONS };

// Says who publishes here, to programs of any version.
static void send_hello(Bus *bus)
{
    static const char program[] = "pliantd", version[] = PLIANT_VERSION;
    const pliant_hello_t message = {.utime = clock_utime(),
                                    .program = (char *)(uintptr_t)program,
                                    .version = (char *)(uintptr_t)version,
                                    .types = PLIANT_LCMTYPES_COUNT,
                                    .prefix = (char *)(uintptr_t)bus->scene->prefix,
                                    .input_prefix = (char *)(uintptr_t)bus->scene->input_prefix};
    bus_publish(bus, OUT_HELLO, 0, &message);
}

void bus_send_answer(Bus *bus, const Answer *answer)
{
    // The channel that the request came on tells the client which of its numbers this is.
    char channel[2 * CHANNEL_MAX];
    snprintf(channel, sizeof channel, "%s_%s", bus->scene->input_prefix,
             input_channel(answer->kind));
    bool describes =
        answer->ok && answer->kind == INPUT_COMMAND && answer->command == PLIANT_COMMAND_T_DESCRIBE;
    // DESCRIBE is answered by the text that the bus has, and by meshes and frames.
    const char *text = describes ? bus->describe : answer->text;
    pliant_reply_t message = {.utime = clock_utime(),
                              .sender = answer->sender,
                              .id = answer->id,
                              .ok = answer->ok,
                              .step = answer->step,
                              .separated = answer->separated,
                              .nodes_added = answer->nodes_added,
                              .pieces = answer->pieces,
                              .channel = channel,
                              .text = (char *)(uintptr_t)text};
    bus_publish(bus, OUT_REPLY, 0, &message);
    if (!describes)
        return;
    send_hello(bus);
    bus_restart_streams(bus);
}

void bus_send_event(Bus *bus, const EventOut *event)
{
    const char *body = event->body >= 0 ? sim_body(bus->sim, event->body)->name : "";
    pliant_event_t message = {.utime = clock_utime(),
                              .sequence = (int32_t)++bus->channel[OUT_EVENT]->sequence,
                              .step = event->step,
                              .body = (char *)(uintptr_t)body,
                              .kind = (char *)(uintptr_t)event->kind,
                              .text = (char *)(uintptr_t)event->text};
    bus_publish(bus, OUT_EVENT, 0, &message);
    // A recording has the events, too.
    if (bus->exchange->records && !ring_push(&bus->exchange->told, event))
        atomic_fetch_add_explicit(&bus->exchange->lost, 1, memory_order_relaxed);
}

// --- status ---

static void fill_bodies(const Bus *bus, pliant_body_status_t *out)
{
    for (int i = 0; i < sim_body_count(bus->sim); i++) {
        Body *body = sim_body(bus->sim, i); // only its constant members are read
        // What changes was copied with the status; the rest is constant.
        const BodyOut *from = &bus->status->body[i];
        out[i] = (pliant_body_status_t){.name = body->name,
                                        .model = (char *)(uintptr_t)body->ops->model,
                                        .integrator =
                                            (char *)(uintptr_t)integrator_name(body->integrator),
                                        .topology = from->topology,
                                        .nodes = from->nodes,
                                        .springs = from->springs,
                                        .elements = from->elements,
                                        .pieces = from->pieces,
                                        .finest_level = from->finest_level,
                                        .time_step = from->time_step,
                                        .kinetic = from->measure.kinetic,
                                        .elastic = from->measure.elastic,
                                        .mass = from->mass,
                                        .max_displacement = from->measure.max_displacement,
                                        .estimated_error = from->estimated_error};
    }
}

static int fill_stages(const Bus *bus, char *name[STAGE_COUNT], double us[STAGE_COUNT])
{
    int count = sim_stage_count(bus->sim);
    for (int i = 0; i < count; i++) {
        StageId stage = sim_stage(bus->sim, i);
        name[i] = (char *)(uintptr_t)stage_name(stage);
        us[i] = bus->status->stage_us[stage];
    }
    return count;
}

static int fill_guard(const GuardCounts *guard, char **name, int64_t *count)
{
    int reasons = 0;
    for (int i = 0; i < GUARD_REASONS; i++) {
        const char *what;
        int64_t times = guard_reason(guard, i, &what);
        if (times == 0)
            continue;
        name[reasons] = (char *)(uintptr_t)what;
        count[reasons++] = times;
    }
    return reasons;
}

// Fills names and counts of what was refused, dropped, held back or corrected.
static int fill_reasons(const Bus *bus, char *name[REASONS], int64_t count[REASONS])
{
    int reasons = 0;
    // What the daemon itself lost or did about its time budget,
    int64_t lost = atomic_load_explicit(&bus->exchange->recorded_lost, memory_order_relaxed);
    if (lost > 0) {
        name[reasons] = (char *)(uintptr_t) "frames_not_recorded";
        count[reasons++] = lost;
    }
    if (bus->status->governor_actions > 0) {
        name[reasons] = (char *)(uintptr_t) "governor_stage";
        count[reasons++] = bus->status->governor_stage;
        name[reasons] = (char *)(uintptr_t) "governor_actions";
        count[reasons++] = bus->status->governor_actions;
    }
    // then the guard's findings, then refused messages by cause.
    reasons += fill_guard(&bus->status->guard, name + reasons, count + reasons);
    for (int i = ACCEPTED + 1; i < REFUSAL_COUNT; i++) {
        if (bus->gate.refused[i] == 0)
            continue;
        name[reasons] = (char *)(uintptr_t)refusal_name((Refusal)i);
        count[reasons++] = bus->gate.refused[i];
    }
    // Whose senders were built from other types than this server.
    for (int k = 0; k < INPUT_KINDS; k++) {
        if (bus->gate.foreign[k] == 0)
            continue;
        name[reasons] = (char *)(uintptr_t)input_foreign_name((InputKind)k);
        count[reasons++] = bus->gate.foreign[k];
    }
    return reasons;
}

// Slow ticks make statuses rare: a repeat tells how fast the ticks since the last one were.
static double find_factor(Bus *bus, bool fresh)
{
    const int64_t now_ns = clock_now_ns();
    const int64_t ticks = atomic_load_explicit(&bus->exchange->step, memory_order_relaxed);
    const double due = 1e-9 * (double)(now_ns - bus->fresh_ns) * bus->scene->sim.rate_hz;
    if (!fresh)
        return bus->status->state == RUN_RUNNING
                   ? (double)(ticks - bus->fresh_ticks) / fmax(due, 1.0)
                   : 0.0;
    bus->fresh_ns = now_ns;
    bus->fresh_ticks = ticks;
    return bus->status->real_time_factor;
}

// Sends the status. Not `fresh`: a repeat, whose figures "since the last status" are zero.
void bus_send_status(Bus *bus, bool fresh)
{
    const StatusOut *from = bus->status;
    const int64_t late = atomic_load_explicit(&bus->exchange->late, memory_order_relaxed);
    // Timings are old while the run stands; while ticks are slow they are the last there are.
    const bool timed = fresh || from->state == RUN_RUNNING;
    // Collect the variable parts: figures of bodies, stages and reasons.
    char *stage[STAGE_COUNT], *reason[REASONS];
    double stage_us[STAGE_COUNT];
    int64_t count[REASONS];
    fill_bodies(bus, bus->body_status);
    pliant_status_t message = {.utime = clock_utime(),
                               .sequence = (int32_t)++bus->channel[OUT_STATUS]->sequence,
                               .scene = (char *)(uintptr_t)bus->scene->name,
                               .state = (char *)(uintptr_t)loop_state_name(from->state),
                               .step = from->step,
                               .time = from->time,
                               .rate_hz = bus->scene->sim.rate_hz,
                               .real_time_factor = find_factor(bus, fresh),
                               .late_ticks = late > from->late_ticks ? late : from->late_ticks,
                               .resets = from->resets,
                               .rejected = gate_refused(&bus->gate),
                               .num_stages = fill_stages(bus, stage, stage_us),
                               .stage = stage,
                               .stage_us = stage_us,
                               .num_bodies = sim_body_count(bus->sim),
                               .body = bus->body_status,
                               .num_reasons = fill_reasons(bus, reason, count),
                               .reason = reason,
                               .count = count};
    if (timed) {
        memcpy(message.step_us, from->step_us, sizeof message.step_us);
        memcpy(message.wake_us, from->wake_us, sizeof message.wake_us);
    } else {
        memset(stage_us, 0, sizeof stage_us);
    }
    // Remember the time stamp, by which bus_claim.c tells our statuses from a rival's.
    bus->own_status[bus->channel[OUT_STATUS]->sequence % OWN_STATUSES] = message.utime;
    bus_publish(bus, OUT_STATUS, 0, &message);
    send_hello(bus);
}

void bus_report_status(Bus *bus, int64_t now_ns)
{
    double hz = bus->scene->publish.status_hz;
    const StatusOut *newest = slot_take(&bus->exchange->status);
    if (newest != NULL)
        bus->status = newest;
    if (bus->status == NULL)
        return;
    bool overdue = hz > 0.0 && now_ns >= bus->next_status_ns;
    // Limit the rate, however often a client requests it.
    bool asked = bus->claim.asked && now_ns >= bus->status_reported_ns + BUS_AGAIN_NS;
    if (newest == NULL && !overdue && !asked)
        return;
    bus_send_status(bus, newest != NULL);
    bus->claim.asked = false;
    bus->status_reported_ns = now_ns;
    // The step thread's own status comes first; only while it is idle is the last one repeated.
    if (hz > 0.0)
        bus->next_status_ns = now_ns + (int64_t)(1.5e9 / hz);
}

// --- what the other threads have left ---

static void publish_answers(Bus *bus, Ring *ring, int64_t now_ns)
{
    const Answer *answer;
    while ((answer = ring_peek(ring)) != NULL) {
        // The client that steps receives nodes and contacts of the last tick before the reply.
        if (answer->after_frame) {
            bus_send_frames(bus, now_ns, true);
            bus_send_contacts(bus);
        }
        // Remember the answer for repeats, then send it.
        if (!answer->ok && !answer->tries)
            gate_count(&bus->gate, REFUSED_NOT_POSSIBLE);
        gate_answer(&bus->gate, answer);
        bus_send_answer(bus, answer);
        bus->outstanding[input_is_urgent(answer->kind, answer->command)]--;
        ring_pop(ring);
    }
}

static void publish_events(Bus *bus, Ring *ring)
{
    const EventOut *event;
    while ((event = ring_peek(ring)) != NULL) {
        log_line(LOG_DEBUG, "%s: %s", event->kind, event->text);
        bus_send_event(bus, event);
        ring_pop(ring);
    }
}

void bus_report(Bus *bus, int64_t now_ns)
{
    Exchange *exchange = bus->exchange;
    publish_events(bus, &exchange->event);
    if (atomic_load(&exchange->pace_told)) {
        EventOut slow = {
            .step = bus->status != NULL ? bus->status->step : 0, .body = -1, .kind = "slow"};
        snprintf(slow.text, sizeof slow.text, "%s", exchange->pace);
        bus_send_event(bus, &slow);
        atomic_store(&exchange->pace_told, false);
    }
    publish_answers(bus, &exchange->answer, now_ns);
    if (exchange->checkpoints)
        publish_answers(bus, &exchange->written, now_ns);
    if (exchange->checkpoints || exchange->records || exchange->logs_inputs)
        publish_events(bus, &exchange->files_event);
}
