// SPDX-License-Identifier: MIT
// Successive runs of one service: what one of them keeps, the next one goes on from or leaves
// alone, whatever ended it. With the command line of the test_argument(2) of systemd, argv[2].
#include "test.h"
#include "recording_view.h"
#include "session.h"

#include "lcm_client.h"
#include "scene_writer.h"
#include "effort.h"
#include "random.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>

enum { RUNS = 20 };

static const char HEAD[] = "publish = { nodes_hz = 100.0; status_hz = 20.0; };\n"
                           "settle_s = 0.0;\n";

static bool holds_something(const char *path)
{
    struct stat facts;
    return stat(path, &facts) == 0 && facts.st_size > 0;
}

// The test_argument(2)'s options with these in place of $PLIANTD_OPTIONS, and the scene.
static void unit_arguments(const char *options, const char *scene, char *arguments, size_t size)
{
    char line[1024];
    FREED char *text = file_text(test_argument(2));
    const char *begin = strstr(text, "\nExecStart=");
    assert_non_null(begin);
    begin = strchr(begin, ' ') + 1; // behind the program
    snprintf(line, sizeof line, "%.*s", (int)strcspn(begin, "\n"), begin);
    char *at = strstr(line, "$PLIANTD_OPTIONS");
    char *scene_at = strstr(line, "@SYSCONFDIR@/pliant/%i.cfg");
    assert_true(at != NULL && scene_at != NULL && at < scene_at);
    *at = '\0';
    snprintf(arguments, size, "%s%s %s", line, options, scene);
}

// The name of run `number`, 1 for the first.
static const char *numbered(const char *stem, const char *extension, int number)
{
    char name[128];
    if (number == 1)
        snprintf(name, sizeof name, "%s%s", stem, extension);
    else
        snprintf(name, sizeof name, "%s-%d%s", stem, number, extension);
    return scratch(name);
}

// The log of a run begins where the run did, and leads on from there.
static void expect_log_readable(const char *log, const char *base, const char *scene)
{
    Process daemon;
    run_daemon(&daemon, "--offline 0.01 --input %s %s %s %s", log, base != NULL ? "--resume" : "",
               base != NULL ? base : "", scene);
    if (daemon.code != 0)
        fail_msg("%s: %s", log, daemon.err);
}

static void expect_recording_readable(const char *path)
{
    SCOPED(view_free) BodyView view = {0};
    SCOPED(view_close) hid_t file = view_open(path, true);
    assert_true(file >= 0);
    view_body(&view, file, "sphere");
}

static void pause_ms(double ms)
{
    const struct timespec pause = {.tv_nsec = (long)(ms * 1e6)};
    nanosleep(&pause, NULL);
}

// What a daemon that is no more had sent.
static void drain(Client *client)
{
    for (double until = client_now() + 0.05; client_now() < until;)
        client_listen(client, 5);
}

TEST(a_service_killed_twenty_times_loses_nothing_since_its_checkpoint)
{
    uint64_t chance = 7;
    char options[2048], arguments[4096];
    const char *scene = write_scene("service.cfg", HEAD, PROBE_TOOL);
    const char *kept = scratch("last.h5");
    const char *base = scratch("base.h5");
    snprintf(options, sizeof options,
             "--checkpoint %s --checkpoint-every 0.02 --log-inputs %s --record %s", kept,
             scratch("inputs.log"), scratch("run.h5"));
    unit_arguments(options, scene, arguments, sizeof arguments);
    SCOPED_CLIENT Client *client = client_create();
    for (int number = 1; number <= RUNS; number++) {
        long long before = kept_step(kept, scene);
        if (before >= 0)
            file_copy(kept, base);
        client->events = client->status.count = 0;
        server_start_for(client, &pliantd, "%s", arguments);
        wait_until(client, saw_event(client, "checkpoint"));
        pause_ms(random_between(&chance, 0.0, 40.0)); // somewhere between two writes, or in one
        process_finish(&pliantd, SIGKILL);
        assert_int_equal(pliantd.code, 1000 + SIGKILL);
        drain(client);

        // It went on from what there was, and what there is now is later.
        char said[64];
        snprintf(said, sizeof said, before < 0 ? "from scratch" : "step %lld", before);
        if (strstr(pliantd.err, said) == NULL)
            fail_msg("run %d: no '%s' in: %s", number, said, pliantd.err);
        assert_true(kept_step(kept, scene) > before);
        expect_log_readable(numbered("inputs", ".log", number), before < 0 ? NULL : base, scene);
        expect_recording_readable(numbered("run", ".h5", number));
    }
    assert_false(holds_something(numbered("run", ".h5", RUNS + 1)));
}

