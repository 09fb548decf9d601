// SPDX-License-Identifier: MIT
// Cases in processes of their own: the same results for any number of them, and a task that dies
// loses nothing but itself.
#include "test.h"
#include "study_bench.h"

#include "study/pool.h"
#include "study/run.h"

#include <signal.h>
#include <unistd.h>

// --- The pool ---

enum { TASKS = 9, MANY = 100, BIG = 100000 }; // results larger than a pipe holds

typedef struct Trial {
    int done[TASKS];
    bool lost[TASKS];
    char why[TASKS][160];
    bool whole;
    int deadly, hanging; // tasks; -1: none; MANY: all but the last
    pid_t parent;
} Trial;

static void trial_run(void *user, int task, void *result)
{
    const Trial *trial = user;
    int *number = result;
    bool dies = task == trial->deadly || (trial->deadly == MANY && task < TASKS - 1);
    if (dies && getpid() != trial->parent)
        kill(getpid(), SIGKILL);
    while (task == trial->hanging && getpid() != trial->parent)
        pause();
    for (int i = 0; i < BIG; i++)
        number[i] = 1000 * task + i;
}

static void trial_done(void *user, int task, const void *result, const char *why)
{
    Trial *trial = user;
    const int *number = result;
    trial->done[task]++;
    trial->lost[task] = result == NULL;
    if (why != NULL)
        snprintf(trial->why[task], sizeof trial->why[task], "%s", why);
    for (int i = 0; i < BIG && number != NULL; i++)
        trial->whole = trial->whole && number[i] == 1000 * task + i;
}

