// SPDX-License-Identifier: MIT
// The lattice of a cut body by its definition, from the bits and the labels alone, in the plainest
// way; and what anything that follows its changes must know.
#ifndef PLIANT_TESTS_CUT_REFERENCE_H
#define PLIANT_TESTS_CUT_REFERENCE_H

#include "cut_sample.h"

// True if a cell is solid at load.
bool cut_reference_is_solid(const CutSample *sample, const int at[3]);
// Fails the test unless leaves, vertices and what must be divided are as the bits say.
void cut_reference_check(const CutSample *sample);
// Derives everything that follows from the state again: it must be the same.
void cut_reference_check_derived(CutLattice *cut);
// Returns a copy of everything that a call may change, to be freed.
unsigned char *cut_reference_copy(const CutSample *sample, size_t *size);

// The vertices of elements as the changes report them, and which rows hold one.
typedef struct CutFollower {
    int (*node)[NODE_COUNT]; // [element]
    int used;                // rows
    int *id;                 // [capacity] -1: none
    bool *carried;           // [capacity]
} CutFollower;

CutFollower cut_follower_create(const CutLattice *cut);
void cut_follower_drop(CutFollower *follower);
// Follows the changes and forgets them: they must name all that differs, and the lattice be as its
// bits say.
void cut_follower_settle(CutFollower *follower, CutSample *sample);
// Divides and takes away what the budget allows of some random cells, as a body does.
void cut_follower_remove_random(CutFollower *follower, CutSample *sample, uint64_t *seed);

// Damages the state, of a removable body once cells have gone: each time it must be refused, or
// everything must hold. Returns the share that was refused.
double cut_reference_damage(CutSample *sample, uint64_t *seed);

#endif
