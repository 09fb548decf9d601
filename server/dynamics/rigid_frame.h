// Best fit of the rest shape to the present shape, weighted by masses or by shape-preserving
// springs: the rigid motion that base frames follow, and the virtual nodes of surface bodies with
// frame = "body" (server/surface/README.md, "Virtual nodes on a rigid frame").
#ifndef PLIANT_DYNAMICS_RIGID_FRAME_H
#define PLIANT_DYNAMICS_RIGID_FRAME_H

#include "base/isa.h"
#include "base/memory.h"

#include <stdbool.h>

// A rigid motion: x = center + rotation (X - rest_center).
typedef struct FramePose {
    double rest_center[3]; // [m]
    double center[3];      // [m]
    double rotation[3][3];
    double velocity[3]; // of the center [m/s]
    double angular[3];  // [rad/s]
} FramePose;

typedef struct RigidFrame {
    int (*run)[2]; // [run_count] first slot and end of the slots that count; of a body without
    int run_count; // levels one run, all
    int whole[1][2];
    Precision precision;     // of the rows
    bool displaced;          // rows hold displacements from `rest`, else positions
    const double (*rest)[3]; // [slot_count] rest positions [m]
    const double *weight;    // [slot_count] any unit, k'_s [N/m] for the energy; 0 for padding
    double total_weight;
    double *rotation; // quaternion w x y z; part of the state (start of the next fit)
    FramePose pose;   // valid after rigid_frame_fit
} RigidFrame;

// Keeps positions and weights by reference; weights must sum to more than 0 (those of a body with
// levels may be set later: rigid_frame_weigh).
RigidFrame *rigid_frame_create(const char *name, Precision precision, bool displaced,
                               int slot_count, const double (*rest)[3], const double *weight,
                               Arena *arena, StateList *state);
// Recomputes the rest centre after rest positions, weights or runs have changed.
void rigid_frame_weigh(RigidFrame *frame);
// Fits position, rotation and velocities to rows (rows.h) [slot_count][ROW].
void rigid_frame_fit(RigidFrame *frame, const void *rows);

// Returns the energy of the shape-preserving springs in these rows [J]; changes nothing.
double rigid_frame_energy(const RigidFrame *frame, const void *rows);

#endif
