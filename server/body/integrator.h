// SPDX-License-Identifier: MIT
// Time integration schemes as lists of evaluations. A body evaluates its forces once for each and
// advances its own rows in the same pass; this file provides the coefficients.
#ifndef PLIANT_BODY_INTEGRATOR_H
#define PLIANT_BODY_INTEGRATOR_H

#include <stdbool.h>

typedef enum IntegratorKind {
    INTEGRATOR_RK4,      // classic Runge-Kutta, 4 evaluations, order 4 (Choi et al. 2005)
    INTEGRATOR_LEAPFROG, // drift-kick-drift, 1 evaluation, order 2; damping, from the velocity
                         // before the kick, is correct to order 1
    INTEGRATOR_SYMPLECTIC_EULER, // kick-drift, 1 evaluation, order 1
    INTEGRATOR_EXPLICIT,         // number of explicit schemes
    // Theta method, one linear system per step; stable for any stiffness of the body itself.
    // Surface bodies only (surface/implicit.h).
    INTEGRATOR_IMPLICIT = INTEGRATOR_EXPLICIT,
    INTEGRATOR_COUNT,
} IntegratorKind;

// Returns "rk4", "leapfrog", "symplectic_euler" or "implicit".
const char *integrator_name(IntegratorKind kind);
// True for explicit schemes of kicks: one evaluation a step, no numerical damping. Solids and plane
// bodies know no others.
bool integrator_is_symplectic(IntegratorKind kind);

// Use of the accelerations a(x, v) of one evaluation. k = (v, a) is the derivative of the row y =
// (x, v); y0 is the row at the start of the substep, ys the evaluated row.
typedef enum EvaluationRule {
    EVALUATION_RK4_FIRST,  // sum = y0 + weight h k;   next = y0 + advance h k
    EVALUATION_RK4_MIDDLE, // sum += weight h k;       next = y0 + advance h k
    EVALUATION_RK4_LAST,   // next = sum + weight h k
    EVALUATION_KICK,       // v += h a;                x += advance h v (the new v)
    EVALUATION_IMPLICIT,   // a is partly that of the end of a step; the body has the details
} EvaluationRule;

typedef struct Evaluation {
    EvaluationRule rule;
    double at;      // time of the evaluation, as a fraction of the substep
    double weight;  // share of this evaluation in the substep's impulse
    double advance; // see EvaluationRule
    bool last;      // of the tick: set by the pipeline, the result is the tick's
} Evaluation;

typedef struct Integrator {
    const char *name; // in scenes
    int order;        // p: halving the step divides the error by 2^p
    int evaluation_count;
    Evaluation evaluation[4];
    // Schemes of kicks only. Leapfrog: positions move by half a substep before the tick's first
    // kick, by whole drifts between kicks, and by half a drift after the last. Implicit: before the
    // first kick the body sets the positions at which external forces are evaluated.
    bool kicks;
    double first_drift; // before the first kick, in substeps
    double last_drift;  // after the last kick, instead of Evaluation.advance
    // Energy that the guard allows, as a ratio to what the body had and was given. Leapfrog near
    // the bound of its step lets the energy oscillate by 5.3, symplectic Euler by 19
    // (tests/stability/trial.c); twice that, since the account follows the energy to its minimum.
    double most_growth;
} Integrator;

const Integrator *integrator_get(IntegratorKind kind);
// Returns evaluation s of a substep; `last`: of the last substep of a tick.
Evaluation integrator_evaluation(const Integrator *integrator, int s, bool last);

// Largest stable time steps of the explicit schemes for a linear system with
// M^-1 K bounded by lambda and M^-1 C bounded by c (server/sim/README.md, "Time step").

// Returns the step [s] for lambda [1/s2] >= 0, c [1/s] >= 0; infinity if both are zero. RK4: 2.6
// min(1/sqrt(lambda), 1/c); the smallest radius of its region over the left half plane is 2.616.
// Leapfrog and symplectic Euler: (sqrt(c^2 + 4 lambda) - c)/lambda, exact for explicit damping.
// Both times the safety factor 0.9.
double stability_time_step(IntegratorKind kind, double lambda, double c);

// Returns the substeps of a tick [s] for steps of at most `time_step` [s]: rounded up, with a
// tolerance of 1e-9.
int stability_substeps(double tick, double time_step);

#endif
