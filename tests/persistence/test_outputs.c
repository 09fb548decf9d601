// SPDX-License-Identifier: MIT
// No program replaces what is not its own, or writes through a link at a temporary's name.
#include "test.h"
#include "session.h"

#include "lcm_client.h"
#include "scene_writer.h"

#include <errno.h>
#include <sys/stat.h>

static const char PRECIOUS[] = "solid organ\n  facet normal 0 0 1\n";
static const char *prepare, *record, *monitor, *probe, *study;

static void expect_precious(const char *path)
{
    FREED char *text = file_text(path);
    if (strcmp(text, PRECIOUS) != 0)
        fail_msg("%s was replaced by: %.40s", path, text);
}

typedef struct Writer {
    const char *const *program; // NULL: the daemon
    const char *arguments;      // with %s for the file and %s for the scene, in this order
} Writer;

static const Writer writers[] = {
    {NULL, "--offline 0.05 --checkpoint %s %s"},
    {NULL, "--duration 0.05 --checkpoint %s %s"},
    {NULL, "--offline 0.05 --record %s %s"},
    {NULL, "--duration 0.05 --record %s %s"},
    {NULL, "--duration 0.05 --log-inputs %s %s"},
    {&prepare, "-o %s %s"},
    {&record, "-o %s --wait 0.1"},
    {&record, "--overwrite -o %s --wait 0.1"},
    {&monitor, "--duration 0.1 --nodes sphere --write %s"},
    {&monitor, "--duration 0.1 --nodes sphere --shape %s"},
    {&monitor, "--duration 0.1 --nodes sphere --peak %s"},
    {&probe, "--press 0,0,0.06 --log %s"},
};
enum { WRITERS = sizeof writers / sizeof writers[0] };

static void run_writer(Process *daemon, const Writer *writer, const char *path, const char *scene)
{
    char line[4096], format[256];
    // A client has no scene: its line ends behind the file.
    snprintf(format, sizeof format, "%s%s", writer->arguments,
             strstr(writer->arguments, "%s %s") != NULL ? "" : "%.0s");
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
    snprintf(line, sizeof line, format, path, scene);
#pragma GCC diagnostic pop
    process_run(daemon, writer->program != NULL ? *writer->program : NULL, "%s", line);
}

static int find_programs(void **state)
{
    (void)state;
    prepare = program_path("pliant-prepare");
    record = program_path("pliant-record");
    monitor = program_path("pliant-monitor");
    probe = program_path("pliant-probe");
    study = program_path("pliant-study");
    return 0;
}

AROUND_ALL(find_programs, NULL)

TEST(a_file_of_another_kind_is_refused_by_every_writer)
{
    const char *scene = write_scene("foreign.cfg", "", PROBE_TOOL);
    const char *path = scratch("organ.stl");
    write_text(path, PRECIOUS);
    for (int i = 0; i < WRITERS; i++) {
        run_writer(&pliantd, &writers[i], path, scene);
        if (pliantd.code != 1 && pliantd.code != 2)
            fail_msg("%s: exit %d", writers[i].arguments, pliantd.code);
        if (strstr(pliantd.err, "organ.stl: ") == NULL)
            fail_msg("%s: %s", writers[i].arguments, pliantd.err);
        expect_precious(path);
    }
}

// A sealed file of another format is not its own either.
TEST(a_prepared_file_is_no_checkpoint_and_no_checkpoint_one)
{
    const char *scene = write_scene("formats.cfg", "", "");
    const char *kept = scratch("kept.h5");
    const char *made = scratch("made.h5");
    const Writer checkpoint = {NULL, "--offline 0.01 --checkpoint %s %s"};
    const Writer model = {&prepare, "-o %s %s"};
    for (int again = 0; again < 2; again++) { // each over its own
        run_writer(&pliantd, &model, made, scene);
        assert_int_equal(pliantd.code, 0);
        run_writer(&pliantd, &checkpoint, kept, scene);
        assert_int_equal(pliantd.code, again ? 2 : 0); // the same step again, from the start
    }
    run_writer(&pliantd, &checkpoint, made, scene);
    expect_ended(&pliantd, 2, "made.h5: / format \"pliant-prepared\" is not");
    run_writer(&pliantd, &model, kept, scene);
    expect_ended(&pliantd, 2, "kept.h5: / format \"pliant-checkpoint\" is not");
    run_daemon_well(&pliantd, "--offline 0 --resume %s --prepared %s %s", kept, made, scene);
}

