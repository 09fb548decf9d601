// SPDX-License-Identifier: MIT
#include "lcm_client.h"
#include "scoped.h"

#include "pliant_event_t.h"
#include "pliant_mesh_t.h"
#include "pliant_nodes_t.h"
#include "pliant_reply_t.h"
#include "pliant_status_t.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

double client_now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int64_t utime_now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_REALTIME, &t);
    return (int64_t)t.tv_sec * 1000000 + t.tv_nsec / 1000;
}

// --- what came ---

static void on_reply(const lcm_recv_buf_t *buffer, const char *channel, const pliant_reply_t *m,
                     void *user)
{
    (void)buffer;
    (void)channel;
    Client *client = user;
    if (m->sender != client->sender && client->replies >= REPLIES_MAX / 2)
        return; // room for our own
    assert_true(client->replies < REPLIES_MAX);
    Reply *reply = &client->reply[client->replies++];
    *reply = (Reply){.sender = m->sender,
                     .id = m->id,
                     .ok = m->ok != 0,
                     .step = m->step,
                     .separated = m->separated,
                     .nodes_added = m->nodes_added,
                     .pieces = m->pieces,
                     .frame_step = client->frames.step,
                     .contact_step = client->contact.step};
    snprintf(reply->channel, sizeof reply->channel, "%s", m->channel);
    snprintf(reply->text, sizeof reply->text, "%s", m->text);
}

static void on_event(const lcm_recv_buf_t *buffer, const char *channel, const pliant_event_t *m,
                     void *user)
{
    (void)buffer;
    (void)channel;
    Client *client = user;
    if (client->events == EVENTS_MAX)
        return;
    Event *event = &client->event[client->events++];
    snprintf(event->kind, sizeof event->kind, "%s", m->kind);
    snprintf(event->text, sizeof event->text, "%s", m->text);
}

static void on_status(const lcm_recv_buf_t *buffer, const char *channel, const pliant_status_t *m,
                      void *user)
{
    (void)buffer;
    (void)channel;
    StatusSeen *seen = &((Client *)user)->status;
    seen->count++;
    snprintf(seen->state, sizeof seen->state, "%s", m->state);
    seen->step = m->step;
    seen->late_ticks = m->late_ticks;
    seen->resets = m->resets;
    seen->rejected = m->rejected;
    seen->reasons = m->num_reasons < REASONS_MAX ? m->num_reasons : REASONS_MAX;
    for (int i = 0; i < seen->reasons; i++) {
        snprintf(seen->reason[i], sizeof seen->reason[i], "%s", m->reason[i]);
        seen->reason_count[i] = m->count[i];
    }
    if (m->num_bodies > 0) {
        seen->max_displacement = m->body[0].max_displacement;
        seen->estimated_error = m->body[0].estimated_error;
        seen->kinetic = m->body[0].kinetic;
        snprintf(seen->integrator, sizeof seen->integrator, "%s", m->body[0].integrator);
    }
}

static void see_chunk(FramesSeen *seen, const pliant_nodes_t *m)
{
    seen->chunks++;
    if (m->sequence != seen->sequence) {
        if (seen->sequence != 0 && (uint32_t)m->sequence != (uint32_t)seen->sequence + 1)
            seen->gaps++;
        seen->parts = 0;
    }
    seen->sequence = m->sequence;
    seen->topology = m->topology;
    seen->node_count = m->node_count;
    assert_in_range(m->first + m->num_values / 3, 0, NODES_MAX);
    memcpy(seen->position + 3 * m->first, m->position, (size_t)m->num_values * sizeof(float));
    if (++seen->parts == m->chunk_count) {
        seen->ordered = seen->whole == 0 || (seen->ordered && m->step >= seen->step);
        seen->previous_step = seen->step;
        seen->step = m->step;
        seen->whole++;
    }
}

static void on_nodes(const lcm_recv_buf_t *buffer, const char *channel, const pliant_nodes_t *m,
                     void *user)
{
    (void)buffer;
    (void)channel;
    see_chunk(&((Client *)user)->frames, m);
}

static void on_velocities(const lcm_recv_buf_t *buffer, const char *channel,
                          const pliant_nodes_t *m, void *user)
{
    (void)buffer;
    (void)channel;
    see_chunk(&((Client *)user)->velocities, m);
}

