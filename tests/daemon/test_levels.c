// SPDX-License-Identifier: MIT
// A body that refines and coarsens, through the real daemon: what clients make of its meshes and
// deltas has no cracks at any time, checkpoints and input logs continue and repeat it bit for bit,
// recordings hold every mesh.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"
#include "follower.h"

#include "pliant_status_t.h"

#if WITH_HDF5
#include "recording_view.h"
#endif

static const char LIVE[] =
    "publish = { nodes_hz = 60.0; mesh_hz = 1.0; contact_hz = 100.0; status_hz = 20.0; };";
#if WITH_HDF5
static const char PAUSED[] =
    "start = \"paused\"; publish = { nodes_hz = 60.0; mesh_hz = 1.0; contact_hz = 100.0; };";
static const char LOADS[] = "loads = ( { body = \"sphere\"; center = [0.0, 0.0, 0.05];\n"
                            "  radius = 0.03; force = [0.1, 0.0, -0.4]; start = 0.05;\n"
                            "  duration = 0.4; } );";
#endif

// The small scene with levels.
static const char *write_levels(const char *file, const char *precision, const char *head,
                                const char *tail)
{
    char keys[512];
    snprintf(keys, sizeof keys, "precision = \"%s\"; %s", precision, head);
    return write_body_scene(
        file,
        &(SceneParts){
            .head = keys,
            .body = "levels = 3; adapt = { check_hz = 100.0; };\n"
                    "shape = { angular_frequency = 50.0; damping_ratio = 0.3; };\n" LOWER_FIXED,
            .tail = tail});
}

HANDLER(on_status, pliant_status_t, m)
{
    assert_int_equal(m->num_bodies, 1);
    assert_true(isfinite(m->body[0].kinetic) && isfinite(m->body[0].elastic));
    pliant_body_status_t *of = user;
    of->finest_level = m->body[0].finest_level;
    of->nodes = m->body[0].nodes;
}

// Presses for a number of poses, about 3 ms each.
static void press(Client *client, int poses)
{
    for (int i = 0; i < poses; i++) {
        const double angle = 0.02 * i;
        send_pose_at(client, (const double[]){0.015 * cos(angle), 0.015 * sin(angle), 0.046});
        client_listen(client, 3);
    }
}

// Every delta is of the mesh before it, unless a busy machine has lost one.
TEST(clients_see_a_mesh_without_cracks_at_all_times)
{
    SCOPED_CLIENT Client *client = client_create();
    Follower *first = follower_create(client->lcm);
    pliant_body_status_t status = {0};
    pliant_status_t_subscription_t *on =
        pliant_status_t_subscribe(client->lcm, "PLIANT_STATUS", on_status, &status);
    server_start_for(client, &pliantd, "%s", write_levels("live.cfg", "single", LIVE, PROBE_TOOL));
    wait_until(client, first->wholes > 0);
    assert_int_equal(live_nodes(first), SPHERE_NODES);
    const int ahead = first->frames - first->matched; // of its first mesh
    press(client, 250);
    assert_true(first->deltas > 3 && first->most_nodes > 60);
    assert_true(status.finest_level >= 1 && status.nodes > SPHERE_NODES);

    // One who comes late has the mesh as soon as it asks, and follows from there.
    Follower *late = follower_create(client->lcm);
    assert_true(command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "")->ok);
    press(client, 150);
    assert_true(late->mesh.whole);
    assert_true(late->deltas > 0);

    // The tool is withdrawn by silence; the mesh becomes what it was.
    wait_until(client, live_nodes(first) == SPHERE_NODES && status.finest_level == 0);
    assert_int_equal(late->missed, 0);
    follower_destroy(late);
    assert_int_equal(status.nodes, SPHERE_NODES);
    assert_int_equal(first->missed, 0);
    assert_int_equal(first->frames - first->matched, ahead);
    assert_true(first->frames > 30);
    server_stop(client, &pliantd);
    pliant_status_t_unsubscribe(client->lcm, on);
    follower_destroy(first);
}

