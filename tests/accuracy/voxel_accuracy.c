// pliant-voxel-accuracy SCENES OUT [REPEATS [PART...]]: the experiments of Miyazaki et al. 2004 off
// line, all of them or those named.
#include "voxel_accuracy.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static const struct {
    const char *name;
    void (*run)(const Experiment *experiment);
} PARTS[] = {{"disc", disc_layout},   {"cube", cube_layout},       {"press", press_test},
             {"cost", process_costs}, {"beams", beam_and_patches}, {"organ", organ},
             {"cuts", cuts}};
enum { PART_COUNT = sizeof PARTS / sizeof PARTS[0] };

int main(int argc, char **argv)
{
    if (argc < 3 || (argc >= 4 && atoi(argv[3]) < 1)) {
        fprintf(stderr, "usage: pliant-voxel-accuracy SCENES OUT [REPEATS [PART...]]\nparts:");
        for (int p = 0; p < PART_COUNT; p++)
            fprintf(stderr, " %s", PARTS[p].name);
        fprintf(stderr, "\n");
        return 2;
    }
    const Experiment experiment = {argv[1], argv[2], argc >= 4 ? atoi(argv[3]) : 5};
    for (int p = 0; p < PART_COUNT; p++) {
        bool wanted = argc < 5;
        for (int a = 4; a < argc; a++)
            wanted |= strcmp(argv[a], PARTS[p].name) == 0;
        if (wanted)
            PARTS[p].run(&experiment);
    }
    return 0;
}
