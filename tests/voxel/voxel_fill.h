// SPDX-License-Identifier: MIT
// Random sets of solid cells in an element, and what hangs on it; how its places move, slowly.
#ifndef PLIANT_TESTS_VOXEL_FILL_H
#define PLIANT_TESTS_VOXEL_FILL_H

#include "random.h"

#include "voxel/template.h"

#include <string.h>

enum {
    FILL_LEVELS = 3,
    FILL_WORDS = 1 << (3 * FILL_LEVELS - 6),
    FILL_CELLS = 1 << 3 * FILL_LEVELS
};

static inline bool fill_has(const uint64_t *solid, int cell)
{
    return solid[cell / 64] >> cell % 64 & 1;
}

static inline int fill_count(const uint64_t *solid, int level)
{
    int count = 0;
    for (int c = 0; c < 1 << 3 * level; c++)
        count += fill_has(solid, c);
    return count;
}

static inline void fill_add(uint64_t *solid, int cell)
{
    solid[cell / 64] |= (uint64_t)1 << cell % 64;
}

// Cells joined through faces: a random number of them, not all; or a slab, every eighth time.
static inline void fill_random(uint64_t solid[FILL_WORDS], int level, uint64_t *random)
{
    const int edge = 1 << level, all = edge * edge * edge;
    memset(solid, 0, FILL_WORDS * sizeof *solid);
    if (random_below(random, 8) == 0) {
        const int axis = random_below(random, 3), first = random_below(random, edge),
                  thick = 1 + random_below(random, edge - 1);
        for (int c = 0; c < all; c++) {
            const int at[3] = {c % edge, c / edge % edge, c / edge / edge};
            if (at[axis] >= first && at[axis] < first + thick)
                fill_add(solid, c);
        }
        return;
    }
    const int want = 1 + random_below(random, all - 1);
    fill_add(solid, random_below(random, all));
    for (int have = 1; have < want;) {
        const int c = random_below(random, all), step[3] = {1, edge, edge * edge};
        bool joins = false;
        for (int d = 0; d < 3; d++) {
            const int at = c / step[d] % edge;
            joins = joins || (at > 0 && fill_has(solid, c - step[d])) ||
                    (at + 1 < edge && fill_has(solid, c + step[d]));
        }
        if (joins && !fill_has(solid, c)) {
            fill_add(solid, c);
            have++;
        }
    }
}

// How a place in the cube moves with the 26 nodes: linearly with the 8 points around it of those
// that halve the edges, each of which is a node, or the mean of what is around it.
static inline void fill_add_place(unsigned mask, int x, int y, int z, double share,
                                  double to[NODE_COUNT])
{
    const int node = node_at_offset(x, y, z);
    if (node >= 0 && (node < NODE_CORNERS || (mask >> (node - NODE_CORNERS) & 1))) {
        to[node] += share;
    } else if (node < 0) { // the middle
        for (int c = 0; c < 8; c++)
            to[c] += share / 8.0;
    } else if (x == 1) {
        // Of an edge by its ends; of a face by the middles of its edges.
        const double part = y == 1 || z == 1 ? share / 4.0 : share / 2.0;
        for (int end = 0; end <= 2; end += 2)
            fill_add_place(mask, end, y, z, part, to);
        for (int end = 0; end <= 2 && y == 1; end += 2)
            fill_add_place(mask, 1, end, z, part, to);
        for (int end = 0; end <= 2 && z == 1; end += 2)
            fill_add_place(mask, 1, y, end, part, to);
    } else if (y == 1) {
        const double part = z == 1 ? share / 4.0 : share / 2.0;
        for (int end = 0; end <= 2; end += 2)
            fill_add_place(mask, x, end, z, part, to);
        for (int end = 0; end <= 2 && z == 1; end += 2)
            fill_add_place(mask, x, 1, end, part, to);
    } else {
        for (int end = 0; end <= 2; end += 2)
            fill_add_place(mask, x, y, end, share / 2.0, to);
    }
}

static inline void fill_weights(unsigned mask, const double place[3], double to[NODE_COUNT])
{
    memset(to, 0, NODE_COUNT * sizeof *to);
    int low[3];
    double at[3];
    for (int d = 0; d < 3; d++) {
        low[d] = place[d] >= 0.5;
        at[d] = 2.0 * place[d] - low[d];
    }
    for (int c = 0; c < 8; c++) {
        double share = 1.0;
        int o[3];
        for (int d = 0; d < 3; d++) {
            o[d] = low[d] + (c >> d & 1);
            share *= (c >> d & 1) != 0 ? at[d] : 1.0 - at[d];
        }
        if (share != 0.0)
            fill_add_place(mask, o[0], o[1], o[2], share, to);
    }
}

// None, all, or some nodes in the middles of edges and faces.
static inline unsigned fill_random_mask(uint64_t *random)
{
    const unsigned all = (1u << (NODE_COUNT - NODE_CORNERS)) - 1;
    switch (random_below(random, 4)) {
    case 0:
        return 0;
    case 1:
        return all;
    default:
        return (unsigned)random_bits(random) & all;
    }
}

#endif
