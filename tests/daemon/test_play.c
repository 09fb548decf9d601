// SPDX-License-Identifier: MIT
// pliant-play, beside no daemon: what it publishes of a session that the real daemon recorded is
// what is in the file, at any time; which requests, files and prefixes it takes.
#include "test.h"
#include "recorder.h"
#include "scene_writer.h"

#include "pliant_mesh_t.h"

#include <math.h>
#include <signal.h>

static const char PAUSED[] = "start = \"paused\";\n"
                             "publish = { nodes_hz = 60.0; contact_hz = 100.0; };";
static const double TOP[3] = {0.0, 0.0, 0.05}, DOWN[3] = {0.0, 0.02, -0.4};

// ---------------------------------------------------------------------------------------------
// A session: pressed by a tool, pushed by a load, cut

static const char *scene(void)
{
    return write_body_scene("session.cfg",
                            &(SceneParts){.head = PAUSED,
                                          .source = ICO_SPHERE(162, 0.05),
                                          .body = "cuttable = true;" SMALL_SHAPE LOWER_FIXED,
                                          .tail = PROBE_TOOL});
}

static void cut_at(Client *client, double x)
{
    char body[] = "";
    const pliant_cut_t cut = {.sender = client->sender,
                              .id = ++client->next_id,
                              .before = {{x, -0.08, -0.08}, {x, -0.08, 0.08}},
                              .after = {{x, 0.08, -0.08}, {x, 0.08, 0.08}},
                              .body = body};
    assert_int_equal(pliant_cut_t_publish(client->lcm, "PLIANT_CUT", &cut), 0);
    command(client, PLIANT_COMMAND_T_STEP, 1, "");
    wait_until(client, find_reply(client, cut.id) != NULL);
    // A session that goes on finds it cut already.
}

static void act(Client *client)
{
    enum { ROUNDS = 24 };
    send_load(client, TOP, 0.03, DOWN, 1.0, "");
    for (int i = 0; i < ROUNDS; i++) {
        const double position[3] = {0.0, 0.0, 0.055 - 1e-3 * i};
        pliant_tool_pose_t pose = make_pose(client, position);
        send_pose(client, &pose);
        if (i == 8 || i == 16)
            cut_at(client, 1e-3 * i - 0.02);
        command(client, PLIANT_COMMAND_T_STEP, 10, "");
    }
}

// Runs the daemon with these options and records what `act` does.
static void record_session(const char *format, const char *path, const char *more)
{
    Client *client = client_create();
    Process daemon;
    daemon_start(&daemon, format, path, more, scene());
    client_wait_for_daemon(client);
    act(client);
    stop(client, &daemon);
    client_destroy(client);
}

// A path for longer than 31 calls of scratch.
static const char *keep(char path[PATH_TEXT], const char *name)
{
    snprintf(path, PATH_TEXT, "%s", scratch(name));
    return path;
}

static const char *session(void)
{
    static char path[PATH_TEXT];
    if (path[0] == '\0') {
        keep(path, "session.h5");
        record_session("--record %s %s %s", path, "");
    }
    return path;
}

static Client *start(Process *program, const char *arguments)
{
    Client *client = client_create();
    process_start(program, program_path("pliant-play"), "%s", arguments);
    client_wait_for_daemon(client);
    return client;
}

static Client *start_paused(Process *program, const char *path)
{
    char line[1200];
    snprintf(line, sizeof line, "--paused %s", path);
    return start(program, line);
}

// The frame that came last, whole, is this one of the file, bit for bit.
static void expect_frame(const Client *client, const BodyView *view, int frame)
{
    assert_int_equal(client->frames.step, view->step[frame]);
    assert_int_equal(client->frames.node_count, view->count[frame]);
    assert_memory_equal(client->frames.position, view->position[view->first[frame]],
                        (size_t)view->count[frame] * sizeof *view->position);
}

static const Reply *set(Client *client, const char *format, double value)
{
    char text[100];
    snprintf(text, sizeof text, format, value);
    const Reply *reply = command(client, PLIANT_COMMAND_T_SET, 0, text);
    if (!reply->ok)
        fail_msg("%s: %s", text, reply->text);
    return reply;
}

// ---------------------------------------------------------------------------------------------

AROUND_EACH(NULL, harness_teardown)