static Trial try_pool(int jobs, int deadly, int hanging, double timeout_s)
{
    Trial trial = {.whole = true, .deadly = deadly, .hanging = hanging, .parent = getpid()};
    Status status = {0};
    const Pool pool = {.task_count = TASKS,
                       .jobs = jobs,
                       .result_bytes = BIG * sizeof(int),
                       .timeout_s = timeout_s,
                       .user = &trial,
                       .run = trial_run,
                       .done = trial_done};
    assert_true(pool_run(&pool, &status));
    for (int t = 0; t < TASKS; t++)
        assert_int_equal(trial.done[t], 1);
    assert_true(trial.whole);
    return trial;
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(every_task_is_done_once_by_any_number_of_processes)
{
    for (int jobs = 1; jobs <= 12; jobs = 2 * jobs + 1) {
        Trial trial = try_pool(jobs, -1, -1, 0.0);
        for (int t = 0; t < TASKS; t++)
            assert_false(trial.lost[t]);
    }
}

TEST(a_task_that_dies_loses_only_itself)
{
    for (int deadly = 0; deadly < TASKS; deadly += TASKS - 1) {
        Trial trial = try_pool(3, deadly, -1, 0.0);
        for (int t = 0; t < TASKS; t++)
            assert_int_equal(trial.lost[t], t == deadly);
        expect_in(trial.why[deadly], "signal 9");
    }
}

// More than there are processes at a time: each is replaced.
TEST(the_last_task_is_done_when_all_others_die)
{
    Trial trial = try_pool(2, MANY, -1, 0.0);
    for (int t = 0; t < TASKS; t++)
        assert_int_equal(trial.lost[t], t < TASKS - 1);
}

TEST(a_task_that_hangs_is_ended)
{
    Trial trial = try_pool(2, -1, 4, 1.0);
    for (int t = 0; t < TASKS; t++)
        assert_int_equal(trial.lost[t], t == 4);
    assert_string_equal(trial.why[4], POOL_TOO_LONG);
}

// --- A study ---

static StudyCase cases[STUDY_CASES];
static StudyResult result[3];

// All but the times.
static void expect_same(const StudyRun *a, const StudyRun *b)
{
    assert_string_equal(a->what.name, b->what.name);
    assert_int_equal(a->verdict, b->verdict);
    assert_string_equal(a->why, b->why);
    assert_int_equal(a->substeps, b->substeps);
    assert_int_equal(a->nodes_most, b->nodes_most);
    assert_int_equal(a->links, b->links);
    assert_memory_equal(&a->time_step, &b->time_step, sizeof a->time_step);
    assert_memory_equal(&a->time, &b->time, sizeof a->time);
    assert_memory_equal(&a->total, &b->total, sizeof a->total);
}

TEST(results_do_not_depend_on_the_number_of_processes)
{
    static const char text[] = SHEET_BODY(
        "levels = 1; adapt = { force = 1e-4; };") "loads = ( { center = [0.0, 0.0, 0.0]; radius = "
                                                  "0.03; force = [0.0, 0.0, -0.02];"
                                                  " duration = 10.0; } );\n";
    int count = 0;
    for (int jobs = 1; jobs <= 3; jobs++) {
        Bench bench;
        Status status = {0};
        StudyResult *of = &result[jobs - 1];
        bench_create(&bench, text,
                     &(StudyOptions){.duration_s = 0.1, .repeats = 1, .jobs = jobs, .quick = true});
        count = study_make_cases(&bench.scene, &bench.context.options, cases);
        assert_true(study_make_references(&bench.context, cases, count, NULL, NULL, of, &status));
        assert_true(study_run_all(&bench.context, cases, count, jobs, NULL, NULL, of, &status));
        bench_destroy(&bench);
        int told = 0, refused = 0;
        assert_int_equal(of->run_count, count);
        for (int i = 0; i < count; i++) {
            assert_string_equal(of->run[i].what.name, cases[i].name);
            expect_same(&of->run[i], &result[0].run[i]);
            told += isfinite(of->run[i].time.patch) && isfinite(of->run[i].total.patch);
            refused += of->run[i].verdict == STUDY_REFUSED;
        }
        assert_int_equal(told + refused, count); // a refused case stops nothing
        assert_true(told > refused);
        for (int m = 0; m < of->mesh_count; m++)
            assert_memory_equal(&of->mesh[m].reference.own_error,
                                &result[0].mesh[m].reference.own_error, sizeof(double));
    }
}

// The references of a mesh that changes nothing: their own error is far below that of the cases.
TEST(references_are_better_than_what_they_judge)
{
    SCOPED(bench_destroy) Bench bench;
    Status status = {0};
    StudyResult *of = &result[0];
    memset(of, 0, sizeof *of);
    bench_create(&bench, SHEET,
                 &(StudyOptions){
                     .duration_s = 0.2, .repeats = 1, .jobs = 1, .quick = true, .only = "level 0"});
    int count = study_make_cases(&bench.scene, &bench.context.options, cases);
    assert_true(study_make_references(&bench.context, cases, count, NULL, NULL, of, &status));
    assert_int_equal(of->mesh_count, 1);
    const StudyReference *reference = &of->mesh[0].reference;
    print_message("%s: differences %.3g %.3g, order %.3f, own error %.3g\n", reference->what,
                  reference->difference[0], reference->difference[1], reference->order,
                  reference->own_error);
    assert_true(reference->known);
    expect_near(reference->order, 4.0, 0.3); // RK4, near where rounding begins
    assert_true(study_run_all(&bench.context, cases, count, 1, NULL, NULL, of, &status));
    for (int i = 0; i < count; i++) {
        const StudyRun *run = &of->run[i];
        // RK4 with the steps that the reference is made of is as good as it.
        if (run->verdict == STUDY_OK && run->what.precision == PRECISION_DOUBLE &&
            run->what.integrator != INTEGRATOR_RK4)
            assert_true(run->time.patch > 100.0 * reference->own_error);
    }
    // Level 2 is the finest of all: a sheet's level 0 is not as good as that.
    expect_in(of->finest.what, "level 2");
    assert_true(of->run[0].total.patch > of->run[0].time.patch);
}
