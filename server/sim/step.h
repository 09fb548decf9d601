// SPDX-License-Identifier: MIT
// Private to the module sim: what else than a tick calls the steps of the bodies.
#ifndef PLIANT_SIM_STEP_H
#define PLIANT_SIM_STEP_H

#include "sim/sim_data.h"

// Advances a body by the time of one substep in `substeps` steps, without external forces and
// without the bodies that joints connect it to; for the error estimate, which takes it back.
void advance_alone(Sim *sim, int body, int substeps);
// Lists the stages that the scene needs. Load time, when all else is complete.
void pipeline_create(Sim *sim);

#endif
