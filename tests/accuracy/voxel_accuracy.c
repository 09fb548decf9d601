// pliant-voxel-accuracy SCENES OUT [REPEATS]: the experiments of Miyazaki et al. 2004 off line.
#include "voxel_accuracy.h"

#include <stdlib.h>

int main(int argc, char **argv)
{
    if (argc < 3 || argc > 4 || (argc == 4 && atoi(argv[3]) < 1)) {
        fprintf(stderr, "usage: pliant-voxel-accuracy SCENES OUT [REPEATS]\n");
        return 2;
    }
    const Experiment experiment = {argv[1], argv[2], argc == 4 ? atoi(argv[3]) : 5};
    disc_layout(&experiment);
    cube_layout(&experiment);
    press_test(&experiment);
    process_costs(&experiment);
    beam_and_patches(&experiment);
    organ(&experiment);
    return 0;
}
