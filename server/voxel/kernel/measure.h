// SPDX-License-Identifier: MIT
// Private to the kernels: measures elements and changes nothing: their elastic energy (formula in
// element.c), for status and tests; which have more stress than a limit.
#ifndef PLIANT_VOXEL_KERNEL_MEASURE_H
#define PLIANT_VOXEL_KERNEL_MEASURE_H

#include "voxel/kernel/hanging.h"
#include "voxel/kernel/plain.h"

// Computes the rotations of WIDTH deformations, on a copy of `last`. Returns half the square of
// what the barrier closes.
INLINE Vector energy_fit(const Deformation *deformation, const double (*last)[4], Polar *polar)
{
    Motion motion;
    Vector spin[3];
    Root root;
    polar_root(deformation, &root);
    Vector unfit = polar_fit(deformation, &root, polar);
    if (__builtin_expect(!vector_any(vector_or(unfit, crushed(&root))), 1))
        return vector_set(0.0);
    double scratch[WIDTH][4];
    Deformation copy = *deformation;
    memcpy(scratch, last, sizeof scratch);
    repair(deformation, &motion, unfit, false, scratch, polar, spin);
    return barrier(polar, vector_set(0.0), vector_set(0.0), vector_set(0.0), &copy);
}

// Returns G(q) for the linear law's energy over its scale, lane by lane.
static Vector stiffened(const VoxelPass *pass, Vector q)
{
    for (int i = 0; i < WIDTH; i++)
        q[i] = (Real)stiffening_energy(&pass->stiffening->curve, (double)q[i]);
    return q;
}

// Adds lane by lane, so that sums have one order at every width.
static void add_lanes(Vector v, double *sum)
{
    for (int i = 0; i < WIDTH; i++)
        *sum += (double)v[i];
}

// Returns the energy of plain cubes in units of H^3 Pa.
INLINE Vector plain_energy(const VoxelPass *pass, const ElementClass *c, const int *vertex,
                           const double (*last)[4], const Real *dashpot)
{
    const bool paper = pass->law == VOXEL_MIYAZAKI2004;
    const Real gradient = (Real)(0.25 / c->size);
    Vector u[3][MODES];
    for (int corner = 0; corner < NODE_CORNERS; corner++) {
        Vector first[3], second[3];
        vector_load_rows(pass->rows, vertex + corner * LANES, false, first, second);
        for (int k = 0; k < 3; k++)
            u[k][corner] = first[k];
    }
    Deformation deformation;
    Polar polar;
    Vector bent = vector_set(0.0);
    for (int i = 0; i < 3; i++) {
        butterfly(u[i]);
        for (int k = 0; k < 3; k++)
            deformation.g[i][k] = u[i][AXIS_MODE[k]] * gradient;
        for (int m = 0; m < 4; m++) {
            Vector b = u[i][BENT_MODE[m]] * gradient;
            bent += b * b;
        }
    }
    deformation_complete(&deformation);
    const Vector gap = energy_fit(&deformation, last, &polar);
    // The displacement of a mode is H / 2 times its `bent` at each of 8 corners.
    const double mu = paper ? c->residual / c->size : c->mu;
    const double lambda = paper ? 0.0 : c->lambda;
    const Vector relaxing =
        pass->relaxation.count > 0
            ? relax_energy(pass, (Real)(2.0 * mu) + (Vector){0}, (Real)lambda + (Vector){0},
                           &deformation, &polar, dashpot)
            : vector_set(0.0);
    const Vector gap_energy = (Real)(paper ? 0.0 : barrier_stiffness(mu, lambda)) * gap;
    if (pass->stiffening != NULL) {
        const EnergyFactors by = energy_factors(pass, c);
        const Vector q = plain_q(&by, &deformation, &polar, bent);
        return relaxing +
               (Real)element_energy_scale(c->mu, c->lambda, pass->stiffening->strain) *
                   stiffened(pass, q) +
               gap_energy;
    }
    return relaxing + (Real)mu * square_strain(&deformation, &polar) +
           (Real)(0.5 * lambda) * (polar.stretch * polar.stretch) +
           (Real)(c->residual / c->size) * bent + gap_energy;
}

