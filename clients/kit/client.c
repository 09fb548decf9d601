// SPDX-License-Identifier: MIT
// Connection, waiting and requests of libpliant-client. One thread.
#include "client.h"

#include "wire.h"

#include "pliant_lcmtypes.h"

#include <errno.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/random.h>
#include <time.h>
#include <unistd.h>

bool client_fail(PliantError *error, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error->text, sizeof error->text, format, arguments);
    va_end(arguments);
    return false;
}

// --- connection ---

static bool hear_versions(Client *client);

// Tells a user who expects another host's messages why there are none.
#define NEAR_ONLY " (with ttl=0 only messages of this host arrive)"

static bool join(Client *client, const char *url, PliantError *error)
{
    Network network;
    char why[RECEIVER_WHY_MAX];
    if (!network_read(&network, url, why) || !network_has_route(&network, why))
        return client_fail(error, "%s", why);
    const bool near = network.udpm && network.ttl == 0;
    snprintf(client->url, sizeof client->url, "%s%s", network.url, near ? NEAR_ONLY : "");
    client->lcm = network_open(&network, why);
    if (!client->lcm)
        return client_fail(error, "--lcm-url: %s", why);
    // A client whose messages stay on this host cannot talk to a daemon on another one.
    const ReceiverOptions options = {.receive_bytes = CLIENT_RECEIVE_BYTES,
                                     .remote = network.ttl > 0};
    client->receiver = receiver_create(client->lcm, &network, &options, why);
    return client->receiver || client_fail(error, "%s", why);
}

bool client_connect(Client *client, const PliantOptions *options, PliantError *error)
{
    *client = (Client){.stop_file = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)};
    if (client->stop_file < 0)
        return client_fail(error, "no file descriptor is left: %s", strerror(errno));
    snprintf(client->prefix, sizeof client->prefix, "%s",
             options->prefix ? options->prefix : "PLIANT");
    // A number by which the daemon identifies its senders: 31 bits, never 0.
    uint32_t random;
    if (getrandom(&random, sizeof random, 0) != sizeof random)
        random = (uint32_t)client_now_ns() ^ (uint32_t)getpid() << 16;
    client->sender = (int32_t)(random >> 1 | 1u);
    if (join(client, options->url, error) && hear_versions(client))
        return true;
    client_disconnect(client);
    return false;
}

void client_disconnect(Client *client)
{
    if (client->reply)
        pliant_reply_t_destroy(client->reply);
    receiver_destroy(client->receiver);
    if (client->lcm)
        lcm_destroy(client->lcm);
    if (client->stop_file > 0)
        close(client->stop_file);
    *client = (Client){0};
}

void client_channel(const Client *client, const char *name, const char *body,
                    char channel[CLIENT_CHANNEL_MAX])
{
    snprintf(channel, CLIENT_CHANNEL_MAX, "%s_%s%s%s", client->prefix, name, body ? "_" : "",
             body ? body : "");
}

ReceiverSubscription *client_subscribe(Client *client, const char *name, const char *body,
                                       int queue, lcm_msg_handler_t handler, void *user)
{
    char channel[CLIENT_CHANNEL_MAX];
    client_channel(client, name, body, channel);
    return receiver_subscribe(client->receiver, channel, queue, handler, user);
}

const char *client_body_of(const Client *client, const char *name, const char *channel)
{
    char head[CLIENT_CHANNEL_MAX];
    client_channel(client, name, "", head);
    size_t length = strlen(head);
    return strncmp(channel, head, length) == 0 && channel[length] ? channel + length : NULL;
}

// --- a server of another version ---

// What every server publishes: enough to see that its types are others.
static const struct {
    const char *name;
    const WireType *type;
} HEARD[] = {{"STATUS", &WIRE_STATUS},
             {"CONTACT", &WIRE_CONTACT},
             {"EVENT", &WIRE_EVENT},
             {"REPLY", &WIRE_REPLY},
             {"HELLO", &WIRE_HELLO}};
enum { HEARD_COUNT = sizeof HEARD / sizeof *HEARD };

static void note_hello(Client *client, const void *data, size_t size)
{
    pliant_hello_t hello;
    if (!wire_check(&WIRE_HELLO, data, size) ||
        pliant_hello_t_decode(data, 0, (int)size, &hello) < 0)
        return;
    snprintf(client->server, sizeof client->server, "%.40s %.30s", hello.program, hello.version);
    client->types = hello.types;
    pliant_hello_t_decode_cleanup(&hello);
}

void client_note(Client *client, const char *channel, const void *data, size_t size)
{
    const char *name = channel + strlen(client->prefix) + 1;
    for (int k = 0; k < HEARD_COUNT; k++) {
        const WireType *type = HEARD[k].type;
        if (size < 8 || strcmp(name, HEARD[k].name) != 0)
            continue;
        if (type == &WIRE_HELLO) {
            note_hello(client, data, size);
        } else if (!wire_is(type, data, size)) {
            client->foreign++;
            client->foreign_type = type->name;
        }
    }
}

static void on_heard(const lcm_recv_buf_t *buffer, const char *channel, void *client)
{
    client_note(client, channel, buffer->data, buffer->data_size);
}

static bool hear_versions(Client *client)
{
    enum { QUEUE = 4 };
    bool hears = true;
    for (int k = 0; k < HEARD_COUNT; k++)
        hears = hears && client_subscribe(client, HEARD[k].name, NULL, QUEUE, on_heard, client);
    return hears;
}

