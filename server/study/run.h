// Runs one case: builds its world, drives it, samples it, and says what it costs.
#ifndef PLIANT_STUDY_RUN_H
#define PLIANT_STUDY_RUN_H

#include "study/context.h"

// Fills `run`, whose verdict says how it went; errors are there when the context has references.
// False: out of memory. A function of its arguments but for the times.
bool study_run_case(const StudyContext *context, const StudyCase *what, StudyRun *run);

// The same once, without errors, with the samples into `trace` (made with the context's counts) or
// NULL.
bool study_trace_case(const StudyContext *context, const StudyCase *what, int repeats,
                      StudyRun *run, StudyTrace *trace);

#endif
