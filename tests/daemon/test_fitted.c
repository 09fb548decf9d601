// SPDX-License-Identifier: MIT
// The smooth surface of a solid through the real daemon: a client that follows by deltas has the
// mesh that others get whole, knows which triangles are walls, sees the wall on the blade's plane,
// and a recording has the same positions.
#include "test.h"
#include "lcm_client.h"
#include "frames.h"
#if WITH_HDF5
#include "recording_view.h"
#endif

#include "pliant_walls_t.h"

static const double SIZE = 0.005; // of a cell [m]

static const char SCENE[] =
    "name = \"smooth\"; start = \"paused\"; publish = { nodes_hz = 1000.0; };\n"
    "bodies = ( { name = \"ball\"; model = \"voxel\"; levels = 1; cuttable = true;\n"
    "    surface = \"fitted\";\n"
    "    voxels = { generator = \"ball\"; radius = 0.03; size = 0.005; }; } );\n";

// What a front end keeps that was there from the start, and one that only takes whole meshes.
typedef struct Follower {
    lcm_t *lcm;
    lcm_subscription_t *on[4];
    MeshFrame followed, whole;
    NodesFrame nodes;
    int wholes, deltas, first_wall;
} Follower;

RAW_HANDLER(on_mesh)
{
    Follower *follower = user;
    if (follower->wholes == 0)
        mesh_frame_add(&follower->followed, buffer->data, buffer->data_size);
    follower->wholes +=
        mesh_frame_add(&follower->whole, buffer->data, buffer->data_size) == FRAMES_WHOLE;
}

RAW_HANDLER(on_delta)
{
    Follower *follower = user;
    follower->deltas +=
        mesh_frame_add_delta(&follower->followed, buffer->data, buffer->data_size) == FRAMES_WHOLE;
}

RAW_HANDLER(on_nodes)
{
    Follower *follower = user;
    nodes_frame_add(&follower->nodes, buffer->data, buffer->data_size);
}

RAW_HANDLER(on_walls)
{
    pliant_walls_t walls;
    assert_true(pliant_walls_t_decode(buffer->data, 0, (int)buffer->data_size, &walls) >= 0);
    ((Follower *)user)->first_wall = walls.first_wall;
}

static Follower *follower_create(lcm_t *lcm)
{
    Follower *follower = zeroed(1, sizeof *follower);
    follower->lcm = lcm;
    follower->on[0] = lcm_subscribe(lcm, "PLIANT_MESH_ball", on_mesh, follower);
    follower->on[1] = lcm_subscribe(lcm, "PLIANT_MESH_DELTA_ball", on_delta, follower);
    follower->on[2] = lcm_subscribe(lcm, "PLIANT_NODES_ball", on_nodes, follower);
    follower->on[3] = lcm_subscribe(lcm, "PLIANT_WALLS_ball", on_walls, follower);
    for (int k = 0; k < 4; k++)
        lcm_subscription_set_queue_capacity(follower->on[k], 4096);
    return follower;
}

static void follower_destroy(Follower *follower)
{
    for (int k = 0; k < 4; k++)
        lcm_unsubscribe(follower->lcm, follower->on[k]);
    mesh_frame_destroy(&follower->followed);
    mesh_frame_destroy(&follower->whole);
    nodes_frame_destroy(&follower->nodes);
    free(follower);
}

static void step(Client *client, Follower *follower, int ticks)
{
    const int64_t step = step_daemon(client, ticks)->step;
    wait_until(client, follower->nodes.head.whole && follower->nodes.step == step);
}

// A plane through the ball, not along the lattice.
static const double NORMAL[3] = {0.8, 0.48, 0.36}, EDGE[3] = {-0.6, 0.64, 0.48};

