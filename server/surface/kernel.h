// The spring kernel's seam: what one evaluation of all forces reads and writes. The kernel is one
// source (kernel/spring_kernel.c) compiled once for each precision and instruction-set level;
// additions keep one order at every width and nothing is contracted, so that every level of a
// precision gives the same bits.
//
// Double precision holds positions as they are. Single precision holds displacements u = x - X, so
// that rounding is relative to the deformation and not to the place: a spring's extension is
// ((2 e + du) . du + |e|^2 - r^2) / (l + r) with its rest vector e (performance.md). X may move
// along with the body as a whole (BaseFrame in rows.h): the kernel works in those coordinates.
#ifndef PLIANT_SURFACE_KERNEL_H
#define PLIANT_SURFACE_KERNEL_H

#include "base/precision.h"
#include "dynamics/integrator.h"
#include "dynamics/rows.h"

#include <stdbool.h>

enum { LANES = 16 }; // nodes in a chunk

// Real below is float or double, by the kernel's precision.

// The springs of all chunks. Entries of chunk c: start[c] .. start[c + 1), LANES springs each.
typedef struct SpringTable {
    int chunk_count;
    int *start;        // [chunk_count + 1]
    int *end;          // [chunk_count] scattered only: a chunk's entries end here
    int *own;          // scattered only: [chunk][LANES] slot of the rows of a lane
    int *neighbour;    // [entry][LANES] slot of the other end; padding names its own node
    void *rest_length; // Real [entry][LANES] r [m]
    void *stiffness;   // Real [entry][LANES] k_s [N/m]; 0 for padding
    void *rest_vector; // single: Real [entry][3][LANES] e = X_own - X_other [m]
    void *preload;     // single with prestress: Real [entry][LANES] |e|^2 - r^2 [m2]
} SpringTable;

// What a chunk knows of its own nodes, by slot unless said.
typedef struct NodeTable {
    void *inverse_mass; // Real [1/kg]; 0: fixed
    void *rest;         // Real [chunk][3][LANES] [m]; double: rest position of the virtual node;
                        // single: its arm from the frame's rest centre (scattered: its place),
                        // SHAPE_FRAME_BODY only
    void *shape_rate;   // Real k'_s / m [1/s2]; 0: fixed
    void *shape_drag;   // Real k'_d / m [1/s], against the frame's velocity; 0: fixed
    void *drag;         // Real gamma / m (and k'_d / m in the world frame) [1/s]; 0: fixed
} NodeTable;

// One pass over chunks first_chunk to last_chunk - 1.
typedef struct SpringPass {
    int first_chunk, last_chunk;
    const SpringTable *springs;
    const NodeTable *nodes;
    const void *present;    // Real rows evaluated
    const void *base;       // Real rows at the start of the substep (STAGE_RK4_MIDDLE)
    void *sum;              // Real [chunk][6][LANES] (RK4)
    void *next;             // Real rows written; never `present`
    const void *external;   // Real [chunk][3][LANES] forces from outside [N]
    const FramePose *frame; // SHAPE_FRAME_BODY: the motion that the virtual nodes follow
    Stage stage;
    double h;            // substep [s]
    double damping_time; // k_d / k_s, scaled [s]
    double stiffness_scale;
    double gravity[3];
    double position_limit; // a row longer than that counts as bad [m]
    const int *chunk;      // scattered only: the chunks to go over; first and last count in it
    // scattered only: rows of forces that come by way of other nodes, Real x y z 0 and four unused
    // [N]; sums write them
    void *handed;
    const unsigned char *carries; // [chunk] whether any of its nodes gets such a force
    bool *bad; // set, never cleared, when a row that ends a substep is not finite or out of bounds
} SpringPass;

typedef void SpringKernel(const SpringPass *pass);

// How virtual nodes move; decides the kernel variant.
typedef enum ShapeVariant {
    SHAPE_FRAME_NONE,
    SHAPE_FRAME_WORLD,
    SHAPE_FRAME_BODY,
    SHAPE_VARIANTS
} ShapeVariant;

// Positions (and nothing else) moved by dt with the present velocities: `next` from `present`.
typedef void DriftKernel(const void *present, void *next, int slot_count, double dt);

// The variants of one precision at one instruction-set level.
typedef struct SpringKernels {
    const char *level; // "x86-64-v4" ...
    Precision precision;
    SpringKernel *evaluate[2][SHAPE_VARIANTS][2][2]; // [damped][shape][external][prestressed]
    // For bodies whose nodes come and go: over a list of chunks whose nodes may have their rows
    // anywhere; the sums store forces and move nothing.
    SpringKernel *scattered[2][SHAPE_VARIANTS][2][2]; // as `evaluate`
    SpringKernel *sum[2][2];                          // [damped][prestressed]
    DriftKernel *drift;
} SpringKernels;

// The levels that this machine can run, best first, NULL at the end.
const SpringKernels *const *kernels_available(Precision precision);
// By name, or the best for "auto"; NULL when unknown or not runnable here.
const SpringKernels *kernels_find(Precision precision, const char *level);

#endif
