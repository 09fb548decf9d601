// Runs all cases of a study, several at a time.
#ifndef PLIANT_STUDY_SCHEDULE_H
#define PLIANT_STUDY_SCHEDULE_H

#include "study/context.h"

// Receives a finished case; in the parent, in order of completion.
typedef void StudyProgress(void *user, int done, int count, const StudyRun *run);

// Runs the cases with up to `jobs` processes. result->run [count] are in the order of the cases,
// and the same (except for times) for any number of jobs. A case whose process dies is STUDY_BAD,
// one that takes too long STUDY_SKIPPED. Needs the references. `progress` may be NULL.
bool study_run_all(const StudyContext *context, const StudyCase *cases, int count, int jobs,
                   StudyProgress *progress, void *user, StudyResult *result, Status *status);

#endif
