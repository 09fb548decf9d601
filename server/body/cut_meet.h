// SPDX-License-Identifier: MIT
// Where in a sub-tick the edge of a blade met a link, both moving: approximately, for what is drawn
// of a cut. What is cut follows from cut_exact.h alone. Pure functions.
#ifndef PLIANT_BODY_CUT_MEET_H
#define PLIANT_BODY_CUT_MEET_H

#include "body/cut_exact.h"

typedef struct CutMeeting {
    double along; // of the link, from its first end: 0 to 1, or a little beyond
    Vec3 normal;  // unit, of what the edge swept relative to the link; world frame
} CutMeeting;

// Finds where an edge met a link that cut_count says it met.
CutMeeting cut_meet(const CutPath edge[2], const CutPath link[2]);

#endif
