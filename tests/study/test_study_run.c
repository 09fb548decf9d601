// SPDX-License-Identifier: MIT
// One case: what a study measures of it has the order of its integrator, is what it says it is, and
// fails in words.
#include "test.h"
#include "study_bench.h"

#include "study/sampler.h"
#include "study/run.h"
#include "study/context.h"

static const StudyOptions SHORT = {.duration_s = 0.2, .repeats = 1};

static StudyTrace *trace_of(const Bench *bench, IntegratorKind kind, double step, StudyRun *run)
{
    StudyCase what = study_scene_case(&bench->scene);
    StudyTrace *trace =
        study_trace_create(bench->context.sample_count, bench->context.points.count);
    what.is_scene = false;
    what.integrator = kind;
    what.time_step = step;
    assert_non_null(trace);
    assert_true(study_trace_case(&bench->context, &what, 1, run, trace));
    return trace;
}

// Errors at h and h / 2 against a reference 16 times finer than h / 2 by the method of order 4:
// their ratio is 2^order; the next order's share is a few percent at these steps.
static void expect_order_of(IntegratorKind kind, double step, double order)
{
    SCOPED(bench_destroy) Bench bench;
    StudyRun run;
    double error[2];
    bench_create(&bench, SHEET, &SHORT);
    FREED StudyTrace *reference = trace_of(&bench, INTEGRATOR_RK4, step / 32.0, &run);
    assert_int_equal(run.verdict, STUDY_OK);
    for (int k = 0; k < 2; k++) {
        FREED StudyTrace *trace = trace_of(&bench, kind, step / (k + 1), &run);
        assert_int_equal(run.verdict, STUDY_OK);
        expect_near(run.time_step, step / (k + 1), 1e-12);
        error[k] = study_errors(trace, reference).patch;
    }
    double found = log2(error[0] / error[1]);
    print_message("%s: errors %.3g, %.3g, order %.3f\n", integrator_name(kind), error[0], error[1],
                  found);
    expect_near(found, order, 0.15);
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(rk4_has_order_4)
{
    expect_order_of(INTEGRATOR_RK4, 0.00125, 4.0);
}

TEST(undamped_leapfrog_has_order_2)
{
    expect_order_of(INTEGRATOR_LEAPFROG, 0.00125, 2.0);
}

TEST(symplectic_euler_has_order_1)
{
    expect_order_of(INTEGRATOR_SYMPLECTIC_EULER, 0.000625, 1.0);
}

// A step above the tick: samples are taken at the same times as with the scene's own rate.
TEST(a_step_above_the_tick_lowers_the_rate)
{
    SCOPED(bench_destroy) Bench bench;
    StudyRun run;
    char text[2048];
    snprintf(text, sizeof text, "%s", SHEET);
    memcpy(strstr(text, "200.0"), "2000.", 5);
    bench_create(&bench, text, &SHORT);
    FREED StudyTrace *fine = trace_of(&bench, INTEGRATOR_RK4, 0.0005, &run);
    expect_near(run.rate_hz, 2000.0, 1e-9);
    FREED StudyTrace *coarse = trace_of(&bench, INTEGRATOR_RK4, 0.0025, &run);
    expect_near(run.rate_hz, 400.0, 1e-9);
    expect_near(run.time_step, 0.0025, 1e-12);
    assert_int_equal(run.substeps, 1);
    assert_int_equal(fine->used, coarse->used);
    // Order 4 at a fifth of the period of the stiffest mode: far below a percent; another time or
    // another load would be off by as much as there is.
    assert_true(study_errors(coarse, fine).patch < 0.005);
}

TEST(a_step_beyond_the_bound_is_refused_with_the_reason)
{
    SCOPED(bench_destroy) Bench bench;
    StudyRun run;
    bench_create(&bench, SHEET, &SHORT);
    free(trace_of(&bench, INTEGRATOR_LEAPFROG, 0.01, &run));
    assert_int_equal(run.verdict, STUDY_REFUSED);
    expect_in(run.why, "stability bound");
    assert_null(strstr(run.why, scratch_space.folder));
    assert_true(isnan(run.time.patch));
}

TEST(a_scene_that_blows_up_is_bad)
{
    SCOPED(bench_destroy) Bench bench;
    StudyRun run;
    bench_create(
        &bench,
        SHEET_BODY("time_step = 0.005; unsafe_time_step = true;") "loads = ( { center = [0.0, 0.0, "
                                                                  "0.0]; radius = 0.03; force = "
                                                                  "[0.0, 0.0, -0.02];"
                                                                  " duration = 10.0; } );\n",
        &(StudyOptions){.duration_s = 2.0, .repeats = 1});
    StudyCase own = study_scene_case(&bench.scene);
    assert_true(study_run_case(&bench.context, &own, &run));
    assert_int_equal(run.verdict, STUDY_BAD);
    assert_true(run.why[0] != '\0');
}

// Every accepted tick is within the tolerance, by the routine's own measure; a tolerance a hundred
// times smaller costs more and is nearer to the truth.
TEST(step_doubling_meets_its_tolerance)
{
    SCOPED(bench_destroy) Bench bench;
    StudyRun run;
    double error[2];
    long passes[2];
    bench_create(&bench, SHEET, &SHORT);
    FREED StudyTrace *reference = trace_of(&bench, INTEGRATOR_RK4, 0.0001, &run);
    for (int k = 0; k < 2; k++) {
        StudyCase what = study_scene_case(&bench.scene);
        StudyScene copy;
        World world;
        Status status = {0};
        StepDoubling doubling;
        double tolerance = (k == 0 ? 1e-5 : 1e-8) * bench.context.extent;
        what.is_scene = false;
        what.integrator = INTEGRATOR_RK4;
        what.step_doubling = true;
        what.tolerance = k == 0 ? 1e-5 : 1e-8;
        assert_true(study_build(&bench.context, &what, false, &copy, &world, &status));
        assert_true(step_doubling_create(&doubling, &world, 0, tolerance));
        for (int tick = 0; tick < 20; tick++) {
            step_doubling_step(&doubling);
            assert_int_equal(sim_steps(world.sim), tick + 1); // not counted twice
        }
        assert_true(doubling.worst <= tolerance);
        assert_true(doubling.worst > 0.0);
        passes[k] = doubling.substeps;
        step_doubling_destroy(&doubling);
        world_destroy(&world);
        study_destroy_scene(&copy);

        FREED StudyTrace *trace =
            study_trace_create(bench.context.sample_count, bench.context.points.count);
        assert_true(study_trace_case(&bench.context, &what, 1, &run, trace));
        assert_int_equal(run.verdict, STUDY_OK);
        error[k] = study_errors(trace, reference).patch;
    }
    print_message("step doubling: errors %.3g, %.3g with %ld, %ld substeps\n", error[0], error[1],
                  passes[0], passes[1]);
    assert_true(passes[1] > passes[0]);
    assert_true(error[1] < 0.1 * error[0]);
}

// The pressed patch is that on which the load acts: its mean displacement, weighed by area, is what
// the load works on.
TEST(the_patch_is_where_the_load_is)
{
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, SHEET, &SHORT);
    const StudyPoints *points = &bench.context.points;
    double sum = 0.0;
    int inside = 0;
    assert_int_equal(points->count, 25);
    for (int p = 0; p < points->count; p++) {
        bool near = vec3_length(points->rest[p]) <= 0.03;
        assert_int_equal(points->weight[p] > 0.0, near);
        sum += points->weight[p];
        inside += near;
    }
    assert_int_equal(inside, 5); // the middle and its four neighbours, 25 mm away
    expect_near(sum, 1.0, 1e-14);
    StudyRun run;
    FREED StudyTrace *trace = trace_of(&bench, INTEGRATOR_RK4, 0.001, &run);
    for (int s = 0; s < trace->used; s++) {
        Vec3 mean = {0.0, 0.0, 0.0};
        for (int p = 0; p < points->count; p++)
            mean = vec3_madd(mean, points->weight[p], study_trace_points(trace, s)[p]);
        assert_true(mean.z < 0.0); // the way that it is pressed
        expect_near(vec3_length(vec3_sub(study_trace_sample(trace, s)->patch, mean)), 0.0, 1e-15);
    }
}

