// SPDX-License-Identifier: MIT
// Private to the kernels: what a kernel is compiled for.
#ifndef PLIANT_VOXEL_KERNEL_KIND_H
#define PLIANT_VOXEL_KERNEL_KIND_H

#include "voxel/kernel.h"

// Affine elements, also those that relax or stiffen, and the paper's.
typedef enum ElementKind { ELEMENT_LINEAR, ELEMENT_LAW, ELEMENT_PAPER, ELEMENT_KINDS } ElementKind;

// None, of all but the rigid motion alike, or in proportion to the stiffness.
typedef enum Damping { UNDAMPED, DAMPED, VISCOUS, DAMPINGS } Damping;

// Uniform for a pass; false at compile time for all other kinds.
static inline bool kind_relaxes(ElementKind kind, const VoxelPass *pass)
{
    return kind == ELEMENT_LAW && pass->relaxation.count > 0;
}

static inline bool kind_stiffens(ElementKind kind, const VoxelPass *pass)
{
    return kind == ELEMENT_LAW && pass->stiffening != NULL;
}

#endif
