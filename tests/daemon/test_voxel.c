// SPDX-License-Identifier: MIT
// Voxel bodies in the real daemon: what clients see and feel of them, and that runs repeat.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"

#include "pliant_status_t.h"

#if WITH_HDF5
#include "recording_view.h"
#endif

// A block of 8 x 8 x 8 cells around the origin, 5 cm wide, fixed below.
enum {
    SURFACE_NODES = 9 * 9 * 9 - 7 * 7 * 7,
    ALL_NODES = 9 * 9 * 9,
    TRIANGLES = 6 * 8 * 8 * 2,
};
static const double TOP[3] = {0.0, 0.0, 0.025}, DOWN[3] = {0.0, 0.01, -0.1};
static const double PRESS[3] = {0.001, 0.002, 0.027}, AWAY[3] = {0.0, 0.0, 0.2};
static const char HEAD[] = "publish = { nodes_hz = 50.0; contact_hz = 1000.0; status_hz = 20.0; };";
static const char PAUSED[] = "start = \"paused\";  publish = { nodes_hz = 1000.0; };";
static const char BLOCK[] = "generator = \"box\"; count = 8; size = 0.00625;";

// `voxels`: what the body is made from; `keys`: more of the body.
static const char *write_voxels(const char *file, const char *head, const char *voxels,
                                const char *keys)
{
    char source[512];
    snprintf(source, sizeof source, "model = \"voxel\"; voxels = { %s };", voxels);
    return write_body_scene(file,
                            &(SceneParts){.head = head,
                                          .name = "block",
                                          .source = source,
                                          .material = "youngs_modulus = 1.0e4; density = 1000.0;",
                                          .body = keys,
                                          .tail = PROBE_TOOL});
}

static const char FIXED[] = "levels = 0;\n"
                            "  fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.0249]); } );";

static const char *write_block(const char *name, const char *head)
{
    return write_voxels(name, head, BLOCK, FIXED);
}

typedef struct BodySeen {
    int count, nodes, springs, elements, pieces;
    char model[32], integrator[32];
} BodySeen;

HANDLER(see_status, pliant_status_t, status)
{
    BodySeen *seen = user;
    if (status->num_bodies != 1)
        return;
    const pliant_body_status_t *body = &status->body[0];
    seen->nodes = body->nodes;
    seen->springs = body->springs;
    seen->elements = body->elements;
    seen->pieces = body->pieces;
    snprintf(seen->model, sizeof seen->model, "%s", body->model);
    snprintf(seen->integrator, sizeof seen->integrator, "%s", body->integrator);
    seen->count++;
}

TEST(a_pressed_block_pushes_back_and_is_shown)
{
    SCOPED_CLIENT Client *client = client_create();
    BodySeen seen = {0};
    pliant_status_t_subscription_t *subscription =
        pliant_status_t_subscribe(client->lcm, "PLIANT_STATUS", see_status, &seen);
    server_start_for(client, &pliantd, "%s", write_block("press.cfg", HEAD));
    hold_pose_until(client, AWAY, client->contact.pose_utime != 0);
    assert_false(client->contact.contact);
    hold_pose_until(client, PRESS, client->contact.depth > 1e-4 && client->contact.contact);
    expect_at_least(client->contact.force[2], 1e-3);
    expect_at_most(client->contact.force[2], 5.0); // max_force
    expect_at_least(client->contact.normal[2], 0.5);
    wait_until(client, client->frames.whole > 0 && client->mesh.whole > 0 && seen.count > 0);
    assert_int_equal(client->frames.node_count, SURFACE_NODES);
    assert_int_equal(client->mesh.whole_nodes, SURFACE_NODES);
    assert_int_equal(client->mesh.whole_triangles, TRIANGLES);
    assert_true(client->mesh.in_range);
    assert_string_equal(seen.model, "voxel");
    assert_string_equal(seen.integrator, "symplectic_euler");
    assert_int_equal(seen.elements, 8 * 8 * 8);
    assert_int_equal(seen.springs, 0);
    assert_int_equal(seen.pieces, 1);
    assert_int_equal(client->status.resets, 0);
    pliant_status_t_unsubscribe(client->lcm, subscription);
    process_end(&pliantd);
}

