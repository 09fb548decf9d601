// The converged runs that cases are compared with: one for each mesh among the cases (error of the
// time steps alone), and the finest mesh of all (total error). Each is the last of three runs,
// every one twice as fine as the one before, from which its own error is estimated.
#ifndef PLIANT_STUDY_REFERENCE_H
#define PLIANT_STUDY_REFERENCE_H

#include "study/context.h"

// Reports progress: first with done = 0 and a description of the work, then each run.
typedef void StudyReferenceProgress(void *user, int done, int count, const char *what);

// Makes all references that `cases` need, up to options.jobs at a time; the context owns them, and
// their data is copied to `result`. A reference that cannot be made has `known = false` and the
// reason in `what`. `progress` may be NULL. Returns false with `status` if memory or processes run
// out.
bool study_make_references(StudyContext *context, const StudyCase *cases, int count,
                           StudyReferenceProgress *progress, void *user, StudyResult *result,
                           Status *status);

// Describes the work in words: runs, steps and estimated seconds of one processor. Returns false if
// memory runs out.
bool study_plan_references(StudyContext *context, const StudyCase *cases, int count, char *text,
                           size_t size);

#endif
