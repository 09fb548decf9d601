// pliant-accuracy SCENES OUT [REPEATS]: the experiments of Choi et al. 2005 off line.
#include "accuracy.h"

#include <stdlib.h>

const char *rule_name(SurfaceAdjust rule)
{
    return rule == ADJUST_CONTINUUM ? "continuum" : "choi2005";
}

int main(int argc, char **argv)
{
    if (argc < 3 || argc > 4 || (argc == 4 && atoi(argv[3]) < 1)) {
        fprintf(stderr, "usage: pliant-accuracy SCENES OUT [REPEATS]\n");
        return 2;
    }
    const Experiment experiment = {argv[1], argv[2], argc == 4 ? atoi(argv[3]) : 5};
    masses_and_counts(&experiment);
    collapse_and_recovery(&experiment);
    coarse_against_refined(&experiment);
    displaced_region(&experiment);
    cost_and_curves(&experiment);
    return 0;
}
