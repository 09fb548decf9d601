// SPDX-License-Identifier: MIT
// The loop's accounting and what it publishes unrequested. No test demands that a tick is
// in time: they look at what the daemon reports about itself and at the steps in its messages.
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"

#include "pliant_status_t.h"

#include <math.h>

TEST(ticks_and_late_ticks_add_up_to_the_duration)
{
    run_daemon(&pliantd, "--duration 1 %s", write_scene("duration.cfg", "rate_hz = 1000.0;", ""));
    assert_int_equal(pliantd.code, 0);
    // A tick that is late at the very end can pass it by a few.
    expect_at_least((double)(printed(&pliantd, "ticks") + printed(&pliantd, "late ticks")), 1000);
    assert_int_equal(printed(&pliantd, "step"), printed(&pliantd, "ticks"));
}

TEST(late_ticks_are_skipped_not_replayed)
{
    // A stopped process wakes with hundreds of deadlines behind it.
    const char *scene =
        write_scene("late.cfg", "publish = { status_hz = 20.0; nodes_hz = 0.0; };", "");
    SCOPED_CLIENT Client *client = server_start(&pliantd, "--duration 3 %s", scene);
    process_signal(&pliantd, SIGSTOP);
    double stopped = client_now();
    while (client_now() < stopped + 0.5)
        client_listen(client, 20);
    process_signal(&pliantd, SIGCONT);
    process_wait_for(&pliantd, 0);
    long long ticks = printed(&pliantd, "ticks"), late = printed(&pliantd, "late ticks");
    expect_at_least((double)late, 450); // nearly all deadlines of the half second
    expect_at_most((double)ticks, 2550);
    expect_at_least((double)(ticks + late), 3000);
}

// 10 242 nodes in 400 substeps take several milliseconds on any machine.
TEST(a_scene_slower_than_real_time_is_warned_of_once)
{
    const char *path = scratch("slow.cfg"), *says = "slower than real time for 2 s: ";
    write_text(path, "name = \"slow\"; publish = { nodes_hz = 0.0; };\n"
                     "bodies = ( { name = \"ball\"; time_step = 2.5e-6; shape = {};\n"
                     "  mesh = { generator = \"ico_sphere\"; subdivisions = 4; }; } );\n");
    run_daemon_well(&pliantd, "--duration 5 %s", path);
    const char *warning = strstr(pliantd.err, says);
    assert_non_null(warning);
    expect_in(warning, " of 1000 ticks a second");
    assert_null(strstr(warning + 1, says));
}

HANDLER(on_factor, pliant_status_t, m)
{
    double *factor = user;
    assert_true(isfinite(m->real_time_factor));
    *factor = m->real_time_factor;
}

// Its first status with figures would come after a second of its own time: each repeat before has
// the pace of the ticks so far.
TEST(statuses_of_slow_ticks_have_their_pace)
{
    const char *path = scratch("factor.cfg");
    write_text(path, "name = \"factor\"; publish = { nodes_hz = 0.0; status_hz = 1.0; };\n"
                     "bodies = ( { name = \"ball\"; time_step = 2.5e-6; shape = {};\n"
                     "  mesh = { generator = \"ico_sphere\"; subdivisions = 4; }; } );\n");
    SCOPED_CLIENT Client *client = server_start(&pliantd, "%s", path);
    double factor = 0.0;
    pliant_status_t_subscription_t *on =
        pliant_status_t_subscribe(client->lcm, "PLIANT_STATUS", on_factor, &factor);
    wait_until(client, factor > 0.0);
    expect_at_most((double)client->status.step, 999.0); // else it was that first one
    expect_at_most(factor, 0.9);                        // ticks take several periods
    pliant_status_t_unsubscribe(client->lcm, on);
    process_end(&pliantd);
}

static const char *write_throttled(long long us)
{
    char text[64];
    const char *path = scratch("cpu.stat");
    snprintf(text, sizeof text, "usage_usec 1\nthrottled_usec %lld\n", us);
    write_text(path, text);
    return path;
}

