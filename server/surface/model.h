// Private to the surface room: the arrays of one surface body. Constant after creation unless said.
//
// Layout (performance.md): nodes live in slots, breadth first and then sorted by valence within
// windows, so that 8 consecutive slots (a chunk) have neighbours close in memory and equally many.
// Each node has a 64-byte row (x y z 0 vx vy vz 0) that neighbours read whole; every spring is
// stored at both ends, so that a chunk's forces are sums in registers, with no scatter. Springs of
// a chunk lie slot-major: entry e holds the e-th neighbour of its 8 nodes; short nodes are padded
// with themselves and stiffness 0.
#ifndef PLIANT_SURFACE_MODEL_H
#define PLIANT_SURFACE_MODEL_H

#include "surface/surface.h"
#include "surface/kernel.h"
#include "surface/rigid_frame.h"

// A slot of `external` to which contact forces were added for one evaluation.
typedef struct TouchedSlot {
    int slot;
    double load[3]; // the constant load to put back [N]
} TouchedSlot;

typedef struct SurfaceModel {
    int node_count, edge_count, face_count;
    int slot_count; // node_count rounded up to whole chunks
    int *slot;      // [node_count] of a node
    int *node;      // [slot_count] of a slot; -1 for padding

    // --- springs; by entry and lane ---
    SpringTable springs;
    double damping_time; // beta: k_d = beta k [s], as loaded
    bool damped;

    // --- nodes; by slot ---
    NodeTable nodes;
    double *mass; // [node_count] of every node, fixed ones too [kg]
    ShapeVariant shape;

    // --- rows; `current` says which of the two is the present state ---
    double *rows[2]; // [slot_count][ROW]
    int current;
    double *stage[2];      // rows between stages
    double *sum;           // RK4 only: [slot_count / LANES][6][LANES]
    const double *base;    // row at the start of the substep
    const double *present; // row to be evaluated next
    int next_stage;        // which of `stage` is free

    // --- forces from outside ---
    double *external;     // [chunk][3][LANES] constant loads [N]; part of the state between ticks
    int64_t *loaded;      // 1 while there are constant loads; part of the state
    TouchedSlot *touched; // [touched_count] what contact has added to, and what was there before
    bool *is_touched;     // [slot_count]
    int touched_count;

    // --- parameters that SET can change; part of the state ---
    SurfaceParameters *parameters;
    RigidFrame *rigid; // frame = "body": the best fit of the rest shape, else NULL; its
                       // rotation is part of the state

    double position_limit; // [m] from the origin: beyond it a number is bad
    bool bad;              // the last pass wrote a number out of bounds

    // --- what others see ---
    int (*face)[3];
    int (*face_neighbor)[3];
    double *face_area, *node_area;
    int *node_face_start, *node_face;
    int *id, *piece;
    int (*parent)[2];
    signed char *level;

    const SpringKernels *kernels;
} SurfaceModel;

// The operations of surface.c.
extern const BodyOps surface_ops;

#endif
