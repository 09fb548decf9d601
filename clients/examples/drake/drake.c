// SPDX-License-Identifier: MIT
// pliant-drake: forwards all bodies of a running daemon to Drake's viewers (meldis,
// drake_visualizer), as deformable meshes. One thread; only listens, except for one DESCRIBE that
// requests the meshes.
#include "client.h"
#include "program.h"
#include "frames.h"

#include <stdlib.h>
#include <string.h>

#include "drake_lcmt_viewer_link_data.h"

#include "pliant_command_t.h"

enum { BODIES_MAX = 32, QUEUE = 4096, PATIENCE_S = 3 };
#define CHANNEL "DRAKE_VIEWER_DEFORMABLE"

typedef struct Options {
    PliantOptions client;
    double rate_hz, duration; // [Hz], [s]; 0: until a signal
    double color[3];
} Options;

typedef struct Shown {
    char name[CLIENT_CHANNEL_MAX];
    NodesFrame nodes;
    MeshFrame mesh;
    float *data; // of the newest frame whose mesh is known; [capacity]
    size_t capacity;
    int values; // 0: none yet
} Shown;

typedef struct Bridge {
    Options options;
    Client client;
    Shown body[BODIES_MAX];
    int bodies;
    bool fresh; // has data to send
    int64_t sent;
} Bridge;

// --- options ---

#define AT(member) offsetof(Options, member)

static const ArgumentRow ROWS[] = {
    {.type = ARGUMENT_HEADING, .help = "What to send:"},
    {"rate", 'r', ARGUMENT_NUMBER, "HZ", AT(rate_hz), 0.1, 1000.0, .preset = 20.0,
     .help = "messages per second, at most"},
    {"color", 'c', ARGUMENT_NUMBERS, "R,G,B", AT(color), 0.0, 1.0, .preset_text = "0.85,0.5,0.45",
     .help = "colour of the bodies, each value 0 to 1"},
    {"duration", 'd', ARGUMENT_NUMBER, "S", AT(duration), 0.01, 1e7,
     .help = "exit after S seconds"},
    {.type = ARGUMENT_HEADING, .help = "Where:"},
    {.type = ARGUMENT_ROWS, .rows = PROGRAM_WHERE, .offset = AT(client)},
    {0}};

static const ArgumentTable TABLE = {
    .program = "pliant-drake",
    .about = "Forwards all bodies of a running pliantd to Drake's viewers, on " CHANNEL ".",
    .end = "Exit status: 0 done, 1 no body arrived, 2 bad usage.",
    .rows = ROWS};

// --- what comes ---

// Finds the body of a channel, adds new ones; returns NULL for other channels, or one body too
// many.
// The body of a channel of that kind; "NODES": of positions, whichever way they are sent.
static Shown *find_body(Bridge *bridge, const char *kind, const char *channel)
{
    const char *name = strcmp(kind, "NODES") == 0 ? client_nodes_body(&bridge->client, channel)
                                                  : client_body_of(&bridge->client, kind, channel);
    // "_MESH_DELTA_<body>" matches the pattern of "_MESH_<body>" too.
    if (!name || (strcmp(kind, "MESH") == 0 && strncmp(name, "DELTA_", 6) == 0))
        return NULL;
    for (int k = 0; k < bridge->bodies; k++) {
        if (strcmp(bridge->body[k].name, name) == 0)
            return &bridge->body[k];
    }
    if (bridge->bodies == BODIES_MAX)
        return NULL;
    Shown *body = &bridge->body[bridge->bodies++];
    snprintf(body->name, sizeof body->name, "%s", name);
    return body;
}

// Copies a complete frame, since the next one overwrites its positions chunk by chunk. Omits free
// triangles; keeps free nodes, so that triangles keep their numbers (exact in a float: frames limit
// them to 2^22).
static void pack(Bridge *bridge, Shown *body)
{
    // Positions need the mesh that they belong to.
    const NodesFrame *nodes = &body->nodes;
    const MeshFrame *mesh = &body->mesh;
    if (!mesh->whole || mesh->topology != nodes->head.topology ||
        mesh->node_count != nodes->head.count)
        return;
    // Memory for the largest so far.
    size_t points = 3 * (size_t)nodes->head.count;
    size_t most = 2 + points + 3 * (size_t)mesh->triangle_count;
    if (most > body->capacity) {
        float *data = realloc(body->data, most * sizeof *data);
        if (!data)
            return;
        body->data = data;
        body->capacity = most;
    }
    // Counts first, then positions, then corners: the form of Drake's mesh.
    memcpy(body->data + 2, nodes->position, points * sizeof(float));
    float *corner = body->data + 2 + points;
    int triangles = 0;
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int32_t *v = mesh->triangle + 3 * (size_t)t;
        if (v[0] == v[1])
            continue;
        for (int k = 0; k < 3; k++)
            *corner++ = (float)v[k];
        triangles++;
    }
    body->data[0] = (float)nodes->head.count;
    body->data[1] = (float)triangles;
    body->values = (int)(corner - body->data);
    bridge->fresh = true;
}

