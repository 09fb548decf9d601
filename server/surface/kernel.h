// The spring kernel's seam: what one evaluation of all forces reads and writes. The kernel is one
// source (kernel/spring_kernel.c) compiled once for each instruction-set level; additions keep one
// order at every width and nothing is contracted, so that every level gives the same bits.
#ifndef PLIANT_SURFACE_KERNEL_H
#define PLIANT_SURFACE_KERNEL_H

#include "dynamics/integrator.h"

#include <stdbool.h>

enum {
    LANES = 8, // nodes in a chunk
    ROW = 8,   // doubles in a node's row: x y z 0 vx vy vz 0
};

// The springs of all chunks. Entries of chunk c: start[c] .. start[c + 1), 8 lanes each.
typedef struct SpringTable {
    int chunk_count;
    const int *start; // [chunk_count + 1]
    const int
        *neighbour;      // [entry][LANES] slot of the other end; a padding entry names its own node
    double *rest_length; // [entry][LANES] r [m]
    double *stiffness;   // [entry][LANES] k_s [N/m]; 0 for padding
} SpringTable;

// What a chunk knows of its own nodes, by slot unless said.
typedef struct NodeTable {
    double *inverse_mass; // [1/kg]; 0: fixed
    double *rest;         // [chunk][3][LANES] rest position, of the virtual node [m]
    double *shape_rate;   // k'_s / m [1/s2]; 0: fixed
    double *shape_drag;   // k'_d / m [1/s], against the frame's velocity; 0: fixed
    double *drag;         // gamma / m (and k'_d / m in the world frame) [1/s]; 0: fixed
} NodeTable;

// Parameters that may change between ticks; plain data, part of the state.
typedef struct SurfaceParameters {
    double gravity[3]; // [m/s2]
    double stiffness_scale, damping_scale;
} SurfaceParameters;

// The rigid motion that the virtual nodes follow: x = center + rotation (X - rest_center).
typedef struct FramePose {
    double rest_center[3]; // [m]
    double center[3];      // [m]
    double rotation[3][3];
    double velocity[3]; // of the center [m/s]
    double angular[3];  // [rad/s]
} FramePose;

// A |component| of a velocity beyond this is a bad number: far above any physics, far below
// overflow of its square [m/s].
#define SPEED_LIMIT 1e100

// One pass over all chunks.
typedef struct SpringPass {
    const SpringTable *springs;
    const NodeTable *nodes;
    const double *present;  // rows evaluated
    const double *base;     // rows at the start of the substep (RK4)
    double *sum;            // [chunk][6][LANES] (RK4)
    double *next;           // rows written; never `present`
    const double *external; // [chunk][3][LANES] forces from outside [N]
    const FramePose *frame; // SHAPE_FRAME_BODY
    Stage stage;
    double h;            // substep [s]
    double damping_time; // k_d / k_s, scaled [s]
    double stiffness_scale;
    double gravity[3];
    double position_limit; // a |component| beyond it counts as bad [m]
    bool *bad;             // set, never cleared, when a written row is not finite or out of bounds
} SpringPass;

typedef void SpringKernel(const SpringPass *pass);

// How virtual nodes move; decides the kernel variant.
typedef enum ShapeVariant {
    SHAPE_FRAME_NONE,
    SHAPE_FRAME_WORLD,
    SHAPE_FRAME_BODY,
    SHAPE_VARIANTS
} ShapeVariant;

// The variants of one instruction-set level.
typedef struct SpringKernels {
    const char *level;                            // "x86-64-v4" ...
    SpringKernel *evaluate[2][SHAPE_VARIANTS][2]; // [damped][shape][external]
} SpringKernels;

// The levels that this machine can run, best first, NULL at the end.
const SpringKernels *const *kernels_available(void);
// By name, or the best for "auto"; NULL when unknown or not runnable here.
const SpringKernels *kernels_find(const char *level);

#endif
