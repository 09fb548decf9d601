// Best fit of the rest shape to the present shape, weighted by the shape-preserving springs
// (surface.md section 4): the rigid motion that the virtual nodes follow with frame = "body".
#ifndef PLIANT_SURFACE_RIGID_FRAME_H
#define PLIANT_SURFACE_RIGID_FRAME_H

#include "base/arena.h"
#include "base/state.h"
#include "surface/kernel.h"

typedef struct RigidFrame {
    int (*run)[2]; // [run_count] first slot and end of the slots that count; of a body without
    int run_count; // levels one run, all
    int whole[1][2];
    Precision precision;      // of the rows: displacements from `place`, or positions
    const double (*place)[3]; // [slot_count] rest positions [m]
    const double *weight;     // [slot_count] k'_s [N/m]; 0 for padding
    double total_weight;
    double *rotation; // quaternion w x y z; part of the state (start of the next fit)
    FramePose pose;   // valid after rigid_frame_fit
} RigidFrame;

// Places and weights are kept by reference; weights must sum to more than 0 (those of a body with
// levels may come later: rigid_frame_weigh).
RigidFrame *rigid_frame_create(const char *name, Precision precision, int slot_count,
                               const double (*place)[3], const double *weight, Arena *arena,
                               StateList *state);
// After places, weights or runs have changed: the rest centre anew.
void rigid_frame_weigh(RigidFrame *frame);
// Fits position, rotation and velocities to rows of the given precision [slot_count][ROW].
void rigid_frame_fit(RigidFrame *frame, const void *rows);

// Energy of the shape-preserving springs in these rows [J]; changes nothing.
double rigid_frame_energy(const RigidFrame *frame, const void *rows);

#endif
