// SPDX-License-Identifier: MIT
// pliant-record beside the real daemon: what it makes of the messages, or of a log of them, is what
// the daemon records itself; which bodies, files and logs it takes.
#include "test.h"
#include "recorder.h"
#include "scene_writer.h"

static const char PAUSED[] =
    "start = \"paused\"; publish = { nodes_hz = 60.0; contact_hz = 100.0; status_hz = 20.0; "
    "error_hz = 100.0; };";
static const double TOP[3] = {0.0, 0.0, 0.05}, DOWN[3] = {0.0, 0.02, -0.4};

// A body that refines, and one that is cut.
static const char CHANGING[] =
    "name = \"changing\"; start = \"paused\";\n"
    "publish = { nodes_hz = 60.0; mesh_hz = 1.0; contact_hz = 100.0; status_hz = 20.0; };\n"
    "bodies = (\n"
    "  { name = \"soft\"; model = \"surface\"; levels = 2; adapt = { check_hz = 100.0; };\n"
    "    mesh = { generator = \"ico_sphere\"; nodes = 42; radius = 0.05; };\n"
    "    material = { youngs_modulus_2d = 80.0; areal_density = 4.2; damping_time = 2.0e-4; };\n"
    "    shape = { angular_frequency = 50.0; damping_ratio = 0.3; };\n"
    "    fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.02]); } ); },\n"
    "  { name = \"ball\"; model = \"surface\"; cuttable = true; shape = {};\n"
    "    mesh = { generator = \"ico_sphere\"; nodes = 162; radius = 0.03;\n"
    "             place = { translation = [0.2, 0.0, 0.0]; }; }; } );\n";

// --- Two recordings of the same run ---

static int topology_at(const BodyView *view, int number)
{
    for (int i = 0; i < view->topologies; i++)
        if (view->number[i] == number)
            return i;
    fail_msg("no topology %d", number);
    return -1;
}

static void expect_same_mesh(const BodyView *a, const BodyView *b, int number)
{
    int i = topology_at(a, number), k = topology_at(b, number);
    assert_int_equal(a->triangle_count[i], b->triangle_count[k]);
    assert_int_equal(a->node_count[i], b->node_count[k]);
    assert_memory_equal(a->triangle[a->first_triangle[i]], b->triangle[b->first_triangle[k]],
                        (size_t)a->triangle_count[i] * sizeof *a->triangle);
    assert_memory_equal(a->node_id + a->first_node[i], b->node_id + b->first_node[k],
                        (size_t)a->node_count[i] * sizeof *a->node_id);
}

// Every frame that both have is the same to the bit, with the same mesh. Returns how many.
static int expect_same_frames(const char *path_a, const char *path_b, const char *body)
{
    SCOPED(view_free) BodyView a, b;
    int both = 0;
    view_read(&a, path_a, body);
    view_read(&b, path_b, body);
    for (int i = 0, k = 0; i < a.frames; i++) {
        while (k < b.frames && b.step[k] < a.step[i])
            k++;
        if (k == b.frames || b.step[k] != a.step[i])
            continue;
        assert_true(a.time[i] == b.time[k]);
        assert_int_equal(a.topology[i], b.topology[k]);
        assert_int_equal(a.count[i], b.count[k]);
        assert_memory_equal(a.position[a.first[i]], b.position[b.first[k]],
                            (size_t)a.count[i] * sizeof *a.position);
        if (both == 0 || a.topology[i] != a.topology[i - 1])
            expect_same_mesh(&a, &b, a.topology[i]);
        both++;
    }
    return both;
}

static void expect_same_rows(const char *path_a, const char *path_b, const char *set, int least)
{
    int rows_a, rows_b;
    SCOPED(view_close) hid_t a = view_open(path_a, false), b = view_open(path_b, false);
    FREED double *of_a = view_rows(a, set, H5T_NATIVE_DOUBLE, &rows_a);
    FREED double *of_b = view_rows(b, set, H5T_NATIVE_DOUBLE, &rows_b);
    assert_int_equal(rows_a, rows_b);
    expect_at_least(rows_a, least);
    int columns = strstr(set, "/time") ? 1 : strstr(set, "/orientation") ? 4 : 3;
    assert_memory_equal(of_a, of_b, (size_t)(rows_a * columns) * sizeof *of_a);
}