// Before its first checkpoint, between two and after `kill -9`; it stands still, so that no step of
// the others would be an earlier one.
TEST(a_checkpoint_that_a_live_daemon_keeps_is_its_own)
{
    static const char *const second[] = {
        "--prefix OTHER --checkpoint %s %s",
        "--prefix OTHER --continue --checkpoint %s %s",
        "--offline 0.5 --checkpoint %s %s",
    };
    char scene[PATH_TEXT * 2], kept[PATH_TEXT * 2];
    snprintf(scene, sizeof scene, "%s", write_scene("kept.cfg", "start = \"paused\";", ""));
    snprintf(kept, sizeof kept, "%s", scratch("live.h5"));
    Process first, other;
    SCOPED_CLIENT Client *client = server_start(&first, "--checkpoint %s %s", kept, scene);
    for (int written = 0; written < 3; written++) {
        if (written > 0)
            assert_true(command(client, PLIANT_COMMAND_T_CHECKPOINT, 0, "")->ok);
        for (int i = 0; i < 3; i++) {
            const Writer writer = {NULL, second[i]};
            run_writer(&other, &writer, kept, scene);
            if (other.code != 2 || strstr(other.err, "live.h5: another program that runs") == NULL)
                fail_msg("%s: exit %d: %s", second[i], other.code, other.err);
        }
        if (written > 0)
            assert_int_equal(kept_step(kept, scene), 0);
        else
            assert_int_not_equal(access(kept, F_OK), 0);
    }
    process_finish(&first, SIGKILL);
    const Writer writer = {NULL, second[2]};
    run_writer(&other, &writer, kept, scene);
    expect_code(&other, 0);
}

// The temporary's name, or the sidecar's, is a link to something precious, or something else.
TEST(what_lies_at_a_temporarys_name_stays)
{
    static const Writer whole[] = {{NULL, "--offline 0.01 --checkpoint %s %s"},
                                   {&prepare, "-o %s %s"}};
    char temporary[PATH_TEXT * 3];
    const char *scene = write_scene("links.cfg", "", "");
    const char *path = scratch("linked.h5");
    snprintf(temporary, sizeof temporary, "%s.tmp", path);
    const char *victim = scratch("victim.txt");
    write_text(victim, PRECIOUS);
    for (int i = 0; i < 2; i++) {
        for (int kind = 0; kind < 5; kind++) {
            int made = kind == 0   ? symlink(victim, temporary)
                       : kind == 1 ? link(victim, temporary)
                       : kind == 2 ? mkdir(temporary, 0700)
                       : kind == 3 ? mkfifo(temporary, 0600)
                                   : symlink(scratch("nowhere"), temporary);
            assert_int_equal(made, 0);
            run_writer(&pliantd, &whole[i], path, scene);
            if (pliantd.code != 1 || strstr(pliantd.err, "linked.h5.tmp: is ") == NULL)
                fail_msg("kind %d: exit %d: %s", kind, pliantd.code, pliantd.err);
            expect_precious(victim);
            assert_int_not_equal(access(path, F_OK), 0);
            assert_int_not_equal(access(scratch("nowhere"), F_OK), 0);
            assert_int_equal(remove(temporary), 0);
        }
    }
    // The sidecar is written the same way.
    snprintf(temporary, sizeof temporary, "%s", scratch("r.h5.xdmf.tmp"));
    assert_int_equal(symlink(victim, temporary), 0);
    run_daemon(&pliantd, "--offline 0.01 --record %s %s", scratch("r.h5"), scene);
    assert_int_equal(pliantd.code, 2);
    expect_precious(victim);
}

TEST(what_is_no_file_is_refused_but_null_takes_everything)
{
    const Writer checkpoint = {NULL, "--offline 0.01 --checkpoint %s %s"};
    const Writer model = {&prepare, "-o %s %s"};
    const char *scene = write_scene("kinds.cfg", "", "");
    assert_int_equal(mkdir(scratch("folder"), 0700), 0);
    assert_int_equal(mkfifo(scratch("pipe"), 0600), 0);
    write_text(scratch("target"), "");
    assert_int_equal(symlink(scratch("target"), scratch("link")), 0);
    static const char *const name[] = {"folder", "pipe", "link"};
    for (int i = 0; i < 3; i++) {
        run_writer(&pliantd, &checkpoint, scratch(name[i]), scene);
        assert_int_equal(pliantd.code, 2);
        run_writer(&pliantd, &model, scratch(name[i]), scene);
        assert_int_equal(pliantd.code, 2);
    }
    struct stat null;
    run_writer(&pliantd, &checkpoint, "/dev/null", scene);
    assert_int_equal(pliantd.code, 0);
    run_writer(&pliantd, &model, "/dev/null", scene);
    assert_int_equal(pliantd.code, 0);
    assert_true(stat("/dev/null", &null) == 0 && S_ISCHR(null.st_mode));
}

// Its names are common ones: a folder in which they are somebody else's is left alone.
TEST(a_study_keeps_out_of_a_folder_that_is_not_its_own)
{
    char path[PATH_TEXT * 3];
    const char *scene = write_scene("study.cfg", "", "");
    const char *folder = scratch("results");
    assert_int_equal(mkdir(folder, 0700), 0);
    snprintf(path, sizeof path, "%s/time.png", folder);
    write_text(path, PRECIOUS);
    process_run(&pliantd, study, "--quick --only nothing-of-this-name --out %s %s", folder, scene);
    assert_int_equal(pliantd.code, 2);
    if (strstr(pliantd.err, "time.png: is not of a study") == NULL)
        fail_msg("%s", pliantd.err);
    expect_precious(path);
}
