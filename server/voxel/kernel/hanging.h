// SPDX-License-Identifier: MIT
// Private to the kernels: elements with hanging vertices, WIDTH at a time. Lengths are in units of
// the element's edge H and relative to its first vertex, so that rounding is relative to the
// deformation: u' = (u - u_0) / H, v' = v - v_0.
//
// With c = sum w u' / sum w and, by law,
//   F = 1 + sum u'_i a_i^T, G = sum w_i u'_i X_i^T M^-1, P = H^2 (2 mu (F - R) + lambda tr(D) R),
//   or Miyazaki's F = sum (X_i + u'_i) a_i^T, G = R - 1, P = 0,
// the force is
//   f_i = -P a_i - alpha k H w_i (u'_i - c - G X_i) - beta k w_i (v'_i - v_c - omega x r_i)
//       = -P a_i + w_i (B X_i + b - alpha k H u'_i - beta k v'_i + beta k omega x u'_i),
//   B = alpha k H G + beta k [omega]x, b = alpha k H c + beta k (v_c - omega x c).
// With viscous damping ' = d/dt is that of F, G and e_i = u'_i - c - G X_i:
//   P' = 2 beta k (F' - omega x F) + beta lambda H (R : F') R is added to P, and the residual's
//   velocities are damped by alpha beta k, so that B = alpha k H G + alpha beta k (G' - omega x G).
#ifndef PLIANT_VOXEL_KERNEL_HANGING_H
#define PLIANT_VOXEL_KERNEL_HANGING_H

#include "voxel/kernel/barrier.h"
#include "voxel/kernel/relaxation.h"
#include "voxel/kernel/scatter.h"
#include "voxel/kernel/stiffening.h"
#include "voxel/template.h"

// Parameters of the elements' classes, with the scales of the pass.
typedef struct HangingFactors {
    Vector gradient;     // 1 / H
    Vector stretch;      // 2 mu H^2
    Vector bulk;         // lambda H^2
    Vector bend;         // alpha k H
    Vector damping;      // beta k
    Vector bent;         // viscous: alpha
    Vector bulk_damping; // viscous: beta lambda H
    // Elements that stiffen: as EnergyFactors.
    Vector energy_shape, energy_bulk, energy_bend;
} HangingFactors;

// The same for a batch, one array after another.
enum {
    GRADIENT,
    STRETCH,
    BULK,
    BEND,
    DAMPING,
    USUAL_FACTORS,
    BENT = USUAL_FACTORS,
    BULK_DAMPING,
    ENERGY_SHAPE,
    ENERGY_BULK,
    ENERGY_BEND,
    FACTORS
};

INLINE void hanging_factors(const VoxelPass *pass, const int element_class[LANES], bool viscous,
                            bool stiffens, Real out[FACTORS][LANES])
{
    const double scale = pass->stiffness_scale;
    for (int lane = 0; lane < LANES; lane++) {
        if (lane > 0 && element_class[lane] == element_class[lane - 1]) {
            for (int k = 0; k < USUAL_FACTORS; k++)
                out[k][lane] = out[k][lane - 1];
            for (int k = BENT; k < ENERGY_SHAPE && viscous; k++)
                out[k][lane] = out[k][lane - 1];
            for (int k = ENERGY_SHAPE; k < FACTORS && stiffens; k++)
                out[k][lane] = out[k][lane - 1];
            continue;
        }
        const ElementClass *c = &pass->classes[element_class[lane]];
        const double area = c->size * c->size;
        out[GRADIENT][lane] = (Real)(1.0 / c->size);
        out[STRETCH][lane] = (Real)(scale * 2.0 * c->mu * area);
        out[BULK][lane] = (Real)(scale * c->lambda * area);
        out[BEND][lane] = (Real)(scale * c->size * c->residual);
        out[DAMPING][lane] = (Real)(scale * pass->damping_scale * c->damping);
        if (stiffens) {
            const EnergyFactors energy = energy_factors(pass, c);
            out[ENERGY_SHAPE][lane] = energy.shape;
            out[ENERGY_BULK][lane] = energy.bulk;
            out[ENERGY_BEND][lane] = energy.bend;
        }
        if (!viscous)
            continue;
        out[BENT][lane] = (Real)(c->mu > 0.0 ? c->residual / (c->mu * c->size) : 0.0);
        out[BULK_DAMPING][lane] =
            (Real)(c->mu > 0.0 ? c->lambda / c->mu : 0.0) * out[DAMPING][lane];
    }
}

