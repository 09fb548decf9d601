#include "study/schedule.h"

#include "study/errors.h"
#include "study/pool.h"
#include "study/run.h"

#include <stdio.h>
#include <string.h>

typedef struct Schedule {
    const StudyContext *context;
    const StudyCase *cases;
    int count, done;
    StudyProgress *progress;
    void *user;
    StudyResult *result;
} Schedule;

static void lose(StudyRun *run, const StudyCase *what, StudyVerdict verdict, const char *why)
{
    memset(run, 0, sizeof *run);
    run->what = *what;
    run->verdict = verdict;
    run->time = run->total = study_no_errors();
    snprintf(run->why, sizeof run->why, "%s", why);
}

static void run_task(void *user, int task, void *result)
{
    const Schedule *schedule = user;
    const StudyCase *what = &schedule->cases[task];
    if (!study_run_case(schedule->context, what, result))
        lose(result, what, STUDY_SKIPPED, "out of memory");
}

static void task_done(void *user, int task, const void *result, const char *why)
{
    Schedule *schedule = user;
    StudyRun *run = &schedule->result->run[task];
    if (result != NULL)
        memcpy(run, result, sizeof *run);
    else
        lose(run, &schedule->cases[task],
             strcmp(why, POOL_TOO_LONG) == 0 ? STUDY_SKIPPED : STUDY_BAD, why);
    schedule->done++;
    if (schedule->progress != NULL)
        schedule->progress(schedule->user, schedule->done, schedule->count, run);
}

bool study_run_all(const StudyContext *context, const StudyCase *cases, int count, int jobs,
                   StudyProgress *progress, void *user, StudyResult *result, Status *status)
{
    Schedule schedule = {.context = context,
                         .cases = cases,
                         .count = count,
                         .progress = progress,
                         .user = user,
                         .result = result};
    // A run ends itself after limit_s per repeat; one that goes on after that hangs.
    const Pool pool = {.task_count = count,
                       .jobs = jobs,
                       .result_bytes = sizeof(StudyRun),
                       .timeout_s = 4.0 * context->limit_s + 60.0,
                       .user = &schedule,
                       .run = run_task,
                       .done = task_done};
    result->run_count = count;
    return pool_run(&pool, status);
}
