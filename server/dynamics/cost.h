// Estimates the time of a body's tick before it runs. Load time only.
#ifndef PLIANT_DYNAMICS_COST_H
#define PLIANT_DYNAMICS_COST_H

#include "dynamics/body.h"

// Returns the seconds of a tick of `substeps`, pressed by a probe, on one core of 2 GHz. Calibrated
// with the tables of the front page ("Tuning"), within a third for walls and within a factor of 1.8
// for solids. Not measured on this machine.
double cost_tick(const Body *body, int substeps);

// Returns the least time of an implicit wall with so many springs [s].
double cost_implicit(int springs);

// Budget of the bodies in a tick of 1 ms [s]; the rest is for the machine and messages.
#define COST_BUDGET 6e-4

#endif
