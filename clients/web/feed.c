// SPDX-License-Identifier: MIT
// The LCM side of pliant-web: bodies as they arrive, and the scene that they belong to.
#include "feed.h"

#include "client.h"
#include "pliant_command_t.h"
#include "pliant_event_t.h"
#include "pliant_reply_t.h"
#include "pliant_walls_t.h"
#include "texts.h"
#include "wire.h"

#include <stdlib.h>
#include <string.h>

// --- bodies --------------------------------------------------------------------------------------

void bodies_init(Bodies *bodies, Board *board)
{
    *bodies = (Bodies){.board = board, .body = calloc(BOARD_BODIES, sizeof(Body))};
    if (!bodies->body)
        abort(); // out of memory
}

static void forget_body(Bodies *bodies)
{
    for (int i = 0; i < bodies->count; i++) {
        mesh_frame_destroy(&bodies->body[i].mesh);
        nodes_frame_destroy(&bodies->body[i].nodes);
        rest_frame_destroy(&bodies->body[i].rest);
        look_frame_destroy(&bodies->body[i].look);
        error_map_frame_destroy(&bodies->body[i].error_map);
        elements_frame_destroy(&bodies->body[i].elements);
    }
    bodies->count = 0;
    bodies->open = false;
}

void bodies_destroy(Bodies *bodies)
{
    forget_body(bodies);
    free(bodies->body);
    *bodies = (Bodies){0};
}

static int count_of(const pliant_status_t *status)
{
    return status->num_bodies < BOARD_BODIES ? status->num_bodies : BOARD_BODIES;
}

bool bodies_are(const Bodies *bodies, const pliant_status_t *status)
{
    if (bodies->count != count_of(status))
        return false;
    for (int i = 0; i < bodies->count; i++) {
        if (strncmp(bodies->body[i].name, status->body[i].name, BODY_NAME_MAX - 1) != 0)
            return false;
    }
    return true;
}

void bodies_name(Bodies *bodies, const pliant_status_t *status)
{
    forget_body(bodies);
    bodies->count = count_of(status);
    for (int i = 0; i < bodies->count; i++) {
        Body *body = &bodies->body[i];
        *body = (Body){.shown = -1};
        snprintf(body->name, sizeof body->name, "%s", status->body[i].name);
    }
}

static Body *find(const Bodies *bodies, const char *name)
{
    for (int i = 0; i < bodies->count; i++) {
        if (strcmp(bodies->body[i].name, name) == 0)
            return &bodies->body[i];
    }
    return NULL;
}

// Returns NULL if the board has the same parcel.
static Parcel *unless_shown(const BoardSlot *slot, Parcel *parcel)
{
    // Only this thread changes the slot.
    if (!parcel_equal(slot->parcel, parcel))
        return parcel;
    parcel_drop(parcel);
    return NULL;
}

// Puts new, consistent data on the board: nodes always with the mesh of their topology, and a mesh
// always with nodes of it.
static void show(Bodies *bodies, Body *body)
{
    const MeshFrame *mesh = &body->mesh;
    const NodesFrame *nodes = &body->nodes;
    const RestFrame *rest = &body->rest;
    // Nodes are shown with the mesh that they belong to.
    bool pair = mesh->whole && nodes->ready && nodes->head.topology == mesh->topology &&
                nodes->head.count == mesh->node_count;
    if (pair)
        body->unmatched_ns = 0;
    else if (nodes->ready && body->unmatched_ns == 0)
        body->unmatched_ns = client_now_ns();
    if (!pair || !bodies->open)
        return;
    // Build what is new; what the page has already is not sent again.
    int index = (int)(body - bodies->body);
    const BoardSlot *on_board = bodies->board->body[index];
    Parcel *new_mesh = NULL, *new_rest = NULL, *new_nodes = NULL;
    if (body->new_mesh)
        new_mesh = unless_shown(&on_board[BOARD_MESH], parcel_mesh(index, mesh, body->first_wall));
    bool fits = rest->head.whole && rest->head.topology == mesh->topology;
    if (body->new_rest && fits)
        new_rest = unless_shown(&on_board[BOARD_REST], parcel_rest(index, rest));
    // Send the nodes again with a mesh, so that the page can draw it at once.
    if (body->new_nodes || new_mesh)
        new_nodes = parcel_nodes(index, nodes);
    body->new_mesh = body->new_nodes = false;
    body->new_rest = body->new_rest && !fits;
    // Hand it over in one piece.
    body->shown = mesh->topology;
    if (new_mesh || new_rest || new_nodes)
        board_set_body(bodies->board, index, new_mesh, new_rest, new_nodes);
}