static void on_nodes(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    Shown *body = find_body(user, "NODES", channel);
    if (!body)
        return;
    body->nodes.head.mesh_nodes = body->mesh.most_nodes;
    if (nodes_frame_add(&body->nodes, buffer->data, buffer->data_size) == FRAMES_WHOLE)
        pack(user, body);
}

static void on_mesh(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    Shown *body = find_body(user, "MESH", channel);
    if (body)
        mesh_frame_add(&body->mesh, buffer->data, buffer->data_size);
}

static void on_delta(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    Shown *body = find_body(user, "MESH_DELTA", channel);
    if (body)
        mesh_frame_add_delta(&body->mesh, buffer->data, buffer->data_size);
}

// --- what goes ---

static void send_bodies(Bridge *bridge)
{
    // A viewer wants all shapes in one message.
    drake_lcmt_viewer_geometry_data shape[BODIES_MAX];
    drake_lcmt_viewer_link_data message = {.name = bridge->client.prefix, .geom = shape};
    for (int k = 0; k < bridge->bodies; k++) {
        Shown *body = &bridge->body[k];
        if (body->values == 0)
            continue;
        const double *color = bridge->options.color;
        shape[message.num_geom++] = (drake_lcmt_viewer_geometry_data){
            .type = DRAKE_LCMT_VIEWER_GEOMETRY_DATA_MESH,
            .quaternion = {1.0f},
            .color = {(float)color[0], (float)color[1], (float)color[2], 1.0f},
            .string_data = body->name,
            .num_float_data = body->values,
            .float_data = body->data};
    }
    drake_lcmt_viewer_link_data_publish(bridge->client.lcm, CHANNEL, &message);
    bridge->fresh = false;
    bridge->sent++;
}

static bool run(Bridge *bridge, PliantError *error)
{
    Client *client = &bridge->client;
    // Everything that a body's shape is made of.
    if (!client_subscribe(client, "NODES", ".+", QUEUE, on_nodes, bridge) ||
        !client_subscribe(client, "POINTS", ".+", QUEUE, on_nodes, bridge) ||
        !client_subscribe(client, "MESH", ".+", QUEUE, on_mesh, bridge) ||
        !client_subscribe(client, "MESH_DELTA", ".+", QUEUE, on_delta, bridge))
        return client_fail(error, "LCM refuses to subscribe to %s_*", client->prefix);
    PliantError ignored; // the daemon may start later, and sends its meshes every second too
    client_request(client, PLIANT_COMMAND_T_DESCRIBE, 0, "", 0.5, 2, &ignored);
    const Options *options = &bridge->options;
    const int64_t period = (int64_t)(1e9 / options->rate_hz), start = client_now_ns();
    const int64_t end =
        options->duration > 0.0 ? start + (int64_t)(options->duration * 1e9) : INT64_MAX;
    bool waited = true, warned = false;
    // Send at the given rate whatever is new.
    while (waited && client_now_ns() < end) {
        waited = client_wait(client, client_now_ns() + period, NULL);
        if (bridge->fresh)
            send_bodies(bridge);
        if (!bridge->sent && !warned && client_now_ns() - start > PATIENCE_S * 1000000000LL) {
            client_fail(error, "no body came on %s_NODES_* within %d s: still waiting",
                        client->prefix, PATIENCE_S);
            program_print_error("pliant-drake", error);
            warned = true;
        }
    }
    if (client->broken)
        return client_fail(error, "the LCM connection failed");
    return bridge->sent ? true : client_fail(error, "no body came on %s_NODES_*", client->prefix);
}

int main(int argc, char **argv)
{
    static Bridge bridge;
    Status status = {0};
    if (!arguments_parse(&TABLE, argc, argv, &bridge.options, &status))
        return arguments_exit(&status);
    program_catch_signals();
    PliantError error = {0};
    bool ok = program_await_network(bridge.options.client.url, &error) &&
              client_connect(&bridge.client, &bridge.options.client, &error) &&
              program_stops(client_stop, &bridge.client) && run(&bridge, &error);
    if (!ok)
        program_print_error("pliant-drake", &error);
    client_disconnect(&bridge.client);
    for (int k = 0; k < bridge.bodies; k++) {
        nodes_frame_destroy(&bridge.body[k].nodes);
        mesh_frame_destroy(&bridge.body[k].mesh);
        free(bridge.body[k].data);
    }
    return ok ? 0 : 1;
}
