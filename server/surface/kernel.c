// The instruction-set levels of the kernel that this machine can run.
#include "surface/kernel.h"

#include "base/isa.h"

#include <stddef.h>

extern const SpringKernels spring_kernels_double_base, spring_kernels_single_base;
#if defined(__x86_64__)
extern const SpringKernels spring_kernels_double_v3, spring_kernels_single_v3;
extern const SpringKernels spring_kernels_double_v4, spring_kernels_single_v4;
#endif

static const SpringKernels *const kernels[PRECISION_COUNT][ISA_COUNT] = {
#if defined(__x86_64__)
    [PRECISION_DOUBLE] = {&spring_kernels_double_base, &spring_kernels_double_v3,
                          &spring_kernels_double_v4},
    [PRECISION_SINGLE] = {&spring_kernels_single_base, &spring_kernels_single_v3,
                          &spring_kernels_single_v4},
#else
    [PRECISION_DOUBLE] = {&spring_kernels_double_base},
    [PRECISION_SINGLE] = {&spring_kernels_single_base},
#endif
};

const SpringKernels *const *kernels_available(Precision precision)
{
    static const SpringKernels *available[PRECISION_COUNT][ISA_COUNT + 1];
    int count = 0;
    for (int level = (int)isa_best(); level >= 0; level--)
        available[precision][count++] = kernels[precision][level];
    available[precision][count] = NULL;
    return available[precision];
}

const SpringKernels *kernels_find(Precision precision, const char *name)
{
    IsaLevel level = isa_find(name);
    return level == ISA_COUNT ? NULL : kernels[precision][level];
}
