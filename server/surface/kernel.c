// The kernels of an instruction-set level.
#include "surface/kernel.h"

#include "base/isa.h"

ISA_KERNELS(SpringKernels, spring);

const SpringKernels *kernels_find(Precision precision, const char *name)
{
    IsaLevel level = isa_find(name);
    return level == ISA_COUNT ? NULL : spring_kernels[precision][level];
}
