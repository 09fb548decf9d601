// The instruction-set levels of the plane kernel that this machine can run.
#include "plane/kernel.h"

ISA_KERNELS(PlaneKernels, plane);

const PlaneKernels *plane_kernels_find(Precision precision, const char *level)
{
    IsaLevel found = isa_find(level);
    return found == ISA_COUNT ? NULL : plane_kernels[precision][found];
}
