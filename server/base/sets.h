// SPDX-License-Identifier: MIT
// Sets of numbers: sorted arrays, and disjoint sets of the numbers 0 .. count - 1.
#ifndef PLIANT_BASE_SETS_H
#define PLIANT_BASE_SETS_H

#include <stdbool.h>

// --- sorted arrays: ascending orders for qsort and bsearch ---

// Of ints, and of structs that begin with one.
static inline int compare_ints(const void *a, const void *b)
{
    const int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

static inline int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

// --- disjoint sets in an array of parents ---
// The root of a set is its lowest member, so what comes out does not depend on the order of the
// joins.

// Makes each number a set of its own.
static inline void union_find_reset(int *parent, int count)
{
    for (int i = 0; i < count; i++)
        parent[i] = i;
}

// Returns the root of i's set. Halves the path on the way.
static inline int union_find_root(int *parent, int i)
{
    while (parent[i] != i) {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    return i;
}

// Joins the sets of a and b under the lower of their roots. Returns true if they were two.
static inline bool union_find_join(int *parent, int a, int b)
{
    a = union_find_root(parent, a);
    b = union_find_root(parent, b);
    parent[a > b ? a : b] = a > b ? b : a;
    return a != b;
}

// Replaces each parent by the number of its set; sets are numbered by their lowest members. Returns
// how many there are.
static inline int union_find_number(int *parent, int count)
{
    int sets = 0;
    for (int i = 0; i < count; i++) // parents come before their children
        parent[i] = parent[i] == i ? sets++ : parent[parent[i]];
    return sets;
}

#endif