static void on_mesh(const lcm_recv_buf_t *buffer, const char *channel, const pliant_mesh_t *m,
                    void *user)
{
    (void)buffer;
    (void)channel;
    MeshSeen *seen = &((Client *)user)->mesh;
    if (m->sequence != seen->sequence)
        seen->parts = seen->nodes = seen->triangles = 0;
    seen->sequence = m->sequence;
    seen->topology = m->topology;
    seen->in_range = seen->parts == 0 || seen->in_range;
    for (int i = 0; i < m->num_indices; i++)
        if (m->triangle[i] < 0 || m->triangle[i] >= m->node_count)
            seen->in_range = false;
    seen->nodes += m->num_nodes;
    seen->triangles += m->num_indices / 3;
    if (++seen->parts == m->chunk_count && seen->nodes == m->node_count &&
        seen->triangles == m->triangle_count) {
        seen->whole++;
        seen->whole_nodes = seen->nodes;
        seen->whole_triangles = seen->triangles;
    }
}

static void on_contact(const lcm_recv_buf_t *buffer, const char *channel, const pliant_contact_t *m,
                       void *user)
{
    (void)buffer;
    (void)channel;
    Client *client = user;
    if (client->contact_tool != 0 && m->tool != client->contact_tool)
        return;
    client->contact = *m;
    client->contacts++;
}

// --- the connection ---

// The generated ones are allocated and freed by unsubscribing alone.
struct Subscriptions {
    pliant_reply_t_subscription_t *reply;
    pliant_event_t_subscription_t *event;
    pliant_status_t_subscription_t *status;
    pliant_nodes_t_subscription_t *nodes, *velocity;
    pliant_mesh_t_subscription_t *mesh;
    pliant_contact_t_subscription_t *contact;
};

Client *client_create(void)
{
    static int32_t senders = 1000;
    Client *client = zeroed(1, sizeof *client);
    client->reply = calloc(REPLIES_MAX, sizeof *client->reply);
    client->event = calloc(EVENTS_MAX, sizeof *client->event);
    client->sender = ++senders;
    client->lcm = lcm_create(NULL);
    assert_non_null(client->lcm);
    Subscriptions *on = client->on = calloc(1, sizeof *on);
    assert_non_null(on);
    on->reply = pliant_reply_t_subscribe(client->lcm, "PLIANT_REPLY", on_reply, client);
    on->event = pliant_event_t_subscribe(client->lcm, "PLIANT_EVENT", on_event, client);
    on->status = pliant_status_t_subscribe(client->lcm, "PLIANT_STATUS", on_status, client);
    on->nodes =
        pliant_nodes_t_subscribe(client->lcm, "PLIANT_NODES_(sphere|block)", on_nodes, client);
    on->velocity =
        pliant_nodes_t_subscribe(client->lcm, "PLIANT_VELOCITY_sphere", on_velocities, client);
    on->mesh = pliant_mesh_t_subscribe(client->lcm, "PLIANT_MESH_(sphere|block)", on_mesh, client);
    on->contact = pliant_contact_t_subscribe(client->lcm, "PLIANT_CONTACT", on_contact, client);
    pliant_reply_t_subscription_set_queue_capacity(on->reply, 4096);
    pliant_contact_t_subscription_set_queue_capacity(on->contact, 4096);
    return client;
}

void client_destroy(Client *client)
{
    Subscriptions *on = client->on;
    pliant_reply_t_unsubscribe(client->lcm, on->reply);
    pliant_event_t_unsubscribe(client->lcm, on->event);
    pliant_status_t_unsubscribe(client->lcm, on->status);
    pliant_nodes_t_unsubscribe(client->lcm, on->nodes);
    pliant_nodes_t_unsubscribe(client->lcm, on->velocity);
    pliant_mesh_t_unsubscribe(client->lcm, on->mesh);
    pliant_contact_t_unsubscribe(client->lcm, on->contact);
    lcm_destroy(client->lcm);
    free(on);
    free(client->reply);
    free(client->event);
    free(client);
}

void client_close(Client **client)
{
    client_destroy(*client);
}

void client_listen(Client *client, int ms)
{
    if (lcm_handle_timeout(client->lcm, ms) > 0)
        while (lcm_handle_timeout(client->lcm, 0) > 0) {
        }
}

void client_wait_for_daemon(Client *client)
{
    wait_until(client, client->status.count > 0);
}

static Client *start_server(Process *server, const char *format, va_list list)
{
    char arguments[4096];
    const int length = vsnprintf(arguments, sizeof arguments, format, list);
    assert_in_range(length, 0, sizeof arguments - 1);
    Client *client = client_create();
    daemon_start(server, "%s", arguments);
    client_wait_for_daemon(client);
    return client;
}

Client *server_start(Process *server, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    Client *client = start_server(server, format, list);
    va_end(list);
    return client;
}

