#include "dynamics/stability.h"

#include <limits.h>
#include <math.h>

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
