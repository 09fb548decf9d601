// SPDX-License-Identifier: MIT
// A real daemon with a body that refines and coarsens while it is pressed: what it publishes and
// records is followed by a client that was there from the start, one that came late, and one in
// lockstep.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"
#include "follower.h"
#if WITH_HDF5
#include "recording_view.h"
#endif

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

TEST(a_client_follows_a_body_that_refines_and_coarsens)
{
    const char *scene = write_levels("live.cfg", "");
    SCOPED_CLIENT Client *client = client_create();
    Follower *first = follower_create(client->lcm);
    server_start_for(client, &pliantd, "%s", scene);
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
    assert_int_equal(first->missed + first->early, 0);
    assert_int_equal(first->mesh.refused, 0);
    assert_in_range(first->deepest, 1, 2);
    client_fresh_status(client);
    process_end(&pliantd);
    follower_destroy(late);
    follower_destroy(first);
}

TEST(a_step_shows_its_mesh_before_it_is_answered)
{
    const char *scene = write_levels("lockstep.cfg", "start = \"paused\";");
    SCOPED_CLIENT Client *client = client_create();
    Follower *follower = follower_create(client->lcm);
    server_start_for(client, &pliantd, "%s", scene);
    wait_until(client, follower->wholes > 0);
    press(client, 0.3, 10.0);
    int shown = 0;
    for (int n = 0; n < 60; n++) {
        const Reply *reply = step_daemon(client, 10);
        shown += follower->nodes.step == reply->step && follower->nodes.head.whole &&
                 follower->mesh.topology == follower->nodes.head.topology;
    }
    assert_in_range(shown, 50, 60); // a busy machine may lose some on their way
    assert_true(follower->deltas > 5);
    assert_int_equal(follower->missed + follower->early, 0);
    process_finish(&pliantd, SIGTERM);
    follower_destroy(follower);
}

#if WITH_HDF5
TEST(a_recording_has_the_meshes_of_its_frames)
{
    const char *scene = write_levels("record.cfg", "");
    const char *path = scratch("levels.h5");
    SCOPED_CLIENT Client *client = server_start(&pliantd, "--record %s %s", path, scene);
    press(client, 0.3, 0.5);
    int64_t begun = client->status.step;
    wait_until(client, client->status.step >= begun + 1200); // however slowly it ticks
    process_end(&pliantd);
    SCOPED(view_close) hid_t file = view_open(path, false);
    assert_true(file >= 0);
    SCOPED(view_free) BodyView view;
    view_body(&view, file, "sphere"); // every index points at something
    assert_true(view.frames > 30);
    assert_true(view.topologies > 5);
    for (int t = 0; t < view.topologies; t++) {
        // A closed surface without handles (Euler): twice the nodes but two pairs of triangles.
        assert_int_equal(view.triangle_count[t], 2 * view.node_count[t] - 4);
        assert_true(t == 0 || view.number[t] > view.number[t - 1]);
    }
    int count;
    FREED SidecarFrame *frame = view_sidecar_of(path, &count);
    assert_int_equal(count, view.frames);
    expect_sidecar_matches(frame, count, &view, "sphere");
}
#endif
