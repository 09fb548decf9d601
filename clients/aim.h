// SPDX-License-Identifier: MIT
// Finds where to press a body whose position the user has not measured: takes the node of its
// newest frame that comes first in the direction of the press; of a flat side, the node in its
// middle. One thread.
#ifndef PLIANT_CLIENTS_AIM_H
#define PLIANT_CLIENTS_AIM_H

#include "program.h"

typedef struct Aim {
    char body[64];  // in: its name, "": the first that answers; out: the body that
                    // was found
    double node[3]; // out: world [m]
} Aim;

// `direction` is a unit vector. Returns false with a sentence if no server answers or no frame
// arrives.
bool aim_find(PliantClient *client, const double direction[3], Aim *aim, PliantError *error);

// Chooses the node among `count` nodes at [3 count] positions [m], without free slots (id -1).
// Leaves `node` unchanged if there are none.
void aim_choose(int count, const float *position, const int32_t *id, const double direction[3],
                double node[3]);

#endif
