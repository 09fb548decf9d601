// SPDX-License-Identifier: MIT
// What is true of every body that nothing but gravity acts on, and of one that is pushed once and
// left alone.
#ifndef PLIANT_TESTS_STABILITY_FREE_FALL_H
#define PLIANT_TESTS_STABILITY_FREE_FALL_H

#include "base/isa.h"
#include "sim/sim.h"
#include "random_scene.h"

#include <stddef.h>

typedef enum FallVerdict {
    FALL_SHAPE,    // keeps its shape
    FALL_MOMENTUM, // has gravity's impulse, and a push's
    FALL_SPIN,     // does not begin to turn
    FALL_WORK,     // has no more energy than gravity's work
    FALL_PUSHED,   // gains no energy after a push
    FALL_RESTORED, // is not restored
    FALL_COUNT,
} FallVerdict;

// "shape", "momentum", "spin", "work", "pushed", "restored".
const char *fall_word(FallVerdict verdict);

// Of all bodies of a scene.
typedef struct FallResult {
    int judged[FALL_COUNT]; // bodies
    int wrong[FALL_COUNT];
    char text[FALL_COUNT][200]; // what is wrong with the last of them
} FallResult;

// Strikes out what acts on bodies or strains them from the start, all but gravity.
void free_fall_strip(RandomScene *scene);
// `sim` as built from such a scene: falls for so many ticks, and from its start again is pushed and
// left alone.
void free_fall_judge(Sim *sim, Vec3 gravity, Precision precision, int ticks, FallResult *result);

#endif
