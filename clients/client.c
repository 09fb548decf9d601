// Shared by every client program: options, connection, waiting, requests. One thread.
#include "client.h"

#include "wire.h"

#include "pliant_lcmtypes.h"

#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

bool client_fail(ClientError *error, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error->text, sizeof error->text, format, arguments);
    va_end(arguments);
    return false;
}

// --- options ---

const ArgumentRow CLIENT_WHERE[] = {
    {"lcm-url", 'l', ARGUMENT_TEXT, "URL", offsetof(ClientOptions, url),
     .help = "LCM network (default: LCM_DEFAULT_URL, else LCM's own default)"},
    {"prefix", 0, ARGUMENT_NAME, "NAME", offsetof(ClientOptions, prefix), .preset_text = "PLIANT",
     .help = "prefix of the channels"},
    {0}};

const ArgumentRow CLIENT_INPUT_PREFIX[] = {
    {"input-prefix", 0, ARGUMENT_NAME, "NAME",
     .help = "prefix of tools and commands, if the scene has an input_prefix (default: as "
             "--prefix)"},
    {0}};

int client_read_numbers(const char *line, double *number, int most)
{
    int count = 0;
    for (const char *at = line;;) {
        // One number after the other, separated by blanks.
        while (isspace((unsigned char)*at))
            at++;
        if (!*at)
            return count;
        char *after;
        double value = strtod(at, &after);
        bool whole = after != at && (!*after || isspace((unsigned char)*after));
        if (!whole || !isfinite(value) || count == most)
            return -1;
        number[count++] = value;
        at = after;
    }
}

// --- connection ---

static bool hear_versions(Client *client);

// Tells a user who expects another host's messages why there are none.
#define NEAR_ONLY " (with ttl=0 only messages of this host arrive)"

static bool join(Client *client, const char *url, ClientError *error)
{
    Network network;
    char why[RECEIVER_WHY_MAX];
    if (!network_read(&network, url, why) || !network_has_route(&network, why))
        return client_fail(error, "%s", why);
    const bool near = network.udpm && network.ttl == 0;
    snprintf(client->url, sizeof client->url, "%s%s", network.url, near ? NEAR_ONLY : "");
    client->lcm = lcm_create(network.url);
    if (!client->lcm)
        return client_fail(error, "--lcm-url %s: LCM cannot open it", client->url);
    // A client whose messages stay on this host cannot talk to a daemon on another one.
    const ReceiverOptions options = {.receive_bytes = CLIENT_RECEIVE_BYTES,
                                     .remote = network.ttl > 0};
    client->receiver = receiver_create(client->lcm, &network, &options, why);
    return client->receiver || client_fail(error, "%s", why);
}

bool client_connect(Client *client, const ClientOptions *options, ClientError *error)
{
    *client = (Client){0};
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

static volatile sig_atomic_t stop_signal;
static bool catches_signals; // else they are the business of the program that uses this

static void note_signal(int signal)
{
    stop_signal = signal;
}

// The signals stay blocked except inside ppoll, so that none is lost between a test and the wait.
void client_catch_signals(void)
{
    struct sigaction action = {.sa_handler = note_signal};
    sigset_t mask;
    sigemptyset(&mask);
    for (int k = 0; k < 3; k++) {
        int signal = (const int[]){SIGINT, SIGTERM, SIGHUP}[k];
        sigaction(signal, &action, NULL);
        sigaddset(&mask, signal);
    }
    sigprocmask(SIG_BLOCK, &mask, NULL);
    catches_signals = true;
}

bool client_stopped(void)
{
    return stop_signal != 0;
}

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

bool client_wait(Client *client, int64_t deadline_ns, const bool *done)
{
    sigset_t open;
    sigemptyset(&open);
    while (!client->broken) {
        if (done && *done)
            return true;
        // Signals are let in during the wait alone, so that none is missed before it.
        int64_t left = deadline_ns - client_now_ns();
        if (left < 0)
            left = 0;
        struct timespec timeout = {left / 1000000000, left % 1000000000};
        struct pollfd poll = {.fd = receiver_file(client->receiver), .events = POLLIN};
        int ready = ppoll(&poll, 1, &timeout, catches_signals ? &open : NULL);
        // A signal ends the wait; messages are handled until the deadline.
        if (client_stopped())
            return false;
        if (ready > 0)
            client->broken = receiver_handle(client->receiver) < 0;
        else if (ready < 0 && errno != EINTR)
            client->broken = true;
        // A deadline ends the wait even if messages keep arriving.
        if ((ready == 0 || left == 0) && !client->broken)
            return true;
    }
    return false;
}

static void on_anything(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)buffer;
    (void)channel;
    *(bool *)user = true;
}

