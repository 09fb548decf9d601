// SPDX-License-Identifier: MIT
// Private to the module sim: the error of bodies and of the forces on tools, for who asks.
#ifndef PLIANT_SIM_ERROR_H
#define PLIANT_SIM_ERROR_H

#include "sim/sim_data.h"

// Allocates memory for `body_count` bodies; load time.
ErrorRounds *errors_create(int body_count, double tick, double hz, Arena *arena);
// Goes on with the round under way, or begins one that is due; once per tick, at its end.
void errors_step(Sim *sim);
// Forgets all: the estimates belong to the motion before.
void errors_forget(ErrorRounds *errors, int body_count);

#endif
