// Estimates the error of one integrator step while the scene runs, by step doubling (Press et al.,
// Numerical Recipes, section 17.2). One step h from the current state and two of h/2 are tried and
// discarded. From the distance between their results, with the order p of the scheme, a step's own
// error is 2^p / (2^p - 1) of the distance. It is evaluated at a sample of the body's outer nodes.
// Forces of tools and attachments are excluded, since trying them would change their memory. The
// estimate is published and never affects the motion: it is no part of the state, and a run with it
// is bit-identical to one without. Step thread.
#ifndef PLIANT_DYNAMICS_ESTIMATE_H
#define PLIANT_DYNAMICS_ESTIMATE_H

#include "dynamics/sim.h"

typedef struct Estimator Estimator;

// Allocates memory for the state that a try changes; load time, after the state of all bodies is
// listed.
Estimator *estimate_create(const Body *body, int count, const StateList *state, Arena *arena);
// Tries a body, between two ticks. Costs three substeps, with RK4 of 4 evaluations each.
void estimate_try(Sim *sim, int index);
// Returns the largest error of a tick [m] (of all its substeps) in the tries since the last call;
// 0: none, or the body cannot be tried.
double estimate_take(Estimator *estimator, int index);

#endif
