// SPDX-License-Identifier: MIT
// pliant-play, beside no daemon: what it publishes of a session that the real daemon recorded is
// what is in the file, at any time; which requests, files and prefixes it takes.
#include "test.h"
#include "recorder.h"
#include "scene_writer.h"

#include "io/recording_read.h"
#include "pliant_error_t.h"
#include "pliant_mesh_t.h"

#include <sys/stat.h>

static const char PAUSED[] = "start = \"paused\";\n"
                             "publish = { nodes_hz = 60.0; contact_hz = 100.0; error_hz = 50.0; };";
static const double TOP[3] = {0.0, 0.0, 0.05}, DOWN[3] = {0.0, 0.02, -0.4};

// --- A session: pressed by a tool, pushed by a load, cut ---

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
    const pliant_cut_t cut = make_cut(client, x, 0.08, "");
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
        send_pose_at(client, (const double[]){0.0, 0.0, 0.055 - 1e-3 * i});
        if (i == 8 || i == 16)
            cut_at(client, 1e-3 * i - 0.02);
        command(client, PLIANT_COMMAND_T_STEP, 10, "");
    }
}

// Runs the daemon with these options and records what `act` does.
static void record_session(const char *format, const char *path, const char *more)
{
    Process daemon;
    SCOPED_CLIENT Client *client = server_start(&daemon, format, path, more, scene());
    act(client);
    server_stop(client, &daemon);
}

static const char *session(void)
{
    static const char *path;
    if (path == NULL) {
        path = scratch("session.h5");
        record_session("--record %s %s %s", path, "");
    }
    return path;
}

// What is recorded of its body.
static const BodyView *recorded(void)
{
    static BodyView view;
    if (view.frames == 0)
        view_read(&view, session(), "sphere");
    return &view;
}

static Process program;

static Client *start(const char *format, ...) __attribute__((format(printf, 1, 2)));
static Client *start(const char *format, ...)
{
    char arguments[2400];
    va_list list;
    va_start(list, format);
    vsnprintf(arguments, sizeof arguments, format, list);
    va_end(list);
    Client *client = client_create();
    process_start(&program, program_path("pliant-play"), "%s", arguments);
    client_wait_for_daemon(client);
    return client;
}