void server_stop(Client *client, Process *server)
{
    assert_true(command(client, PLIANT_COMMAND_T_STOP, 0, "")->ok);
    process_wait_for(server, 0);
}

int fixture_start(void **state, const char *format, ...)
{
    static Fixture fixture;
    va_list list;
    va_start(list, format);
    fixture.client = start_server(&fixture.daemon, format, list);
    va_end(list);
    *state = &fixture;
    return 0;
}

int fixture_end(void **state)
{
    Fixture *fixture = *state;
    process_signal(&fixture->daemon, SIGTERM);
    process_wait(&fixture->daemon);
    client_destroy(fixture->client);
    if (fixture->daemon.code != 0)
        print_error("exit %d: %s\n", fixture->daemon.code, fixture->daemon.err);
    return fixture->daemon.code;
}

// --- what goes out ---

void send_bytes(Client *client, const char *channel, const void *data, size_t size)
{
    // A kernel buffer holds some two hundred small messages: never more than a few at once.
    static int sent;
    const struct timespec pause = {.tv_nsec = 2000000};
    if (++sent % 8 == 0)
        nanosleep(&pause, NULL);
    assert_int_equal(lcm_publish(client->lcm, channel, data, (unsigned)size), 0);
}

static void publish_command(Client *client, int32_t id, int kind, int64_t value,
                            const char *argument)
{
    pliant_command_t m = {.utime = utime_now(),
                          .sender = client->sender,
                          .id = id,
                          .kind = kind,
                          .value = value,
                          .argument = (char *)(uintptr_t)argument};
    assert_int_equal(pliant_command_t_publish(client->lcm, "PLIANT_COMMAND", &m), 0);
}

int32_t send_command(Client *client, int kind, int64_t value, const char *argument)
{
    int32_t id = ++client->next_id;
    publish_command(client, id, kind, value, argument);
    return id;
}

static void publish_load(Client *client, const void *message)
{
    assert_int_equal(pliant_load_t_publish(client->lcm, "PLIANT_LOAD", message), 0);
}

static pliant_load_t make_load(Client *client, const double center[3], double radius,
                               const double force[3], double duration, const char *body)
{
    pliant_load_t m = {.utime = utime_now(),
                       .sender = client->sender,
                       .id = ++client->next_id,
                       .radius = radius,
                       .duration = duration,
                       .body = (char *)(uintptr_t)body};
    memcpy(m.center, center, sizeof m.center);
    memcpy(m.force, force, sizeof m.force);
    return m;
}

int32_t send_load(Client *client, const double center[3], double radius, const double force[3],
                  double duration, const char *body)
{
    const pliant_load_t m = make_load(client, center, radius, force, duration, body);
    publish_load(client, &m);
    return m.id;
}

pliant_tie_t make_tie(Client *client, int kind, const double center[3], double radius,
                      const char *body)
{
    pliant_tie_t m = {.utime = utime_now(),
                      .sender = client->sender,
                      .id = ++client->next_id,
                      .action = PLIANT_TIE_T_MAKE,
                      .kind = kind,
                      .radius = radius,
                      .stiffness = 0.3,
                      .damping_ratio = 0.5,
                      .body = (char *)(uintptr_t)body};
    memcpy(m.center, center, sizeof m.center);
    return m;
}

static void publish_tie(Client *client, const void *message)
{
    assert_int_equal(pliant_tie_t_publish(client->lcm, "PLIANT_TIE", message), 0);
}

const Reply *apply_tie(Client *client, const pliant_tie_t *tie)
{
    return answer_to(client, tie->id, publish_tie, tie);
}

pliant_cut_t make_cut(Client *client, double x, double reach, const char *body)
{
    return (pliant_cut_t){.sender = client->sender,
                          .id = ++client->next_id,
                          .before = {{x, -reach, -reach}, {x, -reach, reach}},
                          .after = {{x, reach, -reach}, {x, reach, reach}},
                          .body = (char *)(uintptr_t)body};
}

pliant_tool_pose_t make_pose(Client *client, const double position[3])
{
    pliant_tool_pose_t m = {.utime = utime_now(),
                            .sender = client->sender,
                            .sequence = ++client->pose_sequence,
                            .tool = 1,
                            .orientation = {1.0, 0.0, 0.0, 0.0},
                            .active = 1};
    memcpy(m.position, position, sizeof m.position);
    return m;
}

int64_t send_pose(Client *client, const pliant_tool_pose_t *pose)
{
    assert_int_equal(pliant_tool_pose_t_publish(client->lcm, "PLIANT_TOOL_POSE", pose), 0);
    return pose->utime;
}

