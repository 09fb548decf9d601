// SPDX-License-Identifier: MIT
// Frames of bodies: assembles positions and meshes, and hands both out together, when they belong
// together. A frame is never changed, so that it can be kept; frames of one topology share the
// mesh.
#include "kit.h"

#include "wire.h"

#include "pliant_walls_t.h"

#include <stdlib.h>
#include <string.h>

// --- frames --------------------------------------------------------------------------------------

static bool same(const void *a, const void *b, size_t bytes)
{
    return bytes == 0 || memcmp(a, b, bytes) == 0;
}

#define COLUMN_BYTES(mesh, type, width, of, ...)                                                   \
    ((size_t)MESH_SLOTS_##of((mesh)->node_count, (mesh)->triangle_count) * (width) * sizeof(type))

// True if the copy is the mesh; a restarted server gives the numbers of topologies again.
static bool mesh_is(const KitMesh *mesh, const MeshFrame *frame)
{
    bool is = mesh && mesh->topology == frame->topology && mesh->node_count == frame->node_count &&
              mesh->triangle_count == frame->triangle_count;
#define SAME_COLUMN(name, ...)                                                                     \
    is = is && same(mesh->name, frame->name, COLUMN_BYTES(frame, __VA_ARGS__));
    MESH_COLUMNS(SAME_COLUMN)
    return is;
}

// Writes the colours of the nodes of a mesh: `of` the body where nodes have none, and those that
// the mesh before has until the look of this one comes.
static unsigned char *colours_of(const MeshFrame *mesh, const LookFrame *look,
                                 const unsigned char of[3], const unsigned char *own,
                                 const KitMesh *before, const unsigned char *had)
{
    const size_t values = 3 * (size_t)mesh->node_count;
    const bool fits = look->head.whole && look->varies && look->head.topology == mesh->topology &&
                      look->head.count == mesh->node_count;
    unsigned char *colour = malloc(values + 1);
    if (!colour)
        abort(); // the sizes are bounded: the machine itself is out of memory
    for (int i = 0; i < mesh->node_count; i++) {
        const bool known =
            !fits && look->varies && had && i < before->node_count && before->id[i] == mesh->id[i];
        memcpy(colour + 3L * i, fits ? own + 3L * i : known ? had + 3L * i : of, 3);
    }
    return colour;
}

// True if the copy has these colours.
static bool look_is(const KitMesh *mesh, const LookFrame *look)
{
    if (!look->head.whole)
        return true;
    if (!mesh->color)
        return false;
    if (look->varies &&
        (look->head.topology != mesh->topology || look->head.count != mesh->node_count))
        return true; // of another mesh
    for (int i = 0; i < mesh->node_count; i++) {
        const long at = 3L * i;
        if (memcmp(mesh->color + at, look->varies ? look->outside + at : look->color, 3) != 0 ||
            memcmp(mesh->inside + at, look->varies ? look->inside + at : look->wall, 3) != 0)
            return false;
    }
    return true;
}

// Returns a copy of the mesh, which is the caller's. `before`: NULL, or the one that it replaces.
static KitMesh *mesh_copy(const MeshFrame *from, const LookFrame *look, const KitMesh *before)
{
    const bool coloured = look->head.whole || (before && before->color);
#define COPY_COLUMN(name, ...) .name = kit_copy(from->name, COLUMN_BYTES(from, __VA_ARGS__)),
    return kit_mesh_create(
        &(const KitMesh){.topology = from->topology,
                         .node_count = from->node_count,
                         .triangle_count = from->triangle_count,
                         MESH_COLUMNS(COPY_COLUMN).color =
                             coloured ? colours_of(from, look, look->color, look->outside, before,
                                                   before ? before->color : NULL)
                                      : NULL,
                         .inside = coloured ? colours_of(from, look, look->wall, look->inside,
                                                         before, before ? before->inside : NULL)
                                            : NULL});
}

// Hands the newest positions out if there is one of each node and the mesh is theirs.
static void frame_try(PliantClient *kit, KitBody *body)
{
    const NodesFrame *nodes = &body->nodes;
    const MeshFrame *mesh = &body->mesh;
    if (!nodes->ready || !body->waiting)
        return;
    if (!mesh->whole || mesh->topology != nodes->head.topology ||
        mesh->node_count != nodes->head.count) {
        kit->wants_mesh = true;
        return;
    }
    // Most whole meshes repeat the one that is there.
    if (body->renewed && (!mesh_is(body->shared, mesh) || !look_is(body->shared, &body->look))) {
        KitMesh *before = body->shared;
        body->shared = mesh_copy(mesh, &body->look, before);
        kit_mesh_release(before);
    }
    body->renewed = false;
    float *position = kit_copy(nodes->position, 3 * (size_t)nodes->head.count * sizeof *position);
    pliant_body_release(body->newest);
    body->newest = kit_frame_create(
        &(const PliantBody){.name = body->name,
                            .count = ++body->count,
                            .step = nodes->step,
                            .time = nodes->time,
                            .utime = nodes->head.utime,
                            .position = position,
                            .first_wall = body->first_wall,
                            .old_nodes = nodes->head.count - nodes->head.parts.arrived},
        body->shared);
    body->waiting = false;
    kit->news++;
}

// --- messages ------------------------------------------------------------------------------------

static KitBody *find(const PliantClient *kit, const char *name)
{
    for (int i = 0; i < kit->bodies && name; i++) {
        if (strcmp(kit->body[i]->name, name) == 0)
            return kit->body[i];
    }
    return NULL;
}

// Returns the entry of a body, made if it is new; NULL: no name, or there is room for no more.
static KitBody *add(PliantClient *kit, const char *name)
{
    KitBody *body = find(kit, name);
    if (body || !name || kit->bodies == KIT_BODIES || strlen(name) >= sizeof body->name)
        return body;
    body = kit_copy(&(const KitBody){0}, sizeof *body);
    strcpy(body->name, name);
    kit->body[kit->bodies++] = body;
    return body;
}

static void on_nodes(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    PliantClient *kit = user;
    KitBody *body = add(kit, client_nodes_body(&kit->client, channel));
    if (!body)
        return;
    body->nodes.head.mesh_nodes = body->mesh.most_nodes;
    const FramesResult result = nodes_frame_add(&body->nodes, buffer->data, buffer->data_size);
    if (result != FRAMES_WHOLE && result != FRAMES_PATCHED)
        return;
    body->waiting = true;
    frame_try(kit, body);
}

static void take_mesh(PliantClient *kit, KitBody *body, FramesResult result)
{
    kit->wants_mesh |= result == FRAMES_MISSED;
    if (result != FRAMES_WHOLE)
        return;
    body->renewed = true;
    frame_try(kit, body);
}

// Channels of meshes and deltas begin alike.
static void on_mesh(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    PliantClient *kit = user;
    const char *name = client_body_of(&kit->client, "MESH_DELTA", channel);
    const bool is_delta = name != NULL;
    KitBody *body = add(kit, is_delta ? name : client_body_of(&kit->client, "MESH", channel));
    if (!body)
        return;
    if (!is_delta)
        kit->mesh_ns = client_now_ns();
    take_mesh(kit, body,
              is_delta ? mesh_frame_add_delta(&body->mesh, buffer->data, buffer->data_size)
                       : mesh_frame_add(&body->mesh, buffer->data, buffer->data_size));
}

static void on_look(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    PliantClient *kit = user;
    KitBody *body = add(kit, client_body_of(&kit->client, "LOOK", channel));
    if (!body)
        return;
    body->look.head.mesh_nodes = body->mesh.most_nodes;
    // The next frame has them.
    if (look_frame_add(&body->look, buffer->data, buffer->data_size) == FRAMES_WHOLE)
        body->renewed = true;
}

static void on_walls(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    PliantClient *kit = user;
    KitBody *body = add(kit, client_body_of(&kit->client, "WALLS", channel));
    pliant_walls_t walls;
    if (body && wire_check(&WIRE_WALLS, buffer->data, buffer->data_size) &&
        pliant_walls_t_decode(buffer->data, 0, (int)buffer->data_size, &walls) >= 0 &&
        walls.first_wall >= 0)
        body->first_wall = walls.first_wall;
}

bool pliant_hear_bodies(PliantClient *kit, bool hear)
{
    enum { QUEUE = 1000 };
    static const struct {
        const char *name;
        lcm_msg_handler_t handler;
    } CHANNELS[KIT_BODY_CHANNELS] = {{"NODES", on_nodes},
                                     {"POINTS", on_nodes},
                                     {"MESH", on_mesh},
                                     {"WALLS", on_walls},
                                     {"LOOK", on_look}};
    for (int k = 0; k < KIT_BODY_CHANNELS; k++) {
        if (!hear)
            receiver_unsubscribe(kit->client.receiver, kit->hears[k]);
        kit->hears[k] = !hear           ? NULL
                        : kit->hears[k] ? kit->hears[k]
                                        : client_subscribe(&kit->client, CHANNELS[k].name, ".+",
                                                           QUEUE, CHANNELS[k].handler, kit);
        if (hear && !kit->hears[k])
            return client_fail(&kit->error, "LCM refuses to subscribe to %s_%s_.+",
                               kit->client.prefix, CHANNELS[k].name);
    }
    kit->wants_mesh &= hear;
    return true;
}

void kit_bodies_destroy(PliantClient *kit)
{
    for (int i = 0; i < kit->bodies; i++) {
        KitBody *body = kit->body[i];
        nodes_frame_destroy(&body->nodes);
        mesh_frame_destroy(&body->mesh);
        look_frame_destroy(&body->look);
        kit_mesh_release(body->shared);
        pliant_body_release(body->newest);
        free(body);
    }
    kit->bodies = 0;
}

// --- what is there -------------------------------------------------------------------------------

int pliant_body_count(const PliantClient *kit)
{
    int count = 0;
    for (int i = 0; i < kit->bodies; i++)
        count += kit->body[i]->newest != NULL;
    return count;
}

const char *pliant_body_name(const PliantClient *kit, int k)
{
    for (int i = 0; i < kit->bodies; i++) {
        if (kit->body[i]->newest && k-- == 0)
            return kit->body[i]->name;
    }
    return NULL;
}

const PliantBody *pliant_body(const PliantClient *kit, const char *name)
{
    const KitBody *body = find(kit, name);
    return body ? body->newest : NULL;
}

const PliantBody *pliant_wait_body(PliantClient *kit, const char *name, double seconds)
{
    char what[CLIENT_CHANNEL_MAX + 32];
    KitBody *body = add(kit, name);
    if (!body) {
        client_fail(&kit->error, "body '%.80s': none has such a name, or there are %d already",
                    name ? name : "", KIT_BODIES);
        return NULL;
    }
    snprintf(what, sizeof what, "frame of body '%s'", body->name);
    return kit_wait_for(kit, what, seconds, &body->count) ? body->newest : NULL;
}
