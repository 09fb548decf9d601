// SPDX-License-Identifier: MIT
// Where a tool will be soon, for bodies that are finer there (BodyOps.approach). Plain data.
#ifndef PLIANT_BODY_APPROACH_H
#define PLIANT_BODY_APPROACH_H

#include "base/vec.h"

// Something that is on an axis, or moves along it: the way of a tool's tip or of an end of one of
// its capsules until APPROACH_TIME from now, the capsule's axis now and then, or a place where
// something acts on the body.
#define APPROACH_TIME 0.05 // [s]

typedef struct Approach {
    Vec3 from, to; // [m] in the world
    double radius; // [m]
    double speed;  // from one to the other [m/s]; 0: it is on all of the axis at once
    double begin;  // time until it is at `from` [s]
    double reach;  // of a place: distance from the axis within which something acts [m]; of a tool
                   // 0: its radius counts
    Vec3 across;   // unit, of a flat place: what acts is not farther from the axis along that than
    double thick;  // so much [m]; 0: as far as it reaches
} Approach;

// Returns the time until it is at a point of the axis [s], 0: `from`, 1: `to`.
static inline double approach_time(const Approach *approach, double along)
{
    const double way = along * vec3_length(vec3_sub(approach->to, approach->from));
    return approach->begin + (approach->speed > 0.0 ? way / approach->speed : 0.0);
}

enum { APPROACH_MOST = 32 }; // of one body

#endif
