// Runs one case: builds its world, drives it, samples it, and measures its cost.
#ifndef PLIANT_STUDY_RUN_H
#define PLIANT_STUDY_RUN_H

#include "study/context.h"

// Fills `run`; its verdict is the outcome; errors are set if the context has references. Returns
// false if memory runs out. Depends on its arguments alone, except for times.
bool study_run_case(const StudyContext *context, const StudyCase *what, StudyRun *run);

// Does the same once, without errors, with the samples in `trace` (made with the context's counts)
// or NULL.
bool study_trace_case(const StudyContext *context, const StudyCase *what, int repeats,
                      StudyRun *run, StudyTrace *trace);

// Runs all cases of a study, several at a time.

// Receives a finished case; in the parent, in order of completion.
typedef void StudyProgress(void *user, int done, int count, const StudyRun *run);

// Runs the cases with up to `jobs` processes. result->run [count] are in the order of the cases,
// and the same (except for times) for any number of jobs. A case whose process dies is STUDY_BAD,
// one that takes too long STUDY_SKIPPED. Needs the references. `progress` may be NULL.
bool study_run_all(const StudyContext *context, const StudyCase *cases, int count, int jobs,
                   StudyProgress *progress, void *user, StudyResult *result, Status *status);

#endif
