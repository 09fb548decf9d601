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

// Of several measurements the least; `least` begins as 0.
void keep_least(double *least, double value);

#endif
