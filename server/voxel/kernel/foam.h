// SPDX-License-Identifier: MIT
// Private to the kernels: how WIDTH elements turn. The rotations of their deformations by FOAM
// (Markley 1993, "Attitude determination using vector observations: a fast optimal matrix
// algorithm"), branch-free. With s1, s2, s3 the singular values of F, s3 with the sign of det F,
// and |.| the Frobenius norm,
//   lambda = s1 + s2 + s3 = tr(R^T F) is the largest root of
//     (lambda^2 - |F|^2)^2 - 8 lambda det F - 4 |cof F|^2,
//   kappa = (lambda^2 - |F|^2) / 2, zeta = kappa lambda - det F = (s1 + s2) (s2 + s3) (s3 + s1),
//   R = ((kappa + |F|^2) F - F F^T F + lambda cof F) / zeta.
// Everything is expressed as the difference from rest, F = 1 + G: lambda = 3 + l, kappa = 3 + k,
// |F|^2 = 3 + n, det F = 1 + d, cof F = 1 + C, F F^T = 1 + E, so that
//   q(l) = k (3 + k/2) - l (1 + d) - (3 d + c), k = l (3 + l/2) - n/2, 1 + 2 c / 3 = |cof F|^2 / 3
//   zeta (R - 1) = (5 + k + n) G - E F + (3 + l) C + (n + d - 2 (k + l) - k l) 1
// and near rest rounding is relative to the deformation. At rest all terms are exactly zero.
//
// Halley's method from the upper bound sqrt(3) |F|; q' = zeta. Where zeta >= 0.2 lambda^3, l is
// then exact to 4e-7 (3 steps) and to rounding (4 steps), over all such s1, s2, s3; Newton's would
// need 5 and 7. Needles, inverted and very small elements are left to repair.h.
#ifndef PLIANT_VOXEL_KERNEL_FOAM_H
#define PLIANT_VOXEL_KERNEL_FOAM_H

#include "base/vector.h"

enum { HALLEY_STEPS = KERNEL_SINGLE ? 3 : 4 };

// A symmetric matrix.
enum { XX, YY, ZZ, YZ, ZX, XY, SYMMETRIC };

typedef struct Deformation {
    Vector g[3][3];         // F - 1 by rows
    Vector f[3][3];         // F
    Vector gram[SYMMETRIC]; // F F^T - 1
} Deformation;

typedef struct Polar {
    Vector turn[3][3]; // zeta (R - 1) by rows
    Vector inverse;    // 1 / zeta
    Vector stretch;    // tr(R^T F) - 3
} Polar;

INLINE void deformation_complete(Deformation *by)
{
    Vector(*g)[3] = by->g, (*f)[3] = by->f, *e = by->gram;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            f[i][k] = i == k ? g[i][k] + REAL(1.0) : g[i][k];
    }
    for (int i = 0; i < 3; i++)
        e[i] = g[i][i] + g[i][i] + (g[i][0] * g[i][0] + g[i][1] * g[i][1] + g[i][2] * g[i][2]);
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3; // YZ, ZX, XY
        e[3 + i] = g[j][k] + g[k][j] + (g[j][0] * g[k][0] + g[j][1] * g[k][1] + g[j][2] * g[k][2]);
    }
}

// Intermediate results that the two halves of the fit share.
typedef struct Root {
    Vector l, k, n, d;
    Vector zeta;
    Vector cofactor[3][3]; // C by rows
} Root;

