// Private to the kernels: finds the few elements whose stress exceeds a limit, which tearing must
// examine. With D = R^T F - 1 and P = R (2 mu D + lambda tr(D) 1),
//   |P|^2 = 4 mu^2 |D|^2 + (4 mu lambda + 3 lambda^2) tr(D)^2.
// Changes nothing.
#ifndef PLIANT_VOXEL_KERNEL_STRESS_H
#define PLIANT_VOXEL_KERNEL_STRESS_H

#include "voxel/kernel/energy.h"

// Parameters of a class: |P|^2 over the square of the limit is shear |D|^2 + bulk tr(D)^2.
typedef struct StressFactors {
    Real shear, bulk;
} StressFactors;

static inline StressFactors stress_factors(const VoxelPass *pass, const ElementClass *c,
                                           double limit)
{
    const bool paper = pass->law == VOXEL_MIYAZAKI2004;
    const double scale = pass->stiffness_scale / limit;
    const double mu = scale * (paper ? c->residual / c->size : c->mu);
    const double lambda = paper ? 0.0 : scale * c->lambda;
    return (StressFactors){(Real)(4.0 * mu * mu), (Real)(lambda * (4.0 * mu + 3.0 * lambda))};
}

// Returns the bits of WIDTH lanes above the limit. Elements too flat or inverted for the fast path,
// and bad numbers, count as above every limit.
INLINE unsigned beyond(Deformation *deformation, Vector shear, Vector bulk)
{
    Root root;
    Polar polar;
    deformation_complete(deformation);
    polar_root(deformation, &root);
    Vector unfit = polar_fit(deformation, &root, &polar);
    Vector square =
        shear * square_strain(deformation, &polar) + bulk * (polar.stretch * polar.stretch);
    Mask high = (Mask)vector_or(unfit, vector_not_within(square, vector_set(1.0)));
    if (__builtin_expect(!vector_any((Vector)high), 1))
        return 0;
    unsigned bits = 0;
    for (int lane = 0; lane < WIDTH; lane++)
        bits |= (unsigned)(high[lane] != 0) << lane;
    return bits;
}

INLINE void plain_deformation(const VoxelPass *pass, const int *vertex, Real gradient,
                              Deformation *out)
{
    Vector u[3][MODES];
#define LOAD(c)                                                                                    \
    {                                                                                              \
        Vector first[3], second[3];                                                                \
        vector_load_rows(pass->rows, vertex + (c)*LANES, false, first, second);                    \
        for (int k = 0; k < 3; k++)                                                                \
            u[k][c] = first[k];                                                                    \
    }
    EACH_CORNER(LOAD)
#undef LOAD
    for (int i = 0; i < 3; i++) {
        butterfly(u[i]);
        for (int k = 0; k < 3; k++)
            out->g[i][k] = u[i][AXIS_MODE[k]] * gradient;
    }
}

static void plain_stress(const VoxelPass *pass, double limit, uint16_t *high)
{
    const PlainBatches *plain = pass->plain;
    for (int b = 0; b < plain->batch_count; b++) {
        const ElementClass *c = &pass->classes[plain->element_class[b]];
        const StressFactors by = stress_factors(pass, c, limit);
        const int *vertex = plain->vertex + (long)b * NODE_CORNERS * LANES;
        unsigned bits = 0;
        for (int lane = 0; lane < LANES; lane += WIDTH) {
            Deformation deformation;
            plain_deformation(pass, vertex + lane, (Real)(0.25 / c->size), &deformation);
            bits |= beyond(&deformation, by.shear - (Vector){0}, by.bulk - (Vector){0}) << lane;
        }
        high[b] = (uint16_t)bits;
    }
}

INLINE void hanging_stress(const VoxelPass *pass, double limit, bool paper, bool mixed,
                           uint16_t *high)
{
    const HangingBatches *hanging = pass->hanging;
    const int pure = hanging->batch_count - hanging->mixed_count;
    for (int b = mixed ? pure : 0; b < (mixed ? hanging->batch_count : pure); b++) {
        const RestTable *table = &pass->tables[hanging->table[b]];
        const int *vertex = hanging->vertex + (long)hanging->start[b] * LANES;
        _Alignas(64) Real factor[FACTORS][LANES], shear[LANES], bulk[LANES];
        hanging_factors(pass, hanging->element_class[b], factor);
        for (int lane = 0; lane < LANES; lane++) {
            const ElementClass *c = &pass->classes[hanging->element_class[b][lane]];
            const StressFactors by = stress_factors(pass, c, limit);
            shear[lane] = by.shear;
            bulk[lane] = by.bulk;
        }
        unsigned bits = 0;
        for (int lane = 0; lane < LANES; lane += WIDTH) {
            const Rest rest = {mixed, table->count,
                               (const Real *)table->number + (mixed ? lane : 0)};
            Hanging h;
            gather_hanging(pass, &rest, vertex + lane, vector_load(factor[GRADIENT] + lane), paper,
                           false, &h);
            bits |= beyond(&h.deformation, vector_load(shear + lane), vector_load(bulk + lane))
                    << lane;
        }
        high[b] = (uint16_t)bits;
    }
}

static void stress(const VoxelPass *pass, double limit, uint16_t *high)
{
    uint16_t *hanging = high + pass->plain->batch_count;
    plain_stress(pass, limit, high);
    for (int mixed = 0; mixed < 2; mixed++)
        if (pass->law == VOXEL_MIYAZAKI2004)
            hanging_stress(pass, limit, true, mixed != 0, hanging);
        else
            hanging_stress(pass, limit, false, mixed != 0, hanging);
}

#endif
