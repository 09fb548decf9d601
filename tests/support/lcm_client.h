// SPDX-License-Identifier: MIT
// The other end of the daemon's messages: sends inputs, remembers what came back.
#ifndef PLIANT_TESTS_LCM_CLIENT_H
#define PLIANT_TESTS_LCM_CLIENT_H

#include "harness.h"

#include "pliant_command_t.h"
#include "pliant_contact_t.h"
#include "pliant_cut_t.h"
#include "pliant_load_t.h"
#include "pliant_tie_t.h"
#include "pliant_tool_pose_t.h"

enum { REPLIES_MAX = 512, EVENTS_MAX = 512, REASONS_MAX = 32, NODES_MAX = 12000 };

typedef struct Reply {
    int32_t sender, id;
    bool ok;
    int64_t step;
    int separated, nodes_added, pieces;
    char channel[64], text[4096];
    int64_t frame_step, contact_step; // of the newest frame and contact received before it
} Reply;

typedef struct Event {
    char kind[32], text[256];
} Event;

typedef struct StatusSeen {
    int count;
    char state[32];
    int64_t step, late_ticks, resets, rejected;
    int reasons;
    char reason[REASONS_MAX][64];
    int64_t reason_count[REASONS_MAX];
    double max_displacement, kinetic, estimated_error;
    char integrator[32]; // of the first body
} StatusSeen;

typedef struct FramesSeen {
    int chunks, whole; // chunks received, frames whose every chunk came
    int parts;         // chunks of the present frame
    int32_t sequence, topology;
    int node_count, gaps; // sequences that were skipped
    int64_t step;         // of the newest whole frame
    int64_t previous_step;
    bool ordered; // steps always grew
    float position[3 * NODES_MAX];
} FramesSeen;

typedef struct MeshSeen {
    int whole, parts, nodes, triangles;
    int32_t sequence, topology;
    bool in_range;                    // every index named a node
    int whole_nodes, whole_triangles; // of the last whole mesh
} MeshSeen;

typedef struct Subscriptions Subscriptions;

typedef struct Client {
    lcm_t *lcm;
    Subscriptions *on;
    int32_t sender, next_id, pose_sequence;
    Reply *reply; // [REPLIES_MAX]
    int replies;
    Event *event; // [EVENTS_MAX]
    int events;
    StatusSeen status;
    FramesSeen frames, velocities;
    MeshSeen mesh;
    pliant_contact_t contact; // the newest, of contact_tool unless that is 0
    int contact_tool;
    int contacts;
} Client;

// Connects on the default URL and prefix PLIANT; waits for nothing.
Client *client_create(void);
void client_destroy(Client *client);
void client_close(Client **client);
#define SCOPED_CLIENT SCOPED(client_close)
// Handles messages for at most `ms` milliseconds, or until the first ones have been handled.
void client_listen(Client *client, int ms);
double client_now(void); // [s]

