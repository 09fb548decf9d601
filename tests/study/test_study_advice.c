// SPDX-License-Identifier: MIT
// What a study advises: the cheapest run that has all that was asked for, and its keys, which make
// a scene that case.
#include "test.h"
#include "scene_text.h"
#include "study_sample.h"

#include "study/report.h"
#include "study/scene_keys.h"

static StudyResult result;
static Advice advice;

static const char *advised(double error, double rate_hz)
{
    advice_make(&result, error, rate_hz, &advice);
    return advice.run < 0 ? "none" : result.run[advice.run].what.name;
}

// Within 1 % at 1000 Hz: b alone; every other lacks one thing, and would be cheaper.
static void fill(void)
{
    sample_begin(&result, 0.001, 1e-6);
    sample_add(&result, "slow, level 2", 0.5, 600e-6, 0.001, 0.001);
    sample_add(&result, "b, level 1", 0.3, 400e-6, 0.001, 0.008);
    sample_add(&result, "coarse, level 0", 0.1, 100e-6, 0.001, 0.02);
    sample_add(&result, "late, level 1", 0.1, 800e-6, 0.001, 0.001);
    StudyRun *lower = sample_add(&result, "lower rate, level 1", 0.1, 100e-6, 0.001, 0.001);
    lower->rate_hz = 500.0;
    StudyRun *doubling = sample_add(&result, "doubling, level 1", 0.1, 100e-6, 0.001, 0.001);
    doubling->what.step_doubling = true;
    StudyRun *bad = sample_add(&result, "bad, level 1", 0.1, 100e-6, 0.001, 0.001);
    bad->verdict = STUDY_BAD;
    StudyRun *unknown = sample_add(&result, "unknown, level 1", 0.1, 100e-6, 0.001, 0.001);
    unknown->total.patch = unknown->total.surface = (double)NAN;
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(cheapest_that_has_everything_is_advised)
{
    fill();
    assert_string_equal(advised(0.01, 1000.0), "b, level 1");
    assert_true(advice.met);
    assert_false(advice.time_only);
    expect_near(advice.error, 0.009, 1e-12); // with the reference's own error of 0.1 %
    expect_in(advice.sentence, "The cheapest choice within 1 % that holds 1000 Hz on "
                               "this machine is \"b, level 1\"");
    expect_in(advice.sentence, "0.9 % (0.8 % measured, up to 0.1 % of the reference");
    expect_in(advice.sentence, "the longest 800 us");
}

// Each of them would be advised, were its one fault not there.
TEST(each_condition_alone_excludes)
{
    for (int i = 2; i < 8; i++) {
        fill();
        assert_string_equal(advised(0.01, 1000.0), "b, level 1");
        StudyRun *run = &result.run[i];
        run->total.patch = 0.001;
        run->tick_p99 = 100e-6;
        run->rate_hz = 1000.0;
        run->what.step_doubling = false;
        run->verdict = STUDY_OK;
        assert_string_equal(advised(0.01, 1000.0), run->what.name);
    }
}

TEST(reference_s_own_error_counts)
{
    fill();
    result.finest.own_error = 0.0021; // b: 0.8 % and this exceed 1 %
    assert_string_equal(advised(0.01, 1000.0), "slow, level 2");
    assert_true(advice.met);
}

// An order that looks good does not make it smaller than what the last refinement still changed.
TEST(last_difference_of_the_reference_counts)
{
    fill();
    result.finest.difference[1] = 0.0021;
    assert_string_equal(advised(0.01, 1000.0), "slow, level 2");
    result.finest.difference[1] = 0.011;
    advised(0.01, 1000.0);
    assert_true(advice.time_only);
}

// 99 of 100 ticks may take seven tenths of the period, and no more.
TEST(a_share_of_the_tick_is_kept_free)
{
    fill();
    result.run[1].tick_p99 = 0.699e-3;
    assert_string_equal(advised(0.01, 1000.0), "b, level 1");
    result.run[1].tick_p99 = 0.701e-3;
    assert_string_equal(advised(0.01, 1000.0), "slow, level 2");
}

// What to change where nothing is enough: eight times too slow, a wall needs a quarter of its
// nodes; what misses the error alone needs more; walls without bending do not converge.
TEST(the_next_step_is_said)
{
    sample_begin(&result, 0.001, 1e-6);
    StudyRun *run = sample_add(&result, "slow, level 1", 5.6, 5.6e-3, 0.001, 0.001);
    run->cpu_median = 5.6;
    run->nodes_most = 4000;
    result.wall = result.bends = true;
    advised(0.01, 1000.0);
    assert_false(advice.met);
    expect_in(advice.sentence, "A mesh of about 1e+03 nodes would hold the rate");
    assert_null(strstr(advice.sentence, "implicit"));
    run->substeps = 40;
    advised(0.01, 1000.0);
    expect_in(advice.sentence, "Try integrator = \"implicit\": 40 steps");
    // The error alone.
    run->cpu_median = 0.1;
    run->tick_p99 = 1e-4;
    run->total.patch = run->total.surface = 0.05;
    advised(0.01, 1000.0);
    expect_in(advice.sentence, "Try one level more");
    assert_null(strstr(advice.sentence, "thickness"));
    // No reference, as the wall folds.
    fill();
    result.wall = true;
    result.finest.own_error = result.finest.difference[1] = 0.2;
    advised(0.01, 1000.0);
    expect_in(advice.sentence, "give its material a thickness");
}

// Also when single ticks are short: the processor must keep up.
TEST(mean_cost_must_fit_too)
{
    fill();
    result.run[1].cpu_median = 0.71;
    result.run[0].cpu_median = 0.72;
    advised(0.01, 1000.0);
    assert_false(advice.met);
}

TEST(where_nothing_fits_the_nearest_is_named_with_what_it_misses)
{
    fill();
    assert_string_equal(advised(0.0015, 1000.0),
                        "slow, level 2"); // "late" errs as little, but late
    result.run[0].verdict = STUDY_BAD;    // which had it all
    assert_string_equal(advised(0.0025, 1000.0), "b, level 1");
    assert_false(advice.met);
    assert_true(advice.holds);
    expect_in(advice.sentence, "it misses the error (3.6 times");
    // Where none holds the rate none is advised.
    result.run[1].verdict = result.run[2].verdict = STUDY_BAD;
    assert_string_equal(advised(0.0025, 1000.0), "late, level 1");
    assert_false(advice.holds);
    expect_in(advice.sentence, "No advice: nothing here holds 1000 Hz");
    expect_in(advice.sentence, "it misses the time of a tick (1.14 times");
}

// Under a tool the patch goes where the tool does: what a hand feels must be right, too.
TEST(error_of_the_force_counts_too)
{
    fill();
    result.run[1].total.force = 0.4;
    assert_string_equal(advised(0.01, 1000.0), "slow, level 2");
    result.run[0].total.force = 0.5;
    result.run[2].total.force = 0.6;
    result.run[3].verdict = result.run[4].verdict = STUDY_BAD;
    assert_string_equal(advised(0.01, 1000.0), "b, level 1");
    assert_false(advice.met);
    assert_non_null(
        strstr(advice.sentence, "misses the error of the force on the tool (40 times)"));
    result.nudged.force = 0.1;
    advised(0.01, 1000.0);
    expect_in(advice.sentence, "(50 times)");
}

// A body that makes 2 % of inputs that differ by 0.01 % is known to 2 %, whatever the references.
TEST(what_nearly_equal_inputs_differ_by_counts)
{
    fill();
    result.nudged = (StudyErrors){.patch = 0.02, .force = 0.05};
    assert_string_equal(advised(0.03, 1000.0), "b, level 1"); // 0.8 + 2 %; else the coarse one
    assert_true(advice.met);
    expect_near(advice.error, 0.028, 1e-12);
    expect_in(advice.sentence, "up to 2 % of the motion itself");
    advised(0.01, 1000.0);
    assert_false(advice.met);
    expect_in(advice.sentence, "already move the patch by 2 %");
    expect_in(advice.sentence, "ask for --error 2.2%");
    result.nudged.patch = (double)NAN;
    assert_string_equal(advised(0.03, 1000.0), "coarse, level 0");
}

// A mesh whose finest levels still differ has an advice for what can be promised of it.
TEST(in_all_the_least_round_error_that_can_be_promised_is_advised)
{
    fill();
    advice_make_total(&result, 0.01, 1000.0, &advice);
    assert_true(advice.met);
    assert_string_equal(result.run[advice.run].what.name, "b, level 1");
    assert_null(strstr(advice.sentence, "finest meshes differ"));
    // 0.8 % and 3 % of the reference are within 5 %; so are 2 % and 3 %, which is cheaper.
    result.finest.difference[1] = 0.03;
    advice_make_total(&result, 0.01, 1000.0, &advice);
    assert_true(advice.met);
    assert_string_equal(result.run[advice.run].what.name, "coarse, level 0");
    expect_near(advice.error, 0.05, 1e-12);
    expect_in(advice.sentence, "In all, the cheapest choice within 5 % that holds");
    expect_in(advice.sentence, "the two finest meshes differ by 3 %");
    // One that nothing is known of says why.
    result.finest.known = false;
    snprintf(result.finest.what, sizeof result.finest.what, "none: level 2 would take 99 s");
    advice_make_total(&result, 0.01, 1000.0, &advice);
    assert_int_equal(advice.run, -1);
    assert_string_equal(advice.sentence,
                        "No advice in all: no reference, level 2 would take 99 s.");
    snprintf(result.finest.what, sizeof result.finest.what, "leapfrog double, 1 ms, levels 0");
    advice_make_total(&result, 0.01, 1000.0, &advice);
    expect_in(advice.sentence, "levels 0, has no finer one to be judged by");
}

TEST(without_a_total_reference_the_promise_is_about_time)
{
    fill();
    result.finest.known = false;
    // A coarser mesh is exact in time too, and would always be cheaper: it does not count.
    StudyRun *scene = &result.run[1];
    scene->what.is_scene = true;
    scene->what.level = 1;
    for (int i = 3; i < 8; i++)
        result.run[i].what.level = 2;
    result.mesh[0].level = 1;
    assert_string_equal(advised(0.01, 1000.0), "b, level 1");
    assert_true(advice.met);
    assert_true(advice.time_only);
    expect_in(advice.sentence, "The promise is about the steps in time alone");
    // A reference that itself errs more than what is asked for is no better.
    fill();
    result.finest.own_error = 0.02;
    result.run[1].what.is_scene = true;
    advised(0.01, 1000.0);
    assert_true(advice.time_only);
    expect_in(advice.sentence, "may itself err by 2 %");
    // Nor one whose error is not known.
    result.finest.own_error = (double)NAN;
    advised(0.01, 1000.0);
    assert_true(advice.time_only);
}

TEST(without_any_reference_nothing_is_advised)
{
    fill();
    result.run[1].what.is_scene = true;
    result.finest.known = false;
    result.mesh[0].reference.known = false;
    assert_string_equal(advised(0.01, 1000.0), "none");
    assert_int_equal(strncmp(advice.sentence, "No advice: ", 11), 0);
}

// --- keys ----------------------------------------------------------------------------------------

#define SURFACE                                                                                    \
    "// a comment with bodies = ( { levels = 9; } ); in it\n"                                      \
    "name = \"a-tricky\" /* and */ \"name\";\n"                                                    \
    "rate_hz : 500.0, /* precision = \"double\"; */\n"                                             \
    "bodies = (\n"                                                                                 \
    "  { name = \"one\"; mesh = { generator = \"ico_sphere\"; nodes = 42; radius = 0.05; };\n"     \
    "    levels = 3;  # finest\n"                                                                  \
    "    adapt = { force = 0.01; speed = 0.3; };\n"                                                \
    "    time_step = 0.0001; fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, 0.0]); } ) },\n"    \
    "  { name = \"two\"; mesh = { generator = \"uv_sphere\"; } }\n"                                \
    ");\n"                                                                                         \
    "tools = ( { id = 1; kind = \"probe\"; capsules = ( { radius = 0.005; } ); } );\n"

#define VOXEL                                                                                      \
    "bodies = ( { name = \"block\"; model = \"voxel\"; levels = 1;\n"                              \
    "  voxels = { generator = \"box\"; count = [4, 4, 4]; size = 0.01; }; law = \"affine\"; } );"

// Reads `text`, sets the keys of a case in it, reads that.
static void set_keys(const char *text, const StudyCase *what, double rate_hz, Scene *scene)
{
    static char from[SCRATCH_PATH], to[SCRATCH_PATH];
    SceneKeys keys;
    Status status = {0};
    assert_string_equal(read_as_scene(text, scene), "");
    assert_true(scene_keys_of_case(scene, what, rate_hz, &keys));
    scene_destroy(scene);
    bool ok = scene_keys_set(&keys, scratch_path(&scratch_space, "x.cfg", from),
                             scratch_path(&scratch_space, "y.cfg", to), &status);
    assert_string_equal(status.text, "");
    assert_true(ok);
    ok = scene_read(to, scene, &status);
    assert_string_equal(status.text, "");
    assert_true(ok);
}

TEST(advised_keys_make_a_scene_that_case)
{
    SCOPED(scene_destroy) Scene scene;
    const StudyCase held = {.integrator = INTEGRATOR_RK4,
                            .time_step = 0.001 / 3.0,
                            .precision = PRECISION_DOUBLE,
                            .detail = DETAIL_HELD,
                            .level = 2,
                            .paper_rule = true};
    set_keys(SURFACE, &held, 1000.0, &scene);
    assert_true(scene.sim.rate_hz == 1000.0);
    assert_int_equal(scene.precision, PRECISION_DOUBLE);
    assert_int_equal(scene.body_count, 2);
    for (int b = 0; b < 2; b++) {
        const SurfaceOptions *surface = &scene.body[b].surface;
        assert_int_equal(surface->body.integrator, INTEGRATOR_RK4);
        assert_true(surface->body.time_step == 0.001 / 3.0); // to the last bit
        assert_int_equal(surface->body.levels, 2);
        assert_int_equal(surface->start_level, 2);
        assert_false(surface->adaptive);
        assert_int_equal(surface->adjust, ADJUST_CHOI2005);
    }
    assert_string_equal(scene.name, "a-trickyname"); // what was not asked for is as it was
    assert_int_equal(scene.body[0].options.fixed_count, 1);
    assert_int_equal(scene.tool_count, 1);
}

TEST(adaptive_keys_scale_the_scene_s_thresholds)
{
    SCOPED(scene_destroy) Scene scene;
    const StudyCase adaptive = {.integrator = INTEGRATOR_LEAPFROG,
                                .precision = PRECISION_SINGLE,
                                .detail = DETAIL_ADAPTIVE,
                                .level = 2,
                                .threshold = 0.5};
    set_keys(SURFACE, &adaptive, 250.0, &scene);
    const SurfaceOptions *surface = &scene.body[0].surface;
    assert_true(surface->adaptive);
    assert_int_equal(surface->body.levels, 2);
    assert_int_equal(surface->start_level, 0);
    assert_true(surface->adapt.force == 0.005);
    assert_true(surface->adapt.speed == 0.15);
    assert_true(surface->adapt.curvature == 0.8);
    assert_true(surface->body.time_step == 0.0); // the key is gone: the bound decides
    assert_true(scene.body[1].surface.adaptive); // by the usual thresholds
    assert_true(scene.body[1].surface.adapt.force == 0.0025);
}

TEST(the_scene_s_own_case_changes_nothing_but_the_rate)
{
    SCOPED(scene_destroy) Scene before, after;
    assert_string_equal(read_as_scene(SURFACE, &before), "");
    const StudyCase own = {.integrator = before.body[0].surface.body.integrator,
                           .time_step = before.body[0].surface.body.time_step,
                           .precision = before.precision,
                           .detail = DETAIL_SCENE,
                           .level = 3,
                           .threshold = 1.0,
                           .is_scene = true};
    set_keys(SURFACE, &own, 500.0, &after);
    const SurfaceOptions *x = &before.body[0].surface, *y = &after.body[0].surface;
    assert_int_equal(x->body.levels, y->body.levels);
    assert_int_equal(x->start_level, y->start_level);
    assert_int_equal(x->body.integrator, y->body.integrator);
    assert_true(x->body.time_step == y->body.time_step);
    assert_memory_equal(&x->adapt, &y->adapt, sizeof x->adapt);
    assert_true(before.sim.rate_hz == after.sim.rate_hz);
}

TEST(voxel_bodies_get_their_own_keys)
{
    SCOPED(scene_destroy) Scene scene;
    const StudyCase what = {.integrator = INTEGRATOR_LEAPFROG,
                            .time_step = 1e-4,
                            .precision = PRECISION_DOUBLE,
                            .detail = DETAIL_HELD,
                            .level = 2,
                            .paper_rule = true};
    set_keys(VOXEL, &what, 1000.0, &scene);
    assert_int_equal(scene.body[0].voxel.body.levels, 2);
    assert_int_equal(scene.body[0].voxel.law, VOXEL_MIYAZAKI2004);
    assert_int_equal(scene.body[0].voxel.body.integrator, INTEGRATOR_LEAPFROG);
    assert_true(scene.body[0].voxel.body.time_step == 1e-4);
}

// The copy lies in another folder, and still finds what the scene names.
TEST(files_keep_their_place)
{
    static const char off[] =
        "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 "
        "1 2 3\n";
    static const char text[] =
        "bodies = ( { name = \"a\"; mesh = { file = \"a.off\"; }; initial = \"/there/b.h5\"; } );";
    char to[] = "/tmp/pliant-study-XXXXXX";
    SceneKeys keys = {.body_count = 1};
    Status status = {0};
    SCOPED(scene_destroy) Scene scene;
    int there = mkstemp(to);
    assert_true(there >= 0);
    close(there);
    scratch_write(&scratch_space, "a.off", off, sizeof off - 1);
    scratch_write(&scratch_space, "x.cfg", text, sizeof text - 1);
    assert_true(scene_keys_set(&keys, scratch_at("x.cfg"), to, &status));
    bool ok = scene_read(to, &scene, &status);
    unlink(to);
    assert_string_equal(status.text, "");
    assert_true(ok);
    FREED char *real = realpath(scratch_at("a.off"), NULL);
    assert_non_null(real);
    assert_string_equal(scene.body[0].mesh.file, real);
    assert_string_equal(scene.body[0].initial, "/there/b.h5");
}

static void expect_refused(const char *text, const char *said)
{
    char from[SCRATCH_PATH], to[SCRATCH_PATH];
    SceneKeys keys = {.body_count = 1};
    Status status = {0};
    scratch_write_text("x.cfg", text);
    assert_false(scene_keys_set(&keys, scratch_path(&scratch_space, "x.cfg", from),
                                scratch_path(&scratch_space, "z.cfg", to), &status));
    assert_string_equal(status.text + strlen(scratch_space.folder) + 1, said);
    assert_int_not_equal(access(to, F_OK), 0); // nothing half done
}

TEST(what_is_no_scene_is_refused)
{
    char deep[200] = "x = ";
    memset(deep + 4, '(', 100);
    expect_refused("name = \"x", "x.cfg:1: a text has no end");
    expect_refused("rate_hz = 1;\n/* to", "x.cfg:2: a comment has no end");
    expect_refused("bodies = ( { levels 3 } );",
                   "x.cfg:1: this is no scene: a key without a value");
    expect_refused("bodies = ( { levels = 3;", "x.cfg:1: this is no scene: a key is missing or too "
                                               "long");
    expect_refused("x = ;", "x.cfg:1: a value is missing");
    expect_refused("x = [1, 2", "x.cfg:1: a value is missing");
    expect_refused("@include x", "x.cfg:1: a scene with @include, seen from its own folder, has no "
                                 "copy elsewhere");
    expect_refused(deep, "x.cfg:1: groups lie too deep in each other");
}

TEST(keys_are_printed_to_be_pasted)
{
    char said[1024] = "";
    SCOPED(scene_destroy) Scene scene;
    SceneKeys keys;
    const StudyCase what = {.integrator = INTEGRATOR_LEAPFROG,
                            .time_step = 0.0005,
                            .precision = PRECISION_SINGLE,
                            .detail = DETAIL_HELD,
                            .level = 1};
    assert_string_equal(read_as_scene(BODY, &scene), "");
    assert_true(scene_keys_of_case(&scene, &what, 1000.0, &keys));
    FILE *out = fmemopen(said, sizeof said, "w");
    scene_keys_print(&keys, out);
    fclose(out);
    assert_string_equal(said, "rate_hz = 1000.0;\n"
                              "precision = \"single\";\n"
                              "# in the body a:\n"
                              "    integrator = \"leapfrog\";\n"
                              "    time_step = 0.0005;\n"
                              "    levels = 1;\n"
                              "    start_level = 1;\n"
                              "    adjust = \"continuum\";\n"
                              "    # no adapt\n");
}
