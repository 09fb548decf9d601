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

#define PLAIN_VARIANT(name, damped, viscous, relaxes, stiffens)                                    \
    static __attribute__((noinline)) void name(const VoxelPass *pass)                              \
    {                                                                                              \
        evaluate_plain(pass, damped, viscous, relaxes, stiffens);                                  \
    }
PLAIN_VARIANT(plain_undamped, false, false, false, false)
PLAIN_VARIANT(plain_damped, true, false, false, false)
PLAIN_VARIANT(plain_viscous, true, true, false, false)
PLAIN_VARIANT(plain_relaxing_undamped, false, false, true, false)
PLAIN_VARIANT(plain_relaxing_damped, true, false, true, false)
PLAIN_VARIANT(plain_relaxing_viscous, true, true, true, false)
PLAIN_VARIANT(plain_stiffening_undamped, false, false, false, true)
PLAIN_VARIANT(plain_stiffening_damped, true, false, false, true)
PLAIN_VARIANT(plain_stiffening_viscous, true, true, false, true)
PLAIN_VARIANT(plain_both_undamped, false, false, true, true)
PLAIN_VARIANT(plain_both_damped, true, false, true, true)
PLAIN_VARIANT(plain_both_viscous, true, true, true, true)

#define HANGING_VARIANT(name, paper, damped, viscous, relaxes, stiffens, mixed)                    \
    static __attribute__((noinline)) void name(const VoxelPass *pass)                              \
    {                                                                                              \
        evaluate_hanging(pass, paper, damped, viscous, relaxes, stiffens, mixed);                  \
    }
#define HANGING_VARIANTS(name, paper, damped, viscous, relaxes, stiffens)                          \
    HANGING_VARIANT(hanging_##name, paper, damped, viscous, relaxes, stiffens, false)              \
    HANGING_VARIANT(mixed_##name, paper, damped, viscous, relaxes, stiffens, true)
HANGING_VARIANTS(affine, false, false, false, false, false)
HANGING_VARIANTS(affine_damped, false, true, false, false, false)
HANGING_VARIANTS(affine_viscous, false, true, true, false, false)
HANGING_VARIANTS(relaxing, false, false, false, true, false)
HANGING_VARIANTS(relaxing_damped, false, true, false, true, false)
HANGING_VARIANTS(relaxing_viscous, false, true, true, true, false)
HANGING_VARIANTS(stiffening, false, false, false, false, true)
HANGING_VARIANTS(stiffening_damped, false, true, false, false, true)
HANGING_VARIANTS(stiffening_viscous, false, true, true, false, true)
HANGING_VARIANTS(both, false, false, false, true, true)
HANGING_VARIANTS(both_damped, false, true, false, true, true)
HANGING_VARIANTS(both_viscous, false, true, true, true, true)
HANGING_VARIANTS(paper, true, false, false, false, false)
HANGING_VARIANTS(paper_damped, true, true, false, false, false)

static void evaluate(const VoxelPass *pass)
{
    enum { AFFINE, RELAXING, STIFFENING, BOTH, PAPER, LAWS };
    static VoxelKernel *const plain[PAPER][DAMPINGS] = {
        {plain_undamped, plain_damped, plain_viscous},
        {plain_relaxing_undamped, plain_relaxing_damped, plain_relaxing_viscous},
        {plain_stiffening_undamped, plain_stiffening_damped, plain_stiffening_viscous},
        {plain_both_undamped, plain_both_damped, plain_both_viscous}};
    static VoxelKernel *const hanging[LAWS][DAMPINGS][2] = {
        {{hanging_affine, mixed_affine},
         {hanging_affine_damped, mixed_affine_damped},
         {hanging_affine_viscous, mixed_affine_viscous}},
        {{hanging_relaxing, mixed_relaxing},
         {hanging_relaxing_damped, mixed_relaxing_damped},
         {hanging_relaxing_viscous, mixed_relaxing_viscous}},
        {{hanging_stiffening, mixed_stiffening},
         {hanging_stiffening_damped, mixed_stiffening_damped},
         {hanging_stiffening_viscous, mixed_stiffening_viscous}},
        {{hanging_both, mixed_both},
         {hanging_both_damped, mixed_both_damped},
         {hanging_both_viscous, mixed_both_viscous}},
        {{hanging_paper, mixed_paper}, {hanging_paper_damped, mixed_paper_damped}}};
    const int affine = pass->stiffening != NULL ? (pass->relaxation.count > 0 ? BOTH : STIFFENING)
                       : pass->relaxation.count > 0 ? RELAXING
                                                    : AFFINE;
    const int law = pass->law == VOXEL_MIYAZAKI2004 ? PAPER : affine;
    const int damping = !pass->damped ? UNDAMPED : pass->viscous && law != PAPER ? VISCOUS : DAMPED;
    if (pass->plain->batch_count > 0)
        plain[law == PAPER ? AFFINE : law][damping](pass);
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