// Puts what the page draws on whichever mesh it is of on the board, unless it is there already.
static void show_alone(const Bodies *bodies, int index, BoardBodyKind kind, Parcel *parcel)
{
    board_set_of_body(bodies->board, index, kind,
                      unless_shown(&bodies->board->body[index][kind], parcel));
}

static void show_look(Bodies *bodies, Body *body)
{
    const int index = (int)(body - bodies->body);
    if (!body->new_look || !bodies->open)
        return;
    show_alone(bodies, index, BOARD_LOOK, parcel_look(index, &body->look));
    body->new_look = false;
}

void bodies_open(Bodies *bodies)
{
    bodies->open = true;
    for (int i = 0; i < bodies->count; i++) {
        show_look(bodies, &bodies->body[i]);
        show(bodies, &bodies->body[i]);
    }
}

void bodies_take_mesh(Bodies *bodies, const char *name, const void *data, size_t size)
{
    Body *body = find(bodies, name);
    if (!body)
        return;
    body->chunk_ns = client_now_ns();
    if (mesh_frame_add(&body->mesh, data, size) != FRAMES_WHOLE)
        return;
    body->new_mesh = true;
    show(bodies, body);
}

void bodies_take_delta(Bodies *bodies, const char *name, const void *data, size_t size)
{
    Body *body = find(bodies, name);
    if (!body || mesh_frame_add_delta(&body->mesh, data, size) != FRAMES_WHOLE)
        return;
    body->new_mesh = true;
    show(bodies, body);
}

void bodies_take_nodes(Bodies *bodies, const char *name, const void *data, size_t size)
{
    Body *body = find(bodies, name);
    if (!body)
        return;
    // Where packets were lost, older nodes are better than none.
    body->nodes.head.mesh_nodes = body->mesh.most_nodes;
    FramesResult result = nodes_frame_add(&body->nodes, data, size);
    if (result != FRAMES_WHOLE && result != FRAMES_PATCHED)
        return;
    body->new_nodes = true;
    show(bodies, body);
}

void bodies_take_rest(Bodies *bodies, const char *name, const void *data, size_t size)
{
    Body *body = find(bodies, name);
    if (!body)
        return;
    body->rest.head.mesh_nodes = body->mesh.most_nodes;
    if (rest_frame_add(&body->rest, data, size) != FRAMES_WHOLE)
        return;
    body->new_rest = true;
    show(bodies, body);
}

void bodies_take_look(Bodies *bodies, const char *name, const void *data, size_t size)
{
    Body *body = find(bodies, name);
    if (!body)
        return;
    body->look.head.mesh_nodes = body->mesh.most_nodes;
    if (look_frame_add(&body->look, data, size) != FRAMES_WHOLE)
        return;
    body->new_look = true;
    show_look(bodies, body);
}

// The page knows which mesh it is of; the next one comes soon.
void bodies_take_error_map(Bodies *bodies, const char *name, const void *data, size_t size)
{
    Body *body = find(bodies, name);
    if (!body)
        return;
    body->error_map.head.mesh_nodes = body->mesh.most_nodes;
    if (error_map_frame_add(&body->error_map, data, size) != FRAMES_WHOLE || !bodies->open)
        return;
    const int index = (int)(body - bodies->body);
    show_alone(bodies, index, BOARD_ERROR_MAP, parcel_error_map(index, &body->error_map));
}

// The same.
void bodies_take_elements(Bodies *bodies, const char *name, const void *data, size_t size)
{
    Body *body = find(bodies, name);
    if (!body)
        return;
    body->elements.head.mesh_nodes = body->mesh.most_nodes;
    if (elements_frame_add(&body->elements, data, size) != FRAMES_WHOLE || !bodies->open)
        return;
    const int index = (int)(body - bodies->body);
    show_alone(bodies, index, BOARD_ELEMENTS, parcel_elements(index, &body->elements));
}

void bodies_take_walls(Bodies *bodies, const char *name, const void *data, size_t size)
{
    Body *body = find(bodies, name);
    pliant_walls_t walls;
    if (!body || !wire_check(&WIRE_WALLS, data, size) ||
        pliant_walls_t_decode(data, 0, (int)size, &walls) < 0 || walls.first_wall < 0 ||
        walls.first_wall == body->first_wall)
        return;
    body->first_wall = walls.first_wall;
    body->new_mesh = body->mesh.whole;
    show(bodies, body);
}

