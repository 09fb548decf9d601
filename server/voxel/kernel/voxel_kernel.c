// SPDX-License-Identifier: MIT
// Forces of voxel elements (Miyazaki et al. 2004, section 2.2; law and
// derivation in element.c).
//
// Compiled once per precision and level with KERNEL_NAME, KERNEL_LEVEL, KERNEL_SINGLE and
// KERNEL_WIDTH. A lane is an element: the rows of its vertices are loaded whole and transposed in
// registers. Branch-free where data decides, except for the call of repair.h:
// server/PERFORMANCE.md, "Masked loops that gcc 12 miscompiles".
#include "voxel/kernel.h"

#include "voxel/kernel/measure.h"
#include "voxel/kernel/hanging.h"
#include "voxel/kernel/plain.h"

// The kernels: one for each kind of element (kind.h) and damping, without and with hanging
// vertices.
#define EACH_AFFINE(X)                                                                             \
    X(ELEMENT_LINEAR, UNDAMPED)                                                                    \
    X(ELEMENT_LINEAR, DAMPED)                                                                      \
    X(ELEMENT_LINEAR, VISCOUS)                                                                     \
    X(ELEMENT_LAW, UNDAMPED)                                                                       \
    X(ELEMENT_LAW, DAMPED)                                                                         \
    X(ELEMENT_LAW, VISCOUS)
// Whole cubes of the paper's element are linear ones (plain.h).
#define EACH_KIND(X) EACH_AFFINE(X) X(ELEMENT_PAPER, UNDAMPED) X(ELEMENT_PAPER, DAMPED)

#define KERNEL(name, call)                                                                         \
    static __attribute__((noinline)) void name(const VoxelPass *pass)                              \
    {                                                                                              \
        call;                                                                                      \
    }
#define DEFINE_PLAIN(kind, damping)                                                                \
    KERNEL(plain_##kind##_##damping, evaluate_plain(pass, kind, damping))
#define DEFINE_HANGING(kind, damping)                                                              \
    KERNEL(hanging_##kind##_##damping, evaluate_hanging(pass, kind, damping))
EACH_AFFINE(DEFINE_PLAIN)
EACH_KIND(DEFINE_HANGING)

static void evaluate(const VoxelPass *pass)
{
#define NAME_PLAIN(kind, damping)   [kind][damping] = plain_##kind##_##damping,
#define NAME_HANGING(kind, damping) [kind][damping] = hanging_##kind##_##damping,
    static VoxelKernel *const plain[ELEMENT_KINDS][DAMPINGS] = {EACH_AFFINE(NAME_PLAIN)},
                              *const hanging[ELEMENT_KINDS][DAMPINGS] = {EACH_KIND(NAME_HANGING)};
    const ElementKind kind = pass->law == VOXEL_MIYAZAKI2004 ? ELEMENT_PAPER
                             : pass->stiffening != NULL || pass->relaxation.count > 0
                                 ? ELEMENT_LAW
                                 : ELEMENT_LINEAR;
    // For the paper's law both dampings are the same.
    const Damping damping = !pass->damped                            ? UNDAMPED
                            : pass->viscous && kind != ELEMENT_PAPER ? VISCOUS
                                                                     : DAMPED;
    if (pass->plain->batch_count > 0)
        plain[kind == ELEMENT_PAPER ? ELEMENT_LINEAR : kind][damping](pass);
    if (pass->hanging->batch_count > 0)
        hanging[kind][damping](pass);
}

extern const VoxelKernels KERNEL_NAME;
const VoxelKernels KERNEL_NAME = {
    .level = KERNEL_LEVEL,
    .precision = KERNEL_SINGLE ? PRECISION_SINGLE : PRECISION_DOUBLE,
    .evaluate = evaluate,
    .energy = energy,
    .stress = stress,
};
