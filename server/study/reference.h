// The converged runs that cases are compared with: one for each mesh among the cases (error of the
// time steps alone), and the finest mesh of all (total error). Each is the last of three runs,
// every one twice as fine as the one before, which tell its own error.
#ifndef PLIANT_STUDY_REFERENCE_H
#define PLIANT_STUDY_REFERENCE_H

#include "study/context.h"

// For a progress bar: first with done = 0 and what it will take, then what each run was.
typedef void StudyReferenceProgress(void *user, int done, int count, const char *what);

// Makes all references that `cases` need, up to options.jobs at a time; they stay in the context,
// what is known of them goes to `result` too. A reference that cannot be made is `known = false`
// and says why in `what`. `progress` may be NULL. False with `status`: out of memory, no process.
bool study_make_references(StudyContext *context, const StudyCase *cases, int count,
                           StudyReferenceProgress *progress, void *user, StudyResult *result,
                           Status *status);

// In words, what that will take: runs, steps and about how many seconds of one processor. False:
// out of memory.
bool study_plan_references(StudyContext *context, const StudyCase *cases, int count, char *text,
                           size_t size);

#endif
