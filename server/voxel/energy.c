// The elastic energy of a voxel body, for status and tests.
#include "voxel/model.h"

double voxel_energy(const VoxelModel *model, const void *rows)
{
    (void)model, (void)rows;
    return 0.0;
}
