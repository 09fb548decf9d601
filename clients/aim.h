// Finds where to press a body that the user has not measured: asks the daemon for the mesh and
// takes the node that lies first along the direction of the press, of a flat side the one in its
// middle. One thread; waits, outside handlers.
#ifndef PLIANT_CLIENTS_AIM_H
#define PLIANT_CLIENTS_AIM_H

#include "client.h"

typedef struct Aim {
    char body[CLIENT_CHANNEL_MAX]; // in: its name, "": the first that answers; out: which it was
    double node[3];                // out: world [m]
} Aim;

// `direction` is a unit vector. False with a sentence when no daemon, mesh or positions come.
bool aim_find(Client *client, const double direction[3], Aim *aim, ClientError *error);

// That choice: of `count` nodes at [3 count] positions [m], without free slots (id -1). Leaves
// `node` as it is when there are none.
void aim_choose(int count, const float *position, const int32_t *id, const double direction[3],
                double node[3]);

#endif
