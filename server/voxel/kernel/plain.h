// SPDX-License-Identifier: MIT
// Private to the kernels: cubes with 8 corners. In the basis of the 8 products of the signs of a
// corner's coordinates (Hadamard's), a cube's displacements are their mean, three columns of the
// deformation and four modes that do not move the middle; in it all of the element's law is
// diagonal except the rotation. A lane is an element; 24 additions per component transform there,
// 23 back.
#ifndef PLIANT_VOXEL_KERNEL_PLAIN_H
#define PLIANT_VOXEL_KERNEL_PLAIN_H

#include "voxel/kernel/barrier.h"
#include "voxel/kernel/relaxation.h"
#include "voxel/kernel/scatter.h"
#include "voxel/kernel/stiffening.h"

// Modes by the axes whose signs they are the product of: x 1, y 2, z 4.
enum { MODES = 8 };
static const int AXIS_MODE[3] = {1, 2, 4}, BENT_MODE[4] = {3, 5, 6, 7};

// Parameters of a class, with the scales of the pass; forces are of modes, which apply fully to
// each corner.
typedef struct PlainFactors {
    Real gradient;                   // 1 / (4 H): for sums over the corners
    Real stretch;                    // 2 mu H^2 / 4
    Real bulk;                       // lambda H^2 / 4
    Real bend;                       // 4 H alpha k / 8
    Real damping;                    // beta k / 8
    Real bent;                       // viscous: alpha
    Real damping_bent, damping_bulk; // alpha beta k / 8, beta lambda H / 16
    EnergyFactors energy;            // of elements that stiffen
    bool paper;                      // no barrier
} PlainFactors;

INLINE PlainFactors plain_factors(const VoxelPass *pass, int element_class, bool viscous,
                                  bool stiffens)
{
    const ElementClass *c = &pass->classes[element_class];
    // The paper's force k (R R0 - r) at 8 corners is that of mu = k / H, lambda = 0, alpha = 1.
    const bool paper = pass->law == VOXEL_MIYAZAKI2004;
    const double mu = paper ? c->residual / c->size : c->mu, lambda = paper ? 0.0 : c->lambda;
    const double scale = pass->stiffness_scale, area = 0.25 * c->size * c->size;
    const double damping = scale * pass->damping_scale * 0.125 * c->damping;
    const double alpha = viscous && mu > 0.0 ? c->residual / (mu * c->size) : 0.0;
    return (PlainFactors){
        .gradient = (Real)(0.25 / c->size),
        .stretch = (Real)(scale * 2.0 * mu * area),
        .bulk = (Real)(scale * lambda * area),
        .bend = (Real)(scale * 0.5 * c->size * c->residual),
        .damping = (Real)damping,
        .bent = (Real)alpha,
        .damping_bent = (Real)(alpha * damping),
        .damping_bulk = (Real)(viscous && mu > 0.0 ? 0.5 * lambda / mu * damping : 0.0),
        .energy = stiffens ? energy_factors(pass, c) : (EnergyFactors){0},
        .paper = paper,
    };
}

// Transforms corners to modes.
INLINE void butterfly(Vector v[MODES])
{
    for (int bit = 1; bit < MODES; bit *= 2) {
        for (int i = 0; i < MODES; i++) {
            if ((i & bit) != 0)
                continue;
            Vector low = v[i], high = v[i | bit];
            v[i] = high + low;
            v[i | bit] = high - low;
        }
    }
}

// Transforms modes, of which the first is zero, to corners.
INLINE void butterfly_back(Vector v[MODES])
{
    v[0] = -v[1];
    for (int bit = 1; bit < MODES; bit *= 2) {
        for (int i = bit == 1 ? 2 : 0; i < MODES; i++) {
            if ((i & bit) != 0)
                continue;
            Vector low = v[i], high = v[i | bit];
            v[i] = low - high;
            v[i | bit] = low + high;
        }
    }
}

// Returns q (stiffening.h) from the sum of the squares of all `bent`: a mode moves each of 8
// corners by half of its own, in edge lengths.
INLINE Vector plain_q(const EnergyFactors *by, const Deformation *deformation, const Polar *polar,
                      Vector bent)
{
    return by->shape * square_strain(deformation, polar) +
           by->bulk * (polar->stretch * polar->stretch) + (by->bend + by->bend) * bent;
}

