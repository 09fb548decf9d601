// SPDX-License-Identifier: MIT
// A real daemon with a body that refines and coarsens while it is pressed: what it publishes and
// records is followed by a client that was there from the start, one that came late, and one in
// lockstep.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"
#include "frames.h"
#include "mesh_check.h"
#if WITH_HDF5
#include "recording_view.h"
#endif

#include "pliant_mesh_delta_t.h"
#include "pliant_mesh_t.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>

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
    int32_t sequence; // of the newest delta, if any
    bool seen_delta;
    bool behind; // a busy machine has lost a delta: the next whole mesh makes up for it
    int wholes, deltas, missed; // missed: though none had been lost
    int frames, matched;        // matched: those whose mesh was there, or lost
    int most_nodes, least_nodes, deepest;
} Follower;

static void keep_node(Follower *follower, int slot, int origin, int piece, int level)
{
    assert_in_range(slot, 0, SLOTS - 1);
    follower->origin[slot] = origin;
    follower->piece[slot] = piece;
    follower->level[slot] = (signed char)level;
    follower->deepest = level > follower->deepest ? level : follower->deepest;
}

static void expect_whole(Follower *follower)
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
    int nodes = 0;
    for (int i = 0; i < mesh.node_count; i++)
        nodes += mesh.id[i] >= 0;
    follower->most_nodes = nodes > follower->most_nodes ? nodes : follower->most_nodes;
    if (follower->least_nodes == 0 || nodes < follower->least_nodes)
        follower->least_nodes = nodes;
}

static void on_mesh(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Follower *follower = user;
    pliant_mesh_t mesh;
    assert_true(buffer->data_size <= 65499);
    assert_true(pliant_mesh_t_decode(buffer->data, 0, (int)buffer->data_size, &mesh) >= 0);
    for (int k = 0; k < mesh.num_nodes; k++)
        keep_node(follower, mesh.first_node + k, mesh.origin[k], mesh.piece[k], mesh.level[k]);
    pliant_mesh_t_decode_cleanup(&mesh);
    if (mesh_frame_add(&follower->mesh, buffer->data, buffer->data_size) != FRAMES_WHOLE)
        return;
    follower->wholes++;
    follower->behind = false;
    expect_whole(follower);
}

static void on_delta(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Follower *follower = user;
    pliant_mesh_delta_t delta;
    assert_true(buffer->data_size <= 65499);
    assert_true(pliant_mesh_delta_t_decode(buffer->data, 0, (int)buffer->data_size, &delta) >= 0);
    for (int k = 0; k < delta.num_nodes; k++)
        keep_node(follower, delta.node_slot[k], delta.origin[k], delta.piece[k], delta.level[k]);
    const uint32_t ahead = (uint32_t)delta.sequence - (uint32_t)follower->sequence;
    follower->behind |= follower->seen_delta && ahead > 1;
    follower->seen_delta = true;
    follower->sequence = delta.sequence;
    pliant_mesh_delta_t_decode_cleanup(&delta);
    FramesResult result = mesh_frame_add_delta(&follower->mesh, buffer->data, buffer->data_size);
    follower->deltas += result == FRAMES_WHOLE;
    follower->missed += result == FRAMES_MISSED && !follower->behind;
    if (result == FRAMES_WHOLE)
        expect_whole(follower);
}

static void on_nodes(const lcm_recv_buf_t *buffer, const char *channel, void *user)
{
    (void)channel;
    Follower *follower = user;
    const NodesFrame *nodes = &follower->nodes;
    if (nodes_frame_add(&follower->nodes, buffer->data, buffer->data_size) != FRAMES_WHOLE)
        return;
    follower->frames++;
    if (follower->behind) {
        follower->matched++;
        return;
    }
    if (!follower->mesh.whole || follower->mesh.topology != nodes->topology)
        return;
    follower->matched++;
    assert_int_equal(follower->mesh.node_count, nodes->node_count);
    for (int i = 0; i < nodes->node_count; i++) {
        const float *x = nodes->position + 3 * i;
        double r = sqrt((double)(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]));
        // A sphere of 5 cm. Pressed once its top comes to 25 mm of its centre, by two presses at
        // once (the second may come before the first one ends) to 9.5 mm, and no node beyond 59 mm.
        if (follower->mesh.id[i] >= 0)
            assert_true(r > 0.005 && r < 0.08);
    }
}

static Follower *follower_create(lcm_t *lcm)
{
    Follower *follower = calloc(1, sizeof *follower);
    assert_non_null(follower);
    follower->lcm = lcm;
    follower->on[0] = lcm_subscribe(lcm, "PLIANT_MESH_sphere", on_mesh, follower);
    follower->on[1] = lcm_subscribe(lcm, "PLIANT_MESH_DELTA_sphere", on_delta, follower);
    follower->on[2] = lcm_subscribe(lcm, "PLIANT_NODES_sphere", on_nodes, follower);
    for (int k = 0; k < 3; k++)
        lcm_subscription_set_queue_capacity(follower->on[k], 4096);
    return follower;
}

static void follower_destroy(Follower *follower)
{
    for (int k = 0; k < 3; k++)
        lcm_unsubscribe(follower->lcm, follower->on[k]);
    mesh_frame_destroy(&follower->mesh);
    nodes_frame_destroy(&follower->nodes);
    free(follower);
}

