// SPDX-License-Identifier: MIT
#include "run/bus_parts.h"

#include "base/clock.h"
#include "base/log.h"

#include "pliant_lcmtypes.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>

// --- messages out ---

// First value of every sequence on the wire. A test build starts just below the wrap-around.
#ifndef BUS_FIRST_SEQUENCE
#define BUS_FIRST_SEQUENCE 0
#endif

typedef enum OutOf { OF_SERVER, OF_BODY, OF_TOOL } OutOf;

typedef struct OutType {
    const char *channel; // behind the prefix
    OutOf of;
    int (*publish)(lcm_t *lcm, const char *channel, const void *message);
} OutType;

#define OUT_PUBLISH(channel, type, of)                                                             \
    static int publish_##channel(lcm_t *lcm, const char *name, const void *message)                \
    {                                                                                              \
        return pliant_##type##_publish(lcm, name, message);                                        \
    }
OUT_LIST(OUT_PUBLISH)

#define OUT_ROW(channel, type, of) [OUT_##channel] = {"_" #channel, OF_##of, publish_##channel},
static const OutType OUT_TYPES[OUT_KINDS] = {OUT_LIST(OUT_ROW)};

// Names the channels; the reader of scenes has checked their lengths (longest_channel).
static void create_channels(Bus *bus, Arena *arena)
{
    const int counts[] = {[OF_SERVER] = 1,
                          [OF_BODY] = sim_body_count(bus->sim),
                          [OF_TOOL] = sim_tool_count(bus->sim)};
    for (int k = 0; k < OUT_KINDS; k++) {
        const OutType *type = &OUT_TYPES[k];
        const int count = counts[type->of];
        bus->channel[k] = arena_allocate(arena, ARENA_OUTPUT, (size_t)count,
                                         sizeof *bus->channel[k], "run/channels%s", type->channel);
        for (int i = 0; i < count; i++) {
            OutChannel *channel = &bus->channel[k][i];
            const bool of_body = type->of == OF_BODY;
            snprintf(channel->name, sizeof channel->name, "%s%s%s%s", bus->scene->prefix,
                     type->channel, of_body ? "_" : "", of_body ? sim_body(bus->sim, i)->name : "");
            channel->sequence = BUS_FIRST_SEQUENCE;
        }
    }
}

void bus_publish(Bus *bus, Out kind, int index, const void *message)
{
    if (OUT_TYPES[kind].publish(bus->lcm, bus->channel[kind][index].name, message) == 0)
        bus->counts.published++;
    else
        bus->counts.failed++;
}

// --- start ---

// The network may come after us. The signals end the daemon meanwhile, as while it loads.
static void await_route(const Bus *bus, const Network *network, const sigset_t *signals)
{
    char why[RECEIVER_WHY_MAX];
    for (bool said = false; !network_has_route(network, why); said = true) {
        if (!said)
            log_line(LOG_WARNING, "waiting for a network: %s", why);
        service_notify(bus->service, "EXTEND_TIMEOUT_USEC=60000000\nSTATUS=waiting: %s", why);
        pthread_sigmask(SIG_UNBLOCK, signals, NULL);
        nanosleep(&(struct timespec){.tv_sec = 1}, NULL);
        pthread_sigmask(SIG_BLOCK, signals, NULL);
    }
}

static bool join_network(Bus *bus, const char *url, const sigset_t *signals, Status *status)
{
    Network network;
    char why[RECEIVER_WHY_MAX];
    if (!network_read(&network, url, why))
        return status_fail(status, STATUS_INVALID, "%s", why);
    // liblcm would play a log file; ours are applied offline.
    if (strncmp(network.url, "file://", 7) == 0)
        return status_fail(status, STATUS_INVALID,
                           "LCM URL '%s': a log is applied with --input LOG --offline SECONDS",
                           network.url);
    await_route(bus, &network, signals);
    // One LCM object publishes, the receiver hears.
    bus->lcm = network_open(&network, why);
    if (bus->lcm == NULL)
        return status_fail(status, STATUS_FAILED, "%s", why);
    return bus_listen(bus, &network, status) && bus_claim(bus, network.url, status) &&
           bus_subscribe(bus, status);
}