// Returns the energy of elements with hanging vertices [J].
INLINE Vector hanging_energy(const VoxelPass *pass, const Rest *rest, const int *vertex,
                             const HangingFactors *by, bool paper, const double (*last)[4],
                             const Real *dashpot)
{
    Hanging h;
    Polar polar;
    gather_hanging(pass, rest, vertex, by->gradient, paper, false, false, &h);
    deformation_complete(&h.deformation);
    const Vector gap = energy_fit(&h.deformation, last, &polar);
    Vector sum;
    if (pass->stiffening != NULL) {
        // 2 c H^2, from 2 mu H^2 and mu / c.
        sum = by->stretch / by->energy_shape * stiffened(pass, hanging_q(rest, by, &h, &polar)) +
              REAL(2.0 * BARRIER_SHARE) * (by->stretch + REAL(3.0) * by->bulk) * gap;
    } else {
        Vector residual = vector_set(0.0);
        for (int p = 0; p < rest->count; p++)
            for (int i = 0; i < 3; i++) {
                Vector d = h.u[p][i] - h.middle[i];
                for (int k = 0; k < 3; k++)
                    d -= (paper ? polar.turn[i][k] * polar.inverse : h.slope[i][k]) *
                         rest_of(rest, p, 4 + k);
                residual += rest_of(rest, p, 3) * (d * d);
            }
        sum = by->bend * residual;
        if (!paper)
            sum += by->stretch * square_strain(&h.deformation, &polar) +
                   by->bulk * (polar.stretch * polar.stretch) +
                   REAL(2.0 * BARRIER_SHARE) * (by->stretch + REAL(3.0) * by->bulk) * gap;
    }
    if (pass->relaxation.count > 0)
        sum +=
            REAL(2.0) * relax_energy(pass, by->stretch, by->bulk, &h.deformation, &polar, dashpot);
    return REAL(0.5) * sum / by->gradient;
}

static double plain_total(const VoxelPass *pass)
{
    const PlainBatches *plain = pass->plain;
    double total = 0.0;
    for (int b = 0; b < plain->batch_count; b++) {
        const ElementClass *c = &pass->classes[plain->element_class[b]];
        const int *vertex = plain->vertex + (long)b * NODE_CORNERS * LANES;
        const double(*last)[4] = (const double(*)[4])pass->last[b];
        double sum = 0.0;
        for (int lane = 0; lane < LANES; lane += WIDTH)
            add_lanes(plain_energy(pass, c, vertex + lane, last + lane,
                                   dashpot_at(pass, pass->relaxation.count > 0, b, lane).from),
                      &sum);
        total += c->size * c->size * c->size * sum;
    }
    return pass->stiffness_scale * total;
}

// Adds to `total` element by element.
static void add_hanging_energy(const VoxelPass *pass, double *total)
{
    const HangingBatches *hanging = pass->hanging;
    const bool paper = pass->law == VOXEL_MIYAZAKI2004, stiffens = pass->stiffening != NULL;
    RestSpread spread;
    spread.of = NULL;
    for (int b = 0; b < hanging->batch_count; b++) {
        const int *vertex = hanging->vertex + (long)hanging->start[b] * LANES;
        const double(*last)[4] = (const double(*)[4])pass->last[pass->plain->batch_count + b];
        _Alignas(64) Real factor[FACTORS][LANES];
        hanging_factors(pass, hanging->element_class[b], false, stiffens, factor);
        for (int lane = 0; lane < LANES; lane += WIDTH) {
            const Rest rest = rest_at(pass, b, lane, &spread);
            const HangingFactors by = hanging_factors_at(factor, false, stiffens, lane);
            const Real *dashpot = dashpot_at(pass, pass->relaxation.count > 0,
                                             (long)pass->plain->batch_count + b, lane)
                                      .from;
            add_lanes(hanging_energy(pass, &rest, vertex + lane, &by, paper, last + lane, dashpot),
                      total);
        }
    }
}

static double energy(const VoxelPass *pass)
{
    double total = plain_total(pass);
    add_hanging_energy(pass, &total);
    return total;
}

// --- stress ---

// Finds the few elements whose stress exceeds a limit, which tearing must
// examine. With D = R^T F - 1 and P = R (2 mu D + lambda tr(D) 1),
//   |P|^2 = 4 mu^2 |D|^2 + (4 mu lambda + 3 lambda^2) tr(D)^2.
// Parameters of a class: |P|^2 over the square of the limit is shear |D|^2 + bulk tr(D)^2.
typedef struct StressFactors {
    Real shear, bulk;
} StressFactors;

static inline StressFactors stress_factors(const VoxelPass *pass, const ElementClass *c,
                                           double limit)
{
    const bool paper = pass->law == VOXEL_MIYAZAKI2004;
    const double scale = pass->stiffness_scale / (limit * c->share);
    const double mu = scale * (paper ? c->residual / c->size : c->mu);
    const double lambda = paper ? 0.0 : scale * c->lambda;
    return (StressFactors){(Real)(4.0 * mu * mu), (Real)(lambda * (4.0 * mu + 3.0 * lambda))};
}

// Completes deformations and their rotations. Returns all bits set in lanes that count as above
// every limit: too flat or inverted for the fast path, crushed, or bad numbers.
INLINE Vector stress_fit(Deformation *deformation, Polar *polar)
{
    Root root;
    deformation_complete(deformation);
    polar_root(deformation, &root);
    const Vector unfit = polar_fit(deformation, &root, polar);
    return vector_or(unfit, crushed(&root));
}

