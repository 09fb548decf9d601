// SPDX-License-Identifier: MIT
// pliant-record and what may happen to it: a daemon that comes late or is started again, kill -9, a
// full disk, hostile messages.
#include "test.h"
#include "recorder.h"
#include "scene_writer.h"
#include "mesh_message.h"

#include "pliant_event_t.h"
#include "pliant_nodes_t.h"

#include <errno.h>

static const char PAUSED[] =
    "start = \"paused\"; publish = { nodes_hz = 60.0; contact_hz = 100.0; status_hz = 20.0; };";
static const char LIVE[] =
    "publish = { nodes_hz = 60.0; mesh_hz = 5.0; contact_hz = 100.0; status_hz = 20.0; };";

TEST(it_comes_first_or_late_and_goes_on_with_a_daemon_that_is_started_anew)
{
    const char *path = scratch("run.h5"), *second = scratch("run.2.h5");
    const char *scene = write_scene("run.cfg", LIVE, PROBE_TOOL);
    Process daemon, program;
    record_start(&program, path, "--hz 20"); // before there is a daemon
    SCOPED_CLIENT Client *client = server_start(&daemon, "%s", scene);
    wait_until(client, flushed_frames(path) >= 10);
    process_finish(&daemon, SIGKILL);
    daemon_start(&daemon, "%s", scene);
    wait_until(client, flushed_frames(second) >= 10);
    end(&program, SIGTERM, 0);
    server_stop(client, &daemon);
    expect_in(program.err, "the daemon restarted");
    expect_in(program.err, "run.2.h5");
    for (int k = 0; k < 2; k++) {
        const char *file = k == 0 ? path : second;
        SCOPED(view_free) BodyView view;
        view_read(&view, file, "sphere");
        expect_at_least(view.frames, 10);
        // Of every twentieth of a second one at most.
        for (int i = 1; i < view.frames; i++)
            assert_true(view.step[i] / 50 > view.step[i - 1] / 50);
        assert_true(info_of(file)->ended);
    }
}

TEST(what_was_flushed_survives_kill_9)
{
    const char *path = scratch("killed.h5");
    Process daemon, program;
    SCOPED_CLIENT Client *client = server_start(&daemon, "%s", write_scene("killed.cfg", LIVE, ""));
    record_start(&program, path, "");
    wait_until(client, flushed_frames(path) >= 60);
    client_listen(client, rand() % 300);
    int flushed = flushed_frames(path);
    end(&program, SIGKILL, 1000 + SIGKILL);

    const RecordingInfo *info = info_of(path);
    assert_false(info->ended);
    expect_at_least((double)info->body[0].frames, flushed);
    char clear[1200];
    snprintf(clear, sizeof clear, "h5clear -s %s", path);
    if (system("command -v h5clear >/dev/null") == 0) {
        assert_int_equal(system(clear), 0);
        SCOPED(view_free) BodyView view;
        view_read(&view, path, "sphere");
        expect_at_least(view.frames, flushed);
    } else {
        print_message("no h5clear: plain readers are not tried\n");
    }
    server_stop(client, &daemon);
}

TEST(a_full_disk_ends_it_with_a_whole_file)
{
    const char *path = scratch("full.h5");
    SCOPED_CLIENT Client *client = client_create();
    Process daemon, program;
    daemon_start(&daemon, "%s",
                 write_scene("full.cfg", "publish = { nodes_hz = 500.0; status_hz = 20.0; };", ""));
    client_wait_for_daemon(client);
    const rlim_t before = limit_files(700000); // most of it for what HDF5 may add
    record_start(&program, path, "");
    limit_files(before);
    process_wait_for(&program, 1);
    expect_in(program.err, strerror(EFBIG));
    const RecordingInfo *info = info_of(path);
    assert_true(info->ended);
    expect_at_least((double)info->body[0].frames, 1.0);
    assert_int_equal(info->body[0].broken, 0);
    SCOPED(view_free) BodyView view;
    view_read(&view, path, "sphere");
    assert_int_equal(view.frames, info->body[0].frames);
    server_stop(client, &daemon);
}

// --- Hostile messages ---

static void send_nodes(Client *client, pliant_nodes_t *nodes)
{
    assert_int_equal(pliant_nodes_t_publish(client->lcm, "PLIANT_NODES_sphere", nodes), 0);
}