INLINE HangingFactors hanging_factors_at(Real factor[FACTORS][LANES], bool viscous, bool stiffens,
                                         int lane)
{
    HangingFactors by = {
        .gradient = vector_load(factor[GRADIENT] + lane),
        .stretch = vector_load(factor[STRETCH] + lane),
        .bulk = vector_load(factor[BULK] + lane),
        .bend = vector_load(factor[BEND] + lane),
        .damping = vector_load(factor[DAMPING] + lane),
    };
    if (viscous) {
        by.bent = vector_load(factor[BENT] + lane);
        by.bulk_damping = vector_load(factor[BULK_DAMPING] + lane);
    }
    if (stiffens) {
        by.energy_shape = vector_load(factor[ENERGY_SHAPE] + lane);
        by.energy_bulk = vector_load(factor[ENERGY_BULK] + lane);
        by.energy_bend = vector_load(factor[ENERGY_BEND] + lane);
    }
    return by;
}

// The rest shapes of WIDTH lanes.
typedef struct Rest {
    int count;
    const Real *number; // [TABLE_HEAD + count * TABLE_ROW][LANES], of the lanes' first
} Rest;

INLINE Vector rest_head(const Rest *rest, int k)
{
    return vector_load(rest->number + k * LANES);
}

INLINE Vector rest_of(const Rest *rest, int vertex, int k)
{
    return rest_head(rest, TABLE_HEAD + vertex * TABLE_ROW + k);
}

// A table with one number for all lanes, repeated for WIDTH of them.
typedef struct RestSpread {
    const RestTable *of; // NULL: none yet
    _Alignas(64) Real number[TABLE_HEAD + NODE_COUNT * TABLE_ROW][LANES];
} RestSpread;

// Returns the rest shapes of a batch from `lane` on; valid until the next call.
INLINE Rest rest_at(const VoxelPass *pass, int batch, int lane, RestSpread *spread)
{
    const RestTable *table = &pass->tables[pass->hanging->table[batch]];
    const Real *number = table->number;
    if (table->stride == LANES)
        return (Rest){table->count, number + lane};
    if (spread->of != table)
        for (int at = 0; at < TABLE_HEAD + table->count * TABLE_ROW; at++)
            vector_store(spread->number[at], number[at] - (Vector){0});
    spread->of = table;
    return (Rest){table->count, spread->number[0]};
}

// WIDTH elements.
typedef struct Hanging {
    Vector u[NODE_COUNT][3], v[NODE_COUNT][3]; // u', v'
    Vector middle[3], drift[3];                // c, v_c
    Vector slope[3][3];                        // G by rows (affine)
    Vector rate[3][3], slope_rate[3][3];       // viscous: of F and G, times H
    Deformation deformation;
    Motion motion;
} Hanging;

// Loads displacements and sums the terms of first order.
INLINE void gather_hanging(const VoxelPass *pass, const Rest *rest, const int *vertex,
                           Vector gradient, bool paper, bool damped, bool viscous, Hanging *h)
{
    const Vector zero = vector_set(0.0);
    Vector origin[3], origin_speed[3], middle[3], drift[3], g[3][3], slope[3][3];
    for (int i = 0; i < 3; i++) {
        middle[i] = drift[i] = zero;
        for (int k = 0; k < 3; k++)
            g[i][k] = slope[i][k] = h->rate[i][k] = h->slope_rate[i][k] = zero;
    }
    vector_load_rows(pass->rows, vertex, damped, origin, origin_speed);
    for (int p = 0; p < rest->count; p++) {
        Vector u[3], v[3], w = rest_of(rest, p, 3);
        vector_load_rows(pass->rows, vertex + p * LANES, damped, u, v);
        for (int i = 0; i < 3; i++) {
            u[i] = (u[i] - origin[i]) * gradient;
            h->u[p][i] = u[i];
            middle[i] += w * u[i];
            for (int k = 0; k < 3; k++) {
                g[i][k] += rest_of(rest, p, k) * u[i];
                if (!paper)
                    slope[i][k] += rest_of(rest, p, 7 + k) * u[i];
            }
            if (damped) {
                v[i] -= origin_speed[i];
                h->v[p][i] = v[i];
                drift[i] += w * v[i];
            }
            for (int k = 0; k < 3 && viscous; k++) {
                h->rate[i][k] += rest_of(rest, p, k) * v[i];
                h->slope_rate[i][k] += rest_of(rest, p, 7 + k) * v[i];
            }
        }
    }
    // Scale the sums; the deformation of the paper's law has a part at rest.
    static const int at[3][3] = {{XX, XY, ZX}, {XY, YY, YZ}, {ZX, YZ, ZZ}};
    for (int i = 0; i < 3; i++) {
        h->middle[i] = middle[i] * rest_head(rest, 1);
        h->drift[i] = drift[i] * rest_head(rest, 1);
        for (int k = 0; k < 3; k++) {
            h->deformation.g[i][k] = paper ? g[i][k] + rest_head(rest, 2 + at[i][k]) : g[i][k];
            h->slope[i][k] = slope[i][k];
        }
    }
}

