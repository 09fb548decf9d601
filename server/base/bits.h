// SPDX-License-Identifier: MIT
// Sets of the numbers 0 .. count - 1 as one bit each, in words of 64.
#ifndef PLIANT_BASE_BITS_H
#define PLIANT_BASE_BITS_H

#include <stdbool.h>
#include <stdint.h>

// Returns how many words a set takes.
static inline int bits_words(int count)
{
    return (count + 63) / 64;
}

static inline bool bits_has(const uint64_t *set, int i)
{
    return (set[i / 64] >> (i % 64) & 1) != 0;
}

static inline void bits_add(uint64_t *set, int i)
{
    set[i / 64] |= UINT64_C(1) << (i % 64);
}

static inline void bits_remove(uint64_t *set, int i)
{
    set[i / 64] &= ~(UINT64_C(1) << (i % 64));
}

// Removes the lowest bit from a copy of word number `word`, which is not 0. Returns its number in
// the set: `for (uint64_t left = set[w]; left != 0;) { const int i = bits_take(&left, w); ... }`
static inline int bits_take(uint64_t *left, int word)
{
    const int i = word * 64 + __builtin_ctzll(*left);
    *left &= *left - 1;
    return i;
}

static inline int64_t bits_count(const uint64_t *set, int count)
{
    int64_t sum = 0;
    for (int word = 0; word < bits_words(count); word++)
        sum += __builtin_popcountll(set[word]);
    return sum;
}

// Returns how many members of i's word are before i.
static inline int bits_before(const uint64_t *set, int i)
{
    return __builtin_popcountll(set[i / 64] & ((UINT64_C(1) << (i % 64)) - 1));
}

// Moves the members to an array, ascending, and so empties the set. Returns how many there were.
static inline int bits_move(uint64_t *set, int count, int *to)
{
    int members = 0;
    for (int word = 0; word < bits_words(count); word++) {
        for (uint64_t left = set[word]; left != 0;)
            to[members++] = bits_take(&left, word);
        set[word] = 0;
    }
    return members;
}

#endif
