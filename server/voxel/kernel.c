// The instruction-set levels of the kernel that this machine can run.
#include "voxel/kernel.h"

ISA_KERNELS(VoxelKernels, voxel);

const VoxelKernels *voxel_kernels_find(Precision precision, const char *level)
{
    IsaLevel found = isa_find(level);
    return found == ISA_COUNT ? NULL : voxel_kernels[precision][found];
}
