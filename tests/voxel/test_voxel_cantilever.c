// SPDX-License-Identifier: MIT
// Bending: cantilevers under an end load (voxel_trials.h) against Timoshenko's beam and, for nu >
// 0, where the clamp makes the beam stiffer than that, against C3D8I of CalculiX
// (tests/accuracy/cantilever_ccx.sh): a brick with incompatible modes.
#include "test.h"
#include "voxel_trials.h"

static const double LENGTH = 0.2, WIDTH = 0.05; // [m]

// Sagging under its own weight by 5 % of its length, turning by four degrees: the end's mean move
// along z [mm].
static double sag(int n, double nu)
{
    VoxelBenchOptions options = voxel_bench_options(0);
    options.youngs_modulus = 1e6;
    options.poisson_ratio = nu;
    SCOPED(voxel_bench_destroy) VoxelBench bench;
    voxel_bench_box(&bench, 4 * n, n, n, WIDTH / n, &options);
    int count = bench.vertex_count;
    FREED bool *fixed = zeroed((size_t)(3 * count), sizeof *fixed);
    FREED double *load = zeroed((size_t)(3 * count), sizeof *load);
    for (int i = 0; i < count; i++) {
        for (int c = 0; c < 3; c++)
            fixed[3 * i + c] = bench.mesh.point[i][0] == 0;
        load[3 * i + 2] = -9.81 * bench.mass[i];
    }
    double weight = 9.81 * options.density * LENGTH * WIDTH * WIDTH;
    assert_true(voxel_bench_solve(&bench, fixed, load, 1e-9 * weight));
    double sum = 0.0, total = 0.0;
    for (int i = 0; i < count; i++) {
        if (bench.mesh.point[i][0] == 4 * n) {
            sum += bench.mass[i] * (bench.position[i].z - bench.rest[i].z);
            total += bench.mass[i];
        }
    }
    return 1e3 * sum / total;
}

// With alpha = 1/3 an element bends as the continuum does: what is left is the discretisation's.
// Expected: C3D8I, whose four digits these equal.
TEST(even_one_element_through_the_thickness_bends_as_a_beam)
{
    static const double EXPECTED[] = {0.9789, 0.9902, 0.9972, 0.9994};
    VoxelBenchOptions options = voxel_bench_options(0);
    for (int k = 0; k < 4; k++) {
        double ratio = trial_cantilever(1 << k, 0, &options);
        print_message("n %d: %.4f\n", 1 << k, ratio);
        expect_near(ratio, EXPECTED[k], 1e-4);
    }
}

// The paper's residual (alpha = 1) is three times too stiff in bending; expected: its element's
// bending energy, 4 mu h q^2 for u_x = q x y in the place of 4/3 mu h q^2, leaves 1/3 of the
// deflection by bending with one element, and errors of second order fall by four with each
// halving.
TEST(the_paper_s_element_is_too_stiff_in_bending)
{
    static const double EXPECTED[] = {0.346, 0.670, 0.889, 0.970};
    VoxelBenchOptions options = voxel_bench_options(0);
    options.law = VOXEL_MIYAZAKI2004;
    double error[4];
    for (int k = 0; k < 4; k++) {
        double ratio = trial_cantilever(1 << k, 0, &options);
        print_message("paper, n %d: %.4f\n", 1 << k, ratio);
        expect_near(ratio, EXPECTED[k], 0.002);
        error[k] = 1.0 / ratio - 1.0;
    }
    expect_near(error[1] / error[2], 4.0, 0.3);
    expect_near(error[2] / error[3], 4.0, 0.3);
}

// nu = 0.3: within 0.5 % of C3D8I's 0.981 with eight elements, and nu = 0.45, where fully
// integrated bricks lock (C3D8: 0.927), of its 0.955.
TEST(the_volume_term_does_not_lock)
{
    VoxelBenchOptions options = voxel_bench_options(0);
    options.poisson_ratio = 0.3;
    double ratio = trial_cantilever(8, 0, &options);
    print_message("nu 0.3, n 8: %.4f\n", ratio);
    expect_near(ratio, 0.9805, 0.002);
    options.poisson_ratio = 0.45;
    ratio = trial_cantilever(8, 0, &options);
    print_message("nu 0.45, n 8: %.4f\n", ratio);
    expect_near(ratio, 0.9533, 0.002);
}

// Large elements within, near the neutral axis, where strains are small: half a percent.
TEST(large_elements_inside_hardly_change_the_bending)
{
    VoxelBenchOptions options = voxel_bench_options(0);
    double ratio = trial_cantilever(8, 1, &options);
    print_message("levels 0 and 1, n 8: %.4f\n", ratio);
    expect_near(ratio, trial_cantilever(8, 0, &options), 0.005);
}

// Rotations of elements and their strain together, against C3D8I with NLGEOM, whose strain measure
// (Green) differs in second order: the root strains by 2 %, so half a percent.
TEST(a_sagging_beam_turns_as_it_should)
{
    static const double RATIO[] = {0.0, 0.3, 0.45}, EXPECTED[] = {-9.847, -9.707, -9.333};
    for (int k = 0; k < 3; k++) {
        double move = sag(4, RATIO[k]);
        print_message("sagging, nu %.2f: %.3f mm\n", RATIO[k], move);
        expect_near(move, EXPECTED[k], 0.005 * fabs(EXPECTED[k]));
    }
}