bool client_hear_daemon(Client *client, double timeout_s, ClientError *error)
{
    bool heard = false;
    // Contacts or statuses: one of them is always published.
    ReceiverSubscription *on[2] = {
        client_subscribe(client, "CONTACT", NULL, 1, on_anything, &heard),
        client_subscribe(client, "STATUS", NULL, 1, on_anything, &heard)};
    client_wait(client, client_now_ns() + (int64_t)(timeout_s * 1e9), &heard);
    for (int k = 0; k < 2; k++)
        receiver_unsubscribe(client->receiver, on[k]);
    // Say why nothing was heard.
    if (heard)
        return true;
    if (client_stopped())
        return client_fail(error, "interrupted");
    if (client->broken)
        return client_fail(error, "the LCM connection failed");
    return client_fail(error,
                       "no message on %s_CONTACT and %s_STATUS within %g s: no pliantd on %s, or "
                       "one with another prefix (--prefix)?",
                       client->prefix, client->prefix, timeout_s, client->url);
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
                double timeout_s, int tries, ClientError *error)
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
            return client_fail(error, client->broken ? "the LCM connection failed" : "interrupted");
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
                    double timeout_s, int tries, ClientError *error)
{
    char text[256];
    snprintf(text, sizeof text, "%s", argument);
    const pliant_command_t command = {.kind = kind, .value = value, .argument = text};
    return client_ask(client, "COMMAND", publish_command, &command, timeout_s, tries, error);
}

// --- bodies by name ---

void client_bodies_add(ClientBodies *bodies, const char *name)
{
    size_t used = strlen(bodies->list);
    snprintf(bodies->list + used, sizeof bodies->list - used, "%s%s", bodies->count > 0 ? ", " : "",
             name);
    bodies->found |= strcmp(name, bodies->wanted) == 0;
    bodies->count++;
}

bool client_bodies_check(const ClientBodies *bodies, ClientError *error)
{
    return bodies->found || client_fail(error, "the daemon has no body '%s', only: %s",
                                        bodies->wanted, bodies->list);
}

bool client_described_body(const Client *client, const char *wanted, ClientError *error)
{
    ClientBodies bodies = {.wanted = wanted};
    const char *line = client->reply != NULL ? client->reply->text : NULL;
    // Its lines of bodies.
    for (; line != NULL; line = strchr(line, '\n')) {
        char name[CLIENT_CHANNEL_MAX];
        line += *line == '\n';
        if (sscanf(line, "body %63[^: \n]", name) == 1)
            client_bodies_add(&bodies, name);
    }
    return bodies.count == 0 || client_bodies_check(&bodies, error);
}

// --- printing ---

void client_print_text(FILE *out, const char *text, bool lines)
{
    for (; *text; text++) {
        unsigned char c = (unsigned char)*text;
        // C1 controls are c2 80 .. c2 9f in UTF-8; c2 is masked there.
        bool control = c < 0x20 || c == 0x7f || (c == 0xc2 && (unsigned char)text[1] < 0xa0);
        putc(control && !(lines && (c == '\n' || c == '\t')) ? '?' : c, out);
    }
}

void client_print_error(const char *program, const ClientError *error)
{
    fprintf(stderr, "%s: ", program);
    client_print_text(stderr, error->text, true); // it may quote the daemon
    fputc('\n', stderr);
}

// --- text files that a client writes -------------------------------------------------------------

enum { MARK_MOST = 128 };

static bool begins_with(int fd, const char *mark)
{
    char head[MARK_MOST];
    size_t length = strnlen(mark, sizeof head);
    return pread(fd, head, length, 0) == (ssize_t)length && memcmp(head, mark, length) == 0;
}

static bool check(const char *path, int fd, const struct stat *facts, const char *mark,
                  ClientError *error)
{
    return !S_ISREG(facts->st_mode) || facts->st_size == 0 || begins_with(fd, mark) ||
           client_fail(error, "%s: has other contents: it is not replaced", path);
}

bool client_may_write(const char *path, const char *mark, ClientError *error)
{
    struct stat facts;
    if (stat(path, &facts) != 0 || !S_ISREG(facts.st_mode))
        return true; // other faults show when it is written
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    bool ok = fd >= 0 ? check(path, fd, &facts, mark, error)
                      : client_fail(error, "%s: %s", path, strerror(errno));
    if (fd >= 0)
        close(fd);
    return ok;
}

FILE *client_open_output(const char *path, const char *mark, ClientError *error)
{
    struct stat facts;
    // Open a pipe normally: its reader may come later.
    bool regular = stat(path, &facts) != 0 || S_ISREG(facts.st_mode);
    int fd = open(path, (regular ? O_RDWR : O_WRONLY) | O_CREAT | O_CLOEXEC, 0666);
    bool ok = fd >= 0 && fstat(fd, &facts) == 0;
    if (!ok)
        client_fail(error, "%s: %s", path, strerror(errno));
    ok = ok && check(path, fd, &facts, mark, error);
    FILE *file = NULL;
    if (ok && ((S_ISREG(facts.st_mode) && ftruncate(fd, 0) != 0) || !(file = fdopen(fd, "w"))))
        client_fail(error, "%s: %s", path, strerror(errno));
    if (!file && fd >= 0)
        close(fd);
    return file;
}
