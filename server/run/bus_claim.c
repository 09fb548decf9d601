// SPDX-License-Identifier: MIT
// Ownership of the output prefix. Two daemons on one prefix would mix their meshes, so a daemon
// asks before it starts. A lost packet, a broken link or a daemon that was stopped meanwhile can
// hide a second one; each then hears the other's status, both ask again, and the one that has held
// the prefix for a shorter time ends. A hold restarts when the bus thread did not run for longer
// than a client waits for an answer. Questions are random numbers, so a replayed log answers none.
#include "run/bus_parts.h"

#include "base/clock.h"
#include "base/log.h"

#include "pliant_claim_t.h"

#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

enum {
    QUEUE = 16, // messages that liblcm queues for URLs other than udpm
    AWAY_MS =
        1000, // longer than CLAIM_WAIT_MS, lest a daemon on a busy machine yields to a newcomer
};

static int64_t draw(void)
{
    int64_t number = 0;
    if (getrandom(&number, sizeof number, GRND_NONBLOCK) != sizeof number)
        number = clock_now_ns();
    return number != 0 ? number : 1;
}

static int64_t held_us(const Bus *bus)
{
    return (clock_now_ns() - bus->claim.since_ns) / 1000;
}

static void publish(Bus *bus, int64_t question, int64_t answers, int64_t held)
{
    const pliant_claim_t message = {.utime = clock_utime(),
                                    .daemon = bus->claim.daemon,
                                    .question = question,
                                    .answers = answers,
                                    .held = held};
    bus_publish(bus, OUT_CLAIM, 0, &message);
}

static bool read_claim(const lcm_recv_buf_t *message, pliant_claim_t *claim)
{
    const pliant_claim_t any = {0};
    return message->data_size == (uint32_t)pliant_claim_t_encoded_size(&any) &&
           pliant_claim_t_decode(message->data, 0, (int)message->data_size, claim) >= 0;
}

// True if the claim can come from a daemon of this host: it holds its prefix since boot at most.
static bool is_plausible(const Bus *bus, const pliant_claim_t *claim)
{
    const int64_t years_us = INT64_C(10) * 365 * 86400 * 1000000;
    return claim->held >= -1 &&
           claim->held <= (bus->scene->remote ? years_us : clock_now_ns() / 1000);
}

// --- before the start ---

typedef struct Asking {
    const Bus *bus;
    bool taken;
} Asking;

static void on_any_status(const lcm_recv_buf_t *message, const char *channel, void *user)
{
    (void)message;
    (void)channel;
    ((Asking *)user)->taken = true;
}

static void on_first_answer(const lcm_recv_buf_t *message, const char *channel, void *user)
{
    (void)channel;
    Asking *asking = user;
    pliant_claim_t claim;
    if (read_claim(message, &claim) && claim.answers == asking->bus->claim.question)
        asking->taken = true;
}

static void ask_until_answered(Bus *bus, const Asking *asking)
{
    int64_t now_ns = clock_now_ns(), end_ns = now_ns + CLAIM_WAIT_MS * INT64_C(1000000);
    int64_t again_ns = now_ns;
    while (!asking->taken && now_ns < end_ns) {
        // Questions get lost as any message may, so ask more than once.
        if (now_ns >= again_ns) {
            publish(bus, bus->claim.question, 0, -1);
            again_ns = now_ns + CLAIM_ASK_AGAIN_MS * INT64_C(1000000);
        }
        // Wait for the answer, or until it is time to ask again.
        int64_t until_ns = again_ns < end_ns ? again_ns : end_ns;
        struct pollfd in = {.fd = receiver_file(bus->receiver), .events = POLLIN};
        poll(&in, 1, 1 + (int)((until_ns - now_ns) / 1000000));
        receiver_handle(bus->receiver);
        now_ns = clock_now_ns();
    }
}

bool bus_claim(Bus *bus, const char *url, Status *status)
{
    BusClaim *claim = &bus->claim;
    // Draw who we are and what we ask; a log replayed later cannot answer random numbers.
    claim->daemon = draw();
    claim->question = draw();
    claim->since_ns = clock_now_ns();
    // Without a network there is no other daemon.
    if (url != NULL && strncmp(url, "memq://", 7) == 0)
        return true;
    // Hear statuses and claims of others while the question is open.
    Asking asking = {.bus = bus};
    Receiver *receiver = bus->receiver;
    ReceiverSubscription *on[2] = {
        receiver_subscribe(receiver, bus->channel[OUT_STATUS]->name, QUEUE, on_any_status, &asking),
        receiver_subscribe(receiver, bus->channel[OUT_CLAIM]->name, QUEUE, on_first_answer,
                           &asking)};
    if (on[0] == NULL || on[1] == NULL)
        return status_fail(status, STATUS_FAILED, "LCM cannot receive");
    ask_until_answered(bus, &asking);
    for (int i = 0; i < 2; i++)
        receiver_unsubscribe(receiver, on[i]);
    // From here on we hold the prefix, unless somebody answered.
    claim->question = 0;
    claim->since_ns = clock_now_ns();
    if (asking.taken)
        return status_fail(status, STATUS_FAILED,
                           "another daemon publishes on %s: give this one another --prefix",
                           bus->channel[OUT_STATUS]->name);
    return true;
}

