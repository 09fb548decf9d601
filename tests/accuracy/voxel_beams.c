// SPDX-License-Identifier: MIT
// Bending, patches, tension and shear by both laws: the trials of tests/voxel/voxel_trials.h as
// tables.
#include "voxel_accuracy.h"

#include "random.h"
#include "voxel_trials.h"
#include "scoped.h"

#include <math.h>

// The paper's law as in the server: every vertex of an element pulls alike.
static VoxelBenchOptions options_of(int levels, double poisson_ratio, VoxelLaw law)
{
    VoxelBenchOptions options = voxel_bench_options(levels);
    options.poisson_ratio = poisson_ratio;
    options.law = law;
    options.unit_weights = law == VOXEL_MIYAZAKI2004;
    return options;
}

// Columns for CalculiX are joined by the script.
static void write_cantilever(const Experiment *experiment)
{
    FILE *out = experiment_open(experiment, "cantilever-own.tsv");
    fprintf(out, "nu\telements through the thickness\taffine\tmiyazaki2004\n");
    static const double RATIO[2] = {0.0, 0.3};
    for (int r = 0; r < 2; r++)
        for (int n = 1; n <= 8; n *= 2) {
            VoxelBenchOptions affine = options_of(0, RATIO[r], VOXEL_AFFINE);
            VoxelBenchOptions paper = options_of(0, 0.0, VOXEL_MIYAZAKI2004);
            fprintf(out, "%g\t%d\t%.4f\t", RATIO[r], n, trial_cantilever(n, 0, &affine));
            if (RATIO[r] == 0.0)
                fprintf(out, "%.4f\n", trial_cantilever(n, 0, &paper));
            else
                fprintf(out, "-\n"); // it has no Poisson's ratio
        }
    fclose(out);
    out = experiment_open(experiment, "cantilever-graded.tsv");
    fprintf(out, "elements through the thickness\tlevels\taffine\tmiyazaki2004\n");
    for (int levels = 0; levels <= 1; levels++) {
        VoxelBenchOptions affine = options_of(0, 0.0, VOXEL_AFFINE);
        VoxelBenchOptions paper = options_of(0, 0.0, VOXEL_MIYAZAKI2004);
        fprintf(out, "8\t%s\t%.4f\t%.4f\n", levels == 0 ? "0" : "0 and 1",
                trial_cantilever(8, levels, &affine), trial_cantilever(8, levels, &paper));
    }
    fclose(out);
}

void beam_and_patches(const Experiment *experiment)
{
    write_cantilever(experiment);
    CLOSED FILE *out = experiment_open(experiment, "patches.tsv");
    fprintf(out,
            "law\tnu\tuniform deformation: force left inside, of mu h^2 strain\ttension: E off "
            "by\tplaces off by, of the way of the ends\tshear: inside off by, of gamma h\n");
    struct {
        const char *name;
        VoxelLaw law;
        double poisson_ratio;
    } laws[] = {{"affine", VOXEL_AFFINE, 0.0},
                {"affine", VOXEL_AFFINE, 0.3},
                {"miyazaki2004", VOXEL_MIYAZAKI2004, 0.0}};
    for (int l = 0; l < 3; l++) {
        VoxelBenchOptions options = options_of(2, laws[l].poisson_ratio, laws[l].law);
        uint64_t random = 51;
        SCOPED(voxel_bench_destroy) VoxelBench bench;
        voxel_bench_box(&bench, 16, 16, 16, 0.01, &options);
        double worst = 0.0;
        for (int n = 0; n < 3; n++)
            worst = fmax(worst, trial_patch(&bench, &random));
        Tension tension = trial_tension(&options);
        fprintf(out, "%s\t%g\t%.1e\t%.1e\t%.1e\t%.1e\n", laws[l].name, laws[l].poisson_ratio, worst,
                fabs(tension.modulus_error), tension.place_error, trial_shear(&options, &random));
    }
}