double bodies_unmatched(const Bodies *bodies, int64_t now_ns)
{
    const int64_t pause_ns = 500000000; // longer than between the chunks of one mesh
    int64_t longest = 0;
    for (int i = 0; i < bodies->count; i++) {
        const Body *body = &bodies->body[i];
        bool under_way = body->mesh.next.started && !body->mesh.next.done;
        if (under_way && now_ns - body->chunk_ns < pause_ns)
            continue;
        if (body->unmatched_ns && now_ns - body->unmatched_ns > longest)
            longest = now_ns - body->unmatched_ns;
    }
    return (double)longest / 1e9;
}

// --- the feed ------------------------------------------------------------------------------------

static const double SILENCE_S = 2.0;       // without a status: the daemon is gone
static const double MESH_PATIENCE_S = 0.3; // nodes without their mesh, before a request
static const double ASK_FIRST_S = 0.5, ASK_LONGEST_S = 4.0;

static double seconds_since(int64_t then_ns)
{
    return (double)(client_now_ns() - then_ns) / 1e9;
}

// --- the scene ---

// Requests the scene and whole meshes; repeats the request with the same number until an answer
// comes. The interval grows each time, because whole meshes of large bodies take long.
static void describe(Feed *feed)
{
    char channel[CLIENT_CHANNEL_MAX];
    // The same number until it is answered, ever less often.
    if (feed->describe_id == 0)
        feed->describe_id = ++feed->client->last_id;
    feed->patience_s = feed->patience_s < ASK_LONGEST_S ? 2.0 * feed->patience_s : ASK_LONGEST_S;
    feed->describe_ns = client_now_ns();
    session_ask(&feed->requests->session); // which daemon's scene it is
    // It goes to the channels that the daemon hears.
    requests_channel(feed->requests, "COMMAND", channel);
    pliant_command_t command = {.utime = client_utime(),
                                .sender = feed->client->sender,
                                .id = feed->describe_id,
                                .kind = PLIANT_COMMAND_T_DESCRIBE,
                                .argument = (char[]){""}};
    pliant_command_t_publish(feed->client->lcm, channel, &command);
}

static void learn_scene(Feed *feed, const char *text)
{
    // A page that has the scene may send requests, which are for this daemon, so both must be known
    // first. The first status asks again, and so does the loop.
    if (!feed->status || feed->requests->session.daemon == 0)
        return;
    requests_follow(feed->requests);
    Parcel *scene = text_scene(feed->status, text);
    // Only this thread changes the board.
    if (feed->another || !parcel_equal(scene, feed->board->slot[BOARD_SCENE].parcel))
        board_set(feed->board, BOARD_SCENE, scene);
    else
        parcel_drop(scene);
    feed->known = true;
    feed->another = false;
    if (!feed->bodies.open)
        bodies_open(&feed->bodies);
}

static void forget(Feed *feed)
{
    board_clear(feed->board);
    feed->known = false;
    feed->another = true;
    feed->describe_id = 0;
    feed->patience_s = ASK_FIRST_S;
}

// True if a status is from another daemon, or of another scene, than the last one.
static bool is_another(const Feed *feed, const pliant_status_t *status)
{
    const pliant_status_t *last = feed->status;
    if (!last)
        return true;
    const int32_t ahead = (int32_t)((uint32_t)status->sequence - (uint32_t)last->sequence);
    return ahead < 0 || status->step < last->step || strcmp(status->scene, last->scene) != 0 ||
           !bodies_are(&feed->bodies, status);
}

// --- what comes ---

static void on_status(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Feed *feed = user;
    pliant_status_t status;
    if (!wire_check(&WIRE_STATUS, buffer->data, buffer->data_size) ||
        pliant_status_t_decode(buffer->data, 0, (int)buffer->data_size, &status) < 0) {
        feed->wrong_types++;
        return;
    }
    // Another daemon, or another scene: forget what is known.
    bool silent = feed->status && seconds_since(feed->status_ns) > SILENCE_S;
    if (is_another(feed, &status)) {
        bodies_name(&feed->bodies, &status);
        forget(feed);
    }
    // Keep the newest.
    if (feed->status)
        pliant_status_t_destroy(feed->status);
    feed->status = pliant_status_t_copy(&status);
    feed->status_ns = client_now_ns();
    pliant_status_t_decode_cleanup(&status);
    // After a silence it may be another daemon that looks the same.
    if (!feed->known || silent)
        describe(feed);
    board_set(feed->board, BOARD_STATUS, text_status(feed->status));
}

