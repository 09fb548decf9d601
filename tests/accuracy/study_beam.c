// SPDX-License-Identifier: MIT
// Bending of the cantilever of tests/voxel/voxel_trials.h by solid bodies of both laws, for the
// study's report: a row a body with the ratio of its end's deflection to Timoshenko's.
#include "voxel_trials.h"

#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv)
{
    const double poisson_ratio = argc > 1 ? atof(argv[1]) : 0.3;
    for (int law = 0; law < 2; law++)
        for (int n = 1; n <= 8; n *= 2) {
            VoxelBenchOptions options = voxel_bench_options(0);
            options.poisson_ratio = law == 0 ? poisson_ratio : 0.0;
            options.law = law == 0 ? VOXEL_AFFINE : VOXEL_MIYAZAKI2004;
            options.unit_weights = law == 1;
            printf("%s\t%d\t%.4f\n", law == 0 ? "affine" : "miyazaki2004", n,
                   trial_cantilever(n, 0, &options));
            fflush(stdout);
        }
    return 0;
}
