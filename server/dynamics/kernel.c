// The instruction-set levels of the vertex kernel that this machine can run.
#include "dynamics/kernel.h"

ISA_KERNELS(VertexKernels, vertex);

const VertexKernels *vertex_kernels_find(Precision precision, const char *level)
{
    IsaLevel found = isa_find(level);
    return found == ISA_COUNT ? NULL : vertex_kernels[precision][found];
}
