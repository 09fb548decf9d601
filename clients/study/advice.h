// Advises the cheapest case that is accurate enough and keeps the rate.
#ifndef PLIANT_STUDY_ADVICE_H
#define PLIANT_STUDY_ADVICE_H

#include "study/study.h"

// Share of a period that 99 of 100 ticks may take; the rest is for the loop, the other threads and
// a busier body.
#define ADVICE_SHARE 0.7

enum { ADVICE_TEXT = 1024 };

typedef struct Advice {
    int run;  // in result->run; -1: none, no case can be compared
    bool met; // all limits are met; else the nearest case is named and `sentence` says what it
              // misses
    bool time_only; // no usable reference of the total error: only the error of the time steps is
                    // judged
    double error;   // of the run and its reference together
    char sentence[ADVICE_TEXT];
} Advice;

// Chooses among the runs with verdict ok that a scene can specify (not step doubling). The advised
// run has the least median cost of those whose error plus that of the reference (its estimate, but
// at least the last difference that it is based on) is at most `error` (a fraction), that ran at
// `rate_hz` or more, whose 99th percentile of a tick is at most ADVICE_SHARE of the period, and
// whose median cost is at most ADVICE_SHARE. If the reference of the total error is missing or
// itself has an error above `error`, the error in time counts, for runs on the scene's own mesh
// alone: it does not apply to coarser ones.
void advice_make(const StudyResult *result, double error, double rate_hz, Advice *advice);

// The Pareto front: runs that no other run beats in both cost and error.

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
