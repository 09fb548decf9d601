// Runs one case: builds its world, drives it, samples it, and measures its cost.
#ifndef PLIANT_STUDY_RUN_H
#define PLIANT_STUDY_RUN_H

#include "study/context.h"

// Fills `run`; its verdict is the outcome; errors are set if the context has references. Returns
// false if memory runs out. Depends on its arguments alone, except for times.
bool study_run_case(const StudyContext *context, const StudyCase *what, StudyRun *run);

// Does the same once, without errors, with the samples in `trace` (made with the context's counts)
// or NULL.
bool study_trace_case(const StudyContext *context, const StudyCase *what, int repeats,
                      StudyRun *run, StudyTrace *trace);

#endif