TEST(requests_reach_a_solid)
{
    SCOPED_CLIENT Client *client = server_start(&pliantd, "%s", write_block("requests.cfg", HEAD));
    const Reply *reply = apply_load(client, TOP, 0.01, DOWN, 0.5, "block");
    assert_true(reply->ok);
    assert_int_equal(reply->pieces, 1);
    wait_until(client, client->status.max_displacement > 1e-4);
    assert_false(apply_load(client, AWAY, 0.01, DOWN, 0.5, "block")->ok); // no node is there

    assert_true(command(client, PLIANT_COMMAND_T_PAUSE, 0, "")->ok);
    assert_true(command(client, PLIANT_COMMAND_T_SET, 0, "block.damping_scale=0.5")->ok);
    assert_true(command(client, PLIANT_COMMAND_T_SET, 0, "gravity=0 0 -9.81")->ok);
    assert_false(command(client, PLIANT_COMMAND_T_SET, 0, "stiffness_scale=1e9")->ok);
    assert_false(command(client, PLIANT_COMMAND_T_SET, 0, "adapt_force=0.1")->ok);
    int64_t step = command(client, PLIANT_COMMAND_T_STEP, 0, "")->step;
    assert_int_equal(command(client, PLIANT_COMMAND_T_STEP, 40, "")->step, step + 40);
    client_fresh_status(client);
    assert_string_equal(client->status.state, "lockstep");
    expect_at_least(client->status.max_displacement, 1e-5);
    assert_true(command(client, PLIANT_COMMAND_T_RESET, 0, "")->ok);
    command(client, PLIANT_COMMAND_T_STEP, 1, "");
    client_fresh_status(client);
    // A tick from the start, with gravity or without: 1e-5 m; the load had moved it by millimetres.
    expect_at_most(client->status.max_displacement, 2e-5);

    // Garbage on its channels changes nothing.
    static const char junk[200] = "junk";
    int64_t before = client->status.rejected;
    send_bytes(client, "PLIANT_LOAD", junk, sizeof junk);
    send_bytes(client, "PLIANT_TOOL_POSE", junk, 3);
    wait_until(client, client->status.rejected >= before + 2);
    send_pose_at(client, (const double[]){(double)NAN, 0.0, 0.0});
    wait_until(client, client->status.rejected >= before + 3);
    step_daemon(client, 5);
    client_fresh_status(client);
    assert_int_equal(client->status.resets, 0);
    process_end(&pliantd);
}

// Killed, it starts again from its last checkpoint, and tools meet it there.
TEST(a_killed_server_goes_on_from_its_checkpoint)
{
    const char *scene = write_block("killed.cfg", HEAD), *path = scratch("killed.h5");
    SCOPED_CLIENT Client *client = server_start(&pliantd, "--checkpoint %s %s", path, scene);
    hold_pose_until(client, PRESS, client->contact.contact);
    const Reply *reply = command(client, PLIANT_COMMAND_T_CHECKPOINT, 0, "");
    assert_true(reply->ok);
    int64_t step = reply->step;
    process_finish(&pliantd, SIGKILL);
    daemon_start(&pliantd, "--resume %s %s", path, scene);
    client->contact.contact = 0;
    hold_pose_until(client, PRESS, client->contact.contact);
    client_fresh_status(client);
    expect_at_least((double)client->status.step, (double)step);
    process_end(&pliantd);
}

// A cube of 12 triangles inside of the block, in millimetres.
static void write_skin(const char *path)
{
    write_text(path, "v -20 -20 -20\nv 20 -20 -20\nv 20 20 -20\nv -20 20 -20\n"
                     "v -20 -20 20\nv 20 -20 20\nv 20 20 20\nv -20 20 20\n"
                     "f 1 3 2\nf 1 4 3\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\n"
                     "f 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n");
}