bool client_tell_foreign(const Client *client, char *text, size_t size)
{
    if (client->foreign == 0)
        return false;
    const bool known = client->server[0] != '\0';
    const int more = known ? client->types - PLIANT_LCMTYPES_COUNT : 0;
    snprintf(text, size, "%s on %s speaks %s %s than this program: update the %s",
             known ? client->server : "a server", client->prefix,
             more > 0   ? "a newer"
             : more < 0 ? "an older"
                        : "another",
             client->foreign_type,
             more > 0   ? "program"
             : more < 0 ? "server"
                        : "older of the two");
    return true;
}

const char *client_nodes_body(const Client *client, const char *channel)
{
    const char *body = client_body_of(client, "NODES", channel);
    return body ? body : client_body_of(client, "POINTS", channel);
}

// --- waiting ---

int64_t client_now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

int64_t client_utime(void)
{
    struct timespec t;
    clock_gettime(CLOCK_REALTIME, &t);
    return (int64_t)t.tv_sec * 1000000 + t.tv_nsec / 1000;
}

void client_stop(void *client)
{
    const uint64_t one = 1;
    const int file = ((const Client *)client)->stop_file, saved = errno;
    if (file > 0 && write(file, &one, sizeof one) < 0) {
        // It is readable already.
    }
    errno = saved;
}

ClientTurn client_turn(Client *client, int64_t left_ns)
{
    if (client->broken || client->stopped)
        return CLIENT_TURN_OVER;
    struct pollfd poll[] = {{.fd = receiver_file(client->receiver), .events = POLLIN},
                            {.fd = client->stop_file, .events = POLLIN}};
    int ready = 0;
    // In parts: where the network has gone to is looked at in between.
    for (bool first = true; ready == 0 && (first || left_ns > 0); first = false) {
        const int64_t most = RECEIVER_FOLLOW_MS * INT64_C(1000000);
        const int64_t part = left_ns > most ? most : left_ns > 0 ? left_ns : 0;
        receiver_follow(client->receiver);
        ready = ppoll(poll, 2, &(struct timespec){.tv_nsec = part}, NULL);
        left_ns -= part;
    }
    if (ready < 0 && errno == EINTR)
        return CLIENT_TURN_SIGNAL;
    client->stopped = ready > 0 && poll[1].revents != 0;
    client->broken = ready < 0 || (poll[0].revents != 0 && !client->stopped &&
                                   receiver_handle(client->receiver) < 0);
    return client->broken || client->stopped ? CLIENT_TURN_OVER
           : ready > 0                       ? CLIENT_TURN_MESSAGE
                                             : CLIENT_TURN_QUIET;
}

bool client_fail_over(const Client *client, PliantError *error)
{
    return client_fail(error, client->broken ? "the LCM connection failed" : "interrupted");
}

bool client_wait(Client *client, int64_t deadline_ns, const bool *done)
{
    for (;;) {
        if (done && *done && !client->broken)
            return true;
        const int64_t left = deadline_ns - client_now_ns();
        const ClientTurn turn = client_turn(client, left);
        if (turn == CLIENT_TURN_OVER)
            return false;
        // A deadline ends the wait even if messages keep arriving.
        if (turn != CLIENT_TURN_SIGNAL && (turn == CLIENT_TURN_QUIET || left <= 0))
            return true;
    }
}

// --- requests ---

static void on_reply(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Client *client = user;
    pliant_reply_t reply;
    if (!wire_check(&WIRE_REPLY, buffer->data, buffer->data_size) ||
        pliant_reply_t_decode(buffer->data, 0, (int)buffer->data_size, &reply) < 0)
        return;
    // Ours alone: others ask, too.
    if (reply.sender == client->sender && reply.id == client->last_id && !client->reply_come) {
        client->reply = pliant_reply_t_copy(&reply);
        client->reply_come = client->reply != NULL;
    }
    pliant_reply_t_decode_cleanup(&reply);
}

bool client_ask(Client *client, const char *name, ClientPublish *publish, const void *message,
                double timeout_s, int tries, PliantError *error)
{
    char channel[CLIENT_CHANNEL_MAX];
    // Hear replies before the first question.
    if (!client->subscribed && !client_subscribe(client, "REPLY", NULL, 64, on_reply, client))
        return client_fail(error, "LCM refuses to subscribe to %s_REPLY", client->prefix);
    client->subscribed = true;
    // What came to an earlier request is none to this one.
    if (client->reply)
        pliant_reply_t_destroy(client->reply);
    client->reply = NULL;
    client->reply_come = false;
    client->last_id++;
    client_channel(client, name, NULL, channel);
    // The same id each time, so that the daemon executes the request once.
    for (int k = 0; k < tries && !client->reply_come; k++) {
        publish(client, channel, message);
        int64_t deadline = client_now_ns() + (int64_t)(timeout_s * 1e9);
        if (!client_wait(client, deadline, &client->reply_come))
            return client_fail_over(client, error);
    }
    // No answer, or one that says no.
    if (!client->reply_come && client_tell_foreign(client, error->text, sizeof error->text))
        return false;
    if (!client->reply_come)
        return client_fail(error, "no reply on %s_REPLY within %g s: is pliantd running on %s?",
                           client->prefix, timeout_s * tries, client->url);
    if (!client->reply->ok)
        return client_fail(error, "the daemon refuses: %s", client->reply->text);
    return true;
}

static void publish_command(Client *client, const char *channel, const void *message)
{
    pliant_command_t command = *(const pliant_command_t *)message;
    command.utime = client_utime();
    command.sender = client->sender;
    command.id = client->last_id;
    pliant_command_t_publish(client->lcm, channel, &command);
}

bool client_request(Client *client, int32_t kind, int64_t value, const char *argument,
                    double timeout_s, int tries, PliantError *error)
{
    char text[256];
    snprintf(text, sizeof text, "%s", argument);
    const pliant_command_t command = {.kind = kind, .value = value, .argument = text};
    return client_ask(client, "COMMAND", publish_command, &command, timeout_s, tries, error);
}
