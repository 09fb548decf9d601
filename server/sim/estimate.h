// SPDX-License-Identifier: MIT
// Private to the module sim: the error of a step, estimated while the scene runs.
#ifndef PLIANT_SIM_ESTIMATE_H
#define PLIANT_SIM_ESTIMATE_H

#include "sim/sim_data.h"

// Allocates memory for the state that a try changes; load time, after the state of all bodies is
// listed.
Estimator *estimate_create(const Body *body, int count, const StateList *state, Arena *arena);
// Tries a body, between two ticks. Costs three substeps, with RK4 of 4 evaluations each.
void estimate_try(Sim *sim, int index);
// Returns the largest error of a tick [m] (of all its substeps) in the tries since the last call;
// 0: none, or the body cannot be tried.
double estimate_take(Estimator *estimator, int index);

#endif
