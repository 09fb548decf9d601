// SPDX-License-Identifier: MIT
// Reproducible random numbers for tests: the same sequence on every machine.
#ifndef PLIANT_TESTS_RANDOM_H
#define PLIANT_TESTS_RANDOM_H

#include "base/vec.h"

#include <stdint.h>

// xorshift64*
static inline uint64_t random_bits(uint64_t *state)
{
    *state ^= *state >> 12;
    *state ^= *state << 25;
    *state ^= *state >> 27;
    return *state * UINT64_C(2685821657736338717);
}

// In [0, count).
static inline int random_below(uint64_t *state, int count)
{
    return (int)((random_bits(state) >> 33) % (uint64_t)count);
}

// In [low, high).
static inline double random_between(uint64_t *state, double low, double high)
{
    return low + (high - low) * (double)(random_bits(state) >> 11) * 0x1p-53;
}

// In the cube [-1, 1)^3.
static inline Vec3 random_vec3(uint64_t *state)
{
    double x = random_between(state, -1.0, 1.0), y = random_between(state, -1.0, 1.0);
    return vec3(x, y, random_between(state, -1.0, 1.0));
}

#endif
