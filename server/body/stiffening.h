// SPDX-License-Identifier: MIT
// Exponential stiffening (Fung 1967, "Elasticity of soft tissues in simple elongation", and 1993,
// "Biomechanics: Mechanical Properties of Living Tissues", 7.5), of springs and of elements. With W
// the energy of the linear law, c its scale, and q = W / c,
//   energy c G(q),   forces G'(q) times those of the linear law,
//   G' = exp(q)                                     up to the knee q_c,
//        cap - (cap - exp(q_c)) sqrt(q_c / q)       beyond: stress along one axis is then straight,
//   (1 + 2 q_c) exp(q_c) = cap.
// Of a linear law W = x^T H x / 2 the tangent is G' H + G''/c H x x^T H <= (G' + 2 q G'') H
// (Cauchy and Schwarz), where G' + 2 q G'' is (1 + 2 q) exp(q) up to the knee and cap beyond. So
// nothing is ever stiffer than cap times the linear law, which bounds the time step.
// Damping is multiplied by the same curve with the roots of its numbers, exp(q/2) up to the knee
// and below sqrt(cap) beyond: its ratio to what is critical stays about what it is at rest. Pure
// functions.
#ifndef PLIANT_BODY_STIFFENING_H
#define PLIANT_BODY_STIFFENING_H

#include <stdbool.h>

// As in a scene.
typedef struct Stiffening {
    double strain; // s: stress along one axis is E e exp((e / s)^2); 0: none, the law is linear
    double cap;    // largest stiffness over that of the linear law; 1: none
} Stiffening;

static inline bool stiffening_is_on(const Stiffening *stiffening)
{
    return stiffening->strain > 0.0 && stiffening->cap > 1.0;
}

// Returns the bound of the tangent over that of the linear law; 1 without stiffening.
static inline double stiffening_cap(const Stiffening *stiffening)
{
    return stiffening_is_on(stiffening) ? stiffening->cap : 1.0;
}

typedef struct StiffeningCurve {
    double cap;
    double knee;    // q_c, below 3
    double at_knee; // exp(q_c)
} StiffeningCurve;

// `cap` in [1, 100].
StiffeningCurve stiffening_curve(double cap);
// Return G, G' of the secant, and G' + 2 q G'' of the tangent along the deformation. q >= 0.
double stiffening_energy(const StiffeningCurve *curve, double q);
double stiffening_factor(const StiffeningCurve *curve, double q);
double stiffening_tangent(const StiffeningCurve *curve, double q);
// Returns the factor of the damping.
double stiffening_damping(const StiffeningCurve *curve, double q);

#endif