static void on_reply(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Feed *feed = user;
    pliant_reply_t reply;
    if (!wire_check(&WIRE_REPLY, buffer->data, buffer->data_size) ||
        pliant_reply_t_decode(buffer->data, 0, (int)buffer->data_size, &reply) < 0) {
        feed->wrong_types++;
        return;
    }
    // Answers to pages go to them; ours has the scene.
    if (reply.sender != feed->client->sender) {
        requests_answered(feed->requests, reply.sender, reply.id);
        board_send(feed->board, reply.sender, text_reply(&reply));
    } else if (reply.id == feed->describe_id) {
        feed->describe_id = 0;
        if (reply.ok)
            learn_scene(feed, reply.text);
    }
    pliant_reply_t_decode_cleanup(&reply);
}

static void on_event(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Feed *feed = user;
    pliant_event_t event;
    if (!wire_check(&WIRE_EVENT, buffer->data, buffer->data_size) ||
        pliant_event_t_decode(buffer->data, 0, (int)buffer->data_size, &event) < 0) {
        feed->wrong_types++;
        return;
    }
    board_send_all(feed->board, text_event(&event));
    pliant_event_t_decode_cleanup(&event);
}

static void on_ledger(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Feed *feed = user;
    pliant_ledger_t ledger;
    if (!wire_check(&WIRE_LEDGER, buffer->data, buffer->data_size) ||
        pliant_ledger_t_decode(buffer->data, 0, (int)buffer->data_size, &ledger) < 0) {
        feed->wrong_types++;
        return;
    }
    // It belongs to a scene, and comes again.
    if (feed->known)
        board_set(feed->board, BOARD_LEDGER,
                  unless_shown(&feed->board->slot[BOARD_LEDGER], text_ledger(&ledger)));
    pliant_ledger_t_decode_cleanup(&ledger);
}

static void on_errors(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Feed *feed = user;
    pliant_error_t error;
    if (!wire_check(&WIRE_ERROR, buffer->data, buffer->data_size) ||
        pliant_error_t_decode(buffer->data, 0, (int)buffer->data_size, &error) < 0) {
        feed->wrong_types++;
        return;
    }
    if (feed->known)
        board_set(feed->board, BOARD_ERRORS, text_errors(&error));
    pliant_error_t_decode_cleanup(&error);
}

static void on_playback(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Feed *feed = user;
    pliant_playback_t playback;
    if (!wire_check(&WIRE_PLAYBACK, buffer->data, buffer->data_size) ||
        pliant_playback_t_decode(buffer->data, 0, (int)buffer->data_size, &playback) < 0) {
        feed->wrong_types++;
        return;
    }
    // It belongs to a scene, and comes again. What the page has is not sent again.
    if (feed->known) {
        Parcel *recording = playback.whole ? text_recording(&playback) : NULL;
        const BoardSlot *slot = feed->board->slot;
        board_set(feed->board, BOARD_RECORDING, unless_shown(&slot[BOARD_RECORDING], recording));
        board_set(feed->board, BOARD_PLAYBACK,
                  unless_shown(&slot[BOARD_PLAYBACK], text_playback(&playback)));
    }
    pliant_playback_t_decode_cleanup(&playback);
}

static void on_contact(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Feed *feed = user;
    pliant_contact_t contact;
    if (wire_check(&WIRE_CONTACT, buffer->data, buffer->data_size) &&
        pliant_contact_t_decode(buffer->data, 0, (int)buffer->data_size, &contact) >= 0)
        board_set_contact(feed->board, &contact);
    else
        feed->wrong_types++;
}

static void on_pose(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Feed *feed = user;
    pliant_tool_pose_t pose;
    if (wire_check(&WIRE_TOOL_POSE, buffer->data, buffer->data_size) &&
        pliant_tool_pose_t_decode(buffer->data, 0, (int)buffer->data_size, &pose) >= 0)
        board_set_pose(feed->board, &pose);
    else
        feed->wrong_types++;
}

// What comes of bodies. MESH_.+ also matches the deltas of MESH_DELTA_<body>; no body has that
// name, so they are ignored.
static const struct {
    const char *name;
    void (*take)(Bodies *bodies, const char *name, const void *data, size_t size);
    int queue;
} OF_BODIES[FEED_STREAMS] = {
    {"MESH", bodies_take_mesh, 4096},           {"MESH_DELTA", bodies_take_delta, 4096},
    {"NODES", bodies_take_nodes, 4096},         {"POINTS", bodies_take_nodes, 4096},
    {"REST", bodies_take_rest, 4096},           {"LOOK", bodies_take_look, 4096},
    {"ERROR_MAP", bodies_take_error_map, 4096}, {"ELEMENTS", bodies_take_elements, 4096},
    {"WALLS", bodies_take_walls, 64},
};