TEST(a_second_daemon_leaves_the_log_of_the_first_alone)
{
    char holder[64];
    const char *scene = write_scene("two.cfg", HEAD, PROBE_TOOL);
    const char *log = scratch("live.log");
    Process first, second;
    SCOPED_CLIENT Client *client = server_start(&first, "--log-inputs %s %s", log, scene);
    assert_true(command(client, PLIANT_COMMAND_T_SET, 0, "gravity_x=1.1")->ok);
    step_daemon(client, 5);
    wait_until(client, holds_something(log));

    // Under the same prefix it does not get as far as the log.
    run_daemon(&second, "--log-inputs %s %s", log, scene);
    expect_ended(&second, 1, "another daemon");
    // Under its own it hears who is writing there.
    run_daemon(&second, "--prefix OTHER --log-inputs %s %s", log, scene);
    assert_int_equal(second.code, 2);
    snprintf(holder, sizeof holder, "process %ld is writing its log there", (long)first.pid);
    expect_in(second.err, holder);

    server_stop(client, &first);
    char live[32], again[32];
    printed_state(&first, live);
    Process repeated;
    run_daemon_well(&repeated, "--offline 100 --input %s %s", log, scene);
    printed_state(&repeated, again);
    assert_string_equal(again, live);

    // Once no process writes it, it still belongs to its run.
    run_daemon(&second, "--duration 0.1 --log-inputs %s %s", log, scene);
    expect_ended(&second, 2, "exists already");
    run_daemon_well(&second, "--duration 0.1 --log-inputs /dev/null %s", scene);
}

// What is written into a file without a name, or behind an end that was moved, is lost: the run
// goes on, says so once, and ends with status 1.
TEST(a_log_that_another_program_removes_or_truncates_is_missed)
{
    const char *scene = write_scene("missed.cfg", HEAD, PROBE_TOOL), *log = scratch("missed.log");
    for (int removed = 0; removed < 2; removed++) {
        unlink(log);
        SCOPED_CLIENT Client *client = server_start(&pliantd, "--log-inputs %s %s", log, scene);
        assert_true(command(client, PLIANT_COMMAND_T_SET, 0, "gravity_x=1.1")->ok);
        wait_until(client, holds_something(log));
        assert_int_equal(removed ? unlink(log) : truncate(log, 0), 0);
        assert_true(command(client, PLIANT_COMMAND_T_SET, 0, "gravity_x=1.2")->ok);
        wait_until(client, saw_event(client, "inputs"));
        assert_true(command(client, PLIANT_COMMAND_T_STOP, 0, "")->ok);
        process_wait_for(&pliantd, 1);
        expect_in(pliantd.err,
                  removed ? "missed.log: could not write every input: the file was removed"
                          : "missed.log: could not write every input: the file was truncated");
    }
}

TEST(a_later_checkpoint_is_not_replaced)
{
    const char *kept = scratch("later.h5"), *scene = write_scene("later.cfg", HEAD, "");
    run_daemon_well(&pliantd, "--offline 0.2 --checkpoint %s %s", kept, scene);
    run_daemon(&pliantd, "--offline 0.1 --checkpoint %s %s", kept, scene);
    expect_ended(&pliantd, 2, "later.h5: holds step 200");
    run_daemon(&pliantd, "--duration 0.1 --checkpoint %s %s", kept, scene);
    assert_int_equal(pliantd.code, 2);
    assert_int_equal(kept_step(kept, scene), 200);
    run_daemon_well(&pliantd, "--offline 0.1 --continue --checkpoint %s %s", kept, scene);
    assert_int_equal(kept_step(kept, scene), 300);
}

TEST(a_damaged_checkpoint_is_neither_dropped_nor_replaced)
{
    const char *kept = scratch("damaged.h5"), *copy = scratch("copy.h5");
    const char *scene = write_scene("damaged.cfg", HEAD, "");
    run_daemon_well(&pliantd, "--offline 0.2 --checkpoint %s %s", kept, scene);
    FILE *file = fopen(kept, "r+b");
    assert_non_null(file);
    fseek(file, 2000, SEEK_SET);
    fputs("damage", file);
    fclose(file);
    file_copy(kept, copy);
    run_daemon(&pliantd, "--offline 0.1 --continue --checkpoint %s %s", kept, scene);
    expect_ended(&pliantd, 2, "differs from its seal");
    run_daemon(&pliantd, "--offline 0.1 --checkpoint %s %s", kept, scene);
    expect_ended(&pliantd, 2, "it is not replaced");
    run_daemon(&pliantd, "--offline 0.1 --resume %s %s", copy, scene); // the bytes are as they were
    expect_ended(&pliantd, 2, "differs from its seal");
}

