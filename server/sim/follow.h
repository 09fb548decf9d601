// SPDX-License-Identifier: MIT
// Private to the module sim: the one way in which the topology of a body changes.
#ifndef PLIANT_SIM_FOLLOW_H
#define PLIANT_SIM_FOLLOW_H

#include "sim/sim_data.h"

// Changes a body's topology and describes the change; returns false if nothing has changed.
typedef bool BodyChange(Sim *sim, int body, void *context, TopologyChange *change);
// Makes one change, and more while the body requires them (TopologyChange.again). The topology
// number increases, and contacts, attachments, joints, loads and the time step are updated.
void change_body(Sim *sim, int body, BodyChange *make, void *context);
// Lets a solid divide and merge elements (TopologyChange.inside), which nothing outside of it
// refers to: costs nothing but the energy that the guard allows for it.
void change_inside(Sim *sim, int body, BodyChange *make, void *context);

#endif