int64_t send_pose_at(Client *client, const double position[3])
{
    const pliant_tool_pose_t pose = make_pose(client, position);
    return send_pose(client, &pose);
}

const Reply *find_reply(const Client *client, int32_t id)
{
    for (int i = client->replies - 1; i >= 0; i--)
        if (client->reply[i].id == id && client->reply[i].sender == client->sender)
            return &client->reply[i];
    return NULL;
}

int count_replies(const Client *client, int32_t id)
{
    int count = 0;
    for (int i = 0; i < client->replies; i++)
        count += client->reply[i].id == id && client->reply[i].sender == client->sender;
    return count;
}

void repeat_unanswered(Client *client, int32_t first, int kind, int64_t value, const char *argument)
{
    for (int32_t id = first; id <= client->next_id; id++) {
        if (find_reply(client, id) != NULL)
            continue;
        publish_command(client, id, kind, value, argument);
        client_listen(client, 2);
    }
}

typedef struct Request {
    int32_t id;
    void (*publish)(Client *client, const void *message);
    const void *message;
} Request;

// Sends a request, and the same one again at this interval [s], until it is answered, with `ok` if
// that is required. Returns how often it was sent.
static int send_until_answered(Client *client, Client *also, const Request *request,
                               double interval, bool needs_ok)
{
    const double limit = client_now() + 60.0;
    for (int sent = 1; client_now() < limit; sent++) {
        request->publish(client, request->message);
        for (const double next = client_now() + interval; client_now() < next;) {
            client_listen(client, 5);
            if (also != NULL)
                client_listen(also, 0);
            const Reply *reply = find_reply(client, request->id);
            if (reply != NULL && (reply->ok || !needs_ok))
                return sent;
        }
    }
    fail_msg("no answer to request %d in a minute", request->id);
    return 0;
}

static pliant_command_t make_command(Client *client, int kind, int64_t value, const char *argument)
{
    return (pliant_command_t){.id = ++client->next_id,
                              .kind = kind,
                              .value = value,
                              .argument = (char *)(uintptr_t)argument};
}

static void publish_made(Client *client, const void *message)
{
    const pliant_command_t *m = message;
    publish_command(client, m->id, m->kind, m->value, m->argument);
}

const Reply *command(Client *client, int kind, int64_t value, const char *argument)
{
    const pliant_command_t m = make_command(client, kind, value, argument);
    send_until_answered(client, NULL, &(Request){m.id, publish_made, &m}, 1.0, false);
    return find_reply(client, m.id);
}

const Reply *step_daemon(Client *client, int64_t ticks)
{
    const Reply *reply = command(client, PLIANT_COMMAND_T_STEP, ticks, "");
    assert_true(reply->ok);
    return reply;
}

const Reply *apply_load(Client *client, const double center[3], double radius,
                        const double force[3], double duration, const char *body)
{
    const pliant_load_t m = make_load(client, center, radius, force, duration, body);
    send_until_answered(client, NULL, &(Request){m.id, publish_load, &m}, 1.0, false);
    return find_reply(client, m.id);
}

const Reply *answer_to(Client *client, int32_t id,
                       void (*publish)(Client *client, const void *message), const void *message)
{
    send_until_answered(client, NULL, &(Request){id, publish, message}, 1.0, false);
    return find_reply(client, id);
}

int insist(Client *client, Client *also, int kind, int64_t value, const char *argument)
{
    const pliant_command_t m = make_command(client, kind, value, argument);
    return send_until_answered(client, also, &(Request){m.id, publish_made, &m}, 0.05, true);
}

static int find_event(const Client *client, const char *kind)
{
    int i = 0;
    while (i < client->events && strcmp(client->event[i].kind, kind) != 0)
        i++;
    return i;
}

const char *event_text(const Client *client, const char *kind)
{
    const int i = find_event(client, kind);
    return i < client->events ? client->event[i].text : "";
}

bool saw_event(const Client *client, const char *kind)
{
    return find_event(client, kind) < client->events;
}

int64_t refused(const Client *client, const char *reason)
{
    for (int i = 0; i < client->status.reasons; i++)
        if (strcmp(client->status.reason[i], reason) == 0)
            return client->status.reason_count[i];
    return 0;
}

void client_fresh_status(Client *client)
{
    // The reply comes after all that was sent before; the second status from then on was made
    // later.
    command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "");
    int seen = client->status.count;
    wait_until(client, client->status.count >= seen + 2);
}
