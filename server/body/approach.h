// SPDX-License-Identifier: MIT
// Where a tool will be soon, for bodies that are finer there (BodyOps.approach). Plain data.
#ifndef PLIANT_BODY_APPROACH_H
#define PLIANT_BODY_APPROACH_H

#include "base/vec.h"

// The way of a tool's tip, or of one of its capsules, until APPROACH_TIME from now.
#define APPROACH_TIME 0.05 // [s]

typedef struct Approach {
    Vec3 from, to; // [m] in the world
    double radius; // [m]
    double speed;  // of the tool [m/s]
} Approach;

enum { APPROACH_MOST = 32 }; // of one body

#endif