TEST(every_frame_comes_with_the_recorded_bits_and_its_mesh)
{
    BodyView view;
    Process program;
    read_body(session(), "sphere", &view);
    expect_at_least(view.frames, 12);
    expect_at_least(view.topologies, 3); // two cuts
    Client *client = start_paused(&program, session());
    wait_until(client, client->frames.whole > 0);
    for (int f = 0; f < view.frames; f++) {
        if (f > 0)
            assert_true(command(client, PLIANT_COMMAND_T_STEP, 1, "")->ok);
        wait_until(client, client->frames.step == view.step[f]);
        expect_frame(client, &view, f);
        // The mesh of a topology comes before the frame.
        wait_until(client, client->mesh.topology == view.topology[f]);
        assert_int_equal(client->mesh.whole_nodes, view.count[f]);
        assert_true(client->mesh.in_range);
    }
    // And back again.
    for (int f = view.frames - 2; f >= 0; f--) {
        set(client, "step=%g", -1.0);
        wait_until(client, client->frames.step == view.step[f]);
        expect_frame(client, &view, f);
    }
    stop(client, &program);
    client_destroy(client);
    view_free(&view);
}

TEST(a_seek_shows_the_last_frame_at_or_before_that_time)
{
    BodyView view;
    Process program;
    read_body(session(), "sphere", &view);
    Client *client = start_paused(&program, session());
    const double end = view.time[view.frames - 1];
    unsigned random = 1;
    for (int i = 0; i < 40; i++) {
        random = random * 1103515245u + 12345u;
        const double time = end * (random >> 8 & 0xffff) / 65535.0;
        int expected = 0;
        while (expected + 1 < view.frames && view.time[expected + 1] <= time)
            expected++;
        const Reply *reply = set(client, "seek=%.17g", time);
        // The frame comes before the reply.
        assert_int_equal(reply->step, view.step[expected]);
        wait_until(client, client->frames.step == view.step[expected]);
        expect_frame(client, &view, expected);
    }
    stop(client, &program);
    client_destroy(client);
    view_free(&view);
}

TEST(tools_are_where_they_were_with_the_forces_that_were)
{
    Process program;
    int rows, times;
    hid_t file = view_open(session(), false);
    double *force = view_rows(file, "/tools/1/force", H5T_NATIVE_DOUBLE, &rows);
    double *time = view_rows(file, "/tools/1/time", H5T_NATIVE_DOUBLE, &times);
    H5Fclose(file);
    Client *client = start_paused(&program, session());
    int strongest = 0;
    for (int i = 0; i < rows; i++)
        strongest = fabs(force[3 * i + 2]) > fabs(force[3 * strongest + 2]) ? i : strongest;
    assert_true(fabs(force[3 * strongest + 2]) > 0.0);
    set(client, "seek=%.17g", time[strongest]);
    wait_until(client,
               client->contact.contact && client->contact.force[2] == force[3 * strongest + 2]);
    // No device is to render it.
    assert_true(client->contact.valid_until <= client->contact.utime);
    stop(client, &program);
    client_destroy(client);
    free(force);
    free(time);
}

// The newest whole mesh of one chunk.
typedef struct Births {
    int topology, count, origin[NODES_MAX], parent[2 * NODES_MAX];
} Births;

static void on_births(const lcm_recv_buf_t *buffer, const char *channel, const pliant_mesh_t *m,
                      void *user)
{
    (void)buffer, (void)channel;
    Births *births = user;
    assert_int_equal(m->chunk_count, 1);
    births->topology = m->topology;
    births->count = m->num_nodes;
    memcpy(births->origin, m->origin, (size_t)m->num_nodes * sizeof *births->origin);
    memcpy(births->parent, m->parent, 2 * (size_t)m->num_nodes * sizeof *births->parent);
}

