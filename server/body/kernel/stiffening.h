// SPDX-License-Identifier: MIT
// Private to the kernels of springs and elements: the factor of their forces that stiffen
// (body/stiffening.h), branch-free and with the same bits at every width.
#ifndef PLIANT_BODY_KERNEL_STIFFENING_H
#define PLIANT_BODY_KERNEL_STIFFENING_H

#include "base/vector.h"

#include "body/stiffening.h"

typedef struct StiffeningFactors {
    Real knee, drop;   // q_c, cap - exp(q_c)
    Real damping_drop; // sqrt(cap) - exp(q_c / 2)
} StiffeningFactors;

INLINE StiffeningFactors stiffening_factors(const StiffeningCurve *curve)
{
    return (StiffeningFactors){(Real)curve->knee, (Real)(curve->cap - curve->at_knee),
                               (Real)(sqrt(curve->cap) - sqrt(curve->at_knee))};
}

// How often the exponential of a part of q is squared, and the root of that part.
enum { STIFFENING_SQUARES = KERNEL_SINGLE ? 3 : 4 };
#define STIFFENING_ROOT (KERNEL_SINGLE ? 0.35355339059327376 : 0.25)

// Returns exp(q / 2) from part = q / 2^STIFFENING_SQUARES, 0 <= q <= 3; its square is exp(q) within
// 2e-15 (single: 5e-7), and exactly 1 at 0. A polynomial with the least largest error for the part,
// squared all but once.
INLINE Vector stiffening_half_exp(Vector part)
{
#if KERNEL_SINGLE
    static const double TERM[] = {1.0000000230280277, 0.49999693283086571, 0.16673173773526934,
                                  0.041186732869267516, 0.0097562981810516251};
#else
    static const double TERM[] = {0.99999999999999989,   0.50000000000009459,
                                  0.16666666665608612,   0.041666667117452975,
                                  0.0083333239110482907, 0.0013889956668529729,
                                  0.0001977443860978738, 2.6963386205129481e-05};
#endif
    // Short chains: sums of pairs (Estrin).
    const Vector square = part * part;
    Vector y = REAL(TERM[0]) + REAL(TERM[1]) * part;
#if KERNEL_SINGLE
    y += square * ((REAL(TERM[2]) + REAL(TERM[3]) * part) + REAL(TERM[4]) * square);
#else
    y += square * (REAL(TERM[2]) + REAL(TERM[3]) * part);
    y += (square * square) *
         ((REAL(TERM[4]) + REAL(TERM[5]) * part) + square * (REAL(TERM[6]) + REAL(TERM[7]) * part));
#endif
    y = REAL(1.0) + part * y;
    for (int i = 1; i < STIFFENING_SQUARES; i++)
        y *= y;
    return y;
}

// Returns G'(q), q >= 0, and the factor of the damping; NaN where q is.
INLINE Vector stiffening_factor_of(const StiffeningFactors *by, Vector q, Vector *damping)
{
    const Vector knee = by->knee - (Vector){0};
    const Vector low = vector_select_greater(q, knee, knee, q),
                 high = vector_select_greater(q, knee, q, knee);
    const Vector half = stiffening_half_exp(low * REAL(1.0 / (1 << STIFFENING_SQUARES))),
                 beyond = REAL(1.0) - vector_sqrt(knee / high);
    *damping = half + by->damping_drop * beyond;
    return half * half + by->drop * beyond;
}

#endif