// Replaces the displacements u of the corners of WIDTH cubes by their forces, from u and the
// velocities v, by component.
// `dashpot`: of these lanes, in two arrays; read if they relax.
INLINE void plain_forces(const VoxelPass *pass, const PlainFactors *by, ElementKind kind,
                         Damping damps, double (*last)[4], const Dashpot *dashpot,
                         const StiffeningFactors *curve, Vector u[3][MODES], Vector v[3][MODES])
{
    const bool damped = damps != UNDAMPED, viscous = damps == VISCOUS;
    Deformation deformation;
    Root root;
    Polar polar;
    Motion motion;
    Vector spin[3], bent[4][3];
    // Displacements to modes: three give F - 1, four the bending.
    for (int c = 0; c < 3; c++) {
        butterfly(u[c]);
        for (int k = 0; k < 3; k++)
            deformation.g[c][k] = u[c][AXIS_MODE[k]] * by->gradient;
        for (int m = 0; m < 4; m++)
            bent[m][c] = u[c][BENT_MODE[m]] * by->gradient;
    }
    deformation_complete(&deformation);
    polar_root(&deformation, &root);
    // The rigid rotation of the velocities, which damping must not slow.
    if (damped) {
        for (int c = 0; c < 3; c++)
            butterfly(v[c]);
        Vector weighted[4][3];
        for (int m = 0; m < 4; m++)
            for (int c = 0; c < 3; c++)
                weighted[m][c] = viscous ? by->bent * bent[m][c] : bent[m][c];
        for (int i = 0; i < 3; i++) {
            int j = (i + 1) % 3, k = (i + 2) % 3;
            motion.spread[i] = deformation.gram[i] + REAL(1.0);
            motion.spread[3 + i] = deformation.gram[3 + i];
            motion.momentum[i] = vector_set(0.0);
            for (int m = 0; m < 4; m++) {
                motion.spread[i] += weighted[m][i] * bent[m][i];
                motion.spread[3 + i] += weighted[m][j] * bent[m][k];
            }
        }
        for (int m = 0; m < 3; m++) {
            const int mode = AXIS_MODE[m];
            const Vector arm[3] = {deformation.f[0][m], deformation.f[1][m], deformation.f[2][m]};
            add_cross(arm, (const Vector[3]){v[0][mode], v[1][mode], v[2][mode]}, motion.momentum);
        }
        for (int m = 0; m < 4; m++) {
            const int mode = BENT_MODE[m];
            add_cross(weighted[m], (const Vector[3]){v[0][mode], v[1][mode], v[2][mode]},
                      motion.momentum);
        }
        spin_solve(&motion, spin);
    }
    Vector unfit = polar_fit(&deformation, &root, &polar);
    Vector relaxing[3][3] = {{{0}}};
    const Vector linear = by->stretch - (Vector){0}, linear_bulk = by->bulk - (Vector){0};
    Vector stretch = linear, bulk = linear_bulk, bend = by->bend - (Vector){0};
    Vector damping = by->damping - (Vector){0}, damping_bent = damping, damping_bulk = damping;
    if (viscous) {
        damping_bent = by->damping_bent - (Vector){0};
        damping_bulk = by->damping_bulk - (Vector){0};
    }
    const bool rare = vector_any(vector_or(unfit, crushed(&root)));
    if (__builtin_expect(rare, 0))
        repair(&deformation, &motion, unfit, damped, last, &polar, spin);
    if (kind_relaxes(kind, pass))
        relax(pass, linear, linear_bulk, &deformation, &polar, unfit, dashpot, relaxing);
    if (kind_stiffens(kind, pass)) {
        Vector square = vector_set(0.0);
        for (int m = 0; m < 4; m++)
            for (int c = 0; c < 3; c++)
                square += bent[m][c] * bent[m][c];
        Vector damp;
        const Vector factor =
            stiffening_factor_of(curve, plain_q(&by->energy, &deformation, &polar, square), &damp);
        stretch *= factor;
        bulk *= factor;
        bend *= factor;
        if (damped) {
            damping *= damp;
            damping_bent *= damp;
            damping_bulk *= damp;
        }
    }
    if (__builtin_expect(rare, 0) && !by->paper)
        barrier(&polar, linear, linear_bulk, stretch, &deformation);

    // -(2 mu (F - R) + lambda tr(D) R) H^2 / 4, R - 1 = turn inverse
    Vector pressure = polar.stretch * bulk;
    if (viscous) {
        Vector rate[3][3];
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                rate[c][k] = v[c][AXIS_MODE[k]];
        pressure += damping_bulk * dilation_rate(&polar, rate);
    }
    Vector back = (stretch - pressure) * polar.inverse;
    for (int c = 0; c < 3; c++) {
        int c1 = (c + 1) % 3, c2 = (c + 2) % 3;
        for (int k = 0; k < 3; k++) {
            Vector f = back * polar.turn[c][k] - stretch * deformation.g[c][k];
            if (c == k)
                f -= pressure;
            if (damped)
                f -= damping * (v[c][AXIS_MODE[k]] - (spin[c1] * deformation.f[c2][k] -
                                                      spin[c2] * deformation.f[c1][k]));
            if (kind == ELEMENT_LAW)
                f -= relaxing[c][k];
            u[c][AXIS_MODE[k]] = f;
        }
        for (int m = 0; m < 4; m++) {
            Vector f = -bend * bent[m][c];
            if (damped)
                f -= damping_bent *
                     (v[c][BENT_MODE[m]] - (spin[c1] * bent[m][c2] - spin[c2] * bent[m][c1]));
            u[c][BENT_MODE[m]] = f;
        }
    }
    // Forces back to the corners.
    for (int c = 0; c < 3; c++)
        butterfly_back(u[c]);
}

