// How far one step of the integrator is from the truth, while the scene runs: by step doubling
// (Press et al., Numerical Recipes, section 17.2). One step h from the present state and two of h/2
// are tried and forgotten; where they end apart, with the order p of the scheme, a step's own error
// is 2^p / (2^p - 1) of the distance. It is read at a sample of the body's outer nodes.
//
// Forces of tools and of what is held stay out of it, since trying them would change what they
// remember. What it gives is told to clients and never enters the motion: it is no part of the
// state, and a run with it gives the same bits as one without. Step thread.
#ifndef PLIANT_DYNAMICS_ESTIMATE_H
#define PLIANT_DYNAMICS_ESTIMATE_H

#include "dynamics/body.h"

typedef struct Estimator Estimator;

// Load time, after the state of all bodies is listed: room to keep what a try changes of them.
Estimator *estimate_create(const Body *body, int count, const StateList *state, Arena *arena);
// Between two ticks: tries body `index` (as in estimate_create). Costs three substeps, with RK4
// too: 4 evaluations each.
void estimate_try(Estimator *estimator, Body *body, int index);
// The largest error of a tick [m] (of its substeps together) in the tries since the last call; 0:
// none was made, or the body cannot be tried.
double estimate_take(Estimator *estimator, int index);

#endif