TEST(a_mesh_says_where_its_nodes_come_from)
{
    static Births births;
    BodyView view;
    Process program;
    int rows;
    read_body(session(), "sphere", &view);
    hid_t file = view_open(session(), false);
    int *origin = view_rows(file, "/bodies/sphere/node_origin", H5T_NATIVE_INT, &rows);
    int *parent = view_rows(file, "/bodies/sphere/node_parent", H5T_NATIVE_INT, &rows);
    H5Fclose(file);
    Client *client = start_paused(&program, session());
    pliant_mesh_t_subscription_t *mesh =
        pliant_mesh_t_subscribe(client->lcm, "PLIANT_MESH_sphere", on_births, &births);
    set(client, "seek=%.17g", 1e9);
    const int last = view.topologies - 1;
    wait_until(client, births.topology == view.number[last]);
    assert_int_equal(births.count, view.node_count[last]);
    const size_t count = (size_t)births.count;
    assert_memory_equal(births.origin, origin + view.first_node[last], count * sizeof *origin);
    assert_memory_equal(births.parent, parent + 2 * view.first_node[last],
                        2 * count * sizeof *parent);
    pliant_mesh_t_unsubscribe(client->lcm, mesh);
    stop(client, &program);
    client_destroy(client);
    free(origin);
    free(parent);
    view_free(&view);
}

TEST(a_step_back_between_two_frames_shows_the_one_before)
{
    BodyView view;
    Process program;
    read_body(session(), "sphere", &view);
    Client *client = start_paused(&program, session());
    set(client, "seek=%.17g", 0.5 * (view.time[5] + view.time[6]));
    wait_until(client, client->frames.step == view.step[5]);
    set(client, "step=%g", -1.0);
    wait_until(client, client->frames.step == view.step[4]);
    expect_frame(client, &view, 4);
    stop(client, &program);
    client_destroy(client);
    view_free(&view);
}

TEST(a_loop_shows_its_last_frame)
{
    BodyView view;
    Process program;
    read_body(session(), "sphere", &view);
    char line[1200];
    snprintf(line, sizeof line, "--loop --from 0.15 %s", session());
    Client *client = start(&program, line);
    for (int round = 0; round < 3; round++) {
        wait_until(client, client->frames.step == view.step[view.frames - 1]);
        wait_until(client, client->frames.step < view.step[view.frames - 1]);
    }
    stop(client, &program);
    client_destroy(client);
    view_free(&view);
}

TEST(a_loop_of_one_frame_takes_its_time)
{
    BodyView view;
    Process program;
    read_body(session(), "sphere", &view);
    char line[1200];
    snprintf(line, sizeof line, "--loop --from %.17g --to %.17g %s", view.time[5] + 1e-4,
             view.time[5] + 2e-4, session());
    Client *client = start(&program, line);
    // Meshes come once a second, by the same clock as the loop; each round has a status. Rounds
    // take at least 12 ms; without a pause there are thousands.
    const int mesh = client->mesh.whole + 1;
    wait_until(client, client->mesh.whole > mesh);
    const int first = client->status.count;
    wait_until(client, client->mesh.whole > mesh + 1);
    assert_in_range(client->status.count - first, 0, 200);
    stop(client, &program);
    client_destroy(client);
    view_free(&view);
}

TEST(it_plays_in_a_loop_within_the_range_and_at_the_speed)
{
    BodyView view;
    Process program;
    read_body(session(), "sphere", &view);
    Client *client = start_paused(&program, session());
    char range[80];
    const int first = 3, last = view.frames - 4;
    snprintf(range, sizeof range, "range=%.17g %.17g", view.time[first], view.time[last]);
    assert_true(command(client, PLIANT_COMMAND_T_SET, 0, range)->ok);
    set(client, "loop=%g", 1.0);
    set(client, "speed=%g", 2.0);
    wait_until(client, client->frames.step == view.step[first]);
    assert_true(command(client, PLIANT_COMMAND_T_RESUME, 0, "")->ok);
    // Twice to the end and to the start again.
    for (int round = 0; round < 2; round++) {
        wait_until(client, client->frames.step > view.step[first]);
        wait_until(client, client->frames.step == view.step[first]);
    }
    assert_true(client->frames.step >= view.step[first]);
    assert_true(command(client, PLIANT_COMMAND_T_PAUSE, 0, "")->ok);
    wait_until(client, strcmp(client->status.state, "paused") == 0);
    // The events of the session were reported while it passed them.
    assert_true(saw_event(client, "cut"));
    stop(client, &program);
    client_destroy(client);
    view_free(&view);
}

TEST(once_it_ends_by_itself)
{
    char line[1200];
    Process program;
    snprintf(line, sizeof line, "--once --speed 10 %s", session());
    process_run(&program, program_path("pliant-play"), "%s", line);
    assert_int_equal(program.code, 0);
    assert_non_null(strstr(program.out, "1 recording, 0 to "));
}

