// SPDX-License-Identifier: MIT
// A study's result made by hand: what the tests of its telling look at.
#ifndef PLIANT_TESTS_STUDY_SAMPLE_H
#define PLIANT_TESTS_STUDY_SAMPLE_H

#include "study/study.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

// A run that ended well. Cost [s a simulated second], p99 of a tick [s], errors as fractions.
static inline StudyRun *sample_add(StudyResult *result, const char *name, double cost, double p99,
                                   double in_time, double total)
{
    StudyRun *run = &result->run[result->run_count++];
    memset(run, 0, sizeof *run);
    snprintf(run->what.name, sizeof run->what.name, "%s", name);
    run->what.integrator = INTEGRATOR_LEAPFROG;
    run->what.precision = PRECISION_SINGLE;
    run->verdict = STUDY_OK;
    run->substeps = 2;
    run->rate_hz = 1000.0;
    run->time_step = 0.0005;
    run->nodes_least = run->nodes_most = 114;
    run->links = 336;
    run->repeats = 3;
    for (int i = 0; i < 3; i++)
        run->cpu_s[i] = cost * (1.0 + 0.01 * i);
    run->cpu_least = cost;
    run->cpu_median = run->cpu_s[1];
    run->cpu_most = run->cpu_s[2];
    run->tick_p50 = 0.5 * p99;
    run->tick_p99 = p99;
    run->tick_most = 2.0 * p99;
    run->time = (StudyErrors){in_time, 2.0 * in_time, in_time, in_time, (double)NAN};
    run->total = (StudyErrors){total, 2.0 * total, total, total, (double)NAN};
    return run;
}

static inline StudyReference sample_reference(const char *what, double own_error)
{
    StudyReference reference = {.step = {4e-4, 2e-4, 1e-4},
                                .difference = {4.0 * own_error, own_error},
                                .order = 2.0,
                                .own_error = own_error,
                                .known = true};
    snprintf(reference.what, sizeof reference.what, "%s", what);
    return reference;
}

// A result without runs: references of both errors, own errors as fractions.
static inline void sample_begin(StudyResult *result, double own_total, double own_time)
{
    memset(result, 0, sizeof *result);
    snprintf(result->scene, sizeof result->scene, "sample");
    snprintf(result->body, sizeof result->body, "sphere");
    snprintf(result->inputs, sizeof result->inputs, "the scene's load");
    snprintf(result->machine, sizeof result->machine, "a machine");
    result->duration_s = 3.0;
    result->rate_hz = 1000.0;
    result->finest = sample_reference("rk4 double, level 3", own_total);
    result->mesh_count = 1;
    result->mesh[0] =
        (StudyMesh){.detail = DETAIL_SCENE, .reference = sample_reference("rk4 double", own_time)};
}

#endif