static void cut(Client *client)
{
    // The edge moves along what is normal to both.
    const double way[3] = {NORMAL[1] * EDGE[2] - NORMAL[2] * EDGE[1],
                           NORMAL[2] * EDGE[0] - NORMAL[0] * EDGE[2],
                           NORMAL[0] * EDGE[1] - NORMAL[1] * EDGE[0]};
    pliant_cut_t message = {.sender = client->sender, .id = ++client->next_id, .body = "ball"};
    for (int e = 0; e < 2; e++)
        for (int c = 0; c < 3; c++) {
            const double end = 0.002 * NORMAL[c] + (e == 0 ? -0.1 : 0.1) * EDGE[c];
            message.before[e][c] = end - 0.1 * way[c];
            message.after[e][c] = end + 0.1 * way[c];
        }
    const int before = count_replies(client, message.id);
    for (int second = 0; second < 60 && count_replies(client, message.id) == before; second++) {
        pliant_cut_t_publish(client->lcm, "PLIANT_CUT", &message);
        const double next = client_now() + 1.0;
        while (count_replies(client, message.id) == before && client_now() < next)
            client_listen(client, 20);
    }
    assert_true(find_reply(client, message.id)->ok);
}

static void expect_equal_meshes(const MeshFrame *a, const MeshFrame *b)
{
    assert_int_equal(a->topology, b->topology);
    assert_int_equal(a->node_count, b->node_count);
    assert_int_equal(a->triangle_count, b->triangle_count);
    assert_memory_equal(a->triangle, b->triangle,
                        3 * sizeof *a->triangle * (size_t)a->triangle_count);
    assert_memory_equal(a->id, b->id, sizeof *a->id * (size_t)a->node_count);
    assert_memory_equal(a->piece, b->piece, sizeof *a->piece * (size_t)a->node_count);
}

static double radius_rms(const Follower *follower, int nodes)
{
    double sum = 0.0;
    for (int i = 0; i < nodes; i++) {
        const float *x = follower->nodes.position + 3L * i;
        const double r = sqrt((double)(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]));
        sum += (r - 0.03) * (r - 0.03);
    }
    return sqrt(sum / nodes) / SIZE;
}

// Distance of the wall's nodes from the blade's plane [cells].
static double wall_rms(const Follower *follower)
{
    double sum = 0.0;
    int count = 0;
    for (int i = 3 * follower->first_wall; i < 3 * follower->followed.triangle_count; i++) {
        const float *x = follower->nodes.position + 3L * follower->followed.triangle[i];
        double off = -0.002;
        for (int c = 0; c < 3; c++)
            off += NORMAL[c] * (double)x[c];
        sum += off * off;
        count++;
    }
    assert_true(count > 300);
    return sqrt(sum / count) / SIZE;
}

TEST(a_smooth_surface_is_cut_shown_and_recorded)
{
    const char *path = scratch("smooth.h5"), *scene = scratch("smooth.cfg");
    write_text(scene, SCENE);
    Client *client = client_create();
    Follower *follower = follower_create(client->lcm);
#if WITH_HDF5
    daemon_start(&pliantd, "--record %s %s", path, scene);
#else
    (void)path;
    daemon_start(&pliantd, "%s", scene);
#endif
    client_wait_for_daemon(client);
    wait_until(client, follower->wholes > 0 && follower->first_wall > 0);
    step(client, follower, 1);
    const int outer = follower->whole.triangle_count, nodes = follower->whole.node_count;
    assert_int_equal(follower->first_wall, outer);
    print_message("nodes off the sphere: %.3f cells rms\n", radius_rms(follower, nodes));
    assert_true(radius_rms(follower, nodes) < 0.12); // blocks: 0.35
    cut(client);
    step(client, follower, 1);
    step(client, follower, 300); // fades end
    assert_true(follower->deltas > 0);
    const int wholes = follower->wholes;
    command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "");
    wait_until(client, follower->wholes > wholes &&
                           follower->whole.topology == follower->followed.topology);
    expect_equal_meshes(&follower->followed, &follower->whole);
    assert_true(follower->whole.triangle_count > outer);
    print_message("nodes of the wall off the plane: %.3f cells rms\n", wall_rms(follower));
    assert_true(wall_rms(follower) < 0.1); // blocks: 0.3; rims included
#if WITH_HDF5
    static float seen[3 * 20000];
    const int shown = follower->nodes.head.count;
    memcpy(seen, follower->nodes.position, 3 * sizeof(float) * (size_t)shown);
#endif
    server_stop(client, &pliantd);
    follower_destroy(follower);
    client_destroy(client);
#if WITH_HDF5
    BodyView view;
    view_read(&view, path, "ball");
    assert_memory_equal(view.position[view.first[view.frames - 1]], seen,
                        3 * sizeof(float) * (size_t)shown);
    view_free(&view);
#endif
}