TEST(a_run_offline_is_described_too)
{
    const char *path = scratch("offline.h5");
    Process daemon, program;
    run_daemon(&daemon, "--offline 0.1 --record %s %s", path, scene());
    assert_int_equal(daemon.code, 0);
    Client *client = start_paused(&program, path);
    const Reply *reply = command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "");
    assert_non_null(strstr(reply->text, "tool 1: probe, 1 capsules"));
    stop(client, &program);
    client_destroy(client);
}

// ---------------------------------------------------------------------------------------------
// Parts of a session

static int64_t last_step(const char *path)
{
    return info_of(path)->body[0].last_step;
}

TEST(a_session_that_was_continued_is_one)
{
    char kept[2][PATH_TEXT];
    const char *first = keep(kept[0], "part.h5"), *second = keep(kept[1], "part-2.h5");
    char more[1200], line[2400];
    snprintf(more, sizeof more, "--checkpoint %s --continue", scratch("part-check.h5"));
    for (int k = 0; k < 2; k++) // both with the same command line: --continue numbers them
        record_session("--record %s %s %s", first, more);
    const RecordingInfo info = *info_of(first);
    expect_at_least(last_step(second), info.body[0].last_step + 1);
    snprintf(line, sizeof line, "--paused %s %s", first, second);
    Process program;
    Client *client = start(&program, line);
    // Across the joint by single frames: no step comes twice, and none goes back.
    set(client, "seek=%.17g", info.body[0].last_time - 0.05);
    int64_t before = -1;
    for (int i = 0; i < 8; i++) {
        const int64_t step = command(client, PLIANT_COMMAND_T_STEP, 1, "")->step;
        assert_true(step > before);
        before = step;
    }
    expect_at_least(before, info.body[0].last_step + 1);
    // The second part's frames have its bits.
    BodyView view;
    read_body(second, "sphere", &view);
    set(client, "seek=%.17g", 1e9);
    wait_until(client, client->frames.step == view.step[view.frames - 1]);
    expect_frame(client, &view, view.frames - 1);
    view_free(&view);
    stop(client, &program);
    client_destroy(client);
}

TEST(a_session_that_was_restarted_follows)
{
    char line[2400];
    BodyView view;
    read_body(session(), "sphere", &view);
    snprintf(line, sizeof line, "--paused %s %s", session(), session());
    Process program;
    Client *client = start(&program, line);
    // The last frame of the first, then the first one of the second: two topologies, although both
    // files call theirs the same.
    set(client, "seek=%.17g", view.time[view.frames - 1]);
    wait_until(client, client->frames.step == view.step[view.frames - 1]);
    const int32_t topology = client->frames.topology;
    set(client, "step=%g", 1.0);
    wait_until(client, client->frames.step == view.step[0]);
    expect_frame(client, &view, 0);
    assert_int_not_equal(client->frames.topology, topology);
    set(client, "seek=%.17g", 1e9);
    wait_until(client, client->frames.step == view.step[view.frames - 1]);
    expect_frame(client, &view, view.frames - 1);
    assert_int_not_equal(client->frames.topology, topology);
    stop(client, &program);
    client_destroy(client);
    view_free(&view);
}

TEST(a_log_is_played_like_a_recording)
{
    char kept[2][PATH_TEXT];
    const char *log = keep(kept[0], "session.log"), *path = keep(kept[1], "logged.h5");
    Process logger, program;
    Client *client = client_create();
    if (!logger_begin(&logger, client, log)) {
        client_destroy(client);
        return;
    }
    record_session("--record %s %s %s", path, "");
    logger_end(&logger, client, log);
    client_destroy(client);
    BodyView view;
    read_body(path, "sphere", &view);
    client = start_paused(&program, log);
    // The log has what the daemon published, on a busy machine without its last frames.
    const int64_t step = set(client, "seek=%.17g", 1e9)->step;
    int frame = view.frames - 1;
    while (frame > 0 && view.step[frame] > step)
        frame--;
    assert_true(frame > 0);
    wait_until(client, client->frames.step == view.step[frame]);
    expect_frame(client, &view, frame);
    stop(client, &program);
    expect_printed(&program, "converted in ");
    client_destroy(client);
    view_free(&view);
}

