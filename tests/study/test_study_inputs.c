// SPDX-License-Identifier: MIT
// What drives a scene depends on simulated time alone.
#include "test.h"
#include "study_bench.h"

#include "study/sampler.h"
#include "study/inputs.h"
#include "study/run.h"
#include "study/context.h"

#define BALL(more)                                                                                 \
    "rate_hz = 2000.0; precision = \"double\";\n"                                                  \
    "bodies = ( { name = \"ball\";\n"                                                              \
    "  mesh = { generator = \"ico_sphere\"; nodes = 162; radius = 0.05; };\n"                      \
    "  material = { youngs_modulus_2d = 80.0; areal_density = 4.2; damping_time = 2.0e-4; };\n"    \
    "  shape = { angular_frequency = 50.0; damping_ratio = 0.1; };\n"                              \
    "  fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.03]); } ); } );\n" more
#define PROBE                                                                                      \
    "tools = ( { id = 1; kind = \"probe\";"                                                        \
    " capsules = ( { from = [0.0, 0.0, 0.0]; to = [0.1, 0.0, 0.0]; radius = 0.01; } );"            \
    " max_force = 3.3; } );\n"

// Where the tool is at the end of each tick, at one tick rate.
static void follow(const Bench *bench, double step, Vec3 *path, int count, double every_s)
{
    StudyCase what = study_scene_case(&bench->scene);
    StudyScene copy;
    World world;
    Status status = {0};
    StudyPlay play;
    what.is_scene = false;
    what.integrator = INTEGRATOR_RK4;
    what.time_step = step;
    assert_true(study_build(&bench->context, &what, false, &copy, &world, &status));
    assert_true(study_play_begin(&play, &bench->context, &world, &copy.scene, &status));
    int ticks = (int)lround(every_s / sim_tick(world.sim));
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < ticks; k++) {
            assert_true(study_play_tick(&play));
            sim_step(world.sim);
        }
        path[i] = sim_tool_motion(world.sim, 0)->end_position;
    }
    study_play_end(&play);
    world_destroy(&world);
    study_destroy_scene(&copy);
}

AROUND_ALL(scratch_begin, scratch_end)

// Also between the ticks of the slower one: every 2 ms of ticks of 0.5 ms and of 1 ms. Where the
// way begins, turns and ends the target notices within a tick, so later by at most half of a
// millisecond there; the filter keeps that for its lag. Elsewhere the two agree to rounding.
TEST(the_tool_goes_the_same_way_at_any_tick_rate)
{
    enum { COUNT = 350 };
    static Vec3 slow[COUNT], fast[COUNT];
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, BALL(PROBE), &(StudyOptions){.repeats = 1});
    assert_int_equal(bench.context.inputs.drive, DRIVE_PRESS);
    follow(&bench, 0.001, slow, COUNT, 0.002);
    follow(&bench, 0.0005, fast, COUNT, 0.002);
    double farthest = 0.0, fastest = 0.0;
    int same = 0;
    for (int i = 1; i < COUNT; i++)
        fastest = fmax(fastest, vec3_length(vec3_sub(slow[i], slow[i - 1])) / 0.002);
    for (int i = 1; i < COUNT; i++) {
        const double apart = vec3_length(vec3_sub(slow[i], fast[i]));
        expect_at_most(apart, 0.0005 * fastest);
        same += apart < 1e-12;
        farthest = fmax(farthest, vec3_length(vec3_sub(slow[i], bench.context.inputs.press.start)));
    }
    expect_at_least(same, COUNT / 2);
    // It went all the way, and came back.
    expect_near(farthest, bench.context.inputs.press.way, 1e-6);
    expect_near(vec3_length(vec3_sub(slow[COUNT - 1], bench.context.inputs.press.start)), 0.0,
                1e-12);
}

TEST(the_press_comes_from_the_free_side_with_its_shaft_outside)
{
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, BALL(PROBE), &(StudyOptions){.repeats = 1});
    const StudyPress *press = &bench.context.inputs.press;
    // The bottom is held: from the top, down. The nodes of an icosphere are not quite at the pole.
    assert_true(press->inward.z < -0.9);
    Vec3 shaft = quat_rotate(press->orientation, vec3(1.0, 0.0, 0.0));
    expect_near(vec3_dot(shaft, press->inward), -1.0, 1e-9);
    // The ball of 1 cm starts clear of the body and ends a tenth of 10 cm inside.
    expect_near(vec3_length(press->start), 0.05 + 0.01 + 0.005, 1e-3);
    expect_near(press->way, 0.005 + 0.01, 2e-4);
    double sum = 0.0;
    for (int p = 0; p < bench.context.points.count; p++)
        if (bench.context.points.weight[p] > 0.0) {
            assert_true(bench.context.points.rest[p].z > 0.0);
            sum += bench.context.points.weight[p];
        }
    expect_near(sum, 1.0, 1e-12);
}

