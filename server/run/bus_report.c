// Replies, events and status out.
#include "run/bus_parts.h"

#include "base/check.h"
#include "base/clock.h"
#include "base/log.h"
#include "run/loop.h"

#include "pliant_command_t.h"
#include "pliant_event_t.h"
#include "pliant_reply_t.h"
#include "pliant_status_t.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { REASONS = REFUSAL_COUNT + 3 + GUARD_REASONS };

void bus_count_published(Bus *bus, int result)
{
    if (result == 0)
        bus->counts.published++;
    else
        bus->counts.failed++;
}

void bus_send_answer(Bus *bus, const Answer *answer)
{
    char channel[2 * CHANNEL_MAX];
    snprintf(channel, sizeof channel, "%s_%s", bus->scene->input_prefix,
             input_channel(answer->kind));
    bool describes =
        answer->ok && answer->kind == INPUT_COMMAND && answer->command == PLIANT_COMMAND_T_DESCRIBE;
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
    bus_count_published(bus, pliant_reply_t_publish(bus->lcm, bus->reply_channel, &message));
    if (describes)
        bus_restart_streams(bus);
}

void bus_send_event(Bus *bus, const EventOut *event)
{
    const char *body = event->body >= 0 ? sim_body(bus->sim, event->body)->name : "";
    pliant_event_t message = {.utime = clock_utime(),
                              .sequence = (int32_t)++bus->event_sequence,
                              .step = event->step,
                              .body = (char *)(uintptr_t)body,
                              .kind = (char *)(uintptr_t)event->kind,
                              .text = (char *)(uintptr_t)event->text};
    bus_count_published(bus, pliant_event_t_publish(bus->lcm, bus->event_channel, &message));
    if (bus->exchange->records && !ring_push(&bus->exchange->told, event))
        atomic_fetch_add_explicit(&bus->exchange->lost, 1, memory_order_relaxed);
}

// --- status ---

static void fill_bodies(const Bus *bus, pliant_body_status_t *out)
{
    for (int i = 0; i < sim_body_count(bus->sim); i++) {
        Body *body = sim_body(bus->sim, i); // only its constant members are read
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
    reasons += fill_guard(&bus->status->guard, name + reasons, count + reasons);
    for (int i = ACCEPTED + 1; i < REFUSAL_COUNT; i++) {
        if (bus->gate.refused[i] == 0)
            continue;
        name[reasons] = (char *)(uintptr_t)refusal_name((Refusal)i);
        count[reasons++] = bus->gate.refused[i];
    }
    return reasons;
}

// Sends the status. Not `fresh`: a repeat, whose figures "since the last status" are zero.
void bus_send_status(Bus *bus, bool fresh)
{
    const StatusOut *from = bus->status;
    // Collect the variable parts: figures of bodies, stages and reasons.
    char *stage[STAGE_COUNT], *reason[REASONS];
    double stage_us[STAGE_COUNT];
    int64_t count[REASONS];
    int bodies = sim_body_count(bus->sim);
    pliant_body_status_t *body = calloc((size_t)bodies + 1, sizeof *body);
    ASSERT(body != NULL);
    fill_bodies(bus, body);
    pliant_status_t message = {.utime = clock_utime(),
                               .sequence = (int32_t)++bus->status_sequence,
                               .scene = (char *)(uintptr_t)bus->scene->name,
                               .state = (char *)(uintptr_t)loop_state_name(from->state),
                               .step = from->step,
                               .time = from->time,
                               .rate_hz = bus->scene->rate_hz,
                               .real_time_factor = fresh ? from->real_time_factor : 0.0,
                               .late_ticks = from->late_ticks,
                               .resets = from->resets,
                               .rejected = gate_refused(&bus->gate),
                               .num_stages = fill_stages(bus, stage, stage_us),
                               .stage = stage,
                               .stage_us = stage_us,
                               .num_bodies = bodies,
                               .body = body,
                               .num_reasons = fill_reasons(bus, reason, count),
                               .reason = reason,
                               .count = count};
    // A repeated status has no new timings.
    if (fresh) {
        memcpy(message.step_us, from->step_us, sizeof message.step_us);
        memcpy(message.wake_us, from->wake_us, sizeof message.wake_us);
    } else {
        memset(stage_us, 0, sizeof stage_us);
    }
    // Remember the time stamp, by which bus_claim.c tells our statuses from a rival's.
    bus->own_status[bus->status_sequence % OWN_STATUSES] = message.utime;
    bus_count_published(bus, pliant_status_t_publish(bus->lcm, bus->status_channel, &message));
    free(body);
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
        if (!answer->ok)
            gate_count(&bus->gate, REFUSED_NOT_POSSIBLE);
        gate_answer(&bus->gate, answer);
        bus_send_answer(bus, answer);
        bus->outstanding--;
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
    publish_answers(bus, &exchange->answer, now_ns);
    if (exchange->checkpoints)
        publish_answers(bus, &exchange->written, now_ns);
    if (exchange->checkpoints || exchange->records || exchange->logs_inputs)
        publish_events(bus, &exchange->files_event);
}