// A sphere of two more levels, pressed for a while at its top.
static const char *write_levels(const char *name, const char *head)
{
    char keys[256];
    snprintf(
        keys, sizeof keys,
        "%s publish = { nodes_hz = 60.0; mesh_hz = 2.0; contact_hz = 0.0; status_hz = 10.0; };",
        head);
    return write_body_scene(
        name, &(SceneParts){.head = keys,
                            .source = ICO_SPHERE(162, 0.05),
                            .material = "",
                            .body = "levels = 2; shape = {};\n"
                                    "adapt = { force = 0.005; speed = 0.3; curvature = 0.4; "
                                    "check_hz = 100.0; };\n" FIXED_BELOW(-0.03)});
}

static void press(Client *client, double newton, double seconds)
{
    const double top[3] = {0.0, 0.0, 0.05}, force[3] = {0.1 * newton, 0.0, -newton};
    // Refused while a former press keeps the top away from there.
    const double limit = client_now() + 30.0;
    while (!apply_load(client, top, 0.02, force, seconds, "sphere")->ok)
        assert_true(client_now() < limit);
}

AROUND_EACH(NULL, harness_teardown)

TEST(a_client_follows_a_body_that_refines_and_coarsens)
{
    const char *scene = write_levels("live.cfg", "");
    static Process daemon;
    Client *client = client_create();
    Follower *first = follower_create(client->lcm);
    daemon_start(&daemon, "%s", scene);
    client_wait_for_daemon(client);
    wait_until(client, first->wholes > 0);
    press(client, 0.3, 0.5);
    wait_until(client, first->deltas >= 5 && first->most_nodes > 200);
    Follower *late = follower_create(client->lcm);
    wait_until(client, late->wholes > 0);
    press(client, 0.3, 0.5);
    int deltas = late->deltas, frames = late->frames, matched = late->matched;
    wait_until(client, late->deltas >= deltas + 5 && late->frames >= frames + 30);
    // Once it has the mesh it has all frames.
    assert_int_equal(late->matched - matched, late->frames - frames);
    assert_int_equal(late->mesh.topology, first->mesh.topology);
    // At rest the body returns to its coarse mesh.
    wait_until(client, first->mesh.whole && first->least_nodes == 162 && first->deltas > 20);
    // RESET goes back to the mesh of the start under a new number.
    press(client, 0.3, 5.0);
    int before = first->mesh.topology;
    wait_until(client, first->mesh.topology > before + 5);
    before = first->mesh.topology;
    assert_true(command(client, PLIANT_COMMAND_T_RESET, 0, "")->ok);
    wait_until(client, first->mesh.topology > before);
    assert_int_equal(first->missed, 0);
    assert_int_equal(first->mesh.refused, 0);
    assert_in_range(first->deepest, 1, 2);
    client_fresh_status(client);
    process_end(&daemon);
    follower_destroy(late);
    follower_destroy(first);
    client_destroy(client);
}

TEST(a_step_shows_its_mesh_before_it_is_answered)
{
    const char *scene = write_levels("lockstep.cfg", "start = \"paused\";");
    static Process daemon;
    Client *client = client_create();
    Follower *follower = follower_create(client->lcm);
    daemon_start(&daemon, "%s", scene);
    client_wait_for_daemon(client);
    wait_until(client, follower->wholes > 0);
    press(client, 0.3, 10.0);
    int shown = 0;
    for (int n = 0; n < 60; n++) {
        const Reply *reply = command(client, PLIANT_COMMAND_T_STEP, 10, "");
        assert_true(reply->ok);
        shown += follower->nodes.step == reply->step && follower->nodes.whole &&
                 follower->mesh.topology == follower->nodes.topology;
    }
    assert_in_range(shown, 50, 60); // a busy machine may lose some on their way
    assert_true(follower->deltas > 5);
    assert_int_equal(follower->missed, 0);
    process_signal(&daemon, SIGTERM);
    process_wait(&daemon);
    follower_destroy(follower);
    client_destroy(client);
}

#if WITH_HDF5
TEST(a_recording_has_the_meshes_of_its_frames)
{
    const char *scene = write_levels("record.cfg", "");
    static Process daemon;
    const char *path = scratch("levels.h5");
    Client *client = client_create();
    daemon_start(&daemon, "--record %s %s", path, scene);
    client_wait_for_daemon(client);
    press(client, 0.3, 0.5);
    int64_t begun = client->status.step;
    wait_until(client, client->status.step >= begun + 1200); // however slowly it ticks
    process_end(&daemon);
    hid_t file = view_open(path, false);
    assert_true(file >= 0);
    BodyView view;
    view_body(&view, file, "sphere"); // every index points at something
    assert_true(view.frames > 30);
    assert_true(view.topologies > 5);
    for (int t = 0; t < view.topologies; t++) {
        // A closed surface without handles (Euler): twice the nodes but two pairs of triangles.
        assert_int_equal(view.triangle_count[t], 2 * view.node_count[t] - 4);
        assert_true(t == 0 || view.number[t] > view.number[t - 1]);
    }
    char xdmf[1100];
    int count;
    snprintf(xdmf, sizeof xdmf, "%s.xdmf", path);
    SidecarFrame *frame = view_sidecar(xdmf, &count);
    assert_int_equal(count, view.frames);
    expect_sidecar_matches(frame, count, &view, "sphere");
    free(frame);
    view_free(&view);
    H5Fclose(file);
    client_destroy(client);
}
#endif
