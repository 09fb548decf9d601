// Largest stable time steps of the explicit schemes for a linear system with
// M^-1 K bounded by lambda and M^-1 C bounded by c (README.md, "Time step").
#ifndef PLIANT_DYNAMICS_STABILITY_H
#define PLIANT_DYNAMICS_STABILITY_H

#include "dynamics/integrator.h"

// Returns the step [s] for lambda [1/s2] >= 0, c [1/s] >= 0; infinity if both are zero. RK4: 2.6
// min(1/sqrt(lambda), 1/c); the smallest radius of its region over the left half plane is 2.616.
// Leapfrog and symplectic Euler: (sqrt(c^2 + 4 lambda) - c)/lambda, exact for explicit damping.
// Both times the safety factor 0.9.
double stability_time_step(IntegratorKind kind, double lambda, double c);

// Returns the substeps of a tick [s] for steps of at most `time_step` [s]: rounded up, with a
// tolerance of 1e-9.
int stability_substeps(double tick, double time_step);

#endif
