// The instruction-set levels of the plane kernel that this machine can run.
#include "plane/kernel.h"

#include <stddef.h>

extern const PlaneKernels plane_kernels_double_base, plane_kernels_single_base;
#if defined(__x86_64__)
extern const PlaneKernels plane_kernels_double_v3, plane_kernels_single_v3;
extern const PlaneKernels plane_kernels_double_v4, plane_kernels_single_v4;
#endif

static const PlaneKernels *const kernels[PRECISION_COUNT][ISA_COUNT] = {
#if defined(__x86_64__)
    [PRECISION_DOUBLE] = {&plane_kernels_double_base, &plane_kernels_double_v3,
                          &plane_kernels_double_v4},
    [PRECISION_SINGLE] = {&plane_kernels_single_base, &plane_kernels_single_v3,
                          &plane_kernels_single_v4},
#else
    [PRECISION_DOUBLE] = {&plane_kernels_double_base},
    [PRECISION_SINGLE] = {&plane_kernels_single_base},
#endif
};

const PlaneKernels *plane_kernels_find(Precision precision, const char *level)
{
    IsaLevel found = isa_find(level);
    return found == ISA_COUNT ? NULL : kernels[precision][found];
}
