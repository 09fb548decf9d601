// A study on several machines: with the build option PLIANT_MPI the ranks of mpirun share the
// cases, and the result is the same except for times. Without it there is one rank. The only file
// that uses MPI.
#ifndef PLIANT_STUDY_RANKS_H
#define PLIANT_STUDY_RANKS_H

#include "study/run.h"

// Called first and last by main. A code other than STATUS_OK ends the other ranks, which may be
// waiting for this one.
void ranks_begin(int *argc, char ***argv);
void ranks_end(StatusCode code);
// True for the rank that prints and writes files.
bool ranks_is_first(void);
int ranks_count(void);

// Like study_make_references: the first rank makes them and sends them to the others.
bool ranks_make_references(StudyContext *context, const StudyCase *cases, int count,
                           StudyReferenceProgress *progress, void *user, StudyResult *result,
                           Status *status);
// Like study_run_all; with several ranks, each runs one case at a time, whatever `jobs` is, and
// only the first gets the whole result and reports progress.
bool ranks_run_all(const StudyContext *context, const StudyCase *cases, int count, int jobs,
                   StudyProgress *progress, void *user, StudyResult *result, Status *status);

#endif
