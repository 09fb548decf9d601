// SPDX-License-Identifier: MIT
// Stiffening of one element, in double precision and apart from the kernels: for tearing, and for
// the stiffness that clients are told (README.md, "Stiffening"). Pure functions.
#ifndef PLIANT_VOXEL_STIFFENING_H
#define PLIANT_VOXEL_STIFFENING_H

#include "voxel/kernel.h"
#include "voxel/template.h"

// An element with the numbers of its rest shape (kernel.h, TABLE_ROW), lengths over its edge.
typedef struct StiffElement {
    int count;
    double weight[NODE_COUNT];                               // w
    Vec3 rest[NODE_COUNT], lever[NODE_COUNT], u[NODE_COUNT]; // X, w M^-1 X, displacements
} StiffElement;

// Returns sum w |e|^2, e being what the best affine map leaves of the displacements.
double stiff_residual(const StiffElement *element);

// Returns q, the energy of the linear law over its scale, of an element with the deformation F, the
// rotation R and that residual.
double stiff_q(const VoxelStiffening *stiffening, const ElementClass *by, const double f[3][3],
               const double r[3][3], double residual);

#endif
