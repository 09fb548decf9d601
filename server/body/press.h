// SPDX-License-Identifier: MIT
// How a face of a hollow wall pushes a tool that overlaps it (server/sim/README.md, "Contact of
// faces").
#ifndef PLIANT_BODY_PRESS_H
#define PLIANT_BODY_PRESS_H

#include <math.h>

// Depth in which a face comes to its stiffness, at most [radius; m]; depth from which on contact is
// stiffer [radius].
static const double PRESS_ONSET = 0.15, PRESS_LONGEST_ONSET = 7.5e-4, PRESS_BARRIER_FROM = 0.25;

typedef struct FacePress {
    double depth, slope; // as the force counts it [m], and its derivative by the true depth
    double share;        // of the stiffness, without the barrier
} FacePress;

// Grows slowly at first, and near the axis faster, by what the step has room for.
static inline FacePress face_press(double depth, double radius, double barrier)
{
    const double onset = fmin(PRESS_ONSET * radius, PRESS_LONGEST_ONSET);
    const double part = fmin(1.0, depth / onset), share = part * sqrt(part);
    const double beyond = fmax(0.0, depth - PRESS_BARRIER_FROM * radius);
    return (FacePress){.depth =
                           onset * part * share / 2.5 + fmax(0.0, depth - onset) + barrier * beyond,
                       .slope = share + (beyond > 0.0 ? barrier : 0.0),
                       .share = share};
}

#endif
