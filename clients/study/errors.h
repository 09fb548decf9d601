// Errors of a run relative to its reference.
#ifndef PLIANT_STUDY_ERRORS_H
#define PLIANT_STUDY_ERRORS_H

#include "study/study.h"
#include "study/trace.h"

// Compares two traces sampled at the same times, over the length of the shorter. NAN if there is
// nothing to compare.
StudyErrors study_errors(const StudyTrace *trace, const StudyTrace *reference);
// Returns all NAN.
StudyErrors study_no_errors(void);

// Estimates the error of the finest of three solutions, each twice as fine as the one before, from
// the differences between neighbours (Richardson 1911; Roache 1994, eq 3): order p =
// log2(difference[0] / difference[1]), error = difference[1] / (2^min(p, expected) - 1). Sets order
// and own_error. If the differences do not decrease (order NAN) or hardly do (order below 1/2),
// own_error is the larger one. Sets `known` if both differences are finite.
void study_richardson(StudyReference *reference, double expected);

#endif
