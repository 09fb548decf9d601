// SPDX-License-Identifier: MIT
// Checkpoints and input logs: whole files, and runs that continue or repeat with the same bits.
#include "effort.h"
#include "test.h"
#include "lcm_client.h"
#include "scene_writer.h"

#include <lcm/lcm.h>

static const char HEAD[] = "publish = { nodes_hz = 20.0; status_hz = 20.0; };\n"
                           "gravity = [0.0, 0.0, -9.81];";
static const char LOADS[] = "loads = ( { body = \"sphere\"; center = [0.0, 0.0, 0.05];\n"
                            "  radius = 0.03; force = [0.1, 0.0, -0.2]; start = 0.05;\n"
                            "  duration = 0.6; } );";
static const double DOWN[3] = {0.0, 0.02, -0.2};

// The step that a checkpoint continues from.
static long long checkpoint_step(const char *path, const char *scene)
{
    Process daemon;
    run_daemon_well(&daemon, "--offline 0 --resume %s %s", path, scene);
    return printed(&daemon, "step");
}

TEST(offline_runs_are_the_same_every_time)
{
    const char *scene = write_scene("same.cfg", HEAD, LOADS);
    char first[32], second[32];
    run_daemon(&pliantd, "--offline 1 %s", scene);
    printed_state(&pliantd, first);
    run_daemon(&pliantd, "--offline 1 %s", scene);
    printed_state(&pliantd, second);
    assert_string_equal(first, second);
    run_daemon(&pliantd, "--offline 1.001 %s", scene);
    printed_state(&pliantd, second);
    assert_string_not_equal(first, second); // the hash sees a single tick
}

// --- What holds of bodies of all kinds ---

#define LEVELS_BODY                                                                                \
    "levels = 3; adapt = { check_hz = 100.0; };\n"                                                 \
    "shape = { angular_frequency = 50.0; damping_ratio = 0.3; };\n" LOWER_FIXED
#define PUSH(center, force, start, duration)                                                       \
    "loads = ( { center = " center "; radius = 0.03; force = " force ";\n"                         \
    "  start = " start "; duration = " duration "; } );"
#define PUSH_TOP PUSH("[0.0, 0.0, 0.05]", "[0.1, 0.0, -0.4]", "0.05", "0.4")

// Runs of `seconds`, interrupted at `at`.
typedef struct Case {
    const char *name;
    double seconds, at;
    SceneParts parts;
} Case;

static const Case CASES[] = {
    {"a surface", 1.0, 0.4, {.head = HEAD, .tail = LOADS}},
    {"levels",
     1.0,
     0.3,
     {.head = "precision = \"single\";", .body = LEVELS_BODY, .tail = PUSH_TOP}},
    {"levels in double",
     1.0,
     0.3,
     {.head = "precision = \"double\";", .body = LEVELS_BODY, .tail = PUSH_TOP}},
    {"a stiff surface",
     0.2,
     0.07,
     {.source = "model = \"surface\"; integrator = \"auto\";\n"
                "mesh = { generator = \"sphere\"; nodes = 114; radius = 0.05; };",
      .material = "spring_stiffness = 1.0e8; node_mass = 1.0e-6;",
      .body = "shape = { angular_frequency = 50.0; damping_ratio = 0.3; };\n" LOWER_FIXED,
      .tail = PUSH("[0.0, 0.0, 0.05]", "[0.001, 0.0, -0.004]", "0.02", "0.1")}},
#if WITH_VOXEL
#define SOLID(name, precision, generated, keys)                                                    \
    {                                                                                              \
        name, 0.4, 0.15,                                                                           \
        {                                                                                          \
            .head = "precision = \"" precision "\";",                                              \
            .source = "model = \"voxel\"; voxels = { generator = \"" generated                     \
                      "\"; radius = 0.025; size = 0.003; };",                                      \
            .material = "youngs_modulus = 1.0e4; density = 1000.0;", .body = "levels = 2; " keys,  \
            .tail = PUSH("[0.025, 0.0, 0.0]", "[-0.01, 0.005, 0.0]", "0.05", "0.2")                \
        }                                                                                          \
    }
    SOLID("a graded ball", "single", "ball", ""),
    SOLID("a graded ball in double", "double", "ball", "integrator = \"leapfrog\";"),
    SOLID("the paper's plane disc", "single", "disc", "law = \"miyazaki2004\";"),
    SOLID("the paper's plane disc in double", "double", "disc", "law = \"miyazaki2004\";"),
#endif
};

static void expect_state(const char *name, const Process *daemon, const char *whole)
{
    char state[32];
    if (daemon->code != 0)
        fail_msg("%s: %s", name, daemon->err);
    printed_state(daemon, state);
    if (strcmp(state, whole) != 0)
        fail_msg("%s: state %s instead of %s", name, state, whole);
}