// ---------------------------------------------------------------------------------------------
// What it refuses

TEST(what_a_recording_cannot_do_is_refused_in_words)
{
    static const char *const bad[][2] = {{"gravity=0 0 1", "takes seek="},
                                         {"", "takes seek="},
                                         {"=4", "takes seek="},
                                         {"loop", "takes seek="},
                                         {"see=1", "takes seek="},
                                         {"loop=2", "0 or 1"},
                                         {"seek=x", "finite number"},
                                         {"seek=nan", "finite number"},
                                         {"seek=1 2 3", "finite number"},
                                         {"speed=0", "[0.01, 100]"},
                                         {"speed=1e9", "[0.01, 100]"},
                                         {"range=2 1", "rising"},
                                         {"range=1", "two times"},
                                         {"step=1e300", "frames"}};
    Process program;
    Client *client = start_paused(&program, session());
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        const Reply *reply = command(client, PLIANT_COMMAND_T_SET, 0, bad[k][0]);
        assert_false(reply->ok);
        assert_non_null(strstr(reply->text, bad[k][1]));
    }
    assert_false(command(client, PLIANT_COMMAND_T_STEP, 0, "")->ok);
    assert_false(command(client, PLIANT_COMMAND_T_STEP, INT64_MAX, "")->ok);
    assert_false(command(client, PLIANT_COMMAND_T_CHECKPOINT, 0, "")->ok);
    assert_false(apply_load(client, TOP, 0.03, DOWN, 1.0, "")->ok);
    // The tools of the session are described, as by its daemon.
    const Reply *reply = command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "");
    assert_true(reply->ok);
    assert_non_null(strstr(reply->text, "tool 1: probe, 1 capsules"));
    assert_non_null(strstr(reply->text, "scene test: 1000 Hz"));
    stop(client, &program);
    client_destroy(client);
}

TEST(bytes_that_are_no_message_change_nothing)
{
    static const char *const channels[] = {"PLIANT_COMMAND", "PLIANT_CUT", "PLIANT_CLAIM"};
    unsigned char bytes[200];
    Process program;
    Client *client = start_paused(&program, session());
    for (size_t size = 0; size < sizeof bytes; size += 7) {
        memset(bytes, (int)size, sizeof bytes);
        for (int k = 0; k < 3; k++)
            send_bytes(client, channels[k], bytes, size);
    }
    assert_true(command(client, PLIANT_COMMAND_T_STEP, 1, "")->ok);
    stop(client, &program);
    client_destroy(client);
}

TEST(a_prefix_has_one_server)
{
    Process daemon, program, late;
    Client *client = client_create();
    daemon_start(&daemon, "%s", scene());
    client_wait_for_daemon(client);
    process_run(&program, program_path("pliant-play"), "%s", session());
    expect_refusal(&program, 2, "a server publishes on PLIANT_STATUS");
    stop(client, &daemon);
    client_destroy(client);
    // And the other way round.
    client = start_paused(&program, session());
    process_run(&late, NULL, "%s", scene());
    assert_int_equal(late.code, 1);
    assert_non_null(strstr(late.err, "another daemon publishes on PLIANT_STATUS"));
    process_run(&late, program_path("pliant-play"), "%s", session());
    expect_refusal(&late, 2, "a server publishes on PLIANT_STATUS");
    stop(client, &program);
    client_destroy(client);
}

TEST(what_cannot_be_played_is_refused)
{
    char line[1200];
    Process program;
    const char *kept = scratch("text.h5");
    write_text(kept, "no recording");
    process_run(&program, program_path("pliant-play"), " ");
    expect_refusal(&program, 2, "a recording is missing");
    process_run(&program, program_path("pliant-play"), "%s", kept);
    expect_refusal(&program, 2, "is not an HDF5 file");
    process_run(&program, program_path("pliant-play"), "%s", scratch("nowhere.h5"));
    expect_refusal(&program, 2, "No such file");
    snprintf(line, sizeof line, "--from 100 %s", session());
    process_run(&program, program_path("pliant-play"), "%s", line);
    expect_refusal(&program, 2, "--from and --to");
    snprintf(line, sizeof line, "--once --loop %s", session());
    process_run(&program, program_path("pliant-play"), "%s", line);
    expect_refusal(&program, 2, "--once");
}
