// SPDX-License-Identifier: MIT
// pliant-accuracy SCENES OUT [REPEATS [PART...]]: the experiments of Choi et al. 2005 offline.
#include "accuracy.h"

const char *rule_name(SurfaceAdjust rule)
{
    return rule == ADJUST_CONTINUUM ? "continuum" : "choi2005";
}

int main(int argc, char **argv)
{
    static const ExperimentPart parts[] = {
        {"masses", masses_and_counts},         {"collapse", collapse_and_recovery},
        {"damping", damping_of_shape_springs}, {"fabric", coarse_against_refined},
        {"region", displaced_region},          {"cost", cost_and_curves},
        {"thresholds", curvature_thresholds},  {"constant", constant_shape_springs},
    };
    return experiment_main(argc, argv, parts, sizeof parts / sizeof parts[0]);
}