// Loads corners of WIDTH elements. One by one for constant indices: in a loop all modes would be in
// memory, at half the speed.
INLINE void load_corner(const void *rows, const int *vertex, bool damped, int c, Vector u[3][MODES],
                        Vector v[3][MODES])
{
    Vector first[3], second[3];
    vector_load_rows(rows, vertex + c * LANES, damped, first, second);
    for (int k = 0; k < 3; k++) {
        u[k][c] = first[k];
        if (damped)
            v[k][c] = second[k];
    }
}

#define EACH_CORNER(act) act(0) act(1) act(2) act(3) act(4) act(5) act(6) act(7)

INLINE void plain_lanes(const VoxelPass *pass, const PlainFactors *by, const int *vertex,
                        ElementKind kind, Damping damps, double (*last)[4], const Dashpot *dashpot,
                        const StiffeningFactors *curve, Real (*force)[4 * LANES])
{
    const bool damped = damps != UNDAMPED;
    Vector u[3][MODES], v[3][MODES];
#define LOAD(c) load_corner(pass->rows, vertex, damped, c, u, v);
    EACH_CORNER(LOAD)
    plain_forces(pass, by, kind, damps, last, dashpot, curve, u, v);
#define SPREAD(c) vector_spread_rows(force[c], u[0][c], u[1][c], u[2][c]);
    EACH_CORNER(SPREAD)
#undef LOAD
#undef SPREAD
}

INLINE void evaluate_plain(const VoxelPass *pass, ElementKind kind, Damping damps)
{
    const bool relaxes = kind_relaxes(kind, pass), stiffens = kind_stiffens(kind, pass);
    const PlainBatches *plain = pass->plain;
    const StiffeningFactors curve = curve_of(pass, stiffens);
    PlainFactors by = {0};
    int element_class = -1;
    for (int batch = 0; batch < plain->batch_count; batch++) {
        const int *vertex = plain->vertex + (long)batch * NODE_CORNERS * LANES;
        if (plain->element_class[batch] != element_class) {
            element_class = plain->element_class[batch];
            by = plain_factors(pass, element_class, damps == VISCOUS, stiffens);
        }
        _Alignas(64) Real force[NODE_CORNERS][4 * LANES];
        for (int lane = 0; lane < LANES; lane += WIDTH) {
            const Dashpot dashpot = dashpot_at(pass, relaxes, batch, lane);
            plain_lanes(pass, &by, vertex + lane, kind, damps, pass->last[batch] + lane, &dashpot,
                        &curve, (Real(*)[4 * LANES])(force[0] + 4 * lane));
        }
        for (int c = 0; c < NODE_CORNERS; c++)
            scatter_forces(pass->force, vertex + c * LANES, force[c]);
    }
}

#endif