TEST(a_reset_takes_clients_back_to_the_first_mesh)
{
    SCOPED_CLIENT Client *client = client_create();
    Follower *follower = follower_create(client->lcm);
    server_start_for(client, &pliantd, "%s", write_levels("reset.cfg", "double", LIVE, PROBE_TOOL));
    wait_until(client, follower->wholes > 0);
    const int ahead = follower->frames - follower->matched;
    press(client, 150);
    const int before = follower->mesh.topology;
    assert_true(live_nodes(follower) > SPHERE_NODES);
    // Softer than it was loaded, which no step forbids, while it is refined.
    assert_true(command(client, PLIANT_COMMAND_T_SET, 0, "stiffness_scale=0.9")->ok);
    command(client, PLIANT_COMMAND_T_RESET, 0, "");
    wait_until(client, live_nodes(follower) == SPHERE_NODES);
    assert_true(follower->mesh.topology > before); // a number of its own
    press(client, 100);
    assert_int_equal(follower->missed, 0);
    assert_int_equal(follower->frames - follower->matched, ahead);
    server_stop(client, &pliantd);
    follower_destroy(follower);
}

#if WITH_HDF5
// --- The same bits ---

// A live daemon in lockstep: `first` ticks and a checkpoint, then the rest.
static void step_live(const char *arguments, int ticks, char hash[32])
{
    Process daemon;
    SCOPED_CLIENT Client *client = server_start(&daemon, "%s", arguments);
    step_daemon(client, ticks);
    server_stop(client, &daemon);
    printed_state(&daemon, hash);
}

TEST(a_live_run_is_resumed_with_the_same_bits)
{
    const char *scene = write_levels("lockstep.cfg", "single", PAUSED, LOADS);
    const char *part = scratch("lockstep.h5");
    char whole[32], half[32], resumed[32], arguments[1200];
    step_live(scene, 700, whole);
    snprintf(arguments, sizeof arguments, "--checkpoint %s %s", part, scene);
    step_live(arguments, 250, half);
    snprintf(arguments, sizeof arguments, "--resume %s %s", part, scene);
    step_live(arguments, 450, resumed);
    assert_string_not_equal(half, whole);
    assert_string_equal(resumed, whole);
}

// --- Recordings ---

typedef struct Side {
    int32_t from, to;
} Side;

static int compare_sides(const void *left, const void *right)
{
    const Side *a = left, *b = right;
    int32_t low[2] = {a->from < a->to ? a->from : a->to, b->from < b->to ? b->from : b->to};
    int32_t high[2] = {a->from < a->to ? a->to : a->from, b->from < b->to ? b->to : b->from};
    return low[0] != low[1] ? (low[0] > low[1]) - (low[0] < low[1])
                            : (high[0] > high[1]) - (high[0] < high[1]);
}

// Closed: each edge in two triangles, which run along it in opposite directions.
static void expect_closed(int32_t (*triangle)[3], int count)
{
    FREED Side *side = malloc(3 * (size_t)count * sizeof *side);
    for (int i = 0; i < 3 * count; i++)
        side[i] = (Side){triangle[i / 3][i % 3], triangle[i / 3][(i + 1) % 3]};
    qsort(side, 3 * (size_t)count, sizeof *side, compare_sides);
    for (int i = 0; i < 3 * count; i += 2) {
        assert_true(side[i].from == side[i + 1].to && side[i].to == side[i + 1].from);
        assert_true(i + 2 >= 3 * count || compare_sides(&side[i], &side[i + 2]) != 0);
    }
}

TEST(a_recording_holds_every_mesh_without_cracks)
{
    const char *path = scratch("levels.h5");
    run_daemon_well(&pliantd, "--offline 1 --record %s %s", path,
                    write_levels("record.cfg", "single", LIVE, LOADS));
    SCOPED(view_free) BodyView view;
    view_read(&view, path, "sphere");
    assert_true(view.topologies > 5);
    int most = 0;
    for (int t = 0; t < view.topologies; t++) {
        assert_true(t == 0 || view.number[t] > view.number[t - 1]);
        expect_closed(view.triangle + view.first_triangle[t], view.triangle_count[t]);
        // Euler's formula for a sphere: V - E + F = 2 with E = 3 F / 2.
        assert_int_equal(view.node_count[t] - view.triangle_count[t] / 2, 2);
        most = view.node_count[t] > most ? view.node_count[t] : most;
    }
    assert_true(most > 2 * SPHERE_NODES);
    for (int f = 0; f < view.frames; f++) {
        int t = 0;
        while (view.number[t] != view.topology[f])
            assert_true(++t < view.topologies);
        assert_int_equal(view.count[f], view.node_count[t]);
        for (int i = 0; i < view.count[f]; i++)
            assert_true(isfinite(view.position[view.first[f] + i][0]) &&
                        isfinite(view.position[view.first[f] + i][1]) &&
                        isfinite(view.position[view.first[f] + i][2]));
    }
    int count;
    FREED SidecarFrame *frame = view_sidecar_of(path, &count);
    expect_sidecar_matches(frame, count, &view, "sphere");
}
#endif