TEST(a_resumed_run_matches_the_uninterrupted_one)
{
    const char *part = scratch("part.h5");
    const bool all = PLIANT_EFFORT == 1; // else one precision of each
    for (size_t k = 0; k < sizeof CASES / sizeof *CASES; k += all ? 1 : 2) {
        const Case *c = &CASES[k];
        char whole[32], half[32];
        const char *scene = write_body_scene("resume.cfg", &c->parts);
        unlink(part); // of the case before: it may be of a later step
        run_daemon(&pliantd, "--offline %g %s", c->seconds, scene);
        if (pliantd.code != 0)
            fail_msg("%s: %s", c->name, pliantd.err);
        printed_state(&pliantd, whole);
        const long long step = printed(&pliantd, "step");
        if (all) {
            run_daemon(&pliantd, "--offline %g --isa baseline %s", c->seconds, scene);
            expect_state(c->name, &pliantd, whole); // on every processor
        }
        run_daemon(&pliantd, "--offline %g --checkpoint %s %s", c->at, part, scene);
        printed_state(&pliantd, half);
        assert_string_not_equal(half, whole);
        run_daemon(&pliantd, "--offline %g --resume %s %s", c->seconds - c->at, part, scene);
        expect_state(c->name, &pliantd, whole);
        assert_int_equal(printed(&pliantd, "step"), step);
    }
}

TEST(a_checkpoint_reply_comes_when_the_file_is_whole)
{
    const char *scene = write_scene("command.cfg", HEAD, LOADS);
    const char *path = scratch("command.h5");
    SCOPED_CLIENT Client *client = server_start(&pliantd, "--checkpoint %s %s", path, scene);
    assert_false(file_exists(path));
    const Reply *reply = command(client, PLIANT_COMMAND_T_CHECKPOINT, 0, "");
    assert_true(reply->ok);
    assert_int_equal(checkpoint_step(path, scene), reply->step);
    wait_until(client, saw_event(client, "checkpoint"));

    // SIGUSR1 writes another one, the end a last one.
    int64_t before = checkpoint_step(path, scene);
    client->events = 0;
    process_signal(&pliantd, SIGUSR1);
    wait_until(client, saw_event(client, "checkpoint"));
    expect_at_least((double)checkpoint_step(path, scene), (double)before + 1.0);
    process_end(&pliantd);
    assert_int_equal(printed(&pliantd, "checkpoints"), 3);
    assert_int_equal(checkpoint_step(path, scene), printed(&pliantd, "step"));
}

TEST(checkpoints_come_every_so_often)
{
    run_daemon_well(&pliantd, "--duration 1 --checkpoint-every 0.2 --checkpoint %s %s",
                    scratch("every.h5"), write_scene("every.cfg", HEAD, ""));
    // At 0.2, 0.4, 0.6, 0.8 s and the end, one more if no tick was late; fewer on a slow disk.
    expect_at_least((double)printed(&pliantd, "checkpoints"), 2.0);
    expect_at_most((double)printed(&pliantd, "checkpoints"), 6.0);
}

TEST(a_checkpoint_that_cannot_be_written_exits_1)
{
    run_daemon(&pliantd, "--offline 0.1 --checkpoint %s %s", scratch("no/folder.h5"),
               write_scene("folder.cfg", HEAD, ""));
    expect_ended(&pliantd, 1, "folder.h5");
    run_daemon(&pliantd, "--duration 0.1 --checkpoint %s %s", scratch("no/folder.h5"),
               scratch("folder.cfg"));
    assert_int_equal(pliantd.code, 1);
}

// A live run of a body whose top is at z = `top`, with everything that can be sent. `set`: more
// parameters, each of which is set once. Returns with the daemon ended.
typedef struct LiveCase {
    const char *name;
    SceneParts parts;
    double top;
    const char *set[2];
} LiveCase;

