// What to do: the cheapest case that is near enough and holds the rate.
#ifndef PLIANT_STUDY_ADVICE_H
#define PLIANT_STUDY_ADVICE_H

#include "study/study.h"

// Share of a period that 99 of 100 ticks may take, so that the loop, the other threads and a busier
// body have the rest.
#define ADVICE_SHARE 0.7

enum { ADVICE_TEXT = 1024 };

typedef struct Advice {
    int run;        // in result->run; -1: none, no case can be compared
    bool met;       // all of it; else the nearest is named and `sentence` says what it misses
    bool time_only; // no usable reference of the total error: steps in time alone are judged
    double error;   // of the run and of its reference together
    char sentence[ADVICE_TEXT];
} Advice;

// Among the runs with verdict ok that a scene can ask for (not step doubling): the one with the
// least median cost whose error and that of the reference itself (its estimate, but no less than
// the last difference that told it) stay within `error` (a fraction), that ran at `rate_hz` or
// more, whose 99th percentile of a tick is at most ADVICE_SHARE of the period, and whose median
// cost is at most ADVICE_SHARE. Where the reference of the total error is missing or itself errs
// more than `error`, the error in time counts, of runs on the scene's own mesh alone: it says
// nothing of coarser ones.
void advice_make(const StudyResult *result, double error, double rate_hz, Advice *advice);

#endif
