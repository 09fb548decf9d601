// The instruction-set levels of the kernel that this machine can run.
#include "voxel/kernel.h"

#include <stddef.h>

extern const VoxelKernels voxel_kernels_double_base, voxel_kernels_single_base;
#if defined(__x86_64__)
extern const VoxelKernels voxel_kernels_double_v3, voxel_kernels_single_v3;
extern const VoxelKernels voxel_kernels_double_v4, voxel_kernels_single_v4;
#endif

static const VoxelKernels *const kernels[PRECISION_COUNT][ISA_COUNT] = {
#if defined(__x86_64__)
    [PRECISION_DOUBLE] = {&voxel_kernels_double_base, &voxel_kernels_double_v3,
                          &voxel_kernels_double_v4},
    [PRECISION_SINGLE] = {&voxel_kernels_single_base, &voxel_kernels_single_v3,
                          &voxel_kernels_single_v4},
#else
    [PRECISION_DOUBLE] = {&voxel_kernels_double_base},
    [PRECISION_SINGLE] = {&voxel_kernels_single_base},
#endif
};

const VoxelKernels *voxel_kernels_find(Precision precision, const char *level)
{
    IsaLevel found = isa_find(level);
    return found == ISA_COUNT ? NULL : kernels[precision][found];
}
