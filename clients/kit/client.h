// SPDX-License-Identifier: MIT
// The inside of libpliant-client: connection, waiting, requests, and which server answers. Programs
// that handle messages raw (pliant-web, -record, -play, -drake) use it too. One thread: the one
// that called client_connect. Never exits or prints.
#ifndef PLIANT_CLIENTS_CLIENT_H
#define PLIANT_CLIENTS_CLIENT_H

#include "pliant/client.h"

#include "receiver.h"

#include "pliant_reply_t.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    CLIENT_PREFIX_MAX = 32,  // with the longest body name a channel still has at most 63 characters
    CLIENT_CHANNEL_MAX = 64, // LCM's own limit, with the terminating zero
    CLIENT_URL_MAX = 320,
    CLIENT_RECEIVE_BYTES = 2097152, // requested kernel buffer: bursts of 4 MB arrive complete
};

// Sets the text and returns false, for `return client_fail(error, ...)`.
bool client_fail(PliantError *error, const char *format, ...) __attribute__((format(printf, 2, 3)));

// --- connection ---

typedef struct Client {
    lcm_t *lcm;               // publishes only
    Receiver *receiver;       // receives all messages
    char url[CLIENT_URL_MAX]; // for error texts: as the user gave it, and whom it reaches
    char prefix[CLIENT_PREFIX_MAX];
    int32_t sender; // random
    int32_t last_id;
    int stop_file;               // readable after client_stop
    bool broken;                 // the connection failed; client_wait returns at once
    bool stopped;                // a wait has seen client_stop
    pliant_reply_t *reply;       // the answer to last_id, or NULL
    bool reply_come, subscribed; // `subscribed`: to _REPLY
    // a server of another version
    int64_t foreign;          // its messages that are of another type than ours
    const char *foreign_type; // of ours, the last one
    char server[80];          // "pliantd 0.1.0", by its hello; "": not heard yet
    int32_t types;            // that it knows
} Client;

// Connects; on failure nothing is left open. Hears other hosts if the URL's time to live lets
// messages leave this one.
bool client_connect(Client *client, const PliantOptions *options, PliantError *error);
void client_disconnect(Client *client);

// Writes "<PREFIX>_<name>" or "<PREFIX>_<name>_<body>" (body may be NULL).
void client_channel(const Client *client, const char *name, const char *body,
                    char channel[CLIENT_CHANNEL_MAX]);
// Subscribes; the handler runs inside client_wait. `body` may be the pattern ".+". `queue` and NULL
// as in receiver_subscribe.
ReceiverSubscription *client_subscribe(Client *client, const char *name, const char *body,
                                       int queue, lcm_msg_handler_t handler, void *user);
// Takes notes of a message for client_tell_foreign; a connected client does that itself.
void client_note(Client *client, const char *channel, const void *data, size_t size);
// Writes a sentence about a server of another version, which must not be taken for none; returns
// false if none was heard.
bool client_tell_foreign(const Client *client, char *text, size_t size);
// Returns the body in a channel "<PREFIX>_<name>_<body>", or NULL for other channels.
const char *client_body_of(const Client *client, const char *name, const char *channel);
// Likewise of positions, on "_NODES_" and on "_POINTS_": nodes_frame_add takes both.
const char *client_nodes_body(const Client *client, const char *channel);

// --- waiting ---

// Return CLOCK_MONOTONIC [ns] and CLOCK_REALTIME [us].
int64_t client_now_ns(void);
int64_t client_utime(void);

// Ends the wait in progress and each later one. Async-signal-safe, from any thread.
void client_stop(void *client);

// What one turn of waiting has brought.
typedef enum ClientTurn {
    CLIENT_TURN_MESSAGE, // a packet was handled
    CLIENT_TURN_QUIET,   // none came
    CLIENT_TURN_SIGNAL,  // a signal was
    CLIENT_TURN_OVER,    // stopped, or the connection is broken
} ClientTurn;

// Waits for at most `left_ns` (below 0: 0) and handles at most one packet.
ClientTurn client_turn(Client *client, int64_t left_ns);
// Sets the sentence of a wait that was stopped, or broke. Returns false.
bool client_fail_over(const Client *client, PliantError *error);

// Handles messages until `deadline_ns`, `*done` (may be NULL), client_stop or a broken connection.
// Returns true if the deadline or `*done` was reached.
bool client_wait(Client *client, int64_t deadline_ns, const bool *done);

// --- requests ---

// Sends a command and waits for its reply; repeats it with the same id, so that the daemon executes
// it once, `tries` times in all, each with `timeout_s`. client->reply keeps the reply until the
// next request. Returns false without reply, or if the command is refused (reply->ok is false).
bool client_request(Client *client, int32_t kind, int64_t value, const char *argument,
                    double timeout_s, int tries, PliantError *error);

// The same for any request: `publish` sends the message, each time with client->last_id as its id,
// which this call has drawn, and with client->sender.
typedef void ClientPublish(Client *client, const char *channel, const void *message);
bool client_ask(Client *client, const char *name, ClientPublish *publish, const void *message,
                double timeout_s, int tries, PliantError *error);

// --- the daemon that serves ----------------------------------------------------------------------

// Identifies the daemon that serves: a request is for the daemon that runs when it is made, and is
// dropped with it. The daemon's number comes with its answers to questions on _CLAIM. A restarted
// daemon draws another number, and listens only after a quarter of a second without an answer. What
// is sent while an answer is younger than that can therefore reach no other daemon. One thread, the
// one that connected.

// Error text of a request whose daemon is gone.
#define SESSION_GONE "the daemon that this was sent to is gone"

typedef struct Session {
    Client *client;
    bool *change;               // set by each answer; may be NULL
    int64_t daemon;             // that answered last; 0: none
    int64_t question, asked_ns; // open question; 0: none
    int64_t sure_until_ns;      // no other daemon listens before this time
} Session;

// Subscribes to claims, handled inside client_wait. Returns false if LCM refuses.
bool session_open(Session *session, Client *client, bool *change);
// Publishes a question, unless one is open or the answer stays valid for a while.
void session_ask(Session *session);
bool session_is_sure(const Session *session, int64_t now_ns);

#endif
