// Which runs are worth looking at: those that no other beats in both cost and error.
#ifndef PLIANT_STUDY_PARETO_H
#define PLIANT_STUDY_PARETO_H

#include "study/study.h"

// The one number by which runs are compared, of the errors that a run has: that of the pressed
// patch; without a patch that of the surface. NAN: neither.
double study_error(const StudyErrors *errors);

// front[i]: no other candidate costs at most as much and errs at most as much, one of them less.
// All arrays are [count]; a cost or error that is not finite: no candidate. Of candidates that are
// equal in both all are marked.
void pareto_front(int count, const double *costs, const double *errors, bool *front);

// The front of the total error over the median cost, of the runs with verdict ok; front:
// [run_count].
void study_front_total(const StudyResult *result, bool *front);

// The run that is exactly the scene's own choice, or NULL.
const StudyRun *study_scene_run(const StudyResult *result);
// The reference in time of a case's mesh, or NULL.
const StudyReference *study_time_reference(const StudyResult *result, const StudyCase *of);
// What a case's mesh is called: what follows the comma in the names of its cases.
const char *study_mesh_words(const StudyResult *result, const StudyCase *like);

#endif
