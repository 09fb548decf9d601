// SPDX-License-Identifier: MIT
// What a body's elements or springs leave out: the error of its discretisation in space, estimated
// while it runs (BodyOps.estimate). The error of the time step is sim/estimate.h's. Plain data.
#ifndef PLIANT_BODY_ERROR_H
#define PLIANT_BODY_ERROR_H

#include "base/vec.h"

enum { ERROR_TOOLS = 32 };

// What is asked for.
typedef struct ErrorQuestion {
    int tool_count;
    const Vec3 *tool;    // [tool_count] where tools touch the body [m]
    const double *size;  // [tool_count] their radius [m]
    const Vec3 *force;   // [tool_count] on them, in the world [N]
    const double *depth; // [tool_count] how far each is in the faces (ToolWrench.depth) [m], or
                         // NULL: unknown
    const Vec3 *axis;    // [tool_count] on the axes of tools, nearest to where they touch [m]
    const double *kappa; // [tool_count] stiffness by area with which faces push it (body/press.h)
                         // [N/m3]; 0, or NULL: it holds what is in its reach
    double barrier;      // Body.contact_barrier
} ErrorQuestion;

// The answer.
typedef struct BodyError {
    double displacement;       // of the outer nodes' displacements, rms [m]
    double relative;           // the same over the rms of these displacements
    double force[ERROR_TOOLS]; // relative error of the force on each tool of the question
} BodyError;

#endif