// The rows of a set of both, `least` at least: events, or errors. Up to `last` at the end may be in
// one of them alone: of a message that was under way when both ended.
static void expect_same_lines(const char *path_a, const char *path_b, const char *name, int least,
                              int last)
{
    int rows_a, rows_b;
    SCOPED(view_close) hid_t a = view_open(path_a, false), b = view_open(path_b, false);
    hid_t set = H5Dopen2(a, name, H5P_DEFAULT), type = H5Dget_type(set);
    hid_t memory = H5Tget_native_type(type, H5T_DIR_ASCEND);
    size_t size = H5Tget_size(memory);
    FREED char *of_a = view_rows(a, name, memory, &rows_a);
    FREED char *of_b = view_rows(b, name, memory, &rows_b);
    const int both = rows_a < rows_b ? rows_a : rows_b;
    expect_at_least(both, least);
    assert_true(abs(rows_a - rows_b) <= last);
    assert_memory_equal(of_a, of_b, (size_t)both * size);
    H5Tclose(memory);
    H5Tclose(type);
    H5Dclose(set);
}

// --- Beside --record ---

TEST(what_comes_by_messages_is_what_the_daemon_records)
{
    enum { STEPS = 40 };
    const char *own = scratch("own.h5"), *path = scratch("heard.h5");
    SCOPED_CLIENT Client *client = client_create();
    Process daemon, program;
    daemon_start(&daemon, "--record %s %s", own, write_scene("own.cfg", PAUSED, PROBE_TOOL));
    record_start(&program, path, "");
    client_wait_for_daemon(client);
    wait_until(client, has_sidecar(path));
    command(client, PLIANT_COMMAND_T_SET, 0, "gravity_z=-2");
    send_load(client, TOP, 0.03, DOWN, 1.0, "");
    command(client, PLIANT_COMMAND_T_STEP, 3, ""); // no pose yet
    for (int i = 0; i < STEPS; i++) {
        send_pose_at(client, (const double[]){1e-3 * i, 0.0, 0.052 - 2e-4 * i});
        const Reply *reply = command(client, PLIANT_COMMAND_T_STEP, 1 + i % 4, "");
        wait_until(client, client->contact.step == reply->step);
    }
    wait_until(client, flushed_frames(path) >= STEPS + 1);
    server_stop(client, &daemon);
    end(&program, SIGTERM, 0);

    expect_at_least(expect_same_frames(own, path, "sphere"), STEPS + 1);
    expect_same_rows(own, path, "/tools/1/time", STEPS);
    expect_same_rows(own, path, "/tools/1/position", STEPS);
    expect_same_rows(own, path, "/tools/1/force", STEPS);
    expect_same_rows(own, path, "/tools/1/orientation", STEPS);
    expect_same_lines(own, path, "/events", 2, 0);
    expect_same_lines(own, path, "/errors", STEPS / 2, 2); // of the body, in contact of the tool
    const RecordingInfo *info = info_of(path);
    assert_true(info->ended);
    assert_int_equal(info->body_count, 1);
    assert_int_equal(info->body[0].counts.lost + info->body[0].counts.dropped +
                         info->body[0].counts.without_mesh + info->body[0].counts.refused,
                     0);
    assert_string_equal(info->tool[0].name, "1");
    expect_in(program.out, "body sphere: frames ");
}

static void cut_at(Client *client, double x)
{
    const pliant_cut_t cut = make_cut(client, x, 0.05, "ball");
    assert_int_equal(pliant_cut_t_publish(client->lcm, "PLIANT_CUT", &cut), 0);
    command(client, PLIANT_COMMAND_T_STEP, 1, "");
    wait_until(client, find_reply(client, cut.id) != NULL);
    const Reply *reply = find_reply(client, cut.id);
    if (!reply->ok || reply->separated == 0)
        fail_msg("nothing was cut: %s", reply->text);
}