static void on_body(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    FeedStream *stream = user;
    const char *body = client_body_of(stream->feed->client, OF_BODIES[stream->kind].name, channel);
    if (body)
        OF_BODIES[stream->kind].take(&stream->feed->bodies, body, buffer->data, buffer->data_size);
}

// Subscribes to poses, those of pages included.
static bool subscribe_poses(Feed *feed)
{
    char channel[CLIENT_CHANNEL_MAX];
    requests_channel(feed->requests, "TOOL_POSE", channel);
    return receiver_subscribe(feed->client->receiver, channel, 1024, on_pose, feed) != NULL;
}

bool feed_start(Feed *feed, Client *client, Board *board, Requests *requests, PliantError *error)
{
    *feed = (Feed){.client = client, .board = board, .requests = requests};
    bodies_init(&feed->bodies, board);
    bool ok = client_subscribe(client, "STATUS", NULL, 16, on_status, feed) &&
              client_subscribe(client, "REPLY", NULL, 256, on_reply, feed) &&
              client_subscribe(client, "EVENT", NULL, 256, on_event, feed) &&
              client_subscribe(client, "LEDGER", NULL, 16, on_ledger, feed) &&
              client_subscribe(client, "ERROR", NULL, 16, on_errors, feed) &&
              client_subscribe(client, "CONTACT", NULL, 1024, on_contact, feed) &&
              client_subscribe(client, "PLAYBACK", NULL, 16, on_playback, feed) &&
              session_open(&requests->session, client, NULL) && subscribe_poses(feed);
    for (int k = 0; k < FEED_STREAMS; k++) {
        feed->stream[k] = (FeedStream){feed, k};
        ok = ok && client_subscribe(client, OF_BODIES[k].name, ".+", OF_BODIES[k].queue, on_body,
                                    &feed->stream[k]);
    }
    if (!ok)
        return client_fail(error, "LCM refuses to subscribe to %s_*", client->prefix);
    feed->patience_s = ASK_FIRST_S;
    describe(feed);
    return true;
}

// --- the loop ---

static void publish_link(Feed *feed)
{
    double age = feed->status ? seconds_since(feed->status_ns) : 0.0;
    bool linked = feed->status && age <= SILENCE_S;
    if (linked == feed->linked && feed->link_ns != 0 && seconds_since(feed->link_ns) < 1.0)
        return;
    feed->linked = linked;
    feed->link_ns = client_now_ns();
    board_set(feed->board, BOARD_LINK, text_link(linked, age));
}

// Detects a daemon that looks like the last one and is another.
static void follow_daemon(Feed *feed)
{
    const int64_t daemon = feed->requests->session.daemon;
    if (feed->daemon != 0 && feed->daemon != daemon && feed->known && feed->status) {
        bodies_name(&feed->bodies, feed->status);
        forget(feed);
    }
    feed->daemon = daemon;
}

static void ask_for_missing(Feed *feed)
{
    bool missing = bodies_unmatched(&feed->bodies, client_now_ns()) > MESH_PATIENCE_S;
    bool wanted = !feed->known || feed->describe_id != 0 || missing;
    if (!wanted)
        feed->patience_s = ASK_FIRST_S;
    if (wanted && seconds_since(feed->describe_ns) > feed->patience_s)
        describe(feed);
}

static void turn_workbench(Feed *feed)
{
    const pliant_status_t *status = feed->status;
    const WorkbenchHeard heard = {feed->linked, feed->status_ns, status ? status->scene : ""};
    if (feed->workbench)
        workbench_turn(feed->workbench, &heard, client_now_ns());
}

void feed_run(Feed *feed)
{
    const int64_t turn_ns = 20000000;
    while (client_wait(feed->client, client_now_ns() + turn_ns, NULL)) {
        publish_link(feed);
        follow_daemon(feed);
        ask_for_missing(feed);
        requests_repeat(feed->requests, feed->board, client_now_ns());
        turn_workbench(feed);
    }
}

void feed_stop(Feed *feed)
{
    if (feed->status)
        pliant_status_t_destroy(feed->status);
    bodies_destroy(&feed->bodies);
    *feed = (Feed){0};
}
