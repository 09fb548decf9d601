#include "experiment.h"

#include <stdlib.h>

FILE *experiment_open(const Experiment *experiment, const char *name)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", experiment->out, name);
    FILE *file = fopen(path, "w");
    if (file == NULL) {
        perror(path);
        exit(1);
    }
    return file;
}

void keep_least(double *least, double value)
{
    *least = *least == 0.0 || value < *least ? value : *least;
}
