// Best fit of the rest shape to the present shape, weighted by the shape-preserving springs
// (surface.md section 4): the rigid motion that the virtual nodes follow with frame = "body".
#ifndef PLIANT_SURFACE_RIGID_FRAME_H
#define PLIANT_SURFACE_RIGID_FRAME_H

#include "base/arena.h"
#include "base/state.h"
#include "surface/kernel.h"

typedef struct RigidFrame {
    int slot_count;
    const double *weight; // [slot_count] k'_s [N/m]; 0 for padding
    double total_weight;
    double *arm;      // [slot_count][3] weight * (X - C) [N]
    double *rotation; // quaternion w x y z; part of the state (start of the next fit)
    FramePose pose;   // valid after rigid_frame_fit
} RigidFrame;

// `rest` is [chunk][3][LANES]; weights are kept by reference and must sum to more than 0.
RigidFrame *rigid_frame_create(const char *name, int slot_count, const double *rest,
                               const double *weight, Arena *arena, StateList *state);
// Fits position, rotation and velocities to rows [slot_count][ROW].
void rigid_frame_fit(RigidFrame *frame, const double *rows);
// Energy of the shape-preserving springs in these rows [J]; changes nothing.
double rigid_frame_energy(const RigidFrame *frame, const double *rows);

#endif