TEST(a_press_deforms_and_is_felt)
{
    SCOPED(bench_destroy) Bench bench;
    StudyRun run;
    bench_create(&bench, BALL(PROBE), &(StudyOptions){.repeats = 1});
    StudyCase own = study_scene_case(&bench.scene);
    FREED StudyTrace *trace =
        study_trace_create(bench.context.sample_count, bench.context.points.count);
    assert_true(study_trace_case(&bench.context, &own, 1, &run, trace));
    assert_int_equal(run.verdict, STUDY_OK);
    double deepest = 0.0, hardest = 0.0;
    for (int s = 0; s < trace->used; s++) {
        const StudySample *sample = study_trace_sample(trace, s);
        deepest = fmax(deepest, vec3_dot(sample->patch, bench.context.inputs.press.inward));
        hardest = fmax(hardest, -vec3_dot(sample->force, bench.context.inputs.press.inward));
    }
    assert_true(deepest > 0.002 && deepest < 0.011); // of a tip that goes 1 cm deep
    assert_true(hardest > 0.01 && hardest <= 3.4);   // up to the tool's largest, and rounding
    const StudySample *last = study_trace_sample(trace, trace->used - 1);
    expect_near(vec3_length(last->force), 0.0, 0.0); // the tool is away
}

TEST(a_scene_that_nothing_moves_gets_a_load)
{
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, BALL(""), &(StudyOptions){.repeats = 1});
    assert_int_equal(bench.context.inputs.drive, DRIVE_LOADS);
    assert_int_equal(bench.context.scene.load_count, 1);
    assert_int_equal(bench.scene.load_count, 0); // the scene that was given is not touched
    expect_in(bench.context.inputs.text, "built-in load");
}

TEST(a_scene_with_weight_falls)
{
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, BALL("gravity = [0.0, 0.0, -9.81];\n"), &(StudyOptions){.repeats = 1});
    assert_int_equal(bench.context.scene.load_count, 0);
    expect_in(bench.context.inputs.text, "weight");
}

// --- a log ---

static void write_log(const char *path, int64_t ticks)
{
    Status status = {0};
    const InputLogHeader header = {
        .scene = "x", .prefix = "PLIANT", .isa = "baseline", .rate_hz = 2000.0};
    InputLogWriter *writer = input_log_create(path, &header, &status);
    assert_non_null(writer);
    for (int64_t step = 0; step < ticks; step++) {
        AppliedInput applied = {.step = step, .input = {.kind = INPUT_POSE, .sender = 7}};
        Input *input = &applied.input;
        // Down from 65 mm by 20 mm.
        input->pose.tool = 1;
        input->pose.position[2] = 0.065 - 0.02 * (double)step / (double)ticks;
        input->pose.orientation[0] = 1.0;
        input->pose.active = true;
        assert_true(input_log_write(writer, &applied));
    }
    assert_true(input_log_close(writer, ticks, 0, &status));
}

TEST(a_log_drives_the_scene_at_any_rate)
{
    SCOPED(bench_destroy) Bench bench;
    StudyRun run;
    char path[SCRATCH_PATH];
    write_log(scratch_path(&scratch_space, "x.log", path), 600);
    bench_create(&bench, BALL(PROBE), &(StudyOptions){.repeats = 1, .input_log = path});
    assert_int_equal(bench.context.inputs.drive, DRIVE_LOG);
    expect_near(bench.context.inputs.end_s, 0.3, 1e-9);
    expect_near(bench.context.options.duration_s, 0.6, 1e-9);
    // It first touched near the top.
    assert_true(bench.context.inputs.center.z > 0.04);
    StudyTrace *trace[2];
    for (int k = 0; k < 2; k++) {
        StudyCase what = study_scene_case(&bench.scene);
        what.is_scene = false;
        what.integrator = INTEGRATOR_RK4;
        what.time_step = k == 0 ? 0.0005 : 0.001;
        trace[k] = study_trace_create(bench.context.sample_count, bench.context.points.count);
        assert_true(study_trace_case(&bench.context, &what, 1, &run, trace[k]));
        assert_int_equal(run.verdict, STUDY_OK);
        assert_true(vec3_length(study_trace_sample(trace[k], 28)->force) > 0.01);
    }
    // Half a millisecond more until a pose counts, of 66 mm/s: 1 % of some millimetres.
    assert_true(study_errors(trace[1], trace[0]).patch < 0.03);
    free(trace[0]);
    free(trace[1]);
}
