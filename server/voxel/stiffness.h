// Stiffness of elements, and the time step that it requires. Load time.
#ifndef PLIANT_VOXEL_STIFFNESS_H
#define PLIANT_VOXEL_STIFFNESS_H

#include "voxel/kernel.h"
#include "voxel/template.h"
#include "voxel/voxel.h"

typedef struct ElementBounds {
    double lambda;  // of M^-1 K [1/s2]
    double damping; // of M^-1 C, per unit of beta [1/s2]
    double step;    // critical step of a plain cube [s]
} ElementBounds;

// Returns the bounds and the class of a cube of this edge [m] and shape. Its damping is that for
// beta = 1 s.
ElementBounds stiffness_of_element(VoxelLaw law, const SolidMaterial *material, double edge,
                                   const Template *shape, ElementClass *out);

#endif
