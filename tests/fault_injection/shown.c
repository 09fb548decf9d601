// SPDX-License-Identifier: MIT
#include "shown.h"

#include "expect.h"

static uint64_t mix(uint64_t hash, const void *data, size_t size)
{
    const unsigned char *byte = data;
    for (size_t i = 0; i < size; i++)
        hash = (hash ^ byte[i]) * UINT64_C(1099511628211);
    return hash;
}

// Triangles, and the positions of the slots that are in use: free ones hold anything.
static uint64_t hash_of(const MeshFrame *mesh, const NodesFrame *nodes)
{
    uint64_t hash = UINT64_C(14695981039346656037);
    hash = mix(hash, &mesh->topology, sizeof mesh->topology);
    hash = mix(hash, mesh->triangle, 3 * (size_t)mesh->triangle_count * sizeof *mesh->triangle);
    for (int i = 0; i < mesh->node_count; i++)
        if (mesh->id[i] >= 0)
            hash = mix(hash, nodes->position + 3 * (size_t)i, 3 * sizeof *nodes->position);
    return hash | 1;
}

// As a viewer must: nodes are drawn with the mesh of their own topology, or not at all.
static void show(Shown *shown)
{
    const NodesFrame *nodes = &shown->nodes;
    const MeshFrame *mesh = &shown->mesh;
    uint64_t *hash = &shown->hash[(uint32_t)nodes->head.sequence % SHOWN_MOST];
    if (!nodes->head.whole || !mesh->whole || nodes->head.topology != mesh->topology || *hash != 0)
        return;
    assert_int_equal(nodes->head.count, mesh->node_count);
    *hash = hash_of(mesh, nodes);
    shown->count++;
}

static void on_nodes(const lcm_recv_buf_t *message, const char *channel, void *user)
{
    (void)channel;
    Shown *shown = user;
    const bool started = shown->nodes.head.started;
    FramesResult result = nodes_frame_add(&shown->nodes, message->data, message->data_size);
    if (!started && shown->nodes.head.started)
        shown->begun = shown->nodes.head.sequence;
    if (result != FRAMES_WHOLE)
        return;
    shown->whole++;
    show(shown);
}

static void on_mesh(const lcm_recv_buf_t *message, const char *channel, void *user)
{
    (void)channel;
    Shown *shown = user;
    if (mesh_frame_add(&shown->mesh, message->data, message->data_size) != FRAMES_WHOLE)
        return;
    shown->meshes++;
    show(shown);
}

static void on_delta(const lcm_recv_buf_t *message, const char *channel, void *user)
{
    (void)channel;
    Shown *shown = user;
    if (mesh_frame_add_delta(&shown->mesh, message->data, message->data_size) != FRAMES_WHOLE)
        return;
    shown->meshes++;
    show(shown);
}

Shown *shown_create(lcm_t *lcm, const char *body)
{
    static const char *const name[3] = {"NODES", "MESH", "MESH_DELTA"};
    static const lcm_msg_handler_t handler[3] = {on_nodes, on_mesh, on_delta};
    Shown *shown = zeroed(1, sizeof *shown);
    shown->hash = calloc(SHOWN_MOST, sizeof *shown->hash);
    assert_non_null(shown->hash);
    shown->lcm = lcm;
    for (int i = 0; i < 3; i++) {
        char channel[64];
        snprintf(channel, sizeof channel, "PLIANT_%s_%s", name[i], body);
        shown->on[i] = lcm_subscribe(lcm, channel, handler[i], shown);
        lcm_subscription_set_queue_capacity(shown->on[i], 4096);
    }
    return shown;
}

void shown_destroy(Shown *shown)
{
    for (int i = 0; i < 3; i++)
        lcm_unsubscribe(shown->lcm, shown->on[i]);
    mesh_frame_destroy(&shown->mesh);
    nodes_frame_destroy(&shown->nodes);
    free(shown->hash);
    free(shown);
}

int64_t shown_compare(const Shown *one, const Shown *other)
{
    int64_t both = 0;
    for (int i = 0; i < SHOWN_MOST; i++) {
        if (one->hash[i] == 0 || other->hash[i] == 0)
            continue;
        if (one->hash[i] != other->hash[i])
            return -1;
        both++;
    }
    return both;
}