// Begins the sums with those of the columns of F, which count twice as at eight corners.
INLINE void sum_uniform(const Hanging *h, Vector s[SYMMETRIC], Vector l[3])
{
    const Vector two = vector_set(2.0);
    for (int k = 0; k < 3; k++) {
        Vector arm[3], twice[3], rate[3];
        for (int i = 0; i < 3; i++) {
            arm[i] = h->deformation.f[i][k];
            twice[i] = two * arm[i];
            rate[i] = h->rate[i][k];
        }
        for (int i = 0; i < 3; i++) {
            s[i] += twice[i] * arm[i];
            s[3 + i] += twice[(i + 1) % 3] * arm[(i + 2) % 3];
        }
        add_cross(twice, rate, l);
    }
}

// Sums the terms of second order about the middle; viscous: those of the residual e in place of r,
// alpha times.
INLINE void sum_motion(const Rest *rest, Vector bent, bool viscous, Hanging *h)
{
    Vector s[SYMMETRIC], l[3];
    for (int i = 0; i < 3; i++)
        s[i] = s[3 + i] = l[i] = vector_set(0.0);
    if (viscous)
        sum_uniform(h, s, l);
    for (int p = 0; p < rest->count; p++) {
        Vector r[3], wr[3], w = rest_of(rest, p, 3);
        for (int i = 0; i < 3; i++) {
            r[i] = h->u[p][i] - h->middle[i];
            for (int k = 0; k < 3 && viscous; k++)
                r[i] -= h->slope[i][k] * rest_of(rest, p, 4 + k);
            if (!viscous)
                r[i] += rest_of(rest, p, 4 + i);
            wr[i] = viscous ? bent * (w * r[i]) : w * r[i];
        }
        for (int i = 0; i < 3; i++) {
            s[i] += wr[i] * r[i];
            s[3 + i] += wr[(i + 1) % 3] * r[(i + 2) % 3];
        }
        add_cross(wr, h->v[p], l);
    }
    for (int i = 0; i < 3; i++) {
        h->motion.spread[i] = s[i];
        h->motion.spread[3 + i] = s[3 + i];
        h->motion.momentum[i] = l[i]; // sum w r = 0: the origin of v has no effect
    }
}

// Returns q (stiffening.h).
INLINE Vector hanging_q(const Rest *rest, const HangingFactors *by, const Hanging *h,
                        const Polar *polar)
{
    Vector residual = vector_set(0.0);
    for (int p = 0; p < rest->count; p++) {
        Vector square = vector_set(0.0);
        for (int i = 0; i < 3; i++) {
            Vector d = h->u[p][i] - h->middle[i];
            for (int k = 0; k < 3; k++)
                d -= h->slope[i][k] * rest_of(rest, p, 4 + k);
            square += d * d;
        }
        residual += rest_of(rest, p, 3) * square;
    }
    return by->energy_shape * square_strain(&h->deformation, polar) +
           by->energy_bulk * (polar->stretch * polar->stretch) + by->energy_bend * residual;
}

