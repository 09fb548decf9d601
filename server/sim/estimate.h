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
// Returns the error that the time steps have in the present state [m]: the error of a tick, rms
// over a sample of the outer nodes, times the ticks in which the motion turns or fades. Both are
// means over the tries of the last quarter of a second or so. -1: no try in a second.
double estimate_now(const Estimator *estimator, int index, int64_t step, double tick);
// Forgets all tries: they belong to the motion before.
void estimate_forget(Estimator *estimator, int count);

#endif