static Client *start_paused(const char *path)
{
    return start("--paused %s", path);
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

TEST(every_frame_comes_with_the_recorded_bits_and_its_mesh)
{
    const BodyView *view = recorded();
    expect_at_least(view->frames, 12);
    expect_at_least(view->topologies, 3); // two cuts
    SCOPED_CLIENT Client *client = start_paused(session());
    wait_until(client, client->frames.whole > 0);
    for (int f = 0; f < view->frames; f++) {
        if (f > 0)
            step_daemon(client, 1);
        wait_until(client, client->frames.step == view->step[f]);
        expect_frame(client, view, f);
        // The mesh of a topology comes before the frame.
        wait_until(client, client->mesh.topology == view->topology[f]);
        assert_int_equal(client->mesh.whole_nodes, view->count[f]);
        assert_true(client->mesh.in_range);
    }
    // And back again.
    for (int f = view->frames - 2; f >= 0; f--) {
        set(client, "step=%g", -1.0);
        wait_until(client, client->frames.step == view->step[f]);
        expect_frame(client, view, f);
    }
    server_stop(client, &program);
}

TEST(a_seek_shows_the_last_frame_at_or_before_that_time)
{
    const BodyView *view = recorded();
    SCOPED_CLIENT Client *client = start_paused(session());
    const double end = view->time[view->frames - 1];
    unsigned random = 1;
    for (int i = 0; i < 40; i++) {
        random = random * 1103515245u + 12345u;
        const double time = end * (random >> 8 & 0xffff) / 65535.0;
        int expected = 0;
        while (expected + 1 < view->frames && view->time[expected + 1] <= time)
            expected++;
        const Reply *reply = set(client, "seek=%.17g", time);
        // The frame comes before the reply.
        assert_int_equal(reply->step, view->step[expected]);
        wait_until(client, client->frames.step == view->step[expected]);
        expect_frame(client, view, expected);
    }
    server_stop(client, &program);
}

HANDLER(on_error, pliant_error_t, message)
{
    pliant_error_t **newest = user;
    if (*newest != NULL)
        pliant_error_t_destroy(*newest);
    *newest = pliant_error_t_copy(message);
}

TEST(errors_are_told_again_as_they_were)
{
    enum { LINES = 200 };
    static RecordingLedger line[LINES];
    Status status = {0};
    RecordingReader *reader = recording_reader_open(session(), &status);
    assert_non_null(reader);
    const int count = (int)recording_reader_info(reader)->lines[RECORDING_ERRORS];
    assert_in_range(count, 20, LINES);
    expect_ok(recording_reader_lines(reader, RECORDING_ERRORS, 0, count, line, &status), status);
    recording_reader_close(reader);
    SCOPED_CLIENT Client *client = client_create();
    pliant_error_t *newest = NULL;
    pliant_error_t_subscription_t *heard =
        pliant_error_t_subscribe(client->lcm, "PLIANT_ERROR", on_error, &newest);
    process_start(&program, program_path("pliant-play"), "--paused %s", session());
    client_wait_for_daemon(client);
    int bodies = 0, tools = 0;
    for (int i = 0; i < count; i++) {
        if (i == 0 || line[i].step != line[i - 1].step) {
            set(client, "seek=%.17g", line[i].time);
            wait_until(client, newest != NULL && newest->step == line[i].step);
        }
        if (line[i].line == ERRORS_BODY) {
            assert_int_equal(newest->num_bodies, 1);
            assert_string_equal(newest->body[0].name, "sphere");
            assert_true(newest->body[0].space == line[i].value[ERRORS_SPACE] &&
                        newest->body[0].relative == line[i].value[ERRORS_RELATIVE] &&
                        (double)newest->body[0].age == line[i].value[ERRORS_AGE]);
            bodies += newest->body[0].age >= 0;
        } else {
            assert_int_equal(newest->num_tools, 1);
            assert_true(newest->tool[0].tool == 1 &&
                        newest->tool[0].force == line[i].value[ERRORS_FORCE] &&
                        newest->tool[0].error == line[i].value[ERRORS_ERROR]);
            tools++;
        }
    }
    assert_true(bodies > 5 && tools > 2); // it is pressed, then cut away
    pliant_error_t_unsubscribe(client->lcm, heard);
    pliant_error_t_destroy(newest);
    server_stop(client, &program);
}

TEST(tools_are_where_they_were_with_the_forces_that_were)
{
    int rows, times;
    hid_t file = view_open(session(), false);
    FREED double *force = view_rows(file, "/tools/1/force", H5T_NATIVE_DOUBLE, &rows);
    FREED double *time = view_rows(file, "/tools/1/time", H5T_NATIVE_DOUBLE, &times);
    H5Fclose(file);
    SCOPED_CLIENT Client *client = start_paused(session());
    int strongest = 0;
    for (int i = 0; i < rows; i++)
        strongest = fabs(force[3 * i + 2]) > fabs(force[3 * strongest + 2]) ? i : strongest;
    assert_true(fabs(force[3 * strongest + 2]) > 0.0);
    set(client, "seek=%.17g", time[strongest]);
    wait_until(client,
               client->contact.contact && client->contact.force[2] == force[3 * strongest + 2]);
    // No device is to render it.
    assert_true(client->contact.valid_until <= client->contact.utime);
    server_stop(client, &program);
}

// The newest whole mesh of one chunk.
typedef struct Births {
    int topology, count, origin[NODES_MAX], parent[2 * NODES_MAX];
} Births;

HANDLER(on_births, pliant_mesh_t, m)
{
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
    int rows;
    const BodyView *view = recorded();
    hid_t file = view_open(session(), false);
    FREED int *origin = view_rows(file, "/bodies/sphere/node_origin", H5T_NATIVE_INT, &rows);
    FREED int *parent = view_rows(file, "/bodies/sphere/node_parent", H5T_NATIVE_INT, &rows);
    H5Fclose(file);
    SCOPED_CLIENT Client *client = start_paused(session());
    pliant_mesh_t_subscription_t *mesh =
        pliant_mesh_t_subscribe(client->lcm, "PLIANT_MESH_sphere", on_births, &births);
    set(client, "seek=%.17g", 1e9);
    const int last = view->topologies - 1;
    wait_until(client, births.topology == view->number[last]);
    assert_int_equal(births.count, view->node_count[last]);
    const size_t count = (size_t)births.count;
    assert_memory_equal(births.origin, origin + view->first_node[last], count * sizeof *origin);
    assert_memory_equal(births.parent, parent + 2 * view->first_node[last],
                        2 * count * sizeof *parent);
    pliant_mesh_t_unsubscribe(client->lcm, mesh);
    server_stop(client, &program);
}

TEST(a_step_back_between_two_frames_shows_the_one_before)
{
    const BodyView *view = recorded();
    SCOPED_CLIENT Client *client = start_paused(session());
    set(client, "seek=%.17g", 0.5 * (view->time[5] + view->time[6]));
    wait_until(client, client->frames.step == view->step[5]);
    set(client, "step=%g", -1.0);
    wait_until(client, client->frames.step == view->step[4]);
    expect_frame(client, view, 4);
    server_stop(client, &program);
}

TEST(a_loop_shows_its_last_frame)
{
    const BodyView *view = recorded();
    SCOPED_CLIENT Client *client = start("--loop --from 0.15 %s", session());
    for (int round = 0; round < 3; round++) {
        wait_until(client, client->frames.step == view->step[view->frames - 1]);
        wait_until(client, client->frames.step < view->step[view->frames - 1]);
    }
    server_stop(client, &program);
}

TEST(a_loop_of_one_frame_takes_its_time)
{
    const BodyView *view = recorded();
    SCOPED_CLIENT Client *client = start("--loop --from %.17g --to %.17g %s", view->time[5] + 1e-4,
                                         view->time[5] + 2e-4, session());
    // Meshes come once a second, by the same clock as the loop; each round has a status. Rounds
    // take at least 12 ms; without a pause there are thousands.
    const int mesh = client->mesh.whole + 1;
    wait_until(client, client->mesh.whole > mesh);
    const int first = client->status.count;
    wait_until(client, client->mesh.whole > mesh + 1);
    assert_in_range(client->status.count - first, 0, 200);
    server_stop(client, &program);
}

TEST(it_plays_in_a_loop_within_the_range_and_at_the_speed)
{
    const BodyView *view = recorded();
    SCOPED_CLIENT Client *client = start_paused(session());
    char range[80];
    const int first = 3, last = view->frames - 4;
    snprintf(range, sizeof range, "range=%.17g %.17g", view->time[first], view->time[last]);
    assert_true(command(client, PLIANT_COMMAND_T_SET, 0, range)->ok);
    set(client, "loop=%g", 1.0);
    set(client, "speed=%g", 2.0);
    wait_until(client, client->frames.step == view->step[first]);
    assert_true(command(client, PLIANT_COMMAND_T_RESUME, 0, "")->ok);
    // Twice to the end and to the start again.
    for (int round = 0; round < 2; round++) {
        wait_until(client, client->frames.step > view->step[first]);
        wait_until(client, client->frames.step == view->step[first]);
    }
    assert_true(client->frames.step >= view->step[first]);
    assert_true(command(client, PLIANT_COMMAND_T_PAUSE, 0, "")->ok);
    wait_until(client, strcmp(client->status.state, "paused") == 0);
    // The events of the session were reported while it passed them.
    assert_true(saw_event(client, "cut"));
    server_stop(client, &program);
}

TEST(once_it_ends_by_itself)
{
    process_run_well(&program, program_path("pliant-play"), "--once --speed 10 %s", session());
    expect_in(program.out, "1 recording, 0 to ");
}

TEST(a_run_offline_is_described_too)
{
    const char *path = scratch("offline.h5");
    Process daemon;
    run_daemon_well(&daemon, "--offline 0.1 --record %s %s", path, scene());
    SCOPED_CLIENT Client *client = start_paused(path);
    const Reply *reply = command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "");
    expect_in(reply->text, "tool 1: probe, 1 capsules");
    server_stop(client, &program);
}

