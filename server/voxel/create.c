// Makes a voxel body from a lattice. Load time only.
#include "voxel/voxel.h"

#include <math.h>

double voxel_critical_step(const VoxelMaterial *material, double size)
{
    return size * sqrt(material->density * (1.0 - 2.0 * material->poisson_ratio) /
                       material->youngs_modulus);
}
