// SPDX-License-Identifier: MIT
#include "body/integrator.h"

#include <limits.h>
#include <math.h>

static const Integrator integrators[INTEGRATOR_COUNT] = {
    [INTEGRATOR_RK4] = {.name = "rk4",
                        .order = 4,
                        .evaluation_count = 4,
                        .evaluation = {{EVALUATION_RK4_FIRST, 0.0, 1.0 / 6.0, 0.5, false},
                                       {EVALUATION_RK4_MIDDLE, 0.5, 1.0 / 3.0, 0.5, false},
                                       {EVALUATION_RK4_MIDDLE, 0.5, 1.0 / 3.0, 1.0, false},
                                       {EVALUATION_RK4_LAST, 1.0, 1.0 / 6.0, 0.0, false}},
                        .most_growth = 10.0},
    [INTEGRATOR_LEAPFROG] = {.name = "leapfrog",
                             .order = 2,
                             .evaluation_count = 1,
                             .evaluation = {{EVALUATION_KICK, 0.5, 1.0, 1.0, false}},
                             .kicks = true,
                             .first_drift = 0.5,
                             .last_drift = 0.5,
                             .most_growth = 10.0},
    [INTEGRATOR_SYMPLECTIC_EULER] = {.name = "symplectic_euler",
                                     .order = 1,
                                     .evaluation_count = 1,
                                     .evaluation = {{EVALUATION_KICK, 0.0, 1.0, 1.0, false}},
                                     .kicks = true,
                                     .first_drift = 0.0,
                                     .last_drift = 1.0,
                                     .most_growth = 40.0},
    [INTEGRATOR_IMPLICIT] = {.name = "implicit",
                             .order = 1,
                             .evaluation_count = 1,
                             .evaluation = {{EVALUATION_IMPLICIT, 0.5, 1.0, 1.0, false}},
                             .kicks = true,
                             .first_drift = 1.0,
                             .last_drift = 1.0,
                             .most_growth = 10.0},
};

const char *integrator_name(IntegratorKind kind)
{
    return integrators[kind].name;
}

bool integrator_is_symplectic(IntegratorKind kind)
{
    return kind < INTEGRATOR_EXPLICIT && integrators[kind].kicks;
}

const Integrator *integrator_get(IntegratorKind kind)
{
    return &integrators[kind];
}

Evaluation integrator_evaluation(const Integrator *integrator, int s, bool last)
{
    Evaluation evaluation = integrator->evaluation[s];
    evaluation.last = last;
    if (integrator->kicks && last)
        evaluation.advance = integrator->last_drift;
    return evaluation;
}

double stability_time_step(IntegratorKind kind, double lambda, double c)
{
    const double safety = 0.9;
    if (kind == INTEGRATOR_RK4) {
        double stiff = lambda > 0.0 ? 1.0 / sqrt(lambda) : (double)INFINITY;
        double damped = c > 0.0 ? 1.0 / c : (double)INFINITY;
        return safety * 2.6 * fmin(stiff, damped);
    }
    // (sqrt(c^2 + 4 lambda) - c)/lambda, written without cancellation for large c.
    double root = sqrt(c * c + 4.0 * lambda);
    return root + c > 0.0 ? safety * 4.0 / (root + c) : (double)INFINITY;
}

int stability_substeps(double tick, double time_step)
{
    double n = ceil(tick / time_step * (1.0 - 1e-9));
    if (!(n >= 1.0))
        return 1;
    return n > INT_MAX / 2 ? INT_MAX / 2 : (int)n;
}
