// SPDX-License-Identifier: MIT
// Symmetric 3 x 3 matrices, by value. Arrays of six doubles in messages, states and kernels have
// the same order.
#ifndef PLIANT_BASE_SYM3_H
#define PLIANT_BASE_SYM3_H

#include "base/vec.h"

typedef struct Sym3 {
    double xx, yy, zz, yz, zx, xy;
} Sym3;

// a + s b
static inline Sym3 sym3_madd(Sym3 a, double s, Sym3 b)
{
    return (Sym3){a.xx + s * b.xx, a.yy + s * b.yy, a.zz + s * b.zz,
                  a.yz + s * b.yz, a.zx + s * b.zx, a.xy + s * b.xy};
}

static inline Sym3 sym3_scale(double s, Sym3 a)
{
    return (Sym3){s * a.xx, s * a.yy, s * a.zz, s * a.yz, s * a.zx, s * a.xy};
}

// s n n^T
static inline Sym3 sym3_outer(double s, Vec3 n)
{
    return (Sym3){s * n.x * n.x, s * n.y * n.y, s * n.z * n.z,
                  s * n.y * n.z, s * n.x * n.z, s * n.x * n.y};
}

static inline double sym3_trace(Sym3 a)
{
    return a.xx + a.yy + a.zz;
}

static inline Vec3 sym3_times(Sym3 a, Vec3 x)
{
    return vec3(a.xx * x.x + a.xy * x.y + a.zx * x.z, a.xy * x.x + a.yy * x.y + a.yz * x.z,
                a.zx * x.x + a.yz * x.y + a.zz * x.z);
}

// n . a n
static inline double sym3_along(Sym3 a, Vec3 n)
{
    return a.xx * n.x * n.x + a.yy * n.y * n.y + a.zz * n.z * n.z +
           2.0 * (a.xy * n.x * n.y + a.zx * n.x * n.z + a.yz * n.y * n.z);
}

// Returns the adjugate, which is the inverse times the determinant.
static inline Sym3 sym3_adjugate(Sym3 a, double *determinant)
{
    const Sym3 of = {a.yy * a.zz - a.yz * a.yz, a.xx * a.zz - a.zx * a.zx,
                     a.xx * a.yy - a.xy * a.xy, a.xy * a.zx - a.xx * a.yz,
                     a.xy * a.yz - a.zx * a.yy, a.zx * a.yz - a.xy * a.zz};
    *determinant = a.xx * of.xx + a.xy * of.xy + a.zx * of.zx;
    return of;
}

// Solves (a + shift 1) y = x for a positive matrix.
static inline Vec3 sym3_solve(Sym3 a, double shift, Vec3 x)
{
    double determinant;
    a.xx += shift, a.yy += shift, a.zz += shift;
    const Sym3 adjugate = sym3_adjugate(a, &determinant);
    return vec3_scale(1.0 / determinant, sym3_times(adjugate, x));
}

// Copies all nine entries, for a message or for a form of any nine numbers.
static inline void sym3_full(Sym3 a, double m[9])
{
    m[0] = a.xx, m[4] = a.yy, m[8] = a.zz;
    m[5] = m[7] = a.yz, m[2] = m[6] = a.zx, m[1] = m[3] = a.xy;
}

#endif
