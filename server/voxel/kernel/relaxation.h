// SPDX-License-Identifier: MIT
// Private to the kernels: Maxwell branches beside the uniform part of the affine law
// (server/voxel/README.md, "Relaxation"). With R^T F = 1 + B and the dashpot's strain Q of a
// branch, both symmetric,
//   D = B - Q,    Q' = D / time,    sigma = e (2 mu (D - tr(D)/3 1) + [volumetric] K tr(D) 1),
// and P = R (sigma + A). A is skew and makes (sigma + A) (1 + B) symmetric, which is the slope of
// the energy by F, and has no moment: with S = sum sigma,
//   (tr(1 + B) 1 - (1 + B)) a = axis of B S - S B,    det of that matrix = zeta (foam.h).
#ifndef PLIANT_VOXEL_KERNEL_RELAXATION_H
#define PLIANT_VOXEL_KERNEL_RELAXATION_H

#include "voxel/kernel/foam.h"
#include "voxel/kernel/kind.h"

static const int SYMMETRIC_AT[3][3] = {{XX, XY, ZX}, {XY, YY, YZ}, {ZX, YZ, ZZ}};

// The dashpots' strains of the lanes at hand, before and after a pass.
typedef struct Dashpot {
    const Real *from;
    Real *to;
} Dashpot;

// `batch`: hanging ones after the plain ones.
INLINE Dashpot dashpot_at(const VoxelPass *pass, bool relaxes, long batch, int lane)
{
    if (!relaxes)
        return (Dashpot){NULL, NULL};
    const long at = batch * pass->relaxation.count * SYMMETRIC * LANES + lane;
    return (Dashpot){(const Real *)pass->relaxation.from + at,
                     pass->relaxation.to == NULL ? NULL : (Real *)pass->relaxation.to + at};
}

// Computes B, from G = F - 1 and T = R - 1 as B = G + T^T + T^T G, and T.
INLINE void stretch_of(const Deformation *by, const Polar *polar, Vector b[SYMMETRIC],
                       Vector turn[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            turn[i][k] = polar->turn[i][k] * polar->inverse;
    for (int i = 0; i < 3; i++)
        for (int k = i; k < 3; k++)
            b[SYMMETRIC_AT[i][k]] =
                by->g[i][k] + turn[k][i] +
                (turn[0][i] * by->g[0][k] + turn[1][i] * by->g[1][k] + turn[2][i] * by->g[2][k]);
}

// Solves for a.
INLINE void solve_skew(const Vector b[SYMMETRIC], const Vector s[SYMMETRIC], Vector inverse,
                       Vector a[3])
{
    Vector m[3];
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3; // M_kj = (B S - S B)_kj
        m[i] = vector_set(0.0);
        for (int l = 0; l < 3; l++)
            m[i] += b[SYMMETRIC_AT[k][l]] * s[SYMMETRIC_AT[l][j]] -
                    s[SYMMETRIC_AT[k][l]] * b[SYMMETRIC_AT[l][j]];
    }
    const Vector two = REAL(2.0) + (Vector){0};
    const Vector x = two + (b[YY] + b[ZZ]), y = two + (b[ZZ] + b[XX]), z = two + (b[XX] + b[YY]);
    const Vector yz = b[ZX] * b[XY] + x * b[YZ], zx = b[XY] * b[YZ] + y * b[ZX],
                 xy = b[YZ] * b[ZX] + z * b[XY];
    a[0] = ((y * z - b[YZ] * b[YZ]) * m[0] + xy * m[1] + zx * m[2]) * inverse;
    a[1] = (xy * m[0] + (z * x - b[ZX] * b[ZX]) * m[1] + yz * m[2]) * inverse;
    a[2] = (zx * m[0] + yz * m[1] + (x * y - b[XY] * b[XY]) * m[2]) * inverse;
}

// Adds the branches' P to `stress`, in the units of `stretch` (2 mu) and `bulk` (lambda), and moves
// their dashpots on. Elements without a rotation (`unfit`)
// relax at once.
INLINE void relax(const VoxelPass *pass, Vector stretch, Vector bulk, const Deformation *by,
                  const Polar *polar, Vector unfit, const Dashpot *dashpot, Vector stress[3][3])
{
    const Real *from = dashpot->from;
    Real *to = dashpot->to;
    const Vector third = REAL(1.0 / 3.0) + (Vector){0};
    Vector b[SYMMETRIC], s[SYMMETRIC], turn[3][3], a[3];
    stretch_of(by, polar, b, turn);
    for (int i = 0; i < SYMMETRIC; i++)
        s[i] = vector_set(0.0);
    for (int n = 0; n < pass->relaxation.count;
         n++, from += SYMMETRIC * LANES, to += SYMMETRIC * LANES) {
        const RelaxationBranch *branch = &pass->relaxation.branch[n];
        const Real e = (Real)branch->stiffness, half = (Real)branch->half,
                   rest = (Real)(branch->half * branch->half);
        Vector d[SYMMETRIC];
        for (int i = 0; i < SYMMETRIC; i++) {
            d[i] = vector_clear(b[i] - vector_load(from + i * LANES), unfit);
            vector_store(to + i * LANES, b[i] - rest * d[i]);
            d[i] *= half;
        }
        // In the middle of the step.
        const Vector trace = d[XX] + d[YY] + d[ZZ];
        const Vector round =
            branch->volumetric ? (e * bulk) * trace : -(e * third) * (stretch * trace);
        for (int i = 0; i < SYMMETRIC; i++)
            s[i] += (e * stretch) * d[i] + (i < 3 ? round : vector_set(0.0));
    }
    solve_skew(b, s, polar->inverse, a);
    const Vector z[3][3] = {{s[XX], s[XY] - a[2], s[ZX] + a[1]},
                            {s[XY] + a[2], s[YY], s[YZ] - a[0]},
                            {s[ZX] - a[1], s[YZ] + a[0], s[ZZ]}};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            stress[i][k] +=
                z[i][k] + (turn[i][0] * z[0][k] + turn[i][1] * z[1][k] + turn[i][2] * z[2][k]);
}

// Returns the energy of the branches per volume, in the units of `stretch` and `bulk`.
INLINE Vector relax_energy(const VoxelPass *pass, Vector stretch, Vector bulk,
                           const Deformation *by, const Polar *polar, const Real *from)
{
    const Vector third = REAL(1.0 / 3.0) + (Vector){0};
    Vector b[SYMMETRIC], turn[3][3], sum = vector_set(0.0);
    stretch_of(by, polar, b, turn);
    for (int n = 0; n < pass->relaxation.count; n++, from += SYMMETRIC * LANES) {
        const RelaxationBranch *branch = &pass->relaxation.branch[n];
        Vector d[SYMMETRIC], square = vector_set(0.0);
        for (int i = 0; i < SYMMETRIC; i++) {
            d[i] = b[i] - vector_load(from + i * LANES);
            square += (i < 3 ? REAL(1.0) : REAL(2.0)) * (d[i] * d[i]);
        }
        const Vector trace = d[XX] + d[YY] + d[ZZ];
        sum +=
            (Real)branch->stiffness *
            (stretch * square + (branch->volumetric ? bulk : -third * stretch) * (trace * trace));
    }
    return REAL(0.5) * sum;
}

#endif