// First half: mostly a chain of dependent operations. The processor executes unrelated work placed
// between the halves meanwhile.
INLINE void polar_root(const Deformation *by, Root *out)
{
    const Vector(*g)[3] = by->g, *e = by->gram;
    Vector(*c)[3] = out->cofactor; // cof F - 1 = tr(G) 1 - G^T + cof G
    for (int i = 0; i < 3; i++) {
        int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
        for (int k = 0; k < 3; k++) {
            int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
            c[i][k] = g[i1][k1] * g[i2][k2] - g[i1][k2] * g[i2][k1];
        }
    }
    Vector trace = g[0][0] + g[1][1] + g[2][2];
    Vector d = trace + (c[0][0] + c[1][1] + c[2][2]) +
               (g[0][0] * c[0][0] + g[0][1] * c[0][1] + g[0][2] * c[0][2]);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++)
            c[i][k] -= g[k][i];
        c[i][i] += trace;
    }
    Vector n = e[XX] + e[YY] + e[ZZ];
    // |cof F|^2 is the second invariant of F F^T.
    Vector second = e[XX] * e[YY] + e[YY] * e[ZZ] + e[ZZ] * e[XX] -
                    (e[YZ] * e[YZ] + e[ZX] * e[ZX] + e[XY] * e[XY]);
    // q = l^4 / 8 + 3/2 l^3 + (6 - n/4) l^2 + (8 - 3/2 n - d) l + q(0), and its derivatives.
    Vector half_n = REAL(0.5) * n, half_bend = REAL(6.0) - REAL(0.25) * n;
    Vector slope0 = REAL(8.0) - (REAL(1.5) * n + d);
    Vector level = half_n * (REAL(0.25) * n - REAL(5.0)) - (REAL(3.0) * d + REAL(0.5) * second);
    Vector l = vector_sqrt(REAL(9.0) + REAL(3.0) * n) - REAL(3.0);
    // Halley's method: cubic convergence, a fixed number of steps.
    for (int step = 0; step < HALLEY_STEPS; step++) {
        Vector l2 = l * l;
        Vector q = ((REAL(0.125) * l + REAL(1.5)) * l + half_bend) * l2 + (slope0 * l + level);
        Vector slope = (REAL(0.5) * l + REAL(4.5)) * l2 + ((half_bend + half_bend) * l + slope0);
        Vector bend = (REAL(0.75) * l + REAL(4.5)) * l + half_bend; // half the second derivative
        l -= q * slope / (slope * slope - q * bend);
    }
    out->l = l;
    out->k = l * (REAL(3.0) + REAL(0.5) * l) - half_n;
    out->n = n;
    out->d = d;
    out->zeta = (REAL(3.0) + out->k) * (REAL(3.0) + l) - (REAL(1.0) + d);
}

// Second half. Returns all bits set in lanes where the result is not accurate enough.
INLINE Vector polar_fit(const Deformation *by, const Root *root, Polar *out)
{
    const Vector(*g)[3] = by->g, (*f)[3] = by->f, *e = by->gram;
    Vector l = root->l, k = root->k, n = root->n, lambda = REAL(3.0) + l;
    out->stretch = l;
    out->inverse = REAL(1.0) / root->zeta;
    Vector first = REAL(5.0) + (k + n), rest = n + root->d - REAL(2.0) * (k + l) - k * l;
    static const int at[3][3] = {{XX, XY, ZX}, {XY, YY, YZ}, {ZX, YZ, ZZ}};
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            Vector cubed =
                e[at[i][0]] * f[0][j] + e[at[i][1]] * f[1][j] + e[at[i][2]] * f[2][j]; // E F
            out->turn[i][j] = first * g[i][j] - cubed + lambda * root->cofactor[i][j];
        }
        out->turn[i][i] += rest;
    }
    // The constant term: rounding is relative to numbers about 1, too much for an element shrunk
    // below 0.3 of its size.
    Vector least = REAL(0.2) * (lambda * lambda * lambda) + REAL(0.06);
    return vector_not_greater(root->zeta, least);
}

// --- the rigid rotation of WIDTH elements' velocities, omega = I^-1 L ---

// Its input: S = sum w r r^T, so that I = tr(S) 1 - S, and L = sum w r x v.
typedef struct Motion {
    Vector spread[SYMMETRIC];
    Vector momentum[3];
} Motion;

// Returns the rate of tr(R^T F), R : dF/dt, from that of F: R does not contribute, since it makes
// tr(R^T F) stationary.
INLINE Vector dilation_rate(const Polar *polar, Vector rate[3][3])
{
    Vector sum = vector_set(0.0);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            sum += polar->turn[i][k] * rate[i][k];
    return sum * polar->inverse + (rate[0][0] + rate[1][1] + rate[2][2]);
}

INLINE void add_cross(const Vector a[3], const Vector b[3], Vector sum[3])
{
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        sum[i] += a[j] * b[k] - a[k] * b[j];
    }
}

// Solves by the adjugate. Elements that polar_fit rejects may be needles, whose I is singular:
// repair.h replaces their result. In all others the smallest eigenvalue of I is above 1/400 of the
// largest.
INLINE void spin_solve(const Motion *motion, Vector spin[3])
{
    const Vector *s = motion->spread, *l = motion->momentum;
    Vector x = s[YY] + s[ZZ], y = s[ZZ] + s[XX], z = s[XX] + s[YY]; // I; off the diagonal -S
    Vector xx = y * z - s[YZ] * s[YZ], yy = z * x - s[ZX] * s[ZX], zz = x * y - s[XY] * s[XY];
    Vector yz = s[ZX] * s[XY] + x * s[YZ], zx = s[XY] * s[YZ] + y * s[ZX],
           xy = s[YZ] * s[ZX] + z * s[XY];
    Vector inverse = REAL(1.0) / (x * xx - s[XY] * xy - s[ZX] * zx);
    spin[0] = (xx * l[0] + xy * l[1] + zx * l[2]) * inverse;
    spin[1] = (xy * l[0] + yy * l[1] + yz * l[2]) * inverse;
    spin[2] = (zx * l[0] + yz * l[1] + zz * l[2]) * inverse;
}

#endif