TEST(a_run_says_what_it_was)
{
    SCOPED(bench_destroy) Bench bench;
    StudyRun run;
    bench_create(&bench, SHEET, &(StudyOptions){.duration_s = 0.1, .repeats = 3});
    StudyCase own = study_scene_case(&bench.scene);
    assert_true(study_run_case(&bench.context, &own, &run));
    assert_int_equal(run.verdict, STUDY_OK);
    assert_int_equal(run.repeats, 3);
    assert_int_equal(run.nodes_least, 25);
    assert_int_equal(run.nodes_most, 25);
    assert_int_equal(run.links, 56); // 2 * 4 * 5 along, 16 across
    expect_near(run.rate_hz, 200.0, 0.0);
    assert_true(run.cpu_least <= run.cpu_median && run.cpu_median <= run.cpu_most);
    assert_true(run.tick_p50 <= run.tick_p99 && run.tick_p99 <= run.tick_most);
    assert_true(isnan(run.time.patch)); // no reference was made
}

// A taut sheet answers a slightly larger load with a slightly larger motion: by as much, if it is
// linear, as it is for small loads.
TEST(a_nudge_moves_a_sheet_by_as_much)
{
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, SHEET, &SHORT);
    StudyCase what = study_scene_case(&bench.scene);
    what.precision = PRECISION_DOUBLE;
    what.is_scene = false;
    StudyErrors moved;
    Status status = {0};
    assert_true(study_nudge(&bench.context, &what, &moved, &status));
    print_message("moved by %.3g\n", moved.patch);
    expect_at_least(moved.patch, 0.2 * STUDY_NUDGE); // its springs stiffen
    expect_at_most(moved.patch, 1.5 * STUDY_NUDGE);
    assert_true(isnan(moved.force)); // it has no tool
}
