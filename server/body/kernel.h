// SPDX-License-Identifier: MIT
// Interface of the kernels that move vertices: explicit steps of rows of displacements
// (body/rows.h). The kernel is one source (kernel/vertex_kernel.c), compiled for each precision
// and instruction-set level; all levels of a precision are bit-identical.
#ifndef PLIANT_BODY_KERNEL_H
#define PLIANT_BODY_KERNEL_H

#include "base/isa.h"
#include "body/rows.h"

#include <stdbool.h>

// Real is float or double below, depending on the kernel's precision.

// Advances all vertices after their forces are complete: v += h (f / m + g) - loss v, u += advance
// h v, forces to zero. Vertices with inverse mass 0 do not move. `next` may be `present`. Returns
// true if every |u| is within position_limit and every |v| within the speed limit; without `check`
// it may return true unchecked.
typedef struct AdvancePass {
    const void *present;      // Real [vertex][ROW]
    void *next;               // Real [vertex][ROW]
    void *force;              // Real [vertex][4]
    void *more;               // NULL, or forces that are added to these, likewise
    const void *inverse_mass; // Real [vertex] [1/kg]
    int vertex_count;         // the spare one included
    double h, advance;
    double gravity[3]; // in the base frame [m/s2]
    double position_limit;
    double loss; // fraction of the velocity that drag takes; 0: no drag
    bool check;
} AdvancePass;

typedef bool AdvanceKernel(const AdvancePass *pass);
// Moves all vertices by their velocities: u += dt v. `next` may be `present`.
typedef void DriftKernel(const void *present, void *next, int vertex_count, double dt);

// Of vertices at x = rest + u, sums about the origin of their coordinates; the fourth numbers are
// unused.
typedef struct RigidSums {
    double mass;                  // [kg]
    double first[4], momentum[4]; // sum m x, sum m v
    double square[4], product[4]; // sum m x x^T as xx yy zz, yz zx xy
    double spin[4];               // sum m x X v
} RigidSums;

// Takes a share of what differs from a rigid motion: v -= loss (v - velocity - turn X x).
typedef struct SlowPass {
    void *row;                         // Real [vertex][ROW]
    const double (*rest)[3];           // [vertex + 1]: the last is read, not used
    const double *mass;                // [vertex] for the sums [kg]
    double loss, velocity[4], turn[4]; // the fourth numbers are 0
} SlowPass;

// Of vertices `first` to `end` - 1.
typedef void SumKernel(const SlowPass *pass, int first, int end, RigidSums *sums);
typedef void SlowKernel(const SlowPass *pass, int first, int end);

typedef struct VertexKernels {
    const char *level;
    Precision precision;
    AdvanceKernel *advance;
    DriftKernel *drift;
    SumKernel *sum;
    SlowKernel *slow;
} VertexKernels;

// Finds the kernels of a level; NULL if it was not compiled in or does not run on this machine.
const VertexKernels *vertex_kernels_find(Precision precision, const char *level);

#endif
