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

// The variants: the kernel of a scene contains only what the scene uses. By damping: none, of all
// but the rigid motion alike, in proportion to the stiffness, which for the paper's law is the
// same.
enum { UNDAMPED, DAMPED, VISCOUS, DAMPINGS };

#define PLAIN_VARIANT(name, damped, viscous, relaxes)                                              \
    static __attribute__((noinline)) void name(const VoxelPass *pass)                              \
    {                                                                                              \
        evaluate_plain(pass, damped, viscous, relaxes);                                            \
    }
PLAIN_VARIANT(plain_undamped, false, false, false)
PLAIN_VARIANT(plain_damped, true, false, false)
PLAIN_VARIANT(plain_viscous, true, true, false)
PLAIN_VARIANT(plain_relaxing_undamped, false, false, true)
PLAIN_VARIANT(plain_relaxing_damped, true, false, true)
PLAIN_VARIANT(plain_relaxing_viscous, true, true, true)

#define HANGING_VARIANT(name, paper, damped, viscous, relaxes, mixed)                              \
    static __attribute__((noinline)) void name(const VoxelPass *pass)                              \
    {                                                                                              \
        evaluate_hanging(pass, paper, damped, viscous, relaxes, mixed);                            \
    }
HANGING_VARIANT(hanging_affine, false, false, false, false, false)
HANGING_VARIANT(hanging_affine_damped, false, true, false, false, false)
HANGING_VARIANT(hanging_affine_viscous, false, true, true, false, false)
HANGING_VARIANT(hanging_relaxing, false, false, false, true, false)
HANGING_VARIANT(hanging_relaxing_damped, false, true, false, true, false)
HANGING_VARIANT(hanging_relaxing_viscous, false, true, true, true, false)
HANGING_VARIANT(hanging_paper, true, false, false, false, false)
HANGING_VARIANT(hanging_paper_damped, true, true, false, false, false)
HANGING_VARIANT(mixed_affine, false, false, false, false, true)
HANGING_VARIANT(mixed_affine_damped, false, true, false, false, true)
HANGING_VARIANT(mixed_affine_viscous, false, true, true, false, true)
HANGING_VARIANT(mixed_relaxing, false, false, false, true, true)
HANGING_VARIANT(mixed_relaxing_damped, false, true, false, true, true)
HANGING_VARIANT(mixed_relaxing_viscous, false, true, true, true, true)
HANGING_VARIANT(mixed_paper, true, false, false, false, true)
HANGING_VARIANT(mixed_paper_damped, true, true, false, false, true)

static void evaluate(const VoxelPass *pass)
{
    enum { AFFINE, RELAXING, PAPER, LAWS };
    static VoxelKernel *const plain[2][DAMPINGS] = {
        {plain_undamped, plain_damped, plain_viscous},
        {plain_relaxing_undamped, plain_relaxing_damped, plain_relaxing_viscous}};
    static VoxelKernel *const hanging[LAWS][DAMPINGS][2] = {
        {{hanging_affine, mixed_affine},
         {hanging_affine_damped, mixed_affine_damped},
         {hanging_affine_viscous, mixed_affine_viscous}},
        {{hanging_relaxing, mixed_relaxing},
         {hanging_relaxing_damped, mixed_relaxing_damped},
         {hanging_relaxing_viscous, mixed_relaxing_viscous}},
        {{hanging_paper, mixed_paper}, {hanging_paper_damped, mixed_paper_damped}}};
    const int law = pass->law == VOXEL_MIYAZAKI2004 ? PAPER
                    : pass->relaxation.count > 0        ? RELAXING
                                                    : AFFINE;
    const int damping = !pass->damped ? UNDAMPED : pass->viscous && law != PAPER ? VISCOUS : DAMPED;
    if (pass->plain->batch_count > 0)
        plain[law == RELAXING][damping](pass);
    if (pass->hanging->batch_count > pass->hanging->mixed_count)
        hanging[law][damping][0](pass);
    if (pass->hanging->mixed_count > 0)
        hanging[law][damping][1](pass);
}

extern const VoxelKernels KERNEL_NAME;
const VoxelKernels KERNEL_NAME = {
    .level = KERNEL_LEVEL,
    .precision = KERNEL_SINGLE ? PRECISION_SINGLE : PRECISION_DOUBLE,
    .evaluate = evaluate,
    .energy = energy,
    .stress = stress,
};
