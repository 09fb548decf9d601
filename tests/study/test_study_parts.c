// SPDX-License-Identifier: MIT
// The parts of a study as files: what has ended is not run again, what a process died of is run by
// another, and several processes share the rest.
#include "scratch_folder.h"
#include "test.h"

#include "study/parts.h"

#include <errno.h>
#include <signal.h>
#include <sys/wait.h>

enum { TASKS = 12, KEY = 77 };

// Each task leaves a letter in a file of its own whenever it is run.
typedef struct Trial {
    int deadly;      // the task that kills its process; -1: none
    int slow_us;     // of each task
    int done[TASKS]; // results that came
    bool lost[TASKS];
    char why[TASKS][160];
} Trial;

typedef struct Answer {
    int number;
    char why[160];
} Answer;

static int times_run(int task)
{
    char name[32];
    size_t size = 0;
    snprintf(name, sizeof name, "run-%d", task);
    if (access(scratch_at(name), F_OK) != 0)
        return 0;
    free(scratch_read(&scratch_space, name, &size));
    return (int)size;
}

static void trial_run(void *user, int task, void *result)
{
    const Trial *trial = user;
    char name[32], path[SCRATCH_PATH];
    snprintf(name, sizeof name, "run-%d", task);
    FILE *file = fopen(scratch_path(&scratch_space, name, path), "a");
    fputc('x', file);
    fclose(file);
    if (task == trial->deadly)
        kill(getpid(), SIGKILL);
    usleep((useconds_t)trial->slow_us);
    ((Answer *)result)->number = 100 + task;
}

static void trial_lose(void *user, int task, void *result, const char *why)
{
    (void)user;
    Answer *answer = result;
    answer->number = -task;
    snprintf(answer->why, sizeof answer->why, "%s", why);
}

static void trial_done(void *user, int task, const void *result, const char *why)
{
    Trial *trial = user;
    const Answer *answer = result;
    (void)why;
    trial->done[task]++;
    trial->lost[task] = answer->number != 100 + task;
    snprintf(trial->why[task], sizeof trial->why[task], "%s", answer->why);
}

static bool run_trial(Trial *trial, int jobs, bool fresh)
{
    Parts parts;
    Status status = {0};
    const Pool pool = {.task_count = TASKS,
                       .jobs = jobs,
                       .result_bytes = sizeof(Answer),
                       .user = trial,
                       .run = trial_run,
                       .done = trial_done};
    bool ok = parts_open(&parts, scratch_space.folder, KEY, fresh, &status) &&
              parts_run(&parts, "task", &pool, trial_lose, &status);
    parts_close(&parts);
    return ok;
}

// Runs a trial in a process of its own.
static pid_t begin(const Trial *trial, int jobs)
{
    const pid_t pid = fork();
    if (pid == 0) {
        Trial own = *trial;
        _exit(run_trial(&own, jobs, false) ? 0 : 1);
    }
    return pid;
}

static int end(pid_t pid)
{
    int how = 0;
    while (waitpid(pid, &how, 0) < 0 && errno == EINTR)
        ;
    return how;
}

static void expect_all_done(const Trial *trial)
{
    for (int t = 0; t < TASKS; t++) {
        assert_int_equal(trial->done[t], 1);
        assert_false(trial->lost[t]);
    }
}

AROUND_EACH(scratch_begin, scratch_end)

TEST(what_has_ended_is_not_run_again)
{
    for (int round = 0; round < 2; round++) {
        Trial trial = {.deadly = -1};
        assert_true(run_trial(&trial, 1 + round, false));
        expect_all_done(&trial);
    }
    for (int t = 0; t < TASKS; t++)
        assert_int_equal(times_run(t), 1);
    // A fresh start begins again.
    Trial trial = {.deadly = -1};
    assert_true(run_trial(&trial, 1, true));
    for (int t = 0; t < TASKS; t++)
        assert_int_equal(times_run(t), 2);
}

TEST(a_process_that_dies_loses_its_part_to_the_next)
{
    const Trial deadly = {.deadly = 5};
    assert_true(WIFSIGNALED(end(begin(&deadly, 1))));
    assert_int_equal(times_run(4), 1);
    assert_int_equal(times_run(6), 0);
    Trial trial = {.deadly = -1};
    assert_true(run_trial(&trial, 1, false));
    expect_all_done(&trial);
    for (int t = 0; t < TASKS; t++)
        assert_int_equal(times_run(t), t == 5 ? 2 : 1);
}

// Else it would end every process that takes part, one after the other.
TEST(a_part_that_kills_its_process_three_times_is_lost)
{
    Trial deadly = {.deadly = 5};
    for (int k = 0; k < 3; k++)
        assert_true(WIFSIGNALED(end(begin(&deadly, 1))));
    assert_true(run_trial(&deadly, 1, false));
    assert_int_equal(times_run(5), 3);
    for (int t = 0; t < TASKS; t++)
        assert_int_equal(deadly.lost[t], t == 5);
    expect_in(deadly.why[5], "died");
}

TEST(a_part_that_dies_in_a_child_is_lost_for_all)
{
    for (int round = 0; round < 2; round++) {
        Trial trial = {.deadly = 5};
        assert_true(run_trial(&trial, 2, false));
        assert_int_equal(times_run(5), 1);
        for (int t = 0; t < TASKS; t++)
            assert_int_equal(trial.lost[t], t == 5);
        expect_in(trial.why[5], "signal 9");
    }
}

TEST(processes_share_the_parts_and_each_gets_all_results)
{
    // Long enough that the others are there before the first has run all.
    Trial trial = {.deadly = -1, .slow_us = 20000};
    pid_t other[3];
    for (int k = 0; k < 3; k++)
        other[k] = begin(&trial, 1 + k);
    assert_true(run_trial(&trial, 1, false));
    expect_all_done(&trial);
    for (int k = 0; k < 3; k++)
        assert_int_equal(end(other[k]), 0);
    for (int t = 0; t < TASKS; t++)
        assert_int_equal(times_run(t), 1);
}

TEST(parts_of_another_study_are_refused)
{
    Parts parts, other;
    Status status = {0};
    assert_true(parts_open(&parts, scratch_space.folder, KEY, false, &status));
    assert_false(parts_open(&other, scratch_space.folder, KEY + 1, false, &status));
    assert_int_equal(status.code, STATUS_INVALID);
    expect_in(status.text, "parts: of another scene, options or program");
    // Nor is a study begun again that another process takes part in.
    status = (Status){0};
    assert_false(parts_open(&other, scratch_space.folder, KEY + 1, true, &status));
    expect_in(status.text, "another process runs this study");
    parts_close(&parts);
    status = (Status){0};
    assert_true(parts_open(&other, scratch_space.folder, KEY + 1, true, &status));
    parts_close(&other);
}

TEST(a_complete_study_has_no_parts_left_and_runs_nothing)
{
    Trial trial = {.deadly = -1};
    Parts parts;
    Status status = {0};
    assert_true(run_trial(&trial, 1, false));
    assert_true(parts_open(&parts, scratch_space.folder, KEY, false, &status));
    assert_false(parts_complete(&parts));
    parts_finish(&parts);
    assert_true(parts_complete(&parts));
    Answer answer;
    assert_false(parts_load(&parts, "task", 0, &answer, sizeof answer));
    parts_close(&parts);
    Trial again = {.deadly = -1};
    assert_true(run_trial(&again, 1, false));
    assert_int_equal(times_run(0), 1);
}
