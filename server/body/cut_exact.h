// SPDX-License-Identifier: MIT
// Whether a moving link meets the moving edge of a blade: exactly, in space and time. Pure
// functions of integers, so that whatever shares a point agrees about it and nothing can leak
// between neighbouring links, ticks or quadrilaterals (server/sim/README.md, "The exact test"; the
// predicate is the orientation test of Shewchuk 1997, in four dimensions of which one, time, is
// only 0 or 1).
#ifndef PLIANT_BODY_CUT_EXACT_H
#define PLIANT_BODY_CUT_EXACT_H

#include "base/vec.h"

#include <stdbool.h>
#include <stdint.h>

// A place in units of the body's quantum q.
typedef struct CutPoint {
    int64_t x[3];
} CutPoint;

#define CUT_REACH ((int64_t)1 << 39) // differences of coordinates stay below: exact in 128 bits

// A point that moves in a straight line: where it was and where it is.
typedef struct CutPath {
    CutPoint at[2];
} CutPath;

enum { CUT_DEGENERATE = -1 };

// How often a link, between link[0] and link[1], meets an edge while both move: 0 to 4, odd when
// its ends come to lie on two sides of what the edge sweeps; CUT_DEGENERATE when the answer hangs
// on a determinant that is zero: shift the edge and ask again. Each sweeps a quadrilateral in space
// and time, made of two triangles; so the order of the two ends matters: neighbours must agree
// on it (the lower number first).
int cut_count(const CutPath edge[2], const CutPath link[2]);
// False: they certainly do not meet. By boxes, then by the planes of the edge's two triangles.
bool cut_may_meet(const CutPath edge[2], const CutPath link[2]);
// Returns true if the boxes of all places of the edge and of the link share no point.
bool cut_boxes_apart(const CutPath edge[2], const CutPath link[2]);

static inline bool cut_points_equal(CutPoint a, CutPoint b)
{
    return a.x[0] == b.x[0] && a.x[1] == b.x[1] && a.x[2] == b.x[2];
}

#endif