static void run_with_inputs(Process *daemon, const LiveCase *live, const char *log,
                            const char *checkpoint, const char *scene)
{
    SCOPED_CLIENT Client *client = client_create();
    server_start_for(client, daemon, "--log-inputs %s --checkpoint %s %s", log, checkpoint, scene);
    for (int i = 0; i < 200; i++) {
        double position[3] = {1e-5 * i, -2e-5 * i, live->top + 0.005 - 3e-5 * i};
        const double top[3] = {0.0, 0.0, live->top};
        pliant_tool_pose_t pose = make_pose(client, position);
        pose.orientation[0] = 0.99999; // not quite unit: normalised the same way again
        pose.twist_valid = i % 3 == 0;
        pose.twist[2] = -0.01;
        send_pose(client, &pose);
        client_listen(client, 2);
        if (i == 50)
            send_load(client, top, 0.03, DOWN, 0.1, "");
        if (i == 80)
            command(client, PLIANT_COMMAND_T_SET, 0, "gravity_x=1.1");
        if ((i == 90 || i == 95) && live->set[i == 95] != NULL)
            assert_true(command(client, PLIANT_COMMAND_T_SET, 0, live->set[i == 95])->ok);
        if (i == 100)
            command(client, PLIANT_COMMAND_T_STEP, 5, "");
        if (i == 120)
            command(client, PLIANT_COMMAND_T_RESUME, 0, "");
        if (i == 140)
            command(client, PLIANT_COMMAND_T_PAUSE, 0, "");
        if (i == 145)
            command(client, PLIANT_COMMAND_T_RESET, 0, "");
        if (i == 150)
            command(client, PLIANT_COMMAND_T_RESUME, 0, "");
    }
    command(client, PLIANT_COMMAND_T_STOP, 0, "");
    process_wait(daemon);
    if (daemon->code != 0)
        fail_msg("%s: %s", live->name, daemon->err);
}

// The last one is used again by the tests below.
static const LiveCase LIVE_CASES[] = {
    {"levels",
     {.head = HEAD, .body = LEVELS_BODY, .tail = PROBE_TOOL},
     0.045,
     {"adapt_level=1", "sphere.adapt_scale=0.5"}},
#if WITH_VOXEL
    {"a block",
     {.head = HEAD,
      .source = "model = \"voxel\"; voxels = { generator = \"box\"; count = 8; size = 0.00625; };",
      .material = "youngs_modulus = 1.0e4; density = 1000.0;",
      .body = "levels = 0; " FIXED_BELOW(-0.0249),
      .tail = PROBE_TOOL},
     0.025,
     {NULL}},
#endif
    {"a surface", {.head = HEAD, .tail = PROBE_TOOL}, 0.05, {NULL}},
};

TEST(an_input_log_repeats_the_live_run_bit_for_bit)
{
    const char *log = scratch("inputs.log"), *checkpoint = scratch("live.h5");
    for (size_t k = 0; k < sizeof LIVE_CASES / sizeof *LIVE_CASES; k++) {
        const LiveCase *c = &LIVE_CASES[k];
        char live[32];
        const char *scene = write_body_scene("log.cfg", &c->parts);
        unlink(log);
        unlink(checkpoint);
        run_with_inputs(&pliantd, c, log, checkpoint, scene);
        printed_state(&pliantd, live);
        long long step = printed(&pliantd, "step");

        run_daemon(&pliantd, "--offline 1000 --input %s %s", log, scene);
        expect_state(c->name, &pliantd, live);
        assert_int_equal(printed(&pliantd, "step"), step); // the log knows where the run ended
        expect_in(pliantd.out, "rejected 0");

        // The live run's last checkpoint holds the same state.
        run_daemon(&pliantd, "--offline 0 --resume %s %s", checkpoint, scene);
        expect_state(c->name, &pliantd, live);
    }
}

TEST(a_log_of_another_rate_or_time_is_refused)
{
    const char *scene = write_scene("log.cfg", HEAD, PROBE_TOOL);
    run_daemon(&pliantd, "--offline 1 --rate 500 --input %s %s", scratch("inputs.log"), scene);
    expect_ended(&pliantd, 2, "rate_hz 1000");
    // A run that went on after the log had ended.
    run_daemon_well(&pliantd, "--offline 0.1 --resume %s --checkpoint %s %s", scratch("live.h5"),
                    scratch("later.h5"), scene);
    run_daemon(&pliantd, "--offline 1 --resume %s --input %s %s", scratch("later.h5"),
               scratch("inputs.log"), scene);
    expect_ended(&pliantd, 2, "inputs.log: ends at step ");
}

TEST(a_cut_off_log_is_used_as_far_as_it_goes)
{
    const char *scene = write_scene("log.cfg", HEAD, PROBE_TOOL);
    size_t size;
    FREED unsigned char *bytes = file_read(scratch("inputs.log"), &size);
    assert_true(size >= 3000);
    file_write(scratch("short.log"), bytes, 3000);
    run_daemon_well(&pliantd, "--offline 0.5 --input %s %s", scratch("short.log"), scene);
    expect_in(pliantd.err, "cut off after");
    assert_int_equal(printed(&pliantd, "ticks"), 500);
}

