// SPDX-License-Identifier: MIT
// pliant-voxel-accuracy SCENES OUT [REPEATS [PART...]]: the experiments of Miyazaki et al. 2004
// offline.
#include "voxel_accuracy.h"

int main(int argc, char **argv)
{
    static const ExperimentPart parts[] = {
        {"disc", disc_layout},
        {"cube", cube_layout},
        {"press", press_test},
        {"cost", process_costs},
        {"beams", beam_and_patches},
        {"organ", organ},
        {"cuts", cuts},
        {"reality", real_beam},
        {"reality-fine", real_beam_finely},
        {"reality-fit", fit_to_the_beam},
    };
    return experiment_main(argc, argv, parts, sizeof parts / sizeof parts[0]);
}