// --- Parts of a session ---

static int64_t last_step(const char *path)
{
    return info_of(path)->body[0].last_step;
}

TEST(a_session_that_was_continued_is_one)
{
    const char *first = scratch("part.h5"), *second = scratch("part-2.h5");
    char more[1200];
    snprintf(more, sizeof more, "--checkpoint %s --continue", scratch("part-check.h5"));
    for (int k = 0; k < 2; k++) // both with the same command line: --continue numbers them
        record_session("--record %s %s %s", first, more);
    const RecordingInfo info = *info_of(first);
    expect_at_least(last_step(second), info.body[0].last_step + 1);
    SCOPED_CLIENT Client *client = start("--paused %s %s", first, second);
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
    SCOPED(view_free) BodyView view;
    view_read(&view, second, "sphere");
    set(client, "seek=%.17g", 1e9);
    wait_until(client, client->frames.step == view.step[view.frames - 1]);
    expect_frame(client, &view, view.frames - 1);
    server_stop(client, &program);
}

TEST(a_session_that_was_restarted_follows)
{
    const BodyView *view = recorded();
    SCOPED_CLIENT Client *client = start("--paused %s %s", session(), session());
    // The last frame of the first, then the first one of the second: two topologies, although both
    // files call theirs the same.
    set(client, "seek=%.17g", view->time[view->frames - 1]);
    wait_until(client, client->frames.step == view->step[view->frames - 1]);
    const int32_t topology = client->frames.topology;
    set(client, "step=%g", 1.0);
    wait_until(client, client->frames.step == view->step[0]);
    expect_frame(client, view, 0);
    assert_int_not_equal(client->frames.topology, topology);
    set(client, "seek=%.17g", 1e9);
    wait_until(client, client->frames.step == view->step[view->frames - 1]);
    expect_frame(client, view, view->frames - 1);
    assert_int_not_equal(client->frames.topology, topology);
    server_stop(client, &program);
}