// --- while running ---

void bus_hold_again(Bus *bus, int64_t away_ns, int64_t now_ns)
{
    if (away_ns > AWAY_MS * INT64_C(1000000))
        bus->claim.since_ns = now_ns;
}

// Asks at most once per second.
static void ask_rival(Bus *bus)
{
    BusClaim *claim = &bus->claim;
    int64_t now_ns = clock_now_ns();
    if (claim->asked_ns != 0 && now_ns - claim->asked_ns < 1000000000)
        return;
    claim->asked_ns = now_ns;
    claim->question = draw();
    publish(bus, claim->question, 0, held_us(bus));
}

static void meet_rival(Bus *bus, const pliant_claim_t *rival)
{
    EventOut event = {.step = bus->status != NULL ? bus->status->step : 0, .body = -1};
    double held = (double)rival->held * 1e-6, ours = (double)held_us(bus) * 1e-6;
    // Of two daemons the one that has held the prefix for less time ends; report it now and then.
    bool yields = claim_yields(held_us(bus), bus->claim.daemon, rival->held, rival->daemon);
    int64_t now_ns = clock_now_ns();
    if (!yields && bus->claim.reported_ns != 0 && now_ns - bus->claim.reported_ns < 10000000000)
        return;
    bus->claim.reported_ns = now_ns;
    snprintf(event.kind, sizeof event.kind, "%s", yields ? "yielded" : "rival");
    snprintf(event.text, sizeof event.text,
             "another daemon publishes on %.64s too, for %.1f s; this one for %.1f s: %s",
             bus->channel[OUT_STATUS]->name, held, ours,
             yields ? "it ends" : "the other one is to end");
    log_line(yields ? LOG_ERROR : LOG_WARNING, "%s", event.text);
    bus_send_event(bus, &event);
    // The one that yields stops its run.
    if (!yields)
        return;
    bus->claim.yielded = true;
    atomic_store(&bus->exchange->stop, true);
    exchange_wake(bus->exchange->step_fd);
}

static void on_claim(const lcm_recv_buf_t *message, const char *channel, void *user)
{
    (void)channel;
    Bus *bus = user;
    pliant_claim_t claim;
    bool read = read_claim(message, &claim);
    // A forged time must not make us yield.
    if (read && !is_plausible(bus, &claim)) {
        bus_refuse(bus, REFUSED_RANGE, "a claim that was held for longer than may be");
        return;
    }
    // Our own claim came back, or all is lost already.
    if (bus->claim.yielded || (read && claim.daemon == bus->claim.daemon))
        return;
    if (!read) {
        bus->claim.asked = true; // any other message requests a status
        return;
    }
    // An answer to our question: there is another daemon on the prefix.
    if (claim.answers != 0 && claim.answers == bus->claim.question) {
        bus->claim.question = 0;
        meet_rival(bus, &claim);
        return;
    }
    if (claim.question == 0)
        return;
    // Answer the question of a daemon or a client.
    publish(bus, 0, claim.question, held_us(bus));
    if (claim.held < 0)
        bus->claim.asked = true;
    else
        ask_rival(bus); // else the rival would know us, but we would not know the rival
}

// Handles a status on our channel that we did not send. Our own are known by the time stamp after
// the fingerprint.
static void on_status(const lcm_recv_buf_t *message, const char *channel, void *user)
{
    (void)channel;
    Bus *bus = user;
    // The time stamp, behind the fingerprint, tells our own statuses from those of others.
    int64_t utime = 0;
    if (message->data_size >= 16)
        for (int i = 8; i < 16; i++)
            utime = (int64_t)((uint64_t)utime << 8 | ((const unsigned char *)message->data)[i]);
    for (int i = 0; i < OWN_STATUSES; i++)
        if (bus->own_status[i] == utime)
            return;
    // A foreign status means a rival: ask it for how long it has held the prefix.
    if (bus->claim.yielded)
        return;
    ask_rival(bus);
    // Warn at most every ten seconds.
    int64_t now = clock_now_ns();
    if (bus->foreign_reported_ns != 0 && now - bus->foreign_reported_ns < 10000000000)
        return;
    bus->foreign_reported_ns = now;
    log_line(LOG_WARNING, "statuses on %s that are not ours: its clients mix both", channel);
}

bool bus_subscribe_claims(Bus *bus, Status *status)
{
    return bus_subscribe_to(bus, bus->channel[OUT_STATUS]->name, on_status, bus, QUEUE, status) &&
           bus_subscribe_to(bus, bus->channel[OUT_CLAIM]->name, on_claim, bus, QUEUE, status);
}

bool bus_yielded(const Bus *bus)
{
    return bus->claim.yielded;
}
