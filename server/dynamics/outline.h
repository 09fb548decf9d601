// Dimensions of a body's surface: its box, and the number of fixed nodes. Load time only.
#ifndef PLIANT_DYNAMICS_OUTLINE_H
#define PLIANT_DYNAMICS_OUTLINE_H

#include "dynamics/body.h"
#include "geometry/box.h"

typedef struct BodyOutline {
    int nodes, fixed; // of the surface that tools act on
    Box box;          // [m]
} BodyOutline;

BodyOutline body_outline(const Body *body);

#endif