// Refined, coarsened, cut and put together again; recorded by the daemon, by messages, from a log.
TEST(every_frame_has_its_mesh_while_bodies_refine_and_are_cut)
{
    enum { ROUNDS = 60 };
    const char *own = scratch("changing.h5"), *path = scratch("changing-heard.h5");
    const char *log = scratch("changing.log"), *scene = scratch("changing.cfg");
    const char *converted = scratch("changing-converted.h5");
    write_text(scene, CHANGING);
    Client *client = client_create();
    Process daemon, program, logger;
    const bool logs = logger_begin(&logger, client, log);
    daemon_start(&daemon, "--record %s %s", own, scene);
    record_start(&program, path, "");
    client_wait_for_daemon(client);
    wait_until(client, has_sidecar(path));
    send_load(client, TOP, 0.03, DOWN, 0.15, "soft");
    for (int i = 0; i < ROUNDS; i++) {
        if (i % 20 == 10)
            cut_at(client, 0.19 + 5e-4 * i);
        if (i == 45)
            assert_true(command(client, PLIANT_COMMAND_T_RESET, 0, "")->ok);
        step_daemon(client, 6);
        // On a busy machine lcm-logger drops what comes while it waits.
        char round[16];
        snprintf(round, sizeof round, "ROUND_%02d", i);
        if (logs)
            wait_for_log(client, log, round);
    }
    wait_until(client, flushed_frames(path) >= 2 * ROUNDS);
    server_stop(client, &daemon);
    end(&program, SIGINT, 0);
    if (logs)
        logger_end(&logger, client, log);
    client_destroy(client);

    expect_at_least(expect_same_frames(own, path, "soft"), ROUNDS);
    expect_at_least(expect_same_frames(own, path, "ball"), ROUNDS);
    BodyView view;
    view_read(&view, path, "soft");
    expect_at_least(view.topologies, 3);
    view_free(&view);
    view_read(&view, path, "ball");
    expect_at_least(view.topologies, 3);
    view_free(&view);
    if (!logs)
        return;
    char arguments[2200];
    snprintf(arguments, sizeof arguments, "--convert %s -o %s", log, converted);
    record_run(&program, arguments);
    expect_code(&program, 0);
    expect_at_least(expect_same_frames(path, converted, "soft"), ROUNDS);
    expect_at_least(expect_same_frames(path, converted, "ball"), ROUNDS);
}

// --- Options ---

static void expect_end(const char *arguments, int code, const char *needle)
{
    expect_usage(program_path("pliant-record"), &(Usage){arguments, code, needle}, 1);
}

TEST(what_cannot_be_recorded_is_refused)
{
    char line[2400];
    const char *kept = scratch("kept.txt"), *path = scratch("none.h5");
    write_text(kept, "precious");
    expect_end("", 2, "--output");
    expect_end("-o x.h5 --hz 0", 2, "--hz");
    expect_end("-o x.h5 --body a/b", 2, "--body");
    expect_end("-o x.h5 more", 2, "more");
    expect_end("--info x.h5 -o y.h5", 2, "--info");
    snprintf(line, sizeof line, "-o %s", kept);
    expect_end(line, 2, "exists already");
    expect_end(line, 2, "; --overwrite replaces a recording");
    snprintf(line, sizeof line, "-o %s --overwrite", kept);
    expect_end(line, 2, "no HDF5 file");
    snprintf(line, sizeof line, "-o %s --convert %s", path, scratch("nowhere.log"));
    expect_end(line, 2, "nowhere.log");
    snprintf(line, sizeof line, "-o %s --convert %s", path, kept);
    expect_end(line, 1, "not an LCM event log");
    snprintf(line, sizeof line, "--info %s", kept);
    expect_end(line, 2, "not an HDF5 file");
    snprintf(line, sizeof line, "-o %s --wait 0.2", path);
    expect_end(line, 1, "is pliantd running");
    assert_int_equal(access(path, F_OK), -1); // nothing is left of it
}

TEST(bodies_are_chosen_and_files_replaced)
{
    char line[1200];
    const char *path = scratch("chosen.h5"), *scene = scratch("chosen.cfg");
    write_text(scene, CHANGING);
    Process daemon, program;
    SCOPED_CLIENT Client *client = server_start(&daemon, "%s", scene);
    snprintf(line, sizeof line, "-o %s --body none", path);
    expect_end(line, 1, "no body of this name, only: soft, ball\n");
    for (int round = 0; round < 2; round++) {
        snprintf(line, sizeof line, "%s.xdmf", path);
        unlink(line);
        record_start(&program, path, round == 0 ? "--body ball" : "--body soft --overwrite");
        // The newest frame waits for the next request. Until a time, not for a number of messages:
        // a status ends client_listen as well, and a busy machine starts the recorder late.
        const double limit = client_now() + 30.0;
        while (flushed_frames(path) < 5 && client_now() < limit) {
            client->replies = 0; // none of them is looked up again
            command(client, PLIANT_COMMAND_T_STEP, 10, "");
            client_listen(client, 100);
        }
        end(&program, SIGTERM, 0);
        const RecordingInfo *info = info_of(path);
        assert_int_equal(info->body_count, 1);
        assert_string_equal(info->body[0].name, round == 0 ? "ball" : "soft");
    }
    snprintf(line, sizeof line, "--info %s", path);
    record_run(&program, line);
    expect_ended(&program, 0, "ended cleanly");
    expect_in(program.out, "body soft: ");
    server_stop(client, &daemon);
}
