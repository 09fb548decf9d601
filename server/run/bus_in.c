// Messages in: checks, the newest pose into its tool's slot, requests into the ring.
#include "run/bus_parts.h"

#include "base/clock.h"
#include "base/log.h"

#include "pliant_command_t.h"

#include <poll.h>
#include <stdio.h>
#include <string.h>

// One event a second for each reason at most; the counters miss nothing.
static void tell_refusal(Bus *bus, Refusal refusal, const char *why)
{
    int64_t now = clock_now_ns();
    if (bus->refusal_told_ns[refusal] != 0 && now - bus->refusal_told_ns[refusal] < 1000000000)
        return;
    bus->refusal_told_ns[refusal] = now;
    EventOut event = {
        .step = bus->status != NULL ? bus->status->step : 0, .body = -1, .kind = "refused"};
    snprintf(event.text, sizeof event.text, "%s", why);
    bus_send_event(bus, &event);
    log_line(LOG_DEBUG, "refused: %s", why);
}

// `again`: a repeat of it is tried again.
static void answer_refusal(Bus *bus, const GateResult *result, bool again)
{
    Answer answer = {.kind = result->input.kind,
                     .sender = result->input.sender,
                     .id = result->input.id,
                     .step = bus->status != NULL ? bus->status->step : 0};
    memcpy(answer.text, result->why, sizeof answer.text);
    if (again)
        gate_forget(&bus->gate, &result->input);
    else
        gate_answer(&bus->gate, &answer);
    bus_send_answer(bus, &answer);
}

static bool ends_a_step(const Input *input)
{
    return input->kind == INPUT_COMMAND && (input->command.kind == PLIANT_COMMAND_T_PAUSE ||
                                            input->command.kind == PLIANT_COMMAND_T_STOP);
}

// As many answers fit into their ring as requests may wait; one sender may have half of them.
static bool has_room(const Bus *bus, const Input *input)
{
    const int half = EXCHANGE_REQUESTS / 2;
    if (bus->outstanding < half)
        return true;
    // The request itself is pending already.
    return bus->outstanding < EXCHANGE_REQUESTS && gate_pending(&bus->gate, input->sender) <= half;
}

static void hand_over(Bus *bus, GateResult *result)
{
    Exchange *exchange = bus->exchange;
    if (!input_is_request(&result->input)) {
        Slot *slot = &exchange->pose[result->input.index];
        int32_t *lifts = &exchange->lifts[result->input.index];
        *lifts += !result->input.pose.active;
        result->input.pose.lifts = *lifts;
        memcpy(slot_back(slot), &result->input, sizeof result->input);
        slot_publish(slot);
        return;
    }
    if (!has_room(bus, &result->input)) {
        snprintf(result->why, sizeof result->why, "%d requests wait already", bus->outstanding);
        gate_count(&bus->gate, REFUSED_FULL);
        tell_refusal(bus, REFUSED_FULL, result->why);
        answer_refusal(bus, result, true);
        return;
    }
    if (ends_a_step(&result->input))
        atomic_fetch_add(&exchange->interrupts, 1);
    if (ring_push(&exchange->request, &result->input))
        bus->outstanding++;
    exchange_wake(exchange->step_fd);
}

void bus_look(Bus *bus, int64_t now_ns)
{
    // It looks at least every 100 ms. The kernel's buffer keeps the oldest of what came meanwhile
    // and liblcm's thread has to empty it first.
    enum { LOOKS_NS = 100000000, EMPTIED_NS = 50000000 };
    int64_t away_ns = now_ns - bus->looked_ns;
    bus->looked_ns = now_ns;
    if (away_ns > LOOKS_NS + (int64_t)(bus->scene->tool_timeout_s * 1e9))
        bus->stale_until_ns = now_ns + EMPTIED_NS;
    bus_hold_anew(bus, away_ns, now_ns);
}

static void on_input(const lcm_recv_buf_t *message, const char *channel, void *user)
{
    (void)channel;
    const Subscription *subscription = user;
    Bus *bus = subscription->bus;
    bus->counts.received++;
    GateResult result;
    int64_t now_ns = clock_now_ns();
    bus_look(bus, now_ns);
    if (subscription->kind == INPUT_POSE && now_ns < bus->stale_until_ns) {
        gate_count(&bus->gate, REFUSED_STALE);
        return;
    }
    gate_pass(&bus->gate, subscription->kind, message->data, message->data_size, now_ns / 1000,
              &result);
    switch (result.passage) {
    case PASSAGE_OPEN:
        hand_over(bus, &result);
        break;
    case PASSAGE_REFUSED:
        tell_refusal(bus, result.refusal, result.why);
        if (result.known && input_is_request(&result.input))
            answer_refusal(bus, &result, false);
        break;
    case PASSAGE_ANSWERED:
        bus_send_answer(bus, result.answer);
        break;
    case PASSAGE_PENDING:
        break;
    }
}

bool bus_subscribe_to(Bus *bus, const char *channel, lcm_msg_handler_t handler, void *user,
                      int queue, Status *status)
{
    lcm_subscription_t *subscription = lcm_subscribe(bus->lcm, channel, handler, user);
    if (subscription == NULL)
        return status_fail(status, STATUS_FAILED,
                           "LCM cannot receive on %s: are multicast packets filtered?", channel);
    lcm_subscription_set_queue_capacity(subscription, queue);
    return true;
}

bool bus_subscribe(Bus *bus, Status *status)
{
    // The queues keep the oldest and drop the newest: long enough never to fill between two looks.
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
    enum { MOST = 1024 }; // a flood of messages must not stop what goes out
    struct pollfd in = {.fd = lcm_get_fileno(bus->lcm), .events = POLLIN};
    for (int i = 0; i < MOST; i++) {
        if (poll(&in, 1, 0) <= 0 || (in.revents & POLLIN) == 0)
            return false;
        lcm_handle(bus->lcm);
    }
    return true;
}
