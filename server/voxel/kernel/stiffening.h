// SPDX-License-Identifier: MIT
// Private to the kernels: the elastic forces of elements that stiffen
// (server/voxel/README.md, "Stiffening").
// With c = E s^2 / 2, s the strain of the law,
//   q = (mu |F - R|^2 + lambda/2 tr(D)^2 + (alpha k / H) / 2 sum w |e|^2) / c.
#ifndef PLIANT_VOXEL_KERNEL_STIFFENING_H
#define PLIANT_VOXEL_KERNEL_STIFFENING_H

#include "body/kernel/stiffening.h"
#include "voxel/kernel/foam.h"
#include "voxel/kernel.h"

// Of a class: q = shape |F - R|^2 + bulk tr(D)^2 + bend sum w |e|^2, e in edge lengths.
typedef struct EnergyFactors {
    Real shape, bulk, bend;
} EnergyFactors;

INLINE EnergyFactors energy_factors(const VoxelPass *pass, const ElementClass *c)
{
    const double scale = 1.0 / element_energy_scale(c->mu, c->lambda, pass->stiffening->strain);
    return (EnergyFactors){(Real)(c->mu * scale), (Real)(0.5 * c->lambda * scale),
                           (Real)(0.5 * c->residual / c->size * scale)};
}

INLINE StiffeningFactors curve_of(const VoxelPass *pass, bool stiffens)
{
    return stiffens ? stiffening_factors(&pass->stiffening->curve) : (StiffeningFactors){0};
}

// Returns |F - R|^2.
INLINE Vector square_strain(const Deformation *deformation, const Polar *polar)
{
    Vector sum = vector_set(0.0);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            Vector d = deformation->g[i][k] - polar->turn[i][k] * polar->inverse;
            sum += d * d;
        }
    return sum;
}

#endif
