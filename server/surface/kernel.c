// The instruction-set levels of the kernel that this machine can run.
#include "surface/kernel.h"

#include "base/isa.h"

ISA_KERNELS(SpringKernels, spring);

const SpringKernels *const *kernels_available(Precision precision)
{
    static const SpringKernels *available[PRECISION_COUNT][ISA_COUNT + 1];
    int count = 0;
    for (int level = (int)isa_best(); level >= 0; level--)
        available[precision][count++] = spring_kernels[precision][level];
    available[precision][count] = NULL;
    return available[precision];
}

const SpringKernels *kernels_find(Precision precision, const char *name)
{
    IsaLevel level = isa_find(name);
    return level == ISA_COUNT ? NULL : spring_kernels[precision][level];
}
