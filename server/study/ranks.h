// A study on several machines: with the build option PLIANT_MPI the ranks of mpirun take cases, and
// the result is the same but for the times. Without it there is one rank. The only file that knows
// MPI.
#ifndef PLIANT_STUDY_RANKS_H
#define PLIANT_STUDY_RANKS_H

#include "study/reference.h"
#include "study/schedule.h"

// Called first and last by main. A code other than STATUS_OK ends the other ranks
// too, which may be waiting for this one.
void ranks_begin(int *argc, char ***argv);
void ranks_end(StatusCode code);
// Whether this rank is the one that speaks and writes files.
bool ranks_is_first(void);
int ranks_count(void);

// As study_make_references: the first rank makes them, the others are sent them.
bool ranks_make_references(StudyContext *context, const StudyCase *cases, int count,
                           StudyReferenceProgress *progress, void *user, StudyResult *result,
                           Status *status);
// As study_run_all; with more than one rank, each runs one case at a time, whatever `jobs` says,
// and only the first has the whole result and is told of progress.
bool ranks_run_all(const StudyContext *context, const StudyCase *cases, int count, int jobs,
                   StudyProgress *progress, void *user, StudyResult *result, Status *status);

#endif
