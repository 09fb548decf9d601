// The arithmetic of an implicit step, compiled once per instruction-set level with KERNEL_NAME and
// KERNEL_LEVEL: with AVX a Quad is one register. Nothing is contracted and every sum has a fixed
// order, so that all levels are bit-identical. Step thread.
#include "surface/kernel/implicit_assemble.h"
#include "surface/kernel/implicit_momentum.h"
#include "surface/kernel/implicit_solve.h"

extern const ImplicitKernel KERNEL_NAME;
const ImplicitKernel KERNEL_NAME = {
    .assemble = assemble,
    .solve = solve,
    .restore_momentum = restore_momentum,
};
