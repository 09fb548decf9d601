// SPDX-License-Identifier: MIT
// Messages in: checks, the newest pose into its tool's slot, requests into the ring.
#include "run/bus_parts.h"

#include "base/clock.h"
#include "base/log.h"

#include "pliant_command_t.h"

#include <stdio.h>
#include <string.h>

// Publishes at most one event per second for each reason; the counters count all.
static void report_refusal(Bus *bus, Refusal refusal, const char *why)
{
    int64_t now = clock_now_ns();
    if (bus->refusal_reported_ns[refusal] != 0 &&
        now - bus->refusal_reported_ns[refusal] < 1000000000)
        return;
    bus->refusal_reported_ns[refusal] = now;
    EventOut event = {
        .step = bus->status != NULL ? bus->status->step : 0, .body = -1, .kind = "refused"};
    snprintf(event.text, sizeof event.text, "%s", why);
    bus_send_event(bus, &event);
    log_line(LOG_DEBUG, "refused: %s", why);
}

void bus_refuse(Bus *bus, Refusal refusal, const char *why)
{
    gate_count(&bus->gate, refusal);
    report_refusal(bus, refusal, why);
}

// A repeat of the request will be tried again.
static void answer_refusal(Bus *bus, const GateResult *result)
{
    Answer answer = {.kind = result->input.kind,
                     .sender = result->input.sender,
                     .id = result->input.id,
                     .step = bus->status != NULL ? bus->status->step : 0};
    memcpy(answer.text, result->why, sizeof answer.text);
    gate_forget(&bus->gate, &result->input);
    bus_send_answer(bus, &answer);
}

static bool is_urgent(const Input *input)
{
    return input_is_urgent(input->kind, input->command.kind);
}

static bool is_switched_off(const Bus *bus, const Input *input)
{
    return !bus->scene->stop_command && input->kind == INPUT_COMMAND &&
           input->command.kind == PLIANT_COMMAND_T_STOP;
}

// True if the request fits in its lane. A sender may use as many slots as are left: one sender gets
// half, two a third each, and one more client always finds some.
static bool has_room(const Bus *bus, const Input *input)
{
    const bool urgent = is_urgent(input);
    const int left = (urgent ? EXCHANGE_URGENT : EXCHANGE_REQUESTS) - bus->outstanding[urgent];
    return left > 0 &&
           gate_pending(&bus->gate, input->sender, urgent) <= left; // already counted as pending
}

static void hand_over(Bus *bus, GateResult *result)
{
    Exchange *exchange = bus->exchange;
    if (!input_is_request(&result->input)) {
        // A pose overwrites the unread one of its tool; `lifts` lets the step thread see a lift in
        // between.
        Slot *slot = &exchange->pose[result->input.index];
        uint32_t *lifts = &exchange->lifts[result->input.index];
        *lifts += !result->input.pose.active;
        result->input.lifts = (int32_t)*lifts;
        memcpy(slot_back(slot), &result->input, sizeof result->input);
        slot_publish(slot);
        return;
    }
    // Refuse requests that the scene disables or that find no slot.
    if (is_switched_off(bus, &result->input)) {
        snprintf(result->why, sizeof result->why, "STOP is switched off here (stop_command)");
        bus_refuse(bus, REFUSED_SWITCHED_OFF, result->why);
        answer_refusal(bus, result);
        return;
    }
    if (!has_room(bus, &result->input)) {
        snprintf(result->why, sizeof result->why, "%d requests wait already",
                 bus->outstanding[is_urgent(&result->input)]);
        bus_refuse(bus, REFUSED_FULL, result->why);
        answer_refusal(bus, result);
        return;
    }
    // Hand the request to the step thread; a PAUSE or STOP also interrupts a running STEP.
    const bool urgent = is_urgent(&result->input);
    if (urgent)
        atomic_fetch_add(&exchange->interrupts, 1);
    result->input.arrival = bus->arrived++;
    if (ring_push(urgent ? &exchange->urgent : &exchange->request, &result->input))
        bus->outstanding[urgent]++;
    exchange_wake(exchange->step_fd);
}

void bus_look(Bus *bus, int64_t now_ns)
{
    // The thread runs at least every 100 ms. After a longer gap the kernel's buffer keeps the
    // oldest messages, which liblcm's thread must drain first.
    enum { LOOKS_NS = 100000000, EMPTIED_NS = 50000000 };
    int64_t away_ns = now_ns - bus->looked_ns;
    bus->looked_ns = now_ns;
    if (away_ns > LOOKS_NS + (int64_t)(bus->scene->sim.tool_timeout_s * 1e9))
        bus->stale_until_ns = now_ns + EMPTIED_NS;
    bus_hold_again(bus, away_ns, now_ns);
}

