// SPDX-License-Identifier: MIT
// What the programs of the report share: where they read and write, and files there.
#ifndef PLIANT_TESTS_ACCURACY_EXPERIMENT_H
#define PLIANT_TESTS_ACCURACY_EXPERIMENT_H

#include <stdio.h>

typedef struct Experiment {
    const char *scenes, *out; // folders
    int repeats;              // of timed runs
} Experiment;

// A new file out/name, for writing; ends the program when that fails.
FILE *experiment_open(const Experiment *experiment, const char *name);

// One of a program's experiments, by the name that its command line takes.
typedef struct ExperimentPart {
    const char *name;
    void (*run)(const Experiment *experiment);
} ExperimentPart;

// The main function of such a program: PROGRAM SCENES OUT [REPEATS [PART...]] runs all parts, or
// those named. Returns the exit status: 2 for arguments that it does not understand, and says so.
int experiment_main(int argc, char **argv, const ExperimentPart *part, int count);

// Of several measurements the least; `least` begins as 0.
void keep_least(double *least, double value);

#endif