// Exit 1 is tried again by the service manager; 2 would leave the service down.
TEST(a_checkpoint_that_another_program_has_locked_is_no_damage)
{
    const char *kept = scratch("locked.h5"), *scene = write_scene("locked.cfg", HEAD, "");
    run_daemon_well(&pliantd, "--offline 0.1 --checkpoint %s %s", kept, scene);
    const int fd = open(kept, O_RDWR | O_CLOEXEC);
    assert_int_equal(flock(fd, LOCK_EX), 0);
    run_daemon(&pliantd, "--offline 0.1 --continue --checkpoint %s %s", kept, scene);
    expect_ended(&pliantd, 1, "another program is writing it");
    run_daemon(&pliantd, "--offline 0.2 --checkpoint %s %s", kept, scene);
    expect_ended(&pliantd, 1,
                 "another program is writing it (wait for its end): it is not replaced");
    close(fd);
    run_daemon_well(&pliantd, "--offline 0.1 --continue --checkpoint %s %s", kept, scene);
}

// A service manager does not retry exit 2: one bad file must not keep a service down.
TEST(a_run_goes_on_from_the_checkpoint_before_one_that_is_damaged)
{
    const char *scene = write_scene("before.cfg", HEAD, "");
    char file[256], former[256], refused[256];
    snprintf(file, sizeof file, "%s", scratch("before.h5"));
    snprintf(former, sizeof former, "%s", scratch("before.h5.1"));
    snprintf(refused, sizeof refused, "%s", scratch("before.h5.refused"));
    for (int run = 0; run < 2; run++)
        run_daemon_well(&pliantd, "--offline 0.1 --continue --checkpoint %s %s", file, scene);
    assert_int_equal(kept_step(former, scene), 100);
    assert_int_equal(kept_step(file, scene), 200);
    assert_int_equal(truncate(file, 3000), 0);
    run_daemon_well(&pliantd, "--offline 0.1 --continue --checkpoint %s %s", file, scene);
    expect_in(pliantd.err,
              "before.h5.refused now, and the run goes on from the checkpoint before it");
    assert_int_equal(printed(&pliantd, "step"), 200);
    assert_int_equal(kept_step(file, scene), 200);
    assert_true(holds_something(refused));
    // Without one before it, it is refused as ever, and left alone.
    assert_int_equal(unlink(former), 0);
    assert_int_equal(truncate(file, 3000), 0);
    run_daemon(&pliantd, "--offline 0.1 --continue --checkpoint %s %s", file, scene);
    expect_ended(&pliantd, 2, "truncated");
    assert_true(holds_something(file));
}

TEST(a_run_may_begin_from_a_checkpoint_and_then_go_on_from_its_own)
{
    char arguments[4096];
    const char *scene = write_scene("begin.cfg", HEAD, "");
    const char *base = scratch("begin.h5");
    run_daemon_well(&pliantd, "--offline 0.1 --checkpoint %s %s", base, scene);
    snprintf(arguments, sizeof arguments, "--offline 0.1 --continue --resume %s --checkpoint %s %s",
             base, scratch("own.h5"), scene);
    for (int run = 1; run <= 3; run++) {
        run_daemon_well(&pliantd, "%s", arguments);
        assert_int_equal(printed(&pliantd, "step"), 100 + 100 * run);
    }
}

// Nothing has been begun while a scene is loaded, so a signal ends it there and then: one that
// settles for an hour, one of 2.7 million cells that takes two seconds here.
TEST(a_signal_ends_a_scene_that_loads)
{
    static const char *const name[] = {"settles.cfg", "fills.cfg"};
    static const int number[] = {SIGTERM, SIGINT};
    write_scene(name[0], "settle_s = 3600.0;", "");
    write_text(scratch(name[1]), "bodies = ( { name = \"block\"; model = \"voxel\"; voxels = { "
                                 "generator = \"box\"; size = 0.001; "
                                 "count = [150, 150, 120]; }; } );");
    for (int i = 0; i < 2; i++) {
        daemon_start(&pliantd, "%s", scratch(name[i]));
        pause_ms(300.0); // it is loading by then
        process_signal(&pliantd, number[i]);
        double begin = client_now();
        process_wait(&pliantd);
        print_message("%s: ended after %.3f s\n", name[i], client_now() - begin);
        if (pliantd.code != 1000 + number[i])
            fail_msg("exit %d: %s", pliantd.code, pliantd.err);
        expect_in(pliantd.err, "before it had loaded");
    }
}
