// SPDX-License-Identifier: MIT
// Runs that go on inside their log of inputs: from a checkpoint before and after a reset, and from
// one that was taken in a pause, when part of the inputs of its tick were applied already.
#include "test.h"
#include "session.h"

#include "lcm_client.h"
#include "effort.h"

enum { TICKS = 250, HASH_TEXT = 32 };

static void run_to_end(const char *arguments, const char *log, const char *config,
                       char state[HASH_TEXT])
{
    run_daemon_well(&pliantd, "--offline 1000 %s --input %s %s", arguments, log, config);
    printed_state(&pliantd, state);
}

TEST(a_run_goes_on_inside_its_log)
{
    static const double at_s[] = {0.06, 0.16}; // of 0.25 s; most sessions reset in between
    char arguments[PATH_TEXT * 3];
    const char *log = scratch("resume.log");
    const char *part = scratch("part.h5");
    snprintf(arguments, sizeof arguments, "--resume %s", part);
    for (int s = 0; s < EFFORT(SESSION_SCENES); s++) {
        const SessionScene *scene = &session_scenes[s];
        const char *config = session_scene(scene, "single", 1);
        Session session = session_create(scene, 100, TICKS); // with a reset at tick 132
        session_write_log(&session, scene, log);
        session_destroy(&session);
        char whole[HASH_TEXT], resumed[HASH_TEXT];
        run_to_end("", log, config, whole);
        for (int k = 0; k < 2; k++) {
            unlink(part);
            run_daemon_well(&pliantd, "--offline %g --checkpoint %s --input %s %s", at_s[k], part,
                            log, config);
            run_to_end(arguments, log, config, resumed);
            assert_string_equal(resumed, whole);
        }
    }
}

static void push(Client *client, double z)
{
    const double center[3] = {0.0, 0.0, 0.05}, force[3] = {0.0, 0.05, z};
    assert_true(apply_load(client, center, 0.03, force, 0.2, "ball")->ok);
}

// Starts a server on a checkpoint or none, loads in a pause before a checkpoint and behind it,
// lets it go on, and kills it.
static void kill_after_pause(const char *config, const char *from, const char *kept,
                             const char *log)
{
    unlink(log);
    SCOPED_CLIENT Client *client =
        server_start(&pliantd, "--log-inputs %s --checkpoint %s %s %s %s", log, kept,
                     from != NULL ? "--resume" : "", from != NULL ? from : "", config);
    command(client, PLIANT_COMMAND_T_STEP, 30, "");
    command(client, PLIANT_COMMAND_T_PAUSE, 0, "");
    push(client, -0.1);
    push(client, 0.07);
    assert_true(command(client, PLIANT_COMMAND_T_CHECKPOINT, 0, "")->ok);
    push(client, -0.05);
    command(client, PLIANT_COMMAND_T_STEP, 40, "");
    process_finish(&pliantd, SIGKILL);
}

static void expect_same(const char *first, const char *second, const char *log, const char *config,
                        double first_s, double second_s)
{
    char one[HASH_TEXT], other[HASH_TEXT];
    run_daemon_well(&pliantd, "--offline %g %s --input %s %s", first_s, first, log, config);
    printed_state(&pliantd, one);
    long long step = printed(&pliantd, "step");
    run_daemon_well(&pliantd, "--offline %g %s --input %s %s", second_s, second, log, config);
    assert_int_equal(printed(&pliantd, "step"), step);
    printed_state(&pliantd, other);
    assert_string_equal(other, one);
}

TEST(inputs_of_a_pause_are_applied_once)
{
    char from_first[PATH_TEXT * 3], from_second[PATH_TEXT * 3];
    const char *config = session_scene(&session_scenes[0], "single", 1);
    const char *first = scratch("first.h5");
    const char *second = scratch("second.h5");
    const char *log = scratch("pause.log");
    snprintf(from_first, sizeof from_first, "--resume %s", first);
    snprintf(from_second, sizeof from_second, "--resume %s", second);
    kill_after_pause(config, NULL, first, log);
    double begin_s = (double)kept_step(first, config) / SESSION_RATE;
    expect_same("", from_first, log, config, begin_s + 0.05, 0.05);
    // A second log begins where the first checkpoint was: in a pause, behind its inputs.
    kill_after_pause(config, first, second, log);
    double end_s = (double)kept_step(second, config) / SESSION_RATE;
    expect_same(from_first, from_second, log, config, end_s - begin_s + 0.05, 0.05);
}
