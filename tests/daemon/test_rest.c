// SPDX-License-Identifier: MIT
// Rest positions and texture coordinates from the real daemon: with each whole mesh, of its slots,
// also of a body that was refined and cut.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"

#include "pliant_mesh_t.h"
#include "pliant_rest_t.h"

enum { SLOTS = 41000 };

// What a viewer would put together.
typedef struct Viewer {
    int32_t sequence, topology, node_count; // of the mesh under way
    int mesh_parts, mesh_whole;             // chunks, meshes
    int id[SLOTS], origin[SLOTS], parent[SLOTS][2], level[SLOTS];
    int rest_parts, rest_whole, rest_next;
    int32_t rest_topology; // of the last whole one
    float rest[3 * SLOTS], texture[2 * SLOTS];
    int textured;     // chunks with texture coordinates
    bool only_counts; // of a body so large that a busy machine loses some of it
    int32_t rest_sequence;
} Viewer;

RAW_HANDLER(on_mesh)
{
    Viewer *viewer = user;
    pliant_mesh_t mesh;
    assert_true(pliant_mesh_t_decode(buffer->data, 0, (int)buffer->data_size, &mesh) >= 0);
    if (mesh.chunk == 0 || (viewer->only_counts && mesh.sequence != viewer->sequence))
        viewer->mesh_parts = viewer->rest_parts = viewer->rest_next = 0;
    viewer->sequence = mesh.sequence;
    viewer->topology = mesh.topology;
    viewer->node_count = mesh.node_count;
    assert_true(mesh.first_node + mesh.num_nodes <= SLOTS);
    for (int k = 0; k < mesh.num_nodes; k++) {
        int slot = mesh.first_node + k;
        viewer->id[slot] = mesh.id[k];
        viewer->origin[slot] = mesh.origin[k];
        memcpy(viewer->parent[slot], mesh.parent + 2 * k, sizeof viewer->parent[slot]);
        viewer->level[slot] = mesh.level[k];
    }
    viewer->mesh_whole += ++viewer->mesh_parts == mesh.chunk_count;
    pliant_mesh_t_decode_cleanup(&mesh);
}

// Behind the mesh whose sequence it shares; slots in order, each once.
RAW_HANDLER(on_rest)
{
    Viewer *viewer = user;
    pliant_rest_t rest;
    assert_true(buffer->data_size <= 65499);
    assert_true(pliant_rest_t_decode(buffer->data, 0, (int)buffer->data_size, &rest) >= 0);
    if (viewer->only_counts) {
        viewer->rest_parts = rest.sequence == viewer->rest_sequence ? viewer->rest_parts + 1 : 1;
        viewer->rest_sequence = rest.sequence;
        viewer->rest_whole += viewer->rest_parts == rest.chunk_count;
        pliant_rest_t_decode_cleanup(&rest);
        return;
    }
    if (viewer->sequence == rest.sequence) { // else we came in its middle
        assert_int_equal(rest.topology, viewer->topology);
        assert_int_equal(rest.node_count, viewer->node_count);
        assert_int_equal(rest.first, viewer->rest_next);
        assert_int_equal(rest.chunk, viewer->rest_parts);
        assert_true(rest.num_coordinates == 0 || 3 * rest.num_coordinates == 2 * rest.num_values);
        viewer->rest_next += rest.num_values / 3;
        assert_true(viewer->rest_next <= SLOTS);
        memcpy(viewer->rest + 3 * rest.first, rest.position, (size_t)rest.num_values * 4);
        memcpy(viewer->texture + 2 * rest.first, rest.texture, (size_t)rest.num_coordinates * 4);
        viewer->textured += rest.num_coordinates > 0;
        if (++viewer->rest_parts == rest.chunk_count) {
            assert_int_equal(viewer->rest_next, rest.node_count);
            viewer->rest_whole++;
            viewer->rest_topology = rest.topology;
        }
    }
    pliant_rest_t_decode_cleanup(&rest);
}

static Viewer *viewer_create(Client *client, const char *body)
{
    Viewer *viewer = zeroed(1, sizeof *viewer);
    char channel[64];
    snprintf(channel, sizeof channel, "PLIANT_MESH_%s", body);
    lcm_subscription_set_queue_capacity(lcm_subscribe(client->lcm, channel, on_mesh, viewer), 4096);
    snprintf(channel, sizeof channel, "PLIANT_REST_%s", body);
    lcm_subscription_set_queue_capacity(lcm_subscribe(client->lcm, channel, on_rest, viewer), 4096);
    return viewer;
}

static int slot_of(const Viewer *viewer, int id)
{
    for (int i = 0; i < viewer->node_count; i++)
        if (viewer->id[i] == id)
            return i;
    return -1;
}

static double distance(const float *a, const float *b)
{
    double d[3] = {(double)(a[0] - b[0]), (double)(a[1] - b[1]), (double)(a[2] - b[2])};
    return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

// A ball of 5 cm in which a load refines and blades cut, in lockstep; meshes only on request.
static const char *write_ball(const char *publish)
{
    char head[256];
    snprintf(head, sizeof head, "start = \"paused\"; publish = { mesh_hz = 0.0; %s };", publish);
    return write_body_scene(
        "ball.cfg",
        &(SceneParts){.head = head,
                      .source = ICO_SPHERE(642, 0.05),
                      .material = "",
                      .body = "levels = 2; cuttable = true; shape = {};\n"
                              "adapt = { force = 0.005; }; prestress = 0.05;\n" LOWER_FIXED});
}

static void ask_for_meshes(Client *client, const Viewer *viewer)
{
    int wholes = viewer->rest_whole;
    assert_true(command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "")->ok);
    wait_until(client, viewer->rest_whole > wholes);
}

