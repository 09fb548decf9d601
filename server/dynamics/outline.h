// Dimensions of a body's surface: its box, and the number of fixed nodes. Load time only.
#ifndef PLIANT_DYNAMICS_OUTLINE_H
#define PLIANT_DYNAMICS_OUTLINE_H

#include "dynamics/body.h"
#include "geometry/box.h"

typedef struct BodyOutline {
    int nodes, fixed; // of the surface that tools act on
    Box box;          // [m]
} BodyOutline;

BodyOutline body_outline(const Body *body);

// Estimates the time of a body's tick before it runs. Load time only.

// Returns the seconds of a tick of `substeps`, pressed by a probe, on one core of 2 GHz. Calibrated
// with the tables of the front page ("Tuning"), within a third for walls and within a factor of 1.8
// for solids. Not measured on this machine.
double cost_tick(const Body *body, int substeps);

// Returns the least time of an implicit wall with so many springs [s].
double cost_implicit(int springs);

// Budget of the bodies in a tick of 1 ms [s]; the rest is for the machine and messages.
#define COST_BUDGET 6e-4

#endif
