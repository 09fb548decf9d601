// SPDX-License-Identifier: MIT
// A listener that keeps the mesh of the body "sphere" as a front end would, and checks it whenever
// it has changed.
#ifndef PLIANT_TESTS_DAEMON_FOLLOWER_H
#define PLIANT_TESTS_DAEMON_FOLLOWER_H

#include "lcm_client.h"
#include "frames.h"
#include "mesh_check.h"

#include "pliant_mesh_delta_t.h"
#include "pliant_mesh_t.h"

enum { SLOTS = 20000 };

// A listener that keeps what a front end would.
typedef struct Follower {
    lcm_t *lcm;
    lcm_subscription_t *on[3];
    MeshFrame mesh;
    NodesFrame nodes;
    // all of the mesh, for the checker
    int origin[SLOTS], piece[SLOTS];
    signed char level[SLOTS];
    int32_t sequence;      // of the newest delta, if any
    bool seen_delta, open; // chunks of it are still to come
    bool behind;           // a busy machine has lost a delta: the next whole mesh makes up for it
    int wholes, deltas;
    int missed, early;   // deltas of another mesh though none had been lost; before the first mesh
    int frames, matched; // matched: those whose mesh was there, or lost
    int most_nodes, least_nodes, deepest;
} Follower;

static inline void keep_node(Follower *follower, int slot, int origin, int piece, int level)
{
    assert_in_range(slot, 0, SLOTS - 1);
    follower->origin[slot] = origin;
    follower->piece[slot] = piece;
    follower->level[slot] = (signed char)level;
    follower->deepest = level > follower->deepest ? level : follower->deepest;
}

static inline int live_nodes(const Follower *follower)
{
    int count = 0;
    for (int i = 0; i < follower->mesh.node_count; i++)
        count += follower->mesh.id[i] >= 0;
    return count;
}

static inline void expect_whole(Follower *follower)
{
    const MeshFrame *frame = &follower->mesh;
    const BodyMesh mesh = {.topology = frame->topology,
                           .node_count = frame->node_count,
                           .triangle_count = frame->triangle_count,
                           .node_capacity = SLOTS,
                           .triangle_capacity = 2 * SLOTS,
                           .triangle = (const int(*)[3])frame->triangle,
                           .id = frame->id,
                           .origin = follower->origin,
                           .parent = (const int(*)[2])frame->parent,
                           .piece = follower->piece,
                           .level = follower->level};
    expect_crack_free(&mesh, NULL, NULL);
    const int nodes = live_nodes(follower);
    follower->most_nodes = nodes > follower->most_nodes ? nodes : follower->most_nodes;
    if (follower->least_nodes == 0 || nodes < follower->least_nodes)
        follower->least_nodes = nodes;
}

RAW_HANDLER(on_mesh)
{
    Follower *follower = user;
    pliant_mesh_t mesh;
    assert_true(buffer->data_size <= 65499);
    assert_true(pliant_mesh_t_decode(buffer->data, 0, (int)buffer->data_size, &mesh) >= 0);
    for (int k = 0; k < mesh.num_nodes; k++) {
        if (follower->mesh.whole && follower->mesh.topology == mesh.topology)
            assert_int_equal(follower->mesh.id[mesh.first_node + k], mesh.id[k]);
        keep_node(follower, mesh.first_node + k, mesh.origin[k], mesh.piece[k], mesh.level[k]);
    }
    pliant_mesh_t_decode_cleanup(&mesh);
    if (mesh_frame_add(&follower->mesh, buffer->data, buffer->data_size) != FRAMES_WHOLE)
        return;
    follower->wholes++;
    follower->behind = false;
    expect_whole(follower);
}

RAW_HANDLER(on_delta)
{
    Follower *follower = user;
    pliant_mesh_delta_t delta;
    assert_true(buffer->data_size <= 65499);
    assert_true(pliant_mesh_delta_t_decode(buffer->data, 0, (int)buffer->data_size, &delta) >= 0);
    for (int k = 0; k < delta.num_nodes; k++)
        keep_node(follower, delta.node_slot[k], delta.origin[k], delta.piece[k], delta.level[k]);
    const uint32_t ahead = (uint32_t)delta.sequence - (uint32_t)follower->sequence;
    follower->behind |= follower->seen_delta && (ahead > 1 || (ahead == 1 && follower->open));
    follower->seen_delta = true;
    follower->sequence = delta.sequence;
    assert_true(delta.topology > delta.from_topology);
    pliant_mesh_delta_t_decode_cleanup(&delta);
    const bool whole = follower->mesh.whole;
    FramesResult result = mesh_frame_add_delta(&follower->mesh, buffer->data, buffer->data_size);
    follower->deltas += result == FRAMES_WHOLE;
    follower->open = result == FRAMES_MORE;
    if (result == FRAMES_MISSED && !follower->behind)
        whole ? follower->missed++ : follower->early++;
    if (result == FRAMES_WHOLE)
        expect_whole(follower);
}

RAW_HANDLER(on_nodes)
{
    Follower *follower = user;
    const NodesFrame *nodes = &follower->nodes;
    if (nodes_frame_add(&follower->nodes, buffer->data, buffer->data_size) != FRAMES_WHOLE)
        return;
    follower->frames++;
    for (int i = 0; i < 3 * nodes->head.count; i++)
        assert_true(isfinite(nodes->position[i]));
    if (follower->behind) {
        follower->matched++;
        return;
    }
    if (!follower->mesh.whole || follower->mesh.topology != nodes->head.topology)
        return;
    follower->matched++;
    assert_int_equal(follower->mesh.node_count, nodes->head.count);
    for (int i = 0; i < nodes->head.count; i++) {
        const float *x = nodes->position + 3 * i;
        double r = sqrt((double)(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]));
        // A sphere of 5 cm. Pressed once its top comes to 25 mm of its centre, by two presses at
        // once (the second may come before the first one ends) to 9.5 mm, and no node beyond 59 mm.
        if (follower->mesh.id[i] >= 0)
            assert_true(r > 0.005 && r < 0.08);
    }
}

static inline Follower *follower_create(lcm_t *lcm)
{
    Follower *follower = zeroed(1, sizeof *follower);
    follower->lcm = lcm;
    follower->on[0] = lcm_subscribe(lcm, "PLIANT_MESH_sphere", on_mesh, follower);
    follower->on[1] = lcm_subscribe(lcm, "PLIANT_MESH_DELTA_sphere", on_delta, follower);
    follower->on[2] = lcm_subscribe(lcm, "PLIANT_NODES_sphere", on_nodes, follower);
    for (int k = 0; k < 3; k++)
        lcm_subscription_set_queue_capacity(follower->on[k], 4096);
    return follower;
}

static inline void follower_destroy(Follower *follower)
{
    for (int k = 0; k < 3; k++)
        lcm_unsubscribe(follower->lcm, follower->on[k]);
    mesh_frame_destroy(&follower->mesh);
    nodes_frame_destroy(&follower->nodes);
    free(follower);
}

#endif
