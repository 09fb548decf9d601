// How far a run is from its reference.
#ifndef PLIANT_STUDY_ERRORS_H
#define PLIANT_STUDY_ERRORS_H

#include "study/study.h"
#include "study/trace.h"

// Both sampled at the same times; the shorter one counts. NAN where there is nothing to compare.
StudyErrors study_errors(const StudyTrace *trace, const StudyTrace *reference);
// All NAN.
StudyErrors study_no_errors(void);

// The error of the finest of three solutions, each twice as fine as the one before, from the
// differences between neighbours (Richardson 1911; Roache 1994, eq 3): order p =
// log2(difference[0] / difference[1]), error = difference[1] / (2^min(p, expected) - 1). Sets order
// and own_error. Differences that do not fall (order NAN), or hardly (below 1/2): own_error is
// the larger one. `known` is set
// when both differences are finite.
void study_richardson(StudyReference *reference, double expected);

#endif