// Listens until the condition holds; fails the test after a minute.
#define wait_until(client, condition)                                                              \
    do {                                                                                           \
        double limit_ = client_now() + 60.0;                                                       \
        while (!(condition) && client_now() < limit_)                                              \
            client_listen(client, 20);                                                             \
        if (!(condition))                                                                          \
            fail_msg("waited in vain for: %s", #condition);                                        \
    } while (0)

// The daemon is up when its first status has come.
void client_wait_for_daemon(Client *client);

// A client, and a server with these arguments that has answered it.
Client *server_start(Process *server, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
// The server, for a client that is there already.
#define server_start_for(client, server, ...)                                                      \
    do {                                                                                           \
        daemon_start(server, __VA_ARGS__);                                                         \
        client_wait_for_daemon(client);                                                            \
    } while (0)
// Ends a server by STOP; fails the test unless its exit code is 0.
void server_stop(Client *client, Process *server);

// A handler of messages of a type, which gets each one as `message` and `user` as subscribed.
#define HANDLER(name, type, message)                                                               \
    static void name(__attribute__((unused)) const lcm_recv_buf_t *buffer,                         \
                     __attribute__((unused)) const char *channel, const type *message, void *user)
// One of messages as they come, in buffer->data and buffer->data_size.
#define RAW_HANDLER(name)                                                                          \
    static void name(const lcm_recv_buf_t *buffer, __attribute__((unused)) const char *channel,    \
                     void *user)

// A server that a group of tests shares, and the client that it answers.
typedef struct Fixture {
    Process daemon;
    Client *client;
} Fixture;

// For the setup of a group: starts the server with these arguments and waits until it is up; *state
// is the fixture, of which there is one.
int fixture_start(void **state, const char *format, ...) __attribute__((format(printf, 2, 3)));
// For the teardown: ends the server by SIGTERM and returns its exit code.
int fixture_end(void **state);

// Requests return their id; poses their sequence.
int32_t send_command(Client *client, int kind, int64_t value, const char *argument);
// Sends the commands from id `first` on again that have no answer yet: on a busy machine datagrams
// get lost.
void repeat_unanswered(Client *client, int32_t first, int kind, int64_t value,
                       const char *argument);
int32_t send_load(Client *client, const double center[3], double radius, const double force[3],
                  double duration, const char *body);
// A tie of `body` at the sphere, of usual stiffness, as no message yet.
pliant_tie_t make_tie(Client *client, int kind, const double center[3], double radius,
                      const char *body);
// A sweep of `body` in the plane at this x, along y from -reach to reach, through as much of z, as
// no message yet.
pliant_cut_t make_cut(Client *client, double x, double reach, const char *body);
// A pose of tool 1 at `position`, upright.
pliant_tool_pose_t make_pose(Client *client, const double position[3]);
int64_t send_pose(Client *client, const pliant_tool_pose_t *pose);
int64_t send_pose_at(Client *client, const double position[3]); // of make_pose
// Sends a pose of tool 1 there again and again until the condition holds; fails the test after a
// minute.
#define hold_pose_until(client, position, condition)                                               \
    do {                                                                                           \
        const double limit_ = client_now() + 60.0;                                                 \
        while (!(condition) && client_now() < limit_) {                                            \
            const pliant_tool_pose_t pose_ = make_pose((client), (position));                      \
            send_pose((client), &pose_);                                                           \
            client_listen((client), 2);                                                            \
        }                                                                                          \
        if (!(condition))                                                                          \
            fail_msg("kept the tool there in vain for: %s", #condition);                           \
    } while (0)

void send_bytes(Client *client, const char *channel, const void *data, size_t size);

// The newest reply to a request, or NULL; and how many came.
const Reply *find_reply(const Client *client, int32_t id);
int count_replies(const Client *client, int32_t id);
// Sends a command, and the same one again each second, for datagrams get lost on a busy machine,
// until its reply has come; fails the test after a minute.
const Reply *command(Client *client, int kind, int64_t value, const char *argument);
// STEP: so many ticks; fails the test if it is refused.
const Reply *step_daemon(Client *client, int64_t ticks);
const Reply *apply_load(Client *client, const double center[3], double radius,
                        const double force[3], double duration, const char *body);
const Reply *apply_tie(Client *client, const pliant_tie_t *tie);
// Any request, likewise: `publish` sends the message.
const Reply *answer_to(Client *client, int32_t id,
                       void (*publish)(Client *client, const void *message), const void *message);
// A command each 50 ms until a reply is `ok`, as a client does that counts on loss; returns how
// often it was sent. The reply is that to client->next_id. `also` (may be NULL) is listened to
// meanwhile.
int insist(Client *client, Client *also, int kind, int64_t value, const char *argument);
bool saw_event(const Client *client, const char *kind);
const char *event_text(const Client *client, const char *kind); // of the first such one; "": none
int64_t refused(const Client *client, const char *reason);
// A status that was sent after everything before this call had been handled.
void client_fresh_status(Client *client);

#endif
