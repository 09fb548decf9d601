// SPDX-License-Identifier: MIT
#include "experiment.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

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

static bool is_named(const char *name, char **argument, int count)
{
    for (int a = 0; a < count; a++)
        if (strcmp(argument[a], name) == 0)
            return true;
    return false;
}

static int usage(const char *program, const ExperimentPart *part, int count)
{
    fprintf(stderr, "usage: %s SCENES OUT [REPEATS [PART...]]\nparts:", program);
    for (int p = 0; p < count; p++)
        fprintf(stderr, " %s", part[p].name);
    fprintf(stderr, "\n");
    return 2;
}

int experiment_main(int argc, char **argv, const ExperimentPart *part, int count)
{
    if (argc < 3 || (argc >= 4 && atoi(argv[3]) < 1))
        return usage(argv[0], part, count);
    char **named = argv + 4;
    const int named_count = argc > 4 ? argc - 4 : 0;
    int known = 0;
    for (int p = 0; p < count; p++)
        known += is_named(part[p].name, named, named_count);
    if (known != named_count)
        return usage(argv[0], part, count);
    const Experiment experiment = {argv[1], argv[2], argc >= 4 ? atoi(argv[3]) : 5};
    for (int p = 0; p < count; p++)
        if (named_count == 0 || is_named(part[p].name, named, named_count))
            part[p].run(&experiment);
    return 0;
}
