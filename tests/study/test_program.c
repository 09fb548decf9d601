// SPDX-License-Identifier: MIT
// pliant-study as a user runs it: options, exit codes, what it leaves behind; and that the scene it
// advises is one that pliantd takes.
#include "test.h"
#include "study_program.h"

// A ball of 42 nodes that is pressed for a twentieth of a second: the smallest study that has
// everything.
static const char BALL[] =
    "name = \"ball\";  rate_hz = 500.0;  # kept\n"
    "bodies = ( { name = \"ball\";\n"
    "    mesh = { generator = \"ico_sphere\";  nodes = 42;  radius = 0.05; };\n"
    "    levels = 1;  start_level = 0;\n"
    "    shape = { angular_frequency = 50.0;  damping_ratio = 0.1; }; } );\n"
    "loads = ( { center = [0.0, 0.0, 0.05];  radius = 0.03;  force = [0.0, 0.0, -0.3];\n"
    "            start = 0.002;  duration = 0.05; } );\n";

#define STUDY "ball.cfg --quick --duration 0.1 --repeat 1 --only 'leapfrog bound' "

static int write_ball(void **state)
{
    (void)state;
    write_text(scratch("ball.cfg"), BALL);
    return 0;
}

AROUND_ALL(write_ball, NULL)

TEST(help_and_version_are_printed)
{
    run_well("--help");
    expect_printed(&result, "--error=PCT");
    expect_printed(&result, "--jobs=N");
    expect_printed(&result, "Exit code 0: done; 1:");
    expect_printed(&result, "mesh or file.\n");
    run_well("--version");
    assert_int_equal(strncmp(result.out, "pliant-study ", 13), 0);
}

TEST(bad_options_are_named)
{
    static const char *const bad[][2] = {
        {"", "pliant-study: no scene given"},
        {"a.cfg b.cfg", "pliant-study: one scene at a time, got 'a.cfg' and 'b.cfg'"},
        {"--nonsense a.cfg", "pliant-study: '--nonsense' is no option or lacks its value"},
        {"a.cfg --out", "pliant-study: '--out' is no option or lacks its value"},
        {"--error 5 a.cfg", "pliant-study: --error '5' is neither a percentage"},
        {"--error 0% a.cfg", "pliant-study: --error '0%' is neither"},
        {"--error 100% a.cfg", "pliant-study: --error '100%' is neither"},
        {"--error 1%% a.cfg", "pliant-study: --error '1%%' is neither"},
        {"--error % a.cfg", "pliant-study: --error '%' is neither"},
        {"--error nan a.cfg", "pliant-study: --error 'nan' is neither"},
        {"--rate 0 a.cfg", "pliant-study: --rate '0' is not a number in [1, 10000]"},
        {"--rate 1e3x a.cfg", "pliant-study: --rate '1e3x' is not a number"},
        {"--duration -1 a.cfg", "pliant-study: --duration '-1' is not a number"},
        {"--jobs 0 a.cfg", "pliant-study: --jobs '0' is not an integer in [1, 256]"},
        {"--jobs two a.cfg", "pliant-study: --jobs 'two' is not an integer"},
        {"--repeat 33 a.cfg", "pliant-study: --repeat '33' is not an integer in [1, 32]"},
        {"--isa avx a.cfg", "pliant-study: --isa 'avx' is not one of auto, "},
        {"--prefix a.b a.cfg", "pliant-study: --prefix 'a.b' is not 1 to 31 letters"},
        {"--log-level loud a.cfg", "pliant-study: --log-level 'loud' is not error"},
        {"nowhere.cfg", "nowhere.cfg: "},
        {"--input nowhere.log ball.cfg", "nowhere.log: "},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        run(bad[i][0]);
        expect_refusal(&result, 2, bad[i][1]);
        assert_string_equal(result.out, "");
    }
}

TEST(a_folder_that_cannot_be_made_fails)
{
    run(STUDY "--out nowhere/there");
    expect_refusal(&result, 1,
                   "nowhere/there: cannot be made or written to: No such file or directory");
    run(STUDY "--out ball.cfg");
    expect_refusal(&result, 1, "ball.cfg: cannot be made or written to: ");
}

TEST(cases_are_listed_without_being_run)
{
    struct stat info;
    run_well("ball.cfg --list");
    expect_printed(&result, " (the scene)\n");
    expect_printed(&result, "rk4 ");
    expect_printed(&result, " cases\n");
    size_t whole = strlen(result.out);
    run("ball.cfg --list --quick");
    assert_true(strlen(result.out) < whole);
    assert_int_not_equal(stat(scratch("study-ball"), &info), 0);
}

// Files, table, progress; and the advice, taken: pliantd reads it and runs it.
TEST(a_study_leaves_tables_pictures_and_a_scene_that_runs)
{
    run_well(STUDY "--error 20% --rate 250");
    expect_printed(&result, "ball, body ball: ");
    expect_printed(&result, "references, three runs each");
    expect_printed(&result, "(the scene)");
    expect_printed(&result, "(Pareto front)");
    expect_in(result.err, "100 % ");
    assert_null(strchr(result.err, '\r')); // no terminal
    assert_true(is_there("study-ball/runs.tsv"));
    assert_true(is_there("study-ball/references.tsv"));
    assert_true(is_there("study-ball/study.gp"));
    assert_true(is_there("study-ball/advice.cfg"));
    expect_printed(&result, "rate_hz = 250.0;");
    run_daemon_well(&result, "--offline 0.1 study-ball/advised.cfg");
}

TEST(a_scene_that_cannot_be_built_is_refused)
{
    write_text(scratch("bad.cfg"), "bodies = ( { name = \"a\"; levels = 99; } );");
    run("bad.cfg");
    expect_refusal(&result, 2, "bad.cfg:1: ");
}
