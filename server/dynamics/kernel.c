// The instruction-set levels of the vertex kernel that this machine can run.
#include "dynamics/kernel.h"

#include <stddef.h>

extern const VertexKernels vertex_kernels_double_base, vertex_kernels_single_base;
#if defined(__x86_64__)
extern const VertexKernels vertex_kernels_double_v3, vertex_kernels_single_v3;
extern const VertexKernels vertex_kernels_double_v4, vertex_kernels_single_v4;
#endif

static const VertexKernels *const kernels[PRECISION_COUNT][ISA_COUNT] = {
#if defined(__x86_64__)
    [PRECISION_DOUBLE] = {&vertex_kernels_double_base, &vertex_kernels_double_v3,
                          &vertex_kernels_double_v4},
    [PRECISION_SINGLE] = {&vertex_kernels_single_base, &vertex_kernels_single_v3,
                          &vertex_kernels_single_v4},
#else
    [PRECISION_DOUBLE] = {&vertex_kernels_double_base},
    [PRECISION_SINGLE] = {&vertex_kernels_single_base},
#endif
};

const VertexKernels *vertex_kernels_find(Precision precision, const char *level)
{
    IsaLevel found = isa_find(level);
    return found == ISA_COUNT ? NULL : kernels[precision][found];
}