Bus *bus_reserve(World *world, const Scene *scene, Exchange *exchange)
{
    Bus *bus = arena_allocate(&world->arena, ARENA_OUTPUT, 1, sizeof *bus, "run/bus");
    bus->sim = world->sim;
    bus->scene = scene;
    bus->exchange = exchange;
    gate_init(&bus->gate, world->sim, scene->sim.tool_timeout_s, &world->arena);
    create_channels(bus, &world->arena);
    bus_create_streams(bus, &world->arena);
    return bus;
}

bool bus_connect(Bus *bus, const BusOptions *options, Status *status)
{
    bus->describe = options->describe;
    bus->service = options->service;
    const char *url = options->lcm_url != NULL ? options->lcm_url : bus->scene->lcm_url;
    return join_network(bus, url, options->signals, status);
}

// --- the thread ---

static void send_all(Bus *bus)
{
    if (bus->claim.yielded)
        return;
    int64_t now_ns = clock_now_ns();
    bus_report(bus, now_ns);
    bus_send_contacts(bus);
    bus_send_frames(bus, now_ns, false);
    bus_send_meshes(bus, now_ns);
    bus_report_ledger(bus, now_ns);
    bus_send_errors(bus, now_ns);
    bus_send_elements(bus, now_ns);
    bus_send_looks(bus, now_ns);
    bus_report_status(bus, now_ns);
}

// Waits until the next chunk or status is due, a message arrives or the step thread wakes us. A
// step thread without contacts to publish does not wake us, so the wait is short then.
static void wait_for_something(Bus *bus)
{
    int64_t now_ns = clock_now_ns();
    int64_t wait_ns = bus->scene->publish.contact_hz > 0.0 ? 100000000 : 5000000;
    int64_t due_ns = bus_next_chunk_ns(bus), look_ns = service_due_ns(bus->service);
    due_ns = look_ns < due_ns ? look_ns : due_ns;
    if (due_ns != INT64_MAX && due_ns - now_ns < wait_ns)
        wait_ns = due_ns > now_ns ? due_ns - now_ns : 0;
    struct pollfd fds[2] = {{.fd = receiver_file(bus->receiver), .events = POLLIN},
                            {.fd = bus->exchange->bus_fd, .events = POLLIN}};
    struct timespec wait = {.tv_sec = wait_ns / 1000000000, .tv_nsec = wait_ns % 1000000000};
    ppoll(fds, 2, &wait, NULL);
    exchange_clear(bus->exchange->bus_fd);
}

static void *bus_main(void *argument)
{
    Bus *bus = argument;
    bool more = false;
    bus->looked_ns = bus->born_ns = clock_now_ns();
    // Sleep only when the socket is empty; what the step thread left goes out in every iteration.
    while (!atomic_load(&bus->finish)) {
        if (!more)
            wait_for_something(bus);
        bus_look(bus, clock_now_ns());
        more = bus_receive(bus);
        send_all(bus);
        // The service manager hears from this thread, which watches the step thread's beat.
        if (bus->service->told)
            service_look(bus->service, bus->exchange, bus->status, bus->scene->sim.rate_hz,
                         clock_now_ns());
    }
    // The last words: what the other threads left, and the newest frames whole.
    send_all(bus);
    if (!bus->claim.yielded)
        bus_send_frames(bus, clock_now_ns(), true);
    return NULL;
}

bool bus_start(Bus *bus, Status *status)
{
    int error = pthread_create(&bus->thread, NULL, bus_main, bus);
    if (error != 0)
        return status_fail(status, STATUS_FAILED, "cannot start the bus thread: %s",
                           strerror(error));
    pthread_setname_np(bus->thread, "pliant-bus");
    return true;
}

void bus_stop(Bus *bus)
{
    atomic_store(&bus->finish, true);
    exchange_wake(bus->exchange->bus_fd);
    pthread_join(bus->thread, NULL);
}

BusCounts bus_counts(const Bus *bus)
{
    BusCounts counts = bus->counts;
    counts.refused = gate_refused(&bus->gate);
    memcpy(counts.reason, bus->gate.refused, sizeof counts.reason);
    return counts;
}

void bus_disconnect(Bus *bus)
{
    receiver_destroy(bus->receiver);
    bus->receiver = NULL;
    if (bus->lcm != NULL)
        lcm_destroy(bus->lcm);
    bus->lcm = NULL;
}
