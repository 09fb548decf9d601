// SPDX-License-Identifier: MIT
// The error of bodies, as the simulation asks them for it (sim/error.c): what it asks, how often
// and for how much at a time, what becomes of the answers. The bodies are real; their estimates are
// those of a double, which says what it is told to.
#include "test.h"
#include "contact_bench.h"

#include "sim/error.h"

// What the double answers and what it was asked.
static struct {
    int work;        // elements of a round
    BodyError says;  // at its end
    int calls, done; // of this round; rounds so far
    int most;        // largest budget
    ErrorQuestion question;
    Vec3 place[ERROR_TOOLS], force[ERROR_TOOLS], axis[ERROR_TOOLS];
    double size[ERROR_TOOLS], depth[ERROR_TOOLS], kappa[ERROR_TOOLS];
} twin;

static bool twin_estimate(void *model, const ErrorQuestion *question, int budget, BodyError *error)
{
    static int left;
    assert_non_null(model);
    if (twin.calls++ == 0) {
        left = twin.work;
        twin.question = *question;
    }
    // Of one round there is one question.
    assert_int_equal(question->tool_count, twin.question.tool_count);
    for (int i = 0; i < question->tool_count; i++) {
        twin.place[i] = question->tool[i];
        twin.force[i] = question->force[i];
        twin.size[i] = question->size[i];
        twin.depth[i] = question->depth[i];
        twin.axis[i] = question->axis[i];
        twin.kappa[i] = question->kappa[i];
    }
    twin.most = budget > twin.most ? budget : twin.most;
    left -= budget;
    if (left > 0)
        return false;
    *error = twin.says;
    twin.calls = 0;
    twin.done++;
    return true;
}

// A seated sphere under a ball of 8 mm, at 1 kHz, which tells 50 errors a second.
static void create(Bench *bench, BodyOps *ops, int tools)
{
    BenchOptions options = bench_with_tool(bench_ico_sphere(2), bench_ball(0.008));
    options.fixing = BENCH_SEATED;
    options.error_hz = 50.0;
    options.tool_count = tools;
    options.tool[1] = bench_ball(0.004);
    options.tool[1].id = 2;
    bench_create(bench, &options);
    *ops = *bench->body->ops;
    ops->estimate = twin_estimate;
    bench->body->ops = ops;
    memset(&twin, 0, sizeof twin);
    twin.work = 1;
    twin.says = (BodyError){.displacement = 2e-4, .relative = 0.04, .force = {0.05, 0.1}};
}

static void press(Bench *bench, int tool)
{
    const double side = tool == 0 ? 1.0 : -1.0, radius = tool == 0 ? 0.008 : 0.004;
    bench_travel(bench, tool, vec3(side * (BENCH_RADIUS + radius), 0, 0),
                 vec3(side * (BENCH_RADIUS + radius - 0.004), 0, 0), 0.1);
    bench_run(bench, 0.1);
}

TEST(a_round_takes_a_few_percent_of_each_tick_and_rests_until_the_next_is_due)
{
    SCOPED(bench_destroy) Bench bench;
    BodyOps ops;
    create(&bench, &ops, 1);
    twin.work = 200000;
    bench_run(&bench, 1.0);
    // 4 % of a tick of 1 ms, at 2 ns a spring, is 20000 of them: a round has ten ticks. One
    // begins every 20.
    assert_int_equal(twin.most, 20000);
    assert_int_equal(twin.done, 50);
    assert_int_equal(sim_error_cycles(bench.sim), 50);
    // Work that does not end in time delays the next round; there is one call per tick at most.
    twin.work = 2000000;
    const int before = twin.done;
    bench_run(&bench, 1.0);
    assert_in_range(twin.done - before, 9, 10);
}

TEST(a_question_has_the_tools_that_touch_where_they_do)
{
    SCOPED(bench_destroy) Bench bench;
    BodyOps ops;
    create(&bench, &ops, 2);
    bench_run(&bench, 0.1);
    assert_int_equal(twin.question.tool_count, 0);
    press(&bench, 1);
    assert_int_equal(twin.question.tool_count, 1);
    // The second tool alone, between its centre and the wall, with what it feels. One round of 20
    // ticks ago a wall that comes to rest pushed within 1 % of what it does now.
    assert_true(twin.size[0] == 0.004);
    assert_true(vec3_length(vec3_sub(twin.place[0], vec3(-0.047, 0, 0))) < 0.004);
    const Vec3 felt = sim_wrench(bench.sim, 1)->force;
    assert_true(felt.x < -1e-3);
    assert_true(vec3_length(vec3_sub(twin.force[0], felt)) < 0.01 * vec3_length(felt));
    assert_true(fabs(twin.depth[0] - sim_wrench(bench.sim, 1)->depth) < 0.01 * twin.depth[0]);
    // Its middle, to the rounding of the proxy's way, and how faces push it.
    expect_at_most(vec3_length(vec3_sub(twin.axis[0], vec3(-0.05, 0, 0))), 1e-9);
    assert_true(twin.kappa[0] == bench.body->contact_kappa && twin.kappa[0] > 0.0);
    press(&bench, 0);
    assert_int_equal(twin.question.tool_count, 2);
    assert_true(twin.size[0] == 0.008 && twin.size[1] == 0.004);
}