// Played so slowly, its ten seconds would take longer than this test waits.
TEST(a_gap_is_told_and_skipped)
{
    const char *first = scratch("before.h5"), *second = scratch("behind.h5"),
               *check = scratch("gap-check.h5");
    Process daemon;
    run_daemon_well(&daemon, "--offline 0.05 --record %s --checkpoint %s %s", first, check,
                    scene());
    run_daemon_well(&daemon, "--offline 10 --resume %s --checkpoint %s %s", check, check, scene());
    run_daemon_well(&daemon, "--offline 0.05 --resume %s --record %s %s", check, second, scene());
    process_run_well(&program, program_path("pliant-play"), "--once --skip-gaps --speed 0.05 %s %s",
                     first, second);
    expect_in(program.out, "nothing for 10");
    expect_in(program.out, " s on: skipped");
}

// Sets the clock of a log from its middle on by an hour.
static void set_log_clock(const char *log)
{
    struct stat facts;
    FILE *file = fopen(log, "r+b");
    assert_non_null(file);
    assert_int_equal(fstat(fileno(file), &facts), 0);
    unsigned char head[28]; // sync word, number, time stamp, two lengths
    for (long at = 0; fread(head, 1, sizeof head, file) == sizeof head;) {
        uint64_t stamp = 0;
        for (int i = 0; i < 8; i++)
            stamp = stamp << 8 | head[12 + i];
        stamp += at > facts.st_size / 2 ? UINT64_C(3600000000) : 0;
        for (int i = 0; i < 8; i++)
            head[12 + i] = (unsigned char)(stamp >> (56 - 8 * i));
        fseek(file, at, SEEK_SET);
        assert_int_equal(fwrite(head, 1, sizeof head, file), sizeof head);
        for (int i = 20; i < 28; i += 4)
            at += (long)head[i] << 24 | (long)head[i + 1] << 16 | head[i + 2] << 8 | head[i + 3];
        at += (long)sizeof head;
        fseek(file, at, SEEK_SET);
    }
    fclose(file);
}