// Returns the bits of WIDTH lanes above the limit. `factor`: of those that stiffen.
INLINE unsigned beyond(const Deformation *deformation, const Polar *polar, Vector rare,
                       Vector shear, Vector bulk, bool stiffens, Vector factor)
{
    Vector square =
        shear * square_strain(deformation, polar) + bulk * (polar->stretch * polar->stretch);
    if (stiffens)
        square *= factor * factor;
    Mask high = (Mask)vector_or(rare, vector_not_within(square, vector_set(1.0)));
    if (__builtin_expect(!vector_any((Vector)high), 1))
        return 0;
    unsigned bits = 0;
    for (int lane = 0; lane < WIDTH; lane++)
        bits |= (unsigned)(high[lane] != 0) << lane;
    return bits;
}

// Returns the sum of the squares of `bent`, if they stiffen.
INLINE Vector plain_deformation(const VoxelPass *pass, const int *vertex, Real gradient,
                                bool stiffens, Deformation *out)
{
    Vector u[3][MODES], square = vector_set(0.0);
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
        for (int m = 0; m < 4 && stiffens; m++) {
            const Vector bent = u[i][BENT_MODE[m]] * gradient;
            square += bent * bent;
        }
    }
    return square;
}

INLINE void plain_stress(const VoxelPass *pass, double limit, bool stiffens, uint16_t *high)
{
    const PlainBatches *plain = pass->plain;
    const StiffeningFactors curve = curve_of(pass, stiffens);
    for (int b = 0; b < plain->batch_count; b++) {
        const ElementClass *c = &pass->classes[plain->element_class[b]];
        const StressFactors by = stress_factors(pass, c, limit);
        const EnergyFactors energy = stiffens ? energy_factors(pass, c) : (EnergyFactors){0};
        const int *vertex = plain->vertex + (long)b * NODE_CORNERS * LANES;
        unsigned bits = 0;
        for (int lane = 0; lane < LANES; lane += WIDTH) {
            Deformation deformation;
            Polar polar;
            Vector factor = {0}, unused;
            const Vector bent = plain_deformation(pass, vertex + lane, (Real)(0.25 / c->size),
                                                  stiffens, &deformation);
            const Vector rare = stress_fit(&deformation, &polar);
            if (stiffens)
                factor = stiffening_factor_of(&curve, plain_q(&energy, &deformation, &polar, bent),
                                              &unused);
            bits |= beyond(&deformation, &polar, rare, by.shear - (Vector){0},
                           by.bulk - (Vector){0}, stiffens, factor)
                    << lane;
        }
        high[b] = (uint16_t)bits;
    }
}

// Elements that do not stiffen are gathered as the paper's, whatever their law: only the part at
// rest differs, which is 0 in the tables of the affine law.
INLINE void hanging_stress(const VoxelPass *pass, double limit, bool stiffens, uint16_t *high)
{
    const HangingBatches *hanging = pass->hanging;
    const StiffeningFactors curve = curve_of(pass, stiffens);
    RestSpread spread;
    spread.of = NULL;
    for (int b = 0; b < hanging->batch_count; b++) {
        const int *vertex = hanging->vertex + (long)hanging->start[b] * LANES;
        _Alignas(64) Real factor[FACTORS][LANES], shear[LANES], bulk[LANES];
        if (stiffens)
            hanging_factors(pass, hanging->element_class[b], false, true, factor);
        StressFactors limits = {0};
        for (int lane = 0, last = -1; lane < LANES; lane++) {
            const int element_class = hanging->element_class[b][lane];
            const ElementClass *c = &pass->classes[element_class];
            if (element_class != last)
                limits = stress_factors(pass, c, limit);
            last = element_class;
            factor[GRADIENT][lane] = (Real)(1.0 / c->size);
            shear[lane] = limits.shear;
            bulk[lane] = limits.bulk;
        }
        unsigned bits = 0;
        for (int lane = 0; lane < LANES; lane += WIDTH) {
            const Rest rest = rest_at(pass, b, lane, &spread);
            const Vector gradient = vector_load(factor[GRADIENT] + lane);
            Hanging h;
            Polar polar;
            Vector stiffer = {0}, unused;
            gather_hanging(pass, &rest, vertex + lane, gradient, !stiffens, false, false, &h);
            const Vector rare = stress_fit(&h.deformation, &polar);
            if (stiffens) {
                const HangingFactors by = hanging_factors_at(factor, false, true, lane);
                stiffer = stiffening_factor_of(&curve, hanging_q(&rest, &by, &h, &polar), &unused);
            }
            bits |= beyond(&h.deformation, &polar, rare, vector_load(shear + lane),
                           vector_load(bulk + lane), stiffens, stiffer)
                    << lane;
        }
        high[b] = (uint16_t)bits;
    }
}

static void stress(const VoxelPass *pass, double limit, uint16_t *high)
{
    uint16_t *hanging = high + pass->plain->batch_count;
    if (pass->stiffening != NULL) {
        plain_stress(pass, limit, true, high);
        hanging_stress(pass, limit, true, hanging);
    } else {
        plain_stress(pass, limit, false, high);
        hanging_stress(pass, limit, false, hanging);
    }
}

#endif