// A control group's files of our own, where its are.
TEST(the_quota_of_processors_is_named_as_the_cause_of_late_ticks)
{
    const char *path = scratch("quota.cfg"), *folder = scratch(".");
    write_text(scratch("cpu.max"), "20000 100000\n");
    write_throttled(70000);
    write_text(path, "name = \"quota\"; publish = { nodes_hz = 0.0; };\n"
                     "bodies = ( { name = \"ball\"; time_step = 2.5e-6; shape = {};\n"
                     "  mesh = { generator = \"ico_sphere\"; subdivisions = 4; }; } );\n");
    SCOPED_CLIENT Client *client = client_create();
    process_start(&pliantd, "unshare", "-m sh -c 'mount --bind %s /sys/fs/cgroup && exec %s %s'",
                  folder, program_path("pliantd"), path);
    client_wait_for_daemon(client);
    long long us = 70000;
    while (!saw_event(client, "slow")) {
        write_throttled(us += 100000);
        client_listen(client, 100);
    }
    const Event *event = client->event;
    while (strcmp(event->kind, "slow") != 0)
        event++;
    expect_in(event->text, "cpu.max 20000 100000");
    process_end(&pliantd);
    expect_in(pliantd.err, "cpu.max 20000 100000");
    expect_in(pliantd.out, "stopped by the processor quota (cpu.max 20000 100000): ");
}

// The same work in a body that adapts: judged after a quarter of a second, not after 250 ticks,
// of which each takes several periods.
TEST(a_body_that_is_too_slow_is_governed_within_a_few_of_its_ticks)
{
    const char *path = scratch("governed.cfg");
    write_text(path, "name = \"governed\"; publish = { nodes_hz = 0.0; };\n"
                     "bodies = ( { name = \"ball\"; time_step = 2.5e-6; shape = {};\n"
                     "  mesh = { generator = \"ico_sphere\"; subdivisions = 4; }; levels = 1;\n"
                     "  adapt = {}; } );\n");
    SCOPED_CLIENT Client *client = server_start(&pliantd, "%s", path);
    wait_until(client, saw_event(client, "governor"));
    const Event *first = client->event;
    while (strcmp(first->kind, "governor") != 0)
        first++;
    int ticks;
    assert_int_equal(sscanf(first->text, "p95 of %d ticks over", &ticks), 1);
    expect_at_most(ticks, 125); // two periods each would be enough
    process_end(&pliantd);
}

TEST(nodes_come_at_the_steps_when_they_are_due)
{
    SCOPED_CLIENT Client *client = client_create();
    daemon_start(&pliantd, "%s",
                 write_scene("nodes.cfg",
                             "publish = { nodes_hz = 40.0; status_hz = 10.0; velocity = true; };",
                             ""));
    wait_until(client, client->frames.whole >= 1);
    const FramesSeen *frames = &client->frames;
    const int32_t sequence = frames->sequence;
    const int64_t step = frames->step;
    wait_until(client, client->frames.whole >= 30);
    assert_true(client->frames.ordered);
    assert_int_equal(client->frames.node_count, SPHERE_NODES);
    assert_int_equal(client->frames.step % 25, 0); // 1000 Hz / 40 Hz
    // Sequences count all frames, also those that a busy machine loses on their way.
    assert_int_equal(25 * (int64_t)((uint32_t)frames->sequence - (uint32_t)sequence),
                     frames->step - step);
    wait_until(client, client->velocities.whole >= 30);
    assert_int_equal(client->velocities.node_count, SPHERE_NODES);
    process_end(&pliantd);
}

// A slow rate, so that there is time left in ticks on any machine.
TEST(the_error_of_steps_is_told_only_when_asked_and_not_in_lockstep)
{
    static const char *const HEAD[] = {
        "rate_hz = 100.0; gravity = [0.0, 0.0, -9.8]; publish = { status_hz = 20.0; };",
        "rate_hz = 100.0; gravity = [0.0, 0.0, -9.8]; publish = { status_hz = 20.0; };"
        "estimate_error = true;"};
    for (int asked = 0; asked < 2; asked++) {
        SCOPED_CLIENT Client *client =
            server_start(&pliantd, "%s", write_scene("estimate.cfg", HEAD[asked], ""));
        if (asked) {
            wait_until(client, client->status.estimated_error > 0.0);
            // Steps at the bound of stability are off, but not by more than the body has moved.
            expect_at_most(client->status.estimated_error, 1.0);
        }
        step_daemon(client, 5);
        step_daemon(client, 100);
        client_fresh_status(client);
        assert_true(client->status.estimated_error == 0.0);
        server_stop(client, &pliantd);
    }
}

