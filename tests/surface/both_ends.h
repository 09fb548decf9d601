// SPDX-License-Identifier: MIT
// The two entries of each spring, at its two nodes.
#ifndef PLIANT_TESTS_BOTH_ENDS_H
#define PLIANT_TESTS_BOTH_ENDS_H

#include "expect.h"

#include "surface/model.h"

static inline long entry_between(const SurfaceModel *model, int slot, int other)
{
    const SpringTable *springs = &model->springs;
    const int lane = model_lane_of(model, slot);
    for (int e = springs->start[lane / LANES]; e < springs->end[lane / LANES]; e++)
        if (springs->neighbour[(long)e * LANES + lane % LANES] == other)
            return (long)e * LANES + lane % LANES;
    fail_msg("a spring has one end");
    return -1;
}

// Calls for both entries of each spring; returns their number.
static inline int each_spring(const SurfaceModel *model,
                              void (*visit)(const SurfaceModel *, long at, long back, void *),
                              void *with)
{
    const SpringTable *springs = &model->springs;
    int count = 0;
    for (int s = 0; s < model->basis.count; s++) {
        const int lane = model->node[s] >= 0 ? model_lane_of(model, s) : -1;
        for (int e = lane < 0 ? 0 : springs->start[lane / LANES];
             lane >= 0 && e < springs->end[lane / LANES]; e++) {
            const long at = (long)e * LANES + lane % LANES;
            const int other = springs->neighbour[at];
            if (other <= s)
                continue;
            visit(model, at, entry_between(model, other, s), with);
            count++;
        }
    }
    return count;
}

static inline void expect_alike(const SurfaceModel *model, long at, long back, void *with)
{
    (void)with;
    double d[2][RELAXATION_NUMBERS] = {{0.0}};
    relaxation_take(model->relaxation, (int)at, d[0]);
    relaxation_take(model->relaxation, (int)back, d[1]);
    assert_memory_equal(d[0], d[1], sizeof d[0]);
}

// Fails unless the dashpots of both entries are the same.
static inline void expect_both_ends_alike(const SurfaceModel *model)
{
    assert_true(each_spring(model, expect_alike, NULL) > 50);
}

#endif
