// SPDX-License-Identifier: MIT
// The advice is right: against a reference that is finer than the study's own, the advised scene
// errs at most one and a half times what was promised. A small study from beginning to end.
#include "test.h"
#include "scene_text.h"

#include "study/report.h"
#include "study/study.h"
#include "study/sampler.h"
#include "study/run.h"
#include "study/scene_keys.h"

// A stiff sheet in a frame, pressed in its middle: it neither buckles nor folds, so that finer
// meshes come nearer to each other.
static const char SHEET[] =
    "name = \"sheet\";  rate_hz = 500.0;\n"
    "bodies = ( { name = \"sheet\";\n"
    "    mesh = { generator = \"sheet\";  columns = 7;  rows = 7;  width = 0.2;  height = 0.2; };\n"
    "    levels = 1;\n"
    "    shape = { angular_frequency = 50.0;  damping_ratio = 0.3; };\n"
    "    fixed = ( { box = ([-1.0, -1.0, -1.0], [-0.0999, 1.0, 1.0]); },\n"
    "              { box = ([0.0999, -1.0, -1.0], [1.0, 1.0, 1.0]); } ); } );\n"
    "loads = ( { center = [0.0, 0.0, 0.0];  radius = 0.07;  force = [0.0, 0.0, -0.3];\n"
    "            duration = 0.2; } );\n";

static Scene scene;
static StudyContext context;
static StudyCase cases[STUDY_CASES];
static StudyResult result;
static Advice advice;

static StudyTrace *trace_of(const StudyContext *of, const StudyCase *what)
{
    StudyRun run;
    StudyTrace *trace = study_trace_create(of->sample_count, of->points.count);
    assert_non_null(trace);
    assert_true(study_trace_case(of, what, 1, &run, trace));
    assert_string_equal(run.why, "");
    assert_int_equal(run.verdict, STUDY_OK);
    return trace;
}

// Times by the work that is done instead of by a clock: what is advised does not depend on the
// machine.
static void time_by_work(void)
{
    for (int i = 0; i < result.run_count; i++) {
        StudyRun *run = &result.run[i];
        const int stages = integrator_get(run->what.integrator)->evaluation_count;
        run->cpu_median = 1e-8 * run->rate_hz * run->substeps * stages * run->links;
        run->tick_p99 = run->cpu_median / run->rate_hz;
    }
}

static int make_study(void **unused)
{
    const StudyOptions options = {.scene_path = "x.cfg",
                                  .duration_s = 0.3,
                                  .rate_hz = 500.0,
                                  .error = 0.15,
                                  .jobs = 1,
                                  .repeats = 1,
                                  .quick = true,
                                  .only = "bound",
                                  .isa = "auto"};
    Status status = {0};
    scratch_begin(unused);
    assert_string_equal(read_as_scene(SHEET, &scene), "");
    int count = study_make_cases(&scene, &options, cases);
    bool ok = study_prepare(&context, &scene, &options, &status);
    context.limit_s = 600.0; // sanitizers take their time
    ok = ok && study_make_references(&context, cases, count, NULL, NULL, &result, &status) &&
         study_run_all(&context, cases, count, 1, NULL, NULL, &result, &status);
    assert_string_equal(status.text, "");
    assert_true(ok);
    time_by_work();
    return 0;
}

static int end_study(void **unused)
{
    study_destroy(&context);
    scene_destroy(&scene);
    return scratch_end(unused);
}

static double promised(void)
{
    advice_make(&result, context.options.error, context.options.rate_hz, &advice);
    assert_in_range(advice.run, 0, result.run_count - 1);
    assert_true(advice.met);
    return advice.error;
}

AROUND_ALL(make_study, end_study)

TEST(total_error_is_what_was_promised)
{
    double promise = promised();
    assert_false(advice.time_only);
    // The study's finest mesh is of level 2.
    const StudyCase finer = {.integrator = INTEGRATOR_RK4,
                             .precision = PRECISION_DOUBLE,
                             .detail = DETAIL_HELD,
                             .level = 3,
                             .time_step = 2.5e-4};
    FREED StudyTrace *reference = trace_of(&context, &finer);
    FREED StudyTrace *own = trace_of(&context, &result.run[advice.run].what);
    double error = study_errors(own, reference).patch;
    print_message("%s\nagainst level 3: %.3g %%\n", advice.sentence, 100.0 * error);
    expect_at_most(error, 1.5 * promise);
    assert_true(error > 0.0);
}

TEST(error_in_time_is_what_was_promised)
{
    const bool known = result.finest.known;
    result.finest.known = false;
    double promise = promised();
    assert_true(advice.time_only);
    StudyCase what = result.run[advice.run].what, finer = what;
    result.finest.known = known;
    finer.integrator = INTEGRATOR_RK4;
    finer.precision = PRECISION_DOUBLE;
    finer.is_scene = false;
    finer.time_step = 0.5 * study_time_reference(&result, &what)->step[2];
    FREED StudyTrace *reference = trace_of(&context, &finer);
    FREED StudyTrace *own = trace_of(&context, &what);
    double error = study_errors(own, reference).patch;
    expect_at_most(error, 1.5 * promise);
    assert_true(error > 0.0);
}

// Bit by bit: what was measured is what the user gets.
TEST(advised_scene_moves_as_the_case_did)
{
    static StudyContext advised_context;
    static char from[SCRATCH_PATH], to[SCRATCH_PATH];
    SceneKeys keys;
    SCOPED(scene_destroy) Scene advised;
    Status status = {0};
    promised();
    const StudyCase what = result.run[advice.run].what;
    assert_true(scene_keys_of_case(&scene, &what, context.options.rate_hz, &keys));
    bool ok = scene_keys_set(&keys, scratch_path(&scratch_space, "x.cfg", from),
                             scratch_path(&scratch_space, "advised.cfg", to), &status) &&
              scene_read(to, &advised, &status) &&
              study_prepare(&advised_context, &advised, &context.options, &status);
    assert_string_equal(status.text, "");
    assert_true(ok);
    const StudyCase own = study_scene_case(&advised);
    StudyTrace *expected = trace_of(&context, &what), *found = trace_of(&advised_context, &own);
    assert_int_equal(expected->point_count, found->point_count);
    assert_int_equal(expected->used, found->used);
    assert_memory_equal(expected, found,
                        study_trace_bytes(expected->sample_count, expected->point_count));
    free(expected);
    free(found);
    study_destroy(&advised_context);
}