TEST(hostile_messages_are_refused_and_counted)
{
    const char *path = scratch("hostile.h5");
    Process daemon, program;
    SCOPED_CLIENT Client *client =
        server_start(&daemon, "%s", write_scene("hostile.cfg", PAUSED, PROBE_TOOL));
    record_start(&program, path, "");
    wait_until(client, has_sidecar(path));
    command(client, PLIANT_COMMAND_T_STEP, 1, "");
    wait_until(client, client->frames.step == 1);

    // A later frame, so that nothing but its content can be why it is refused, of an earlier time,
    // so that the daemon's own are not taken for belated ones.
    float position[3 * SPHERE_NODES] = {0};
    pliant_nodes_t nodes = {.utime = 1,
                            .sequence = (int32_t)((uint32_t)client->frames.sequence + 10),
                            .step = 2,
                            .time = 2e-3,
                            .topology = client->frames.topology,
                            .node_count = SPHERE_NODES,
                            .chunk_count = 2,
                            .num_values = 3 * SPHERE_NODES / 2,
                            .position = position};
    int refused = 0;
    const unsigned char bytes[64] = {1, 2, 3};
    for (size_t size = 0; size < sizeof bytes; size += 9) {
        send_bytes(client, "PLIANT_NODES_sphere", bytes, size);
        send_bytes(client, "PLIANT_MESH_sphere", bytes, size);
        send_bytes(client, "PLIANT_MESH_DELTA_sphere", bytes, size);
        refused += 3;
    }
    position[5] = NAN;
    send_nodes(client, &nodes), refused++;
    position[5] = 0.0f;
    pliant_nodes_t wrong = nodes;
    wrong.first = SPHERE_NODES; // beyond the end
    send_nodes(client, &wrong), refused++;
    wrong = nodes;
    wrong.node_count = 1 << 30;
    send_nodes(client, &wrong), refused++;
    wrong = nodes;
    wrong.num_values = 4;
    send_nodes(client, &wrong), refused++;
    wrong = nodes;
    wrong.time = (double)INFINITY;
    send_nodes(client, &wrong), refused++;
    // Half a frame that makes sense, and chunks that contradict it.
    send_nodes(client, &nodes);
    wrong = nodes;
    wrong.chunk = 1;
    wrong.first = SPHERE_NODES / 2;
    wrong.node_count = SPHERE_NODES + 1;
    send_nodes(client, &wrong), refused++;
    wrong.node_count = SPHERE_NODES;
    wrong.topology++;
    send_nodes(client, &wrong), refused++;
    // A mesh whose triangle names a free node, and one that contradicts the mesh of its number.
    int32_t id[4] = {0, 1, 2, -1}, triangle[6] = {0, 1, 2, 0, 1, 3}, none[8] = {0};
    int8_t level[4] = {0};
    pliant_mesh_t mesh =
        mesh_message(1000000, 1, nodes.topology + 1, 4, id, none, level, 2, triangle);
    assert_int_equal(pliant_mesh_t_publish(client->lcm, "PLIANT_MESH_sphere", &mesh), 0);
    refused++;
    mesh.sequence++;
    mesh.topology = nodes.topology;
    assert_int_equal(pliant_mesh_t_publish(client->lcm, "PLIANT_MESH_sphere", &mesh), 0);
    refused++;
    send_bytes(client, "PLIANT_STATUS", bytes, sizeof bytes);
    send_bytes(client, "PLIANT_EVENT", bytes, sizeof bytes);
    send_bytes(client, "PLIANT_CONTACT", bytes, sizeof bytes);
    send_bytes(client, "PLIANT_REPLY", bytes, sizeof bytes);

    // Through an event that was sent after all of it we know that all of it was taken.
    char text[] = "last", empty[] = "";
    const pliant_event_t last = {.step = 1, .body = empty, .kind = text, .text = text};
    assert_int_equal(pliant_event_t_publish(client->lcm, "PLIANT_EVENT", &last), 0);
    // The daemon's own frames are still taken: the half one is given up for a newer one.
    for (int i = 0; i < 3; i++)
        command(client, PLIANT_COMMAND_T_STEP, 1, "");
    wait_until(client, flushed_frames(path) >= 3);
    server_stop(client, &daemon);
    end(&program, SIGTERM, 0);
    const RecordingInfo *info = info_of(path);
    assert_int_equal(info->body[0].counts.refused, refused);
    assert_int_equal(info->body[0].counts.dropped, 0);
    assert_int_equal(info->events, 2); // "lockstep" and ours
    SCOPED(view_free) BodyView view;
    view_read(&view, path, "sphere");
    for (int i = 0; i < view.rows; i++)
        for (int k = 0; k < 3; k++)
            assert_true(isfinite(view.position[i][k]));
    assert_int_equal(view.topologies, 1);
}