static void write_log_event(lcm_eventlog_t *log, const char *channel, int64_t utime,
                            const void *data, int size)
{
    char name[64];
    snprintf(name, sizeof name, "%s", channel);
    lcm_eventlog_event_t event = {.timestamp = utime,
                                  .channellen = (int32_t)strlen(name),
                                  .datalen = size,
                                  .channel = name,
                                  .data = (void *)(uintptr_t)data};
    assert_int_equal(lcm_eventlog_write_event(log, &event), 0);
}

// Whole, as a killed writer leaves it, and of lcm-logger.
TEST(a_log_without_a_duration_is_applied_to_its_end)
{
    const char *scene = write_scene("log.cfg", HEAD, PROBE_TOOL);
    char whole[32], to_end[32];
    run_daemon(&pliantd, "--offline 1000 --input %s %s", scratch("inputs.log"), scene);
    printed_state(&pliantd, whole);
    run_daemon_well(&pliantd, "--input %s %s", scratch("inputs.log"), scene);
    expect_in(pliantd.out, "log: all of it");
    printed_state(&pliantd, to_end);
    assert_string_equal(to_end, whole);

    run_daemon_well(&pliantd, "--input %s %s", scratch("short.log"), scene);
    expect_in(pliantd.err, "cut off after");
    expect_in(pliantd.out, "log: all of it");
    expect_at_least((double)printed(&pliantd, "ticks"), 1.0);
    expect_at_most((double)printed(&pliantd, "ticks"), (double)printed(&pliantd, "step"));

    const char *plain = scratch("plain-end.log");
    lcm_eventlog_t *log = lcm_eventlog_create(plain, "w");
    write_log_event(log, "OTHER", 1000000, "x", 1);
    write_log_event(log, "OTHER", 1250000, "x", 1); // a quarter of a second later
    lcm_eventlog_destroy(log);
    run_daemon_well(&pliantd, "--input %s %s", plain, scene);
    assert_int_equal(printed(&pliantd, "step"), 251);
    assert_null(strstr(pliantd.err, "its clock"));
    // One whose logger stood still, and whose clock was then set back.
    log = lcm_eventlog_create(scratch("gaps.log"), "w");
    static const int64_t times[] = {1000000, 1500000, 5500000, 4500000};
    for (size_t i = 0; i < sizeof times / sizeof *times; i++)
        write_log_event(log, "OTHER", times[i], "x", 1);
    lcm_eventlog_destroy(log);
    run_daemon_well(&pliantd, "--input %s %s", scratch("gaps.log"), scene);
    expect_in(pliantd.err, "its clock has 2 gaps or steps, the first of 4.0 s after 0.5 s");
    // A time that is given ends it before.
    run_daemon(&pliantd, "--offline 0.1 --input %s %s", plain, scene);
    assert_int_equal(printed(&pliantd, "step"), 100);
}

TEST(a_plain_log_is_applied_at_its_times)
{
    // As lcm-logger writes: its own test first, other channels between, any epoch.
    const char *scene = write_scene("plain.cfg", "", PROBE_TOOL), *path = scratch("plain.log");
    lcm_eventlog_t *log = lcm_eventlog_create(path, "w");
    assert_non_null(log);
    char name[] = "sphere";
    unsigned char data[512];
    const int64_t epoch = INT64_C(1700000000000000);
    write_log_event(log, "LCM_SELF_TEST", epoch - 5000000, "x", 1);
    write_log_event(log, "CAMERA", epoch, "image", 5);
    pliant_load_t load = {.sender = 1,
                          .id = 1,
                          .center = {0.0, 0.0, 0.05},
                          .radius = 0.03,
                          .force = {0.0, 0.0, -0.2},
                          .duration = 0.1,
                          .body = name};
    int size = pliant_load_t_encode(data, 0, sizeof data, &load);
    write_log_event(log, "PLIANT_LOAD", epoch + 299500, data, size);
    write_log_event(log, "PLIANT_LOAD", epoch + 300500, data, size); // a repeat
    load.id = 2;
    load.radius = (double)NAN;
    size = pliant_load_t_encode(data, 0, sizeof data, &load);
    write_log_event(log, "PLIANT_LOAD", epoch + 300500, data, size);
    lcm_eventlog_destroy(log);

    // Nothing moves up to 0.3 s; the load is in force from the tick that begins there.
    Process before, after;
    run_daemon(&before, "--offline 0.299 --input %s %s", path, scene);
    run_daemon(&after, "--offline 0.301 --checkpoint %s --input %s %s", scratch("plain.h5"), path,
               scene);
    assert_int_equal(before.code, 0);
    assert_int_equal(after.code, 0);
    expect_in(before.out, "applied 0, rejected 0");
    expect_in(after.out, "applied 1, rejected 1");
}
