// SPDX-License-Identifier: MIT
// Private to the kernels: adds a batch's forces to its vertices.
#ifndef PLIANT_VOXEL_KERNEL_SCATTER_H
#define PLIANT_VOXEL_KERNEL_SCATTER_H

#include "base/vector.h"

// Adds the forces of one vertex of all LANES elements, one element after another: two lanes may
// share a vertex, and sums have one order at every width. `from` as vector_spread_rows writes it,
// for every WIDTH lanes.
INLINE void scatter_forces(void *force, const int *vertex, const Real from[4 * LANES])
{
    for (int lane = 0; lane < LANES; lane++) {
        Real *to = (Real *)force + 4L * vertex[lane];
        const Real *add = from + lane / WIDTH * WIDTH * 4 + vector_row_at(lane % WIDTH);
#if KERNEL_WIDTH == 2
        vector_store(to, vector_load(to) + vector_load(add));
        vector_store(to + 2, vector_load(to + 2) + vector_load(add + 2));
#else
        Block sum, more;
        memcpy(&sum, to, sizeof sum);
        memcpy(&more, add, sizeof more);
        sum += more;
        memcpy(to, &sum, sizeof sum);
#endif
    }
}

#endif