TEST(a_log_is_played_like_a_recording)
{
    const char *log = scratch("session.log"), *path = scratch("logged.h5");
    Process logger;
    SCOPED_CLIENT Client *client = client_create();
    if (!logger_begin(&logger, client, log)) {
        return;
    }
    record_session("--record %s %s %s", path, "");
    logger_end(&logger, client, log);
    client_destroy(client);
    SCOPED(view_free) BodyView view;
    view_read(&view, path, "sphere");
    client = start_paused(log);
    // The log has what the daemon published, on a busy machine without its last frames.
    const int64_t step = set(client, "seek=%.17g", 1e9)->step;
    int frame = view.frames - 1;
    while (frame > 0 && view.step[frame] > step)
        frame--;
    assert_true(frame > 0);
    wait_until(client, client->frames.step == view.step[frame]);
    expect_frame(client, &view, frame);
    server_stop(client, &program);
    expect_printed(&program, "converted in ");
    // A clock that was set meanwhile is told of, and changes nothing of what is played.
    set_log_clock(log);
    // Its logger was killed within an event: played up to there, which the exit status says.
    struct stat facts;
    assert_int_equal(stat(log, &facts), 0);
    assert_int_equal(truncate(log, facts.st_size - 20), 0);
    process_start(&program, program_path("pliant-play"), "--once %s", log);
    process_wait_for(&program, 1);
    expect_in(program.err, "cut off after");
    expect_in(program.err, "the clock goes on by 3600");
    expect_printed(&program, "1 recording");
}

// --- What it refuses ---

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
    SCOPED_CLIENT Client *client = start_paused(session());
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        const Reply *reply = command(client, PLIANT_COMMAND_T_SET, 0, bad[k][0]);
        assert_false(reply->ok);
        expect_in(reply->text, bad[k][1]);
    }
    assert_false(command(client, PLIANT_COMMAND_T_STEP, 0, "")->ok);
    assert_false(command(client, PLIANT_COMMAND_T_STEP, INT64_MAX, "")->ok);
    assert_false(command(client, PLIANT_COMMAND_T_CHECKPOINT, 0, "")->ok);
    assert_false(apply_load(client, TOP, 0.03, DOWN, 1.0, "")->ok);
    // The tools of the session are described, as by its daemon.
    const Reply *reply = command(client, PLIANT_COMMAND_T_DESCRIBE, 0, "");
    assert_true(reply->ok);
    expect_in(reply->text, "tool 1: probe, 1 capsules");
    expect_in(reply->text, "scene test: 1000 Hz");
    server_stop(client, &program);
}

TEST(bytes_that_are_no_message_change_nothing)
{
    static const char *const channels[] = {"PLIANT_COMMAND", "PLIANT_CUT", "PLIANT_CLAIM"};
    unsigned char bytes[200];
    SCOPED_CLIENT Client *client = start_paused(session());
    for (size_t size = 0; size < sizeof bytes; size += 7) {
        memset(bytes, (int)size, sizeof bytes);
        for (int k = 0; k < 3; k++)
            send_bytes(client, channels[k], bytes, size);
    }
    step_daemon(client, 1);
    server_stop(client, &program);
}

TEST(a_prefix_has_one_server)
{
    Process daemon, late;
    SCOPED_CLIENT Client *client = server_start(&daemon, "%s", scene());
    process_run(&program, program_path("pliant-play"), "%s", session());
    expect_refusal(&program, 2, "a server publishes on PLIANT_STATUS");
    server_stop(client, &daemon);
    client_destroy(client);
    // And the other way round.
    client = start_paused(session());
    process_run(&late, NULL, "%s", scene());
    expect_ended(&late, 1, "another daemon publishes on PLIANT_STATUS");
    process_run(&late, program_path("pliant-play"), "%s", session());
    expect_refusal(&late, 2, "a server publishes on PLIANT_STATUS");
    server_stop(client, &program);
}

TEST(what_cannot_be_played_is_refused)
{
    const char *kept = scratch("text.h5");
    write_text(kept, "no recording");
    process_run(&program, program_path("pliant-play"), " ");
    expect_refusal(&program, 2, "a recording is missing");
    process_run(&program, program_path("pliant-play"), "%s", kept);
    expect_refusal(&program, 2, "is not an HDF5 file");
    process_run(&program, program_path("pliant-play"), "%s", scratch("nowhere.h5"));
    expect_refusal(&program, 2, "No such file");
    process_run(&program, program_path("pliant-play"), "--from 100 %s", session());
    expect_refusal(&program, 2, "--from and --to");
    process_run(&program, program_path("pliant-play"), "--once --loop %s", session());
    expect_refusal(&program, 2, "--once");
}
