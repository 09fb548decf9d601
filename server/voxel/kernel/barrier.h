// SPDX-License-Identifier: MIT
// Private to the kernels: elements whose volume has fallen below BARRIER_VOLUME, one by one in
// double precision. As rare as those of repair.h, and never inlined either.
#ifndef PLIANT_VOXEL_KERNEL_BARRIER_H
#define PLIANT_VOXEL_KERNEL_BARRIER_H

#include "voxel/barrier.h"
#include "voxel/kernel/repair.h"

// The vectors of one call, in memory.
typedef struct Barrier {
    Real g[3][3][WIDTH], turn[3][3][WIDTH], inverse[WIDTH];
    Real gap[3][3][WIDTH], energy[WIDTH];
} Barrier;

static __attribute__((noinline, cold)) void barrier_lanes(Barrier *by)
{
    for (int lane = 0; lane < WIDTH; lane++) {
        double f[3][3], rotation[3][3], gap[3][3];
        for (int i = 0; i < 9; i++) {
            const double one = i % 4 == 0 ? 1.0 : 0.0;
            f[i / 3][i % 3] = (double)by->g[i / 3][i % 3][lane] + one;
            rotation[i / 3][i % 3] =
                (double)by->turn[i / 3][i % 3][lane] * (double)by->inverse[lane] + one;
        }
        by->energy[lane] =
            (Real)barrier_gap((const double(*)[3])f, (const double(*)[3])rotation, gap);
        for (int i = 0; i < 9; i++)
            by->gap[i / 3][i % 3][lane] = (Real)gap[i / 3][i % 3];
    }
}

// Returns all bits set in the lanes that are crushed, or bad.
INLINE Vector crushed(const Root *root)
{
    return vector_not_greater(root->d, vector_set(BARRIER_VOLUME - 1.0));
}

// Adds what the barrier adds to the stress to the deformation from which the stress is computed, P
// = pull g + ..., where stretch = 2 mu and bulk = lambda; `pull` is 2 mu too, but for elements that
// stiffen, which the barrier does not. Returns half the square of the gap: the barrier's energy
// over its stiffness.
INLINE Vector barrier(const Polar *polar, Vector stretch, Vector bulk, Vector pull, Deformation *by)
{
    Barrier all;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            vector_store(all.g[i][k], by->g[i][k]);
            vector_store(all.turn[i][k], polar->turn[i][k]);
        }
    vector_store(all.inverse, polar->inverse);
    barrier_lanes(&all);
    // A stiffness scale of zero leaves none.
    const Vector share = vector_select_greater(
        pull, vector_set(0.0), REAL(BARRIER_SHARE) * (stretch + REAL(3.0) * bulk) / pull,
        vector_set(0.0));
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            by->g[i][k] += share * vector_load(all.gap[i][k]);
    return vector_load(all.energy);
}

#endif
