// SPDX-License-Identifier: MIT
// Drag on a body that nothing fixes: v_i -= loss (v_i - V - Omega x (x_i - c)), with the rigid
// motion V, Omega that has the momentum and angular momentum of all vertices. So both stay: the
// body flies and turns as without, only its deformation is slowed down. Bodies that are fixed need
// none of this: their velocities lose a share in the kick (kernel.h, AdvancePass.loss).
#ifndef PLIANT_BODY_DRAG_H
#define PLIANT_BODY_DRAG_H

#include "base/memory.h"
#include "base/team.h"
#include "body/kernel.h"

typedef struct Drag {
    RigidSums *part; // [part_count] shares of the vertices
    int part_count;
    double time;         // since the last loss [s]
    const int (*run)[2]; // of the vertices that move; NULL: all do (vertices.h)
    int run_count;
} Drag;

// For bodies of up to `capacity` vertices.
Drag *drag_create(const char *name, int capacity, Arena *arena);
// Slows the rows of the pass; sets its rigid motion. The same bits with and without a team (NULL).
void drag_slow(Drag *by, const VertexKernels *kernels, SlowPass *pass, int count, Team *team);

#endif