TEST(what_is_published_is_recorded)
{
    static const char SKIN[] = "skin = { mesh = \"skin.obj\"; scale = 0.001; };\n  ";
    char keys[512];
    snprintf(keys, sizeof keys, "%s%s", SKIN, FIXED);
    write_skin(scratch("skin.obj"));
    static const char ALL[] =
        "start = \"paused\";  publish = { nodes_hz = 1000.0; nodes = \"all\"; };";
    const struct {
        const char *head, *keys;
        int nodes, triangles;
    } cases[] = {
        {PAUSED, FIXED, SURFACE_NODES, TRIANGLES},
        {ALL, FIXED, ALL_NODES, TRIANGLES},
        {PAUSED, keys, 8, 12},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        enum { STEPS = 10 };
        static float seen[3 * ALL_NODES];
        char name[32];
        snprintf(name, sizeof name, "record-%zu.h5", k);
        const char *path = scratch(name);
        Client *client = client_create();
        const char *scene = write_voxels("record.cfg", cases[k].head, BLOCK, cases[k].keys);
#if WITH_HDF5
        daemon_start(&pliantd, "--record %s %s", path, scene);
#else
        (void)path;
        daemon_start(&pliantd, "%s", scene);
#endif
        client_wait_for_daemon(client);
        send_load(client, TOP, 0.01, DOWN, 1.0, "");
        for (int i = 0; i < STEPS; i++) {
            const Reply *reply = step_daemon(client, 2);
            wait_until(client, client->frames.step == reply->step);
        }
        wait_until(client, client->mesh.whole > 0);
        assert_int_equal(client->frames.node_count, cases[k].nodes);
        assert_int_equal(client->mesh.whole_nodes, cases[k].nodes);
        assert_int_equal(client->mesh.whole_triangles, cases[k].triangles);
        memcpy(seen, client->frames.position, 3 * sizeof(float) * (size_t)cases[k].nodes);
        server_stop(client, &pliantd);
        client_destroy(client);
#if WITH_HDF5
        BodyView view;
        view_read(&view, path, "block");
        assert_int_equal(view.frames, STEPS + 1);
        assert_int_equal(view.nodes, cases[k].nodes);
        assert_int_equal(view.triangles, cases[k].triangles);
        assert_memory_equal(view.position[view.first[STEPS]], seen,
                            3 * sizeof(float) * (size_t)cases[k].nodes);
        assert_true(memcmp(view.position[view.first[0]], seen, sizeof(float)) != 0 ||
                    memcmp(view.position[view.first[0]], view.position[view.first[STEPS]],
                           3 * sizeof(float) * (size_t)cases[k].nodes) != 0);
        view_free(&view);
#endif
    }
}

TEST(wrong_scenes_are_refused_in_one_line)
{
    static const struct {
        const char *voxels, *keys, *needle;
    } cases[] = {
        {"generator = \"pyramid\";", "", "pyramid"},
        {"generator = \"box\"; count = 0; size = 0.01;", "", "count"},
        {"generator = \"box\"; count = 8; size = -0.01;", "", "size"},
        {"file = \"missing.nrrd\"; label = 1;", "", "missing.nrrd"},
        {"mesh = \"missing.stl\"; size = 0.01;", "", "missing.stl"},
        {"generator = \"box\"; count = 8; size = 0.01;", "levels = 99;", "levels"},
        {"generator = \"box\"; count = 8; size = 0.01;", "law = \"none\";", "law"},
        {"generator = \"box\"; count = 8; size = 0.01;", "integrator = \"rk4\";", "rk4"},
        {"generator = \"box\"; count = 8; size = 0.01;", "mesh = { generator = \"sheet\"; };",
         "mesh"},
        {"generator = \"box\"; count = 8; size = 0.01;", "skin = { mesh = \"missing.obj\"; };",
         "missing.obj"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        run_daemon(&pliantd, "--check %s",
                   write_voxels("wrong.cfg", HEAD, cases[k].voxels, cases[k].keys));
        const char *line_end = strchr(pliantd.err, '\n');
        if (pliantd.code != 2 || strstr(pliantd.err, cases[k].needle) == NULL ||
            strstr(pliantd.err, "wrong.cfg:") == NULL || line_end == NULL || line_end[1] != '\0')
            fail_msg("%s %s: exit %d, expected 2 and one line with '%s': %s", cases[k].voxels,
                     cases[k].keys, pliantd.code, cases[k].needle, pliantd.err);
    }
}
