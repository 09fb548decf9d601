// What every client program shares: options, connection, waiting, requests. One thread: the one
// that called client_connect. Prints nothing but what client_print_* is asked to, and never exits.
#ifndef PLIANT_CLIENTS_CLIENT_H
#define PLIANT_CLIENTS_CLIENT_H

#include <argp.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <lcm/lcm.h>

#include "pliant_reply_t.h"

enum {
    CLIENT_PREFIX_MAX = 32,  // with the longest body name a channel still has at most 63 characters
    CLIENT_CHANNEL_MAX = 64, // LCM's own limit, with the terminating zero
    CLIENT_URL_MAX = 256,
    CLIENT_RECEIVE_BYTES = 2097152, // kernel buffer asked for: bursts of 4 MB arrive whole
};

// One sentence that names the thing, the value and the limit.
typedef struct ClientError {
    char text[1024];
} ClientError;

// Sets the text and returns false, so that callers can write `return client_fail(error, ...)`.
bool client_fail(ClientError *error, const char *format, ...) __attribute__((format(printf, 2, 3)));

// --- options ---

typedef struct ClientOptions {
    const char *url;    // NULL: LCM_DEFAULT_URL, else LCM's default
    const char *prefix; // NULL: "PLIANT"
} ClientOptions;

// -l/--lcm-url and --prefix, as a child parser; its input is a ClientOptions.
extern const struct argp CLIENT_ARGP;

// Letters, digits, '_' and '-' only, 1 to `max` of them: what may stand in a channel, where
// subscriptions are patterns.
bool client_name_valid(const char *name, size_t max);

// Numbers from arguments: the whole text, finite, inside [low, high].
bool client_parse_number(const char *text, double low, double high, double *number);
bool client_parse_integer(const char *text, long low, long high, long *number);
// "X,Y,Z", finite, each inside [-limit, limit].
bool client_parse_vector(const char *text, double limit, double vector[3]);
// Numbers of a line between white space: how many, at most `most`; -1: something else, or more.
int client_read_numbers(const char *line, double *number, int most);

// The URL that a client opens: `url`, else `fallback` (LCM_DEFAULT_URL), else LCM's default; with
// recv_buf_size added to a udpm URL that does not set it (unless 0). False when it does not fit.
bool client_url(const char *url, const char *fallback, int receive_bytes, char *out, size_t size);

// --- connection ---

typedef struct Client {
    lcm_t *lcm;
    char url[CLIENT_URL_MAX]; // as the user gave it
    char prefix[CLIENT_PREFIX_MAX];
    int32_t sender; // drawn at random
    int32_t last_id;
    bool broken;                 // the connection failed; client_wait returns at once
    pliant_reply_t *reply;       // the answer to last_id, or NULL
    bool reply_come, subscribed; // `subscribed`: to _REPLY
} Client;

// Connects; on failure nothing is held. Checks the multicast route first, because LCM's own
// complaint prints a wrong address.
bool client_connect(Client *client, const ClientOptions *options, ClientError *error);
void client_disconnect(Client *client);

// "<PREFIX>_<name>" or "<PREFIX>_<name>_<body>" (body may be NULL).
void client_channel(const Client *client, const char *name, const char *body,
                    char channel[CLIENT_CHANNEL_MAX]);
// Subscribes with room for `queue` messages; the handler runs inside client_wait. `body` may be the
// pattern ".+". NULL when LCM refuses.
lcm_subscription_t *client_subscribe(Client *client, const char *name, const char *body, int queue,
                                     lcm_msg_handler_t handler, void *user);
// The body of a channel "<PREFIX>_<name>_<body>", or NULL when it is none.
const char *client_body_of(const Client *client, const char *name, const char *channel);

// --- waiting ---

// SIGINT, SIGTERM and SIGHUP end the next waits instead of the program. Call it before
// client_connect, so that liblcm's threads leave these signals to us.
void client_catch_signals(void);
bool client_stopped(void);

// CLOCK_MONOTONIC [ns] and CLOCK_REALTIME [us].
int64_t client_now_ns(void);
int64_t client_utime(void);

// Handles messages until `deadline_ns`, or until `*done` (may be NULL), a signal or a broken
// connection. True when the deadline or `*done` was reached.
bool client_wait(Client *client, int64_t deadline_ns, const bool *done);

// Waits until a daemon is heard (_CONTACT or _STATUS), so that one that is just starting misses
// nothing of a path. False with a sentence: silence for `timeout_s`, a signal or a broken
// connection.
bool client_hear_daemon(Client *client, double timeout_s, ClientError *error);

// --- requests ---

// Sends a command and waits for its reply; sends it again with the same id, so that the daemon
// executes it once, `tries` times in all, each with `timeout_s`. The reply in client->reply stays
// until the next request. False: no reply (or refused: reply->ok is false).
bool client_request(Client *client, int32_t kind, int64_t value, const char *argument,
                    double timeout_s, int tries, ClientError *error);

// --- printing ---

// Text that came from the network: control characters become '?', line breaks stay if `lines`.
void client_print_text(FILE *out, const char *text, bool lines);
// "program: text" on stderr.
void client_print_error(const char *program, const ClientError *error);

#endif
