// SPDX-License-Identifier: MIT
// Private to the module sim: the error of bodies and of the forces on tools, for who asks.
#ifndef PLIANT_SIM_ERROR_H
#define PLIANT_SIM_ERROR_H

#include "sim/sim_data.h"

// True if a body of the scene is driven by its error (BODY_ADAPT_ERROR).
bool errors_drive(const Sim *sim);
// Load time: makes the rounds of driven bodies, which are part of the state, and those of others,
// if they are asked for.
void errors_create(Sim *sim);
// Goes on with the round under way, or begins one that is due; once per tick, at its end.
void errors_step(Sim *sim, ErrorRounds *errors);
// Forgets all: the estimates belong to the motion before.
void errors_forget(ErrorRounds *errors, int body_count);
// True if the state of the rounds of driven bodies is one that they can have.
bool errors_check(const Sim *sim);

#endif
