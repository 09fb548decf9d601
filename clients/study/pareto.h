// The Pareto front: runs that no other run beats in both cost and error.
#ifndef PLIANT_STUDY_PARETO_H
#define PLIANT_STUDY_PARETO_H

#include "study/study.h"

// Returns the error by which runs are compared: that of the pressed patch; without a patch that of
// the surface. NAN: neither.
double study_error(const StudyErrors *errors);

// Sets front[i] if no other candidate has at most its cost and at most its error, one of them less.
// All arrays are [count]; a cost or error that is not finite excludes the candidate. Marks all of
// several equal candidates.
void pareto_front(int count, const double *costs, const double *errors, bool *front);

// Finds the front of total error over median cost, of the runs with verdict ok; front: [run_count].
void study_front_total(const StudyResult *result, bool *front);

// Returns the run that is exactly the scene's own choice, or NULL.
const StudyRun *study_scene_run(const StudyResult *result);
// Returns the reference in time of a case's mesh, or NULL.
const StudyReference *study_time_reference(const StudyResult *result, const StudyCase *of);
// Returns the name of a case's mesh: the part after the comma in the names of its cases.
const char *study_mesh_words(const StudyResult *result, const StudyCase *like);

#endif
