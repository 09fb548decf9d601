// SPDX-License-Identifier: MIT
// What statics says of a material model, tried on bodies of voxel_bench.h: bending, uniform
// deformation, tension and shear of bodies with elements of several sizes.
#ifndef PLIANT_TESTS_VOXEL_TRIALS_H
#define PLIANT_TESTS_VOXEL_TRIALS_H

#include "voxel_bench.h"

// A cantilever of 0.2 x 0.05 x 0.05 m with n cells through the thickness, clamped at one end, an
// end load spread evenly over the other, small deflections: the mean deflection of the loaded end
// over that of Timoshenko's beam with the shear coefficient 5/6,
//   F L^3 / (3 E I) + F L / (5/6 G A)
// which is exact for nu = 0; for nu > 0 the clamp hinders the section's thinning and makes the beam
// stiffer.
double trial_cantilever(int n, int levels, const VoxelBenchOptions *options);

// F = R S with stretches of 0.7 to 1.4 along random axes at every vertex: the largest force on an
// inner vertex, over mu h^2 |S - 1|.
double trial_patch(VoxelBench *bench, uint64_t *random);

// A bar of 8 x 8 x 16 cells (levels 0 and 1) pulled by 5 % along z between smooth plates.
typedef struct Tension {
    double modulus_error; // of E, from the plates' force and the bar's section
    double place_error;   // largest, over the plates' displacement
} Tension;
Tension trial_tension(const VoxelBenchOptions *options);

// A block of 10 x 8 x 12 cells, all of its surface held as in simple shear by gamma = 0.1: by how
// much the inside does not follow, over gamma h.
double trial_shear(const VoxelBenchOptions *options, uint64_t *random);

#endif
