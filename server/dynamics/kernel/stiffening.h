// Private to the kernels of springs and elements: the factor of their forces that stiffen
// (dynamics/stiffening.h), branch-free and with the same bits at every width.
#ifndef PLIANT_DYNAMICS_KERNEL_STIFFENING_H
#define PLIANT_DYNAMICS_KERNEL_STIFFENING_H

#include "base/vector.h"

#include "dynamics/stiffening.h"

typedef struct StiffeningFactors {
    Real knee, drop;   // q_c, cap - exp(q_c)
    Real damping_drop; // sqrt(cap) - exp(q_c / 2)
} StiffeningFactors;

INLINE StiffeningFactors stiffening_factors(const StiffeningCurve *curve)
{
    return (StiffeningFactors){(Real)curve->knee, (Real)(curve->cap - curve->at_knee),
                               (Real)(sqrt(curve->cap) - sqrt(curve->at_knee))};
}

// Returns exp(q / 2), q in [0, 2.75], as (1 + (exp(q/4) - 1))^2: its square is exp(q) to 9e-16 in
// double, 5e-7 in single precision, and exactly 1 at 0. The polynomial interpolates (exp(t) - 1)/t
// at the Chebyshev points of [0, 11/16]; all of its terms are positive, so that none cancels.
INLINE Vector stiffening_half_exp(Vector q)
{
#if KERNEL_SINGLE
    static const Real C[] = {1.8724233e-3F,  7.9396968e-3F, 4.1810375e-2F,
                             1.66643220e-1F, 5.0000139e-1F, 1.0F};
#else
    static const Real C[] = {
        3.4415116997652774e-08,
        2.594461038205836e-07,
        2.7710065097354855e-06,
        2.479270108923275e-05,
        1.9841600110551185e-04,
        1.388888103134734e-03,
        8.333333449627549e-03,
        4.1666666656641066e-02,
        1.666666666671094e-01,
        4.999999999999924e-01,
        1.0,
    };
#endif
    const Vector t = REAL(0.25) * q;
    Vector sum = C[0] - (Vector){0};
    for (unsigned i = 1; i < sizeof C / sizeof *C; i++)
        sum = sum * t + C[i];
    const Vector root = sum * t + REAL(1.0);
    return root * root;
}

// Returns G'(q), q >= 0, and the factor of the damping; NaN where q is.
INLINE Vector stiffening_factor_of(const StiffeningFactors *by, Vector q, Vector *damping)
{
    const Vector knee = by->knee - (Vector){0};
    const Vector low = vector_select_greater(q, knee, knee, q),
                 high = vector_select_greater(q, knee, q, knee);
    const Vector half = stiffening_half_exp(low), beyond = REAL(1.0) - vector_sqrt(knee / high);
    *damping = half + by->damping_drop * beyond;
    return half * half + by->drop * beyond;
}

#endif
