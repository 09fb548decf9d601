// Finds where to press a body. One thread.
#include "aim.h"
#include "frames.h"

#include <math.h>
#include <string.h>

#include "pliant_command_t.h"

enum { AIM_QUEUE = 4096, AIM_WAIT_S = 3 }; // the queue holds every chunk of the largest mesh
#define LEVEL 1e-3 // tolerance for coming first: this fraction of the body's extent along the press

typedef struct Search {
    Client *client;
    Aim *aim;
    MeshFrame mesh;
    NodesFrame nodes;
    bool ready; // both complete and of the same topology
} Search;

static void update_ready(Search *search)
{
    search->ready = search->mesh.whole && search->nodes.ready &&
                    search->mesh.topology == search->nodes.topology &&
                    search->mesh.node_count == search->nodes.node_count;
}

static void on_mesh(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    Search *search = user;
    const char *body = client_body_of(search->client, "MESH", channel);
    // "_MESH_DELTA_<body>" matches the pattern too, but has another type.
    if (search->ready || !body || strncmp(body, "DELTA_", 6) == 0)
        return;
    if (search->aim->body[0] == '\0')
        snprintf(search->aim->body, sizeof search->aim->body, "%s", body);
    if (strcmp(search->aim->body, body) == 0)
        mesh_frame_add(&search->mesh, buffer->data, buffer->data_size);
    update_ready(search);
}

static void on_delta(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    Search *search = user;
    const char *body = client_body_of(search->client, "MESH_DELTA", channel);
    if (!search->ready && body && strcmp(search->aim->body, body) == 0)
        mesh_frame_add_delta(&search->mesh, buffer->data, buffer->data_size);
    update_ready(search);
}

static void on_nodes(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    Search *search = user;
    const char *body = client_nodes_body(search->client, channel);
    if (!search->ready && body && strcmp(search->aim->body, body) == 0)
        nodes_frame_add(&search->nodes, buffer->data, buffer->data_size);
    update_ready(search);
}

static double along(const float x[3], const double direction[3])
{
    return direction[0] * (double)x[0] + direction[1] * (double)x[1] + direction[2] * (double)x[2];
}

void aim_choose(int count, const float *position, const int32_t *id, const double direction[3],
                double node[3])
{
    // How far the nodes reach along the direction.
    double first = HUGE_VAL, last = -HUGE_VAL, middle[3] = {0.0, 0.0, 0.0}, nearest = HUGE_VAL;
    int level = 0;
    for (int i = 0; i < count; i++) {
        if (id[i] < 0)
            continue;
        first = fmin(first, along(position + 3 * i, direction));
        last = fmax(last, along(position + 3 * i, direction));
    }
    // On a flat side many nodes come first: take the one in its middle, not at its corner.
    const double limit = first + LEVEL * (last - first);
    for (int i = 0; i < count; i++) {
        const float *x = position + 3 * i;
        if (id[i] < 0 || !(along(x, direction) <= limit))
            continue;
        level++;
        for (int k = 0; k < 3; k++)
            middle[k] += ((double)x[k] - middle[k]) / level;
    }
    // The node nearest to the mean of those that come first.
    for (int i = 0; i < count; i++) {
        const float *x = position + 3 * i;
        double distance = 0.0;
        for (int k = 0; k < 3; k++)
            distance += ((double)x[k] - middle[k]) * ((double)x[k] - middle[k]);
        if (id[i] < 0 || !(along(x, direction) <= limit) || distance >= nearest)
            continue;
        nearest = distance;
        for (int k = 0; k < 3; k++)
            node[k] = (double)x[k];
    }
}

static bool search_wait(Search *search, PliantError *error)
{
    // DESCRIBE makes the daemon send its meshes.
    Client *client = search->client;
    PliantError why;
    bool answered = client_request(client, PLIANT_COMMAND_T_DESCRIBE, 0, "", 1.0, 3, &why);
    if (!answered)
        return client_fail(error, "%s", why.text);
    // A name that it does not have will never come.
    const char *body = search->aim->body;
    if (body[0] != '\0' && !client_described_body(client, body, error))
        return false;
    // Then wait for mesh and positions, and say which of them did not come.
    int64_t deadline = client_now_ns() + (int64_t)AIM_WAIT_S * 1000000000;
    if (!client_wait(client, deadline, &search->ready))
        return client_fail(error, client->broken ? "the LCM connection failed" : "interrupted");
    if (search->ready)
        return true;
    if (!search->mesh.whole)
        return client_fail(error,
                           "the daemon answers, but no whole mesh came on %s_MESH_%s within 3 s "
                           "(body's name? receive buffer? LCM sends it on DESCRIBE)",
                           client->prefix, body[0] ? body : "*");
    return client_fail(error,
                       "the mesh of '%s' came, but no positions on %s_NODES_%s within 3 s: is "
                       "publish.nodes_hz 0, or the daemon paused?",
                       body, client->prefix, body);
}

bool aim_find(Client *client, const double direction[3], Aim *aim, PliantError *error)
{
    // Collect the mesh of the body, or of whichever comes first.
    Search search = {.client = client, .aim = aim};
    const char *body = aim->body[0] ? aim->body : ".+";
    ReceiverSubscription *mesh =
        client_subscribe(client, "MESH", body, AIM_QUEUE, on_mesh, &search);
    ReceiverSubscription *delta =
        client_subscribe(client, "MESH_DELTA", body, AIM_QUEUE, on_delta, &search);
    ReceiverSubscription *nodes =
        client_subscribe(client, "NODES", body, AIM_QUEUE, on_nodes, &search);
    ReceiverSubscription *points =
        client_subscribe(client, "POINTS", body, AIM_QUEUE, on_nodes, &search);
    bool ok = mesh && delta && nodes && points
                  ? search_wait(&search, error)
                  : client_fail(error, "LCM refuses to subscribe to the meshes");
    // Nothing may arrive for the search once it is over.
    receiver_unsubscribe(client->receiver, mesh);
    receiver_unsubscribe(client->receiver, delta);
    receiver_unsubscribe(client->receiver, nodes);
    receiver_unsubscribe(client->receiver, points);
    if (ok)
        aim_choose(search.nodes.node_count, search.nodes.position, search.mesh.id, direction,
                   aim->node);
    mesh_frame_destroy(&search.mesh);
    nodes_frame_destroy(&search.nodes);
    return ok;
}
