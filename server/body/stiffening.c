// SPDX-License-Identifier: MIT
#include "body/stiffening.h"

#include <math.h>

// Newton's method from above: (1 + 2 q) exp(q) is convex, and 3 is above the root for any cap up to
// 7 exp(3) = 140.
StiffeningCurve stiffening_curve(double cap)
{
    enum { STEPS = 20 }; // from 3 to 0 takes 8
    double q = cap > 1.0 ? 3.0 : 0.0;
    for (int i = 0; i < STEPS && q > 0.0; i++)
        q = fmax(q - ((1.0 + 2.0 * q) - cap * exp(-q)) / (3.0 + 2.0 * q), 0.0);
    return (StiffeningCurve){.cap = cap, .knee = q, .at_knee = exp(q)};
}

double stiffening_factor(const StiffeningCurve *curve, double q)
{
    if (q <= curve->knee)
        return exp(q);
    return curve->cap - (curve->cap - curve->at_knee) * sqrt(curve->knee / q);
}

double stiffening_tangent(const StiffeningCurve *curve, double q)
{
    return q <= curve->knee ? (1.0 + 2.0 * q) * exp(q) : curve->cap;
}

double stiffening_damping(const StiffeningCurve *curve, double q)
{
    if (q <= curve->knee)
        return exp(0.5 * q);
    return sqrt(curve->cap) - (sqrt(curve->cap) - sqrt(curve->at_knee)) * sqrt(curve->knee / q);
}

double stiffening_energy(const StiffeningCurve *curve, double q)
{
    const double knee = curve->knee;
    if (q <= knee)
        return expm1(q);
    // sqrt(q_c) (sqrt(q) - sqrt(q_c)), without cancellation.
    const double root = sqrt(knee) * (q - knee) / (sqrt(q) + sqrt(knee));
    return expm1(knee) + curve->cap * (q - knee) - 2.0 * (curve->cap - curve->at_knee) * root;
}