TEST(answers_become_lengths_and_forces)
{
    SCOPED(bench_destroy) Bench bench;
    BodyOps ops;
    SimError error;
    SimToolError tool[2];
    create(&bench, &ops, 2);
    // Nothing is known before a round, and of the time step before a try.
    sim_error(bench.sim, 0, &error);
    assert_true(error.space == -1.0 && error.steps == -1.0 && error.total == -1.0);
    assert_true(error.relative == -1.0 && error.age == -1);
    press(&bench, 1);
    press(&bench, 0);
    sim_error(bench.sim, 0, &error);
    assert_true(error.space == 2e-4 && error.steps == -1.0 && error.total == 2e-4);
    assert_true(fabs(error.relative - 0.04) < 1e-15); // a quotient of quotients
    assert_in_range(error.age, 0, 20);
    // Shares are those of the question's tools, in its order; forces those of now.
    sim_tool_errors(bench.sim, tool);
    for (int t = 0; t < 2; t++) {
        const double felt = vec3_length(sim_wrench(bench.sim, t)->force);
        assert_true(fabs(tool[t].force - felt) < 1e-12 * felt);
        assert_true(fabs(tool[t].error - (t == 0 ? 0.05 : 0.1) * felt) < 1e-12 * felt);
    }
    // The time step's is added once there is a try.
    sim_try_step(bench.sim, 0);
    sim_error(bench.sim, 0, &error);
    assert_true(error.steps >= 0.0 && error.total == error.space + error.steps);
    // A tool that has left has no force, and its share is forgotten with the next round.
    bench_withdraw(&bench, 0);
    bench_run(&bench, 0.1);
    sim_tool_errors(bench.sim, tool);
    assert_true(tool[0].force == 0.0 && tool[0].error == 0.0 && tool[1].error > 0.0);
}

TEST(what_is_no_figure_is_never_told)
{
    static const double BAD[] = {(double)NAN, (double)INFINITY, -1.0};
    SCOPED(bench_destroy) Bench bench;
    BodyOps ops;
    SimError error;
    SimToolError tool[2];
    create(&bench, &ops, 2);
    press(&bench, 0);
    press(&bench, 1);
    for (int k = 0; k < 3; k++) {
        // Of a body nothing is known then,
        for (int which = 0; which < 2; which++) {
            const int64_t withheld = sim_guard_counts(bench.sim)->figures;
            twin.says = (BodyError){.displacement = which == 0 ? BAD[k] : 2e-4,
                                    .relative = which == 1 ? BAD[k] : 0.04};
            bench_run(&bench, 0.04);
            sim_error(bench.sim, 0, &error);
            sim_tool_errors(bench.sim, tool);
            assert_true(error.space == -1.0 && error.total == -1.0 && error.relative == -1.0);
            assert_true(error.age == -1 && tool[0].error == -1.0 && tool[1].error == -1.0);
            assert_true(sim_guard_counts(bench.sim)->figures > withheld);
        }
        // of a tool only its own is unknown.
        twin.says = (BodyError){.displacement = 2e-4, .relative = 0.04, .force = {BAD[k], 0.1}};
        bench_run(&bench, 0.04);
        sim_error(bench.sim, 0, &error);
        sim_tool_errors(bench.sim, tool);
        assert_true(error.space == 2e-4 && tool[0].error == -1.0 && tool[1].error > 0.0);
    }
    // At rest both may be zero.
    twin.says = (BodyError){0};
    bench_run(&bench, 0.04);
    sim_error(bench.sim, 0, &error);
    assert_true(error.space == 0.0 && error.total == 0.0 && error.relative == 0.0);
}

TEST(a_body_that_has_not_moved_has_no_large_relative_error)
{
    SCOPED(bench_destroy) Bench bench;
    BodyOps ops;
    SimError error;
    create(&bench, &ops, 1);
    twin.says = (BodyError){.displacement = 1e-12, .relative = 10.0};
    bench_run(&bench, 0.04);
    sim_error(bench.sim, 0, &error);
    const double least = 1e-3 * bench.body->surface.longest_edge;
    assert_true(fabs(error.relative - 1e-12 / least) < 1e-15);
}

TEST(a_reset_forgets_all_and_a_round_under_way_does_not_count)
{
    SCOPED(bench_destroy) Bench bench;
    BodyOps ops;
    SimError error;
    SimToolError tool[1];
    create(&bench, &ops, 1);
    twin.work = 200000;
    press(&bench, 0);
    sim_try_step(bench.sim, 0);
    while (twin.calls != 5)
        sim_step(bench.sim);
    const int done = twin.done;
    sim_reset(bench.sim);
    sim_error(bench.sim, 0, &error);
    sim_tool_errors(bench.sim, tool);
    assert_true(error.space == -1.0 && error.steps == -1.0 && error.age == -1);
    while (twin.done == done)
        sim_step(bench.sim);
    sim_error(bench.sim, 0, &error);
    assert_true(error.space == -1.0); // that round began before
    while (twin.done == done + 1)
        sim_step(bench.sim);
    sim_error(bench.sim, 0, &error);
    assert_true(error.space == 2e-4);
}

TEST(bodies_that_cannot_tell_are_passed_over)
{
    SCOPED(bench_destroy) Bench bench;
    BodyOps ops;
    SimError error;
    create(&bench, &ops, 1);
    ops.estimate = NULL;
    bench_run(&bench, 1.0);
    assert_int_equal(sim_error_cycles(bench.sim), 50);
    sim_error(bench.sim, 0, &error);
    assert_true(error.age == -1 && error.space == -1.0 && twin.done == 0);
}

TEST(the_motion_is_bit_identical_with_and_without_estimates)
{
    uint64_t hash[2];
    for (int asked = 0; asked < 2; asked++) {
        SCOPED(bench_destroy) Bench bench;
        BenchOptions options = bench_with_tool(bench_ico_sphere(2), bench_ball(0.008));
        options.fixing = BENCH_SEATED;
        options.error_hz = asked ? 50.0 : 0.0;
        bench_create(&bench, &options);
        assert_true((bench.sim->errors != NULL) == asked);
        press(&bench, 0);
        hash[asked] = state_hash(&bench.state);
    }
    assert_true(hash[0] == hash[1]);
}
