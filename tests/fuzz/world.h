// SPDX-License-Identifier: MIT
// A small world to which inputs can be done: a surface body and a voxel body, both with levels and
// cuttable, and tools of all kinds, as far as they are built in. Made once; put back to its start
// before each input.
#ifndef PLIANT_TESTS_FUZZ_WORLD_H
#define PLIANT_TESTS_FUZZ_WORLD_H

#include "scene/build.h"

typedef struct FuzzWorld {
    Scene scene;
    World world;
    void *start; // the state after building
} FuzzWorld;

// The one world of this program, as it was after it was built.
FuzzWorld *fuzz_world(void);
// The same of another world: solids that adapt, if voxel bodies are built in.
FuzzWorld *fuzz_world_that_adapts(void);
// Makes one from a scene's text; it must be right.
void fuzz_world_build(FuzzWorld *world, const char *text);
// Every number that it shows is finite, and its state is one that a checkpoint may hold.
void fuzz_world_check(FuzzWorld *world);

#endif