// Adds the forces of WIDTH elements to the rows of a batch, from `lane` on.
INLINE void hanging_forces(const VoxelPass *pass, const Rest *rest, const int *vertex,
                           const HangingFactors *by, ElementKind kind, Damping damps,
                           double (*last)[4], const Dashpot *dashpot,
                           const StiffeningFactors *curve, Real (*out)[4 * LANES])
{
    const bool paper = kind == ELEMENT_PAPER, damped = damps != UNDAMPED,
               viscous = damps == VISCOUS;
    Hanging h;
    Root root;
    Polar polar;
    Vector spin[3] = {{0}};
    // Rotation and spin: independent work between polar_root and polar_fit hides latency.
    gather_hanging(pass, rest, vertex, by->gradient, paper, damped, viscous, &h);
    deformation_complete(&h.deformation);
    polar_root(&h.deformation, &root);
    if (damped) {
        sum_motion(rest, by->bent, viscous, &h);
        spin_solve(&h.motion, spin);
    }
    Vector unfit = polar_fit(&h.deformation, &root, &polar);
    const bool rare = vector_any(paper ? unfit : vector_or(unfit, crushed(&root)));
    Vector relaxing[3][3] = {{{0}}}, stretch = by->stretch, bulk = by->bulk, resist = by->bend;
    Vector resist_rate = by->damping, bulk_rate = by->bulk_damping;
    if (__builtin_expect(rare, 0))
        repair(&h.deformation, &h.motion, unfit, damped, last, &polar, spin);
    if (kind_relaxes(kind, pass))
        relax(pass, by->stretch, by->bulk, &h.deformation, &polar, unfit, dashpot, relaxing);
    if (kind_stiffens(kind, pass)) {
        Vector damp;
        const Vector factor = stiffening_factor_of(curve, hanging_q(rest, by, &h, &polar), &damp);
        stretch *= factor;
        bulk *= factor;
        resist *= factor;
        if (damped) {
            resist_rate *= damp;
            bulk_rate *= damp;
        }
    }
    if (__builtin_expect(rare, 0) && !paper)
        barrier(&polar, by->stretch, by->bulk, stretch, &h.deformation);

    Vector stress[3][3], bend[3][3], shift[3], turn[3]; // P, B, b, beta k omega
    Vector pressure = polar.stretch * bulk;
    if (viscous)
        pressure += bulk_rate * dilation_rate(&polar, h.rate);
    const Vector damping = viscous ? by->bent * resist_rate : resist_rate; // of the residual
    // -(2 mu (F - R) + lambda tr(D) R) as parts along G and along R - 1.
    Vector back = (paper ? resist : pressure - stretch) * polar.inverse;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            if (paper) {
                bend[i][k] = back * polar.turn[i][k];
            } else {
                stress[i][k] = stretch * h.deformation.g[i][k] + back * polar.turn[i][k];
                if (i == k)
                    stress[i][k] += pressure;
                bend[i][k] = resist * h.slope[i][k];
            }
            if (kind == ELEMENT_LAW)
                stress[i][k] += relaxing[i][k];
        }
        shift[i] = resist * h.middle[i];
        if (damped)
            turn[i] = damping * spin[i];
    }
    // Damping enters B and b through omega x.
    for (int i = 0; i < 3 && damped; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        if (viscous) {
            Vector(*f)[3] = h.deformation.f, (*slope)[3] = h.slope;
            for (int c = 0; c < 3; c++) {
                stress[i][c] += (resist_rate + resist_rate) *
                                (h.rate[i][c] - (spin[j] * f[k][c] - spin[k] * f[j][c]));
                bend[i][c] +=
                    damping * h.slope_rate[i][c] - (turn[j] * slope[k][c] - turn[k] * slope[j][c]);
            }
        } else {
            bend[i][k] += turn[j];
            bend[i][j] -= turn[k];
        }
        shift[i] += damping * h.drift[i] - (turn[j] * h.middle[k] - turn[k] * h.middle[j]);
    }
    // Force of each vertex, by the formula above.
    for (int p = 0; p < rest->count; p++) {
        Vector f[3];
        const Vector *u = h.u[p], *v = h.v[p];
        const Vector a[3] = {rest_of(rest, p, 0), rest_of(rest, p, 1), rest_of(rest, p, 2)},
                     x[4] = {rest_of(rest, p, 4), rest_of(rest, p, 5), rest_of(rest, p, 6),
                             rest_of(rest, p, 3)};
        for (int i = 0; i < 3; i++) {
            int j = (i + 1) % 3, k = (i + 2) % 3;
            f[i] = bend[i][0] * x[0] + bend[i][1] * x[1] + bend[i][2] * x[2] +
                   (shift[i] - resist * u[i]);
            if (damped)
                f[i] += (turn[j] * u[k] - turn[k] * u[j]) - damping * v[i];
            f[i] = f[i] * x[3];
            if (!paper)
                f[i] -= stress[i][0] * a[0] + stress[i][1] * a[1] + stress[i][2] * a[2];
        }
        vector_spread_rows(out[p], f[0], f[1], f[2]);
    }
}

INLINE void evaluate_hanging(const VoxelPass *pass, ElementKind kind, Damping damps)
{
    const bool viscous = damps == VISCOUS, relaxes = kind_relaxes(kind, pass),
               stiffens = kind_stiffens(kind, pass);
    const HangingBatches *hanging = pass->hanging;
    double(*last)[LANES][4] = pass->last + pass->plain->batch_count;
    const StiffeningFactors curve = curve_of(pass, stiffens);
    RestSpread spread;
    spread.of = NULL;
    for (int batch = 0; batch < hanging->batch_count; batch++) {
        const int *vertex = hanging->vertex + (long)hanging->start[batch] * LANES;
        const int count = pass->tables[hanging->table[batch]].count;
        _Alignas(64) Real force[NODE_COUNT][4 * LANES], factor[FACTORS][LANES];
        hanging_factors(pass, hanging->element_class[batch], viscous, stiffens, factor);
        for (int lane = 0; lane < LANES; lane += WIDTH) {
            const Rest rest = rest_at(pass, batch, lane, &spread);
            const HangingFactors by = hanging_factors_at(factor, viscous, stiffens, lane);
            const Dashpot dashpot =
                dashpot_at(pass, relaxes, (long)pass->plain->batch_count + batch, lane);
            hanging_forces(pass, &rest, vertex + lane, &by, kind, damps, last[batch] + lane,
                           &dashpot, &curve, (Real(*)[4 * LANES])(force[0] + 4 * lane));
        }
        for (int p = 0; p < count; p++)
            scatter_forces(pass->force, vertex + p * LANES, force[p]);
    }
}

#endif