static void expect_on_the_ball(const Viewer *viewer, bool was_cut)
{
    int midpoints = 0, copies = 0;
    for (int i = 0; i < viewer->node_count; i++) {
        const float *x = viewer->rest + 3 * i;
        if (viewer->id[i] < 0)
            continue;
        const float zero[3] = {0.0F, 0.0F, 0.0F};
        double r = distance(x, zero);
        int origin = slot_of(viewer, viewer->origin[i]);
        if (viewer->origin[i] != viewer->id[i]) {
            copies++;
            // Both lips of a cut rest on the blade's sheet, across x: each within 0.2 of the finest
            // edges, 2 mm, of it (server/surface/cut/README.md, "Lips").
            if (origin >= 0)
                expect_near((double)x[0], (double)viewer->rest[3 * (size_t)origin],
                            2.0 * 0.2 * 0.002);
        } else if (viewer->level[i] > 0) {
            midpoints++;
        }
        // Corners lie on the ball, midpoints a little below or, by the butterfly, above its
        // surface: edges are 8 mm and less, so their middles lie at most 0.16 mm inside.
        assert_true(r < 0.0502 && r > 0.0498);
        if (viewer->level[i] == 0 && !was_cut) // a blade draws nodes onto its way
            expect_near(r, 0.05, 1e-7);        // single precision
    }
    assert_true(midpoints > 20);
    assert_int_equal(copies > 5, was_cut);
}

TEST(each_whole_mesh_comes_with_its_rest)
{
    SCOPED_CLIENT Client *client = client_create();
    FREED Viewer *viewer = viewer_create(client, "sphere");
    daemon_start(&pliantd, "%s", write_ball("rest = true;"));
    client_wait_for_daemon(client);
    step_daemon(client, 1); // nodes that have hardly moved
    ask_for_meshes(client, viewer);
    assert_int_equal(viewer->node_count, 642);
    assert_true(viewer->textured > 0);
    const double top[3] = {0.0, 0.0, 0.05}, force[3] = {0.05, 0.0, -0.4};
    send_load(client, top, 0.02, force, 10.0, "sphere");
    step_daemon(client, 100);
    ask_for_meshes(client, viewer);
    expect_on_the_ball(viewer, false);
    pliant_cut_t cut = {.sender = client->sender,
                        .id = ++client->next_id,
                        .before = {{0.011, -0.1, 0.0}, {0.011, -0.1, 0.1}},
                        .after = {{0.011, 0.1, 0.0}, {0.011, 0.1, 0.1}},
                        .body = (char[]){"sphere"}};
    pliant_cut_t_publish(client->lcm, "PLIANT_CUT", &cut);
    step_daemon(client, 20);
    ask_for_meshes(client, viewer);
    assert_int_equal(viewer->rest_topology, client->frames.topology);
    assert_int_equal(viewer->node_count, client->frames.node_count);
    expect_on_the_ball(viewer, true);
    for (int i = 0; i < viewer->node_count; i++) // the generator's lies in [0, 1]
        assert_true(viewer->texture[2 * i] >= 0.0F && viewer->texture[2 * i] <= 1.0F &&
                    viewer->texture[2 * i + 1] >= 0.0F && viewer->texture[2 * i + 1] <= 1.0F);
    process_end(&pliantd);
}

TEST(unasked_nobody_sends_rest_positions)
{
    SCOPED_CLIENT Client *client = client_create();
    FREED Viewer *viewer = viewer_create(client, "sphere");
    server_start_for(client, &pliantd, "%s", write_ball(""));
    for (int n = 0; n < 3; n++) {
        int wholes = viewer->mesh_whole;
        assert_true(command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "")->ok);
        wait_until(client, viewer->mesh_whole > wholes);
    }
    step_daemon(client, 1); // after all chunks
    assert_int_equal(viewer->rest_whole + viewer->rest_parts, 0);
    process_finish(&pliantd, SIGTERM);
}

// 41 chunks of its mesh and 21 of its rest positions take 0.6 s at 10 ms each.
TEST(whole_meshes_leave_however_often_they_are_asked_for)
{
    const char *scene = scratch("large.cfg");
    write_text(scene,
               "start = \"paused\"; publish = { mesh_hz = 1.0; rest = true; };\n"
               "bodies = ( { name = \"wall\";\n"
               "  mesh = { generator = \"ico_sphere\"; nodes = 40962; radius = 0.05; }; } );\n");
    SCOPED_CLIENT Client *client = client_create();
    FREED Viewer *viewer = viewer_create(client, "wall");
    viewer->only_counts = true;
    server_start_for(client, &pliantd, "%s", scene);
    // From now on three times a second, as by clients that each want it whole.
    const int meshes = viewer->mesh_whole, rests = viewer->rest_whole;
    const double limit = client_now() + 30.0;
    for (double due = 0.0; client_now() < limit &&
                           (viewer->mesh_whole < meshes + 2 || viewer->rest_whole < rests + 2);) {
        if (client_now() > due) {
            send_command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "");
            due = client_now() + 0.3;
        }
        client_listen(client, 10);
    }
    expect_at_least((double)(viewer->mesh_whole - meshes), 2.0);
    expect_at_least((double)(viewer->rest_whole - rests), 2.0);
    process_end(&pliantd);
}
