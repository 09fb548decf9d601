// SPDX-License-Identifier: MIT
// The command line: what is refused, with which exit code, and that one line says why.
#include "test.h"
#include "scene_writer.h"

#define SMALL_BOX                                                                                  \
    "model = \"voxel\"; voxels = { generator = \"box\"; count = [8, 8, 8]; size = 0.0125; };"

// The small scene, of a model that is built in.
static const char *write_any(const char *file, const char *head, const char *tail)
{
    if (WITH_SURFACE)
        return write_scene(file, head, tail);
    return write_body_scene(
        file,
        &(SceneParts){.head = head, .source = SMALL_BOX, .material = "", .body = "", .tail = tail});
}

static void expect_only_refusal(const Process *daemon, int code, const char *text)
{
    expect_refusal(daemon, code, text);
    assert_string_equal(daemon->out, "");
}

TEST(bad_usage_exits_2_with_one_line)
{
    const char *scene = write_any("usage.cfg", "", "");
    const struct {
        const char *arguments, *needle;
        bool with_scene;
    } cases[] = {
        {"", "no scene", false},
        {"--no-such-option", "--no-such-option", true},
        {"--rate", "--rate", false},
        {"--rate fast", "fast", true},
        {"--rate nan", "nan", true},
        {"--rate 0.5", "0.5", true},
        {"--duration -1", "-1", true},
        {"--offline 1 --duration 1", "--duration", true},
        {"--offline soon", "soon", true},
        {"--input x.log --duration 1", "--duration", true},
        {"--input x.log --log-inputs y.log", "not --input", true},
        {"--offline 1 --log-inputs x.log", "--log-inputs", true},
        {"--checkpoint-every 1", "--checkpoint", true},
        {"--record-tools-hz 100", "--record", true},
        {"--record a.h5 --record-tools-hz 0", "--record-tools-hz", true},
        {"--record a.h5 --checkpoint a.h5", "a file of its own", true},
        {"--isa sse9", "sse9", true},
        {"--seed many", "many", true},
        {"--log-level loud", "loud", true},
        {"--prefix a.*b", "a.*b", true},
        {"second.cfg", "second.cfg", true},
        {"--lcm-url http://x", "http://x", true},
        {"--lcm-url udpm://127.0.0.1:7667", "127.0.0.1", true},
        {"--lcm-url file://a.log", "file://a.log", true},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        run_daemon(&pliantd, "%s %s", cases[i].arguments, cases[i].with_scene ? scene : "");
        expect_only_refusal(&pliantd, 2, cases[i].needle);
    }
}

TEST(bad_files_exit_2_and_are_named)
{
    const char *scene = write_any("files.cfg", "", "");
    const char *text = scratch("text.log");
    write_text(text, "this is no log and no checkpoint\n");
    run_daemon(&pliantd, "--check %s", scratch("missing.cfg"));
    expect_only_refusal(&pliantd, 2, "missing.cfg");
    run_daemon(&pliantd, "--offline 1 --input %s %s", text, scene);
    expect_only_refusal(&pliantd, 2, "text.log");
    run_daemon(&pliantd, "--offline 1 --input %s %s", scratch("missing.log"), scene);
    expect_only_refusal(&pliantd, 2, "missing.log");
    run_daemon(&pliantd, "--offline 1 --resume %s %s", text, scene);
    expect_only_refusal(&pliantd, 2, "text.log");
}

TEST(a_bad_scene_names_file_line_and_value)
{
    run_daemon(&pliantd, "--check %s", write_any("bad.cfg", "rate_hz = 20000.0;", ""));
    expect_only_refusal(&pliantd, 2, "bad.cfg:2:");
    expect_in(pliantd.err, "20000");
}

TEST(a_missing_folder_for_the_input_log_exits_1)
{
    run_daemon(&pliantd, "--duration 1 --log-inputs %s %s", scratch("no/such/folder.log"),
               write_any("log.cfg", "", ""));
    expect_only_refusal(&pliantd, 1, "folder.log");
}

TEST(check_and_explain_print_and_exit_0)
{
    const char *scene = write_any("check.cfg", "", PROBE_TOOL);
    run_daemon_well(&pliantd, "--check %s", scene);
    expect_in(pliantd.out, WITH_SURFACE ? "nodes 42" : "cells 8 x 8 x 8");
    expect_in(pliantd.out, "stability limit");
    expect_in(pliantd.out, "tool 1: probe");
    assert_string_equal(pliantd.err, "");
    run_daemon_well(&pliantd, "--explain %s", scene);
    expect_in(pliantd.out, "stages: inputs tools");
    expect_in(pliantd.out, "kernel of body sphere:");
    expect_in(pliantd.out, "bytes");
    expect_in(pliantd.out, "settle_s");
}

// Expects --check to give the scene and its body this verdict.
static void expect_verdict(const char *scene, const char *verdict, Process *daemon)
{
    static const char *const starts[] = {"\ntime of a tick of body sphere alone: ",
                                         "\ntime of a tick on this machine: "};
    run_daemon_well(daemon, "--check %s", scene);
    for (int i = 0; i < 2; i++) {
        char line[512];
        const char *start = strstr(daemon->out, starts[i]);
        assert_non_null(start);
        snprintf(line, sizeof line, "%.*s", (int)strcspn(start + 1, "\n"), start + 1);
        expect_in(line, verdict);
    }
}

// Times of machines and builds differ by less than the factor to either limit: some ten
// microseconds of a tick of 20 ms, and 90,000 substeps, tens of milliseconds, of a tick of 1 ms.
TEST(check_says_whether_a_tick_fits)
{
    expect_verdict(write_any("small.cfg", "rate_hz = 50.0;", PROBE_TOOL), " ms: fits", &pliantd);
    expect_in(pliantd.out, " ms pressed by its tools, of 20 ms: fits\n");
    const char *large = write_body_scene(
        "large.cfg", &(SceneParts){.source = WITH_SURFACE ? SMALL_SPHERE : SMALL_BOX,
                                   .material = WITH_SURFACE ? SOFT_MATERIAL : "",
                                   .body = "time_step = 1.1e-8;\n" LOWER_FIXED});
    expect_verdict(large, " ms: misses", &pliantd);
    expect_in(pliantd.out, ": misses: try for body sphere: ");
    expect_in(pliantd.out, WITH_SURFACE ? "a coarser mesh" : "larger cells");
    assert_null(strstr(pliantd.out, " pressed")); // it has no tool
}

// No tool and no load can push its nodes, but springs do.
TEST(a_body_that_is_only_attached_runs_off_line)
{
    run_daemon(&pliantd, "--offline 0.01 %s",
               write_any("attached.cfg", "",
                         "attachments = ( { body = \"sphere\"; to = \"world\";\n"
                         "  sphere = [0.0, 0.0, 0.05]; radius = 0.03; } );"));
    assert_int_equal(pliantd.code, 0);
    assert_int_equal(printed(&pliantd, "ticks"), 10);
}

TEST(version_and_help_exit_0)
{
    run_daemon_well(&pliantd, "--version");
    expect_in(pliantd.out, "pliantd 0.");
    run_daemon_well(&pliantd, "--help");
    expect_in(pliantd.out, "--log-inputs");
    expect_in(pliantd.out, "mesh or file.\n"); // the prompt comes on a line of its own
}

TEST(rate_replaces_the_scenes)
{
    run_daemon_well(&pliantd, "--offline 1 --rate 500 %s", write_any("rate.cfg", "", ""));
    assert_int_equal(printed(&pliantd, "ticks"), 500);
}