// True for a request older than this daemon: a repeat of one that another daemon did not answer,
// with its original time stamp. Only an age of a few seconds counts: clients have given up by then,
// replayed logs are older, and a changed clock can give any age.
static bool is_older_than_we(const Bus *bus, const Input *input, int64_t now_ns, char *why)
{
    enum { MOST_US = 5000000, SLACK_US = 20000 };
    const int64_t now_utime = clock_utime(),
                  age_least_us = (now_ns - bus->born_ns) / 1000 + SLACK_US;
    if (!input_is_request(input) || input->utime <= now_utime - MOST_US ||
        input->utime >= now_utime - age_least_us)
        return false;
    snprintf(why, INPUT_WHY_MAX,
             "made %.2f s ago, before this daemon started: the daemon that it was sent to is gone",
             1e-6 * (double)(now_utime - input->utime));
    return true;
}

static void on_input(const lcm_recv_buf_t *message, const char *channel, void *user)
{
    (void)channel;
    const Subscription *subscription = user;
    Bus *bus = subscription->bus;
    // Count it, and notice if this thread was away.
    bus->counts.received++;
    GateResult result;
    int64_t now_ns = clock_now_ns();
    bus_look(bus, now_ns);
    // After a gap the age of a pose is unknown: drop it before the gate, which would accept it.
    if (subscription->kind == INPUT_POSE && now_ns < bus->stale_until_ns) {
        gate_count(&bus->gate, REFUSED_STALE);
        return;
    }
    gate_pass(&bus->gate, subscription->kind, message->data, message->data_size, now_ns / 1000,
              &result);
    // Each passage has its answer: execute, refuse, repeat the stored answer, or wait for it.
    switch (result.passage) {
    case PASSAGE_OPEN:
        if (is_older_than_we(bus, &result.input, now_ns, result.why)) {
            bus_refuse(bus, REFUSED_STALE, result.why);
            answer_refusal(bus, &result);
        } else {
            result.input.arrival = now_ns;
            hand_over(bus, &result);
        }
        break;
    case PASSAGE_REFUSED:
        report_refusal(bus, result.refusal, result.why);
        if (result.known && input_is_request(&result.input))
            answer_refusal(bus, &result);
        break;
    case PASSAGE_ANSWERED:
        bus_send_answer(bus, result.answer);
        break;
    case PASSAGE_PENDING:
        break;
    }
}

static void on_dropped(Drop drop, const char *why, void *user)
{
    static const Refusal REFUSED[DROP_COUNT] = {[DROP_MALFORMED] = REFUSED_PACKET,
                                                [DROP_FRAGMENT] = REFUSED_FRAGMENT,
                                                [DROP_REMOTE] = REFUSED_REMOTE};
    bus_refuse(user, REFUSED[drop], why);
}

// A recording has the event also when nobody can hear it.
static void on_moved(bool routed, const char *what, void *user)
{
    Bus *bus = user;
    EventOut event = {
        .step = bus->status != NULL ? bus->status->step : 0, .body = -1, .kind = "network"};
    snprintf(event.text, sizeof event.text, "%s", what);
    bus_send_event(bus, &event);
    log_line(LOG_WARNING, "%s", what);
    if (routed)
        bus_restart_streams(bus);
}

bool bus_listen(Bus *bus, const Network *network, Status *status)
{
    const ReceiverOptions options = {
        .remote = bus->scene->remote, .dropped = on_dropped, .moved = on_moved, .user = bus};
    char why[RECEIVER_WHY_MAX];
    bus->receiver = receiver_create(bus->lcm, network, &options, why);
    return bus->receiver != NULL || status_fail(status, STATUS_FAILED, "%s", why);
}

bool bus_subscribe_to(Bus *bus, const char *channel, lcm_msg_handler_t handler, void *user,
                      int queue, Status *status)
{
    return receiver_subscribe(bus->receiver, channel, queue, handler, user) != NULL ||
           status_fail(status, STATUS_FAILED, "LCM cannot receive on %s", channel);
}

bool bus_subscribe(Bus *bus, Status *status)
{
    // Where liblcm receives, its queues keep the oldest messages and drop the newest, so they are
    // long enough never to fill between two iterations.
    enum { QUEUE = 4096 };
    for (int k = 0; k < INPUT_KINDS; k++) {
        char channel[2 * CHANNEL_MAX];
        snprintf(channel, sizeof channel, "%s_%s", bus->scene->input_prefix,
                 input_channel((InputKind)k));
        bus->subscription[k] = (Subscription){.bus = bus, .kind = (InputKind)k};
        if (!bus_subscribe_to(bus, channel, on_input, &bus->subscription[k], QUEUE, status))
            return false;
    }
    return bus_subscribe_claims(bus, status);
}

bool bus_receive(Bus *bus)
{
    receiver_follow(bus->receiver);
    enum { MOST = 1024 }; // limit per call, so that a flood of messages does not block publishing
    for (int i = 0; i < MOST; i++)
        if (receiver_handle(bus->receiver) <= 0)
            return false;
    return true;
}