TEST(frames_larger_than_a_datagram_come_in_chunks)
{
    const char *path = write_body_scene(
        "large.cfg",
        &(SceneParts){.head = "rate_hz = 100.0; publish = { nodes_hz = 10.0; mesh_hz = 2.0; };",
                      .source = ICO_SPHERE(10242, 0.1),
                      .material = "youngs_modulus_2d = 20.0; areal_density = 4.0;",
                      .body = SMALL_SHAPE});
    SCOPED_CLIENT Client *client = client_create();
    daemon_start(&pliantd, "%s", path);
    wait_until(client, client->frames.whole >= 3 && client->mesh.whole >= 2);
    assert_int_equal(client->frames.node_count, 10242);
    expect_at_least(client->frames.chunks, 3.0 * client->frames.whole); // 4096 nodes a chunk
    assert_true(client->mesh.in_range);
    assert_int_equal(client->mesh.whole_triangles, 20480);
    // The last node of the last chunk lies on the sphere: nothing moves here. Float positions.
    const float *p = client->frames.position + 3 * 10241;
    expect_near(sqrt((double)(p[0] * p[0] + p[1] * p[1] + p[2] * p[2])), 0.1, 1e-6);
    process_end(&pliantd);
}

TEST(a_late_joiner_gets_the_mesh)
{
    client_destroy(
        server_start(&pliantd, "%s", write_scene("mesh.cfg", "publish = { mesh_hz = 5.0; };", "")));
    SCOPED_CLIENT Client *late = client_create();
    wait_until(late, late->mesh.whole > 0 && late->frames.whole > 0);
    assert_true(late->mesh.in_range);
    assert_int_equal(late->mesh.whole_nodes, SPHERE_NODES);
    assert_int_equal(late->mesh.whole_triangles, SPHERE_TRIANGLES);
    assert_int_equal(late->mesh.topology, late->frames.topology);
    process_signal(&pliantd, SIGINT);
    process_wait_for(&pliantd, 0);
}

TEST(without_mesh_hz_describe_brings_the_mesh_and_the_last_nodes)
{
    SCOPED_CLIENT Client *client = client_create();
    daemon_start(&pliantd, "%s",
                 write_scene("describe.cfg",
                             "start = \"paused\";\n"
                             "publish = { mesh_hz = 0.0; status_hz = 20.0; };",
                             PROBE_TOOL));
    client_wait_for_daemon(client);
    client_destroy(client);
    client = client_create();
    client_wait_for_daemon(client);
    assert_int_equal(client->mesh.whole, 0);
    const Reply *reply = command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "");
    assert_true(reply->ok);
    expect_in(reply->text, "sphere");
    expect_in(reply->text, "nodes 42");
    expect_in(reply->text, "tool 1");
    expect_in(reply->text, "capacity");
    wait_until(client, client->mesh.whole > 0 && client->frames.whole > 0);
    process_end(&pliantd);
}

TEST(a_second_daemon_on_the_prefix_is_refused)
{
    Process first, second, third;
    const char *scene = write_scene("prefix.cfg", "publish = { status_hz = 1.0; };", "");
    SCOPED_CLIENT Client *client = server_start(&first, "%s", scene);
    run_daemon(&second, "--duration 1 %s", scene);
    expect_ended(&second, 1, "PLIANT_STATUS");
    run_daemon_well(&third, "--duration 0.2 --prefix OTHER %s", scene);
    process_end(&first);
}

TEST(a_daemon_runs_without_a_network)
{
    run_daemon_well(&pliantd, "--lcm-url memq:// --duration 0.3 %s",
                    write_scene("memq.cfg", "", ""));
    expect_at_least((double)printed(&pliantd, "ticks"), 1.0);
}
