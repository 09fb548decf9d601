// SPDX-License-Identifier: MIT
// Builds a Sim, ready for its first tick, from a scene: makes or imports meshes, reads initial
// states, creates bodies, tools and loads, and lets the bodies settle.
#ifndef PLIANT_SCENE_BUILD_H
#define PLIANT_SCENE_BUILD_H

#include "sim/world.h"
#include "scene/scene.h"

typedef struct BuildOptions {
    const char *isa;      // "auto" or a level
    const char *prepared; // file of prepared models, or NULL: the scene's, if any
    bool may_load;        // loads may come at run time: false only offline without an input log
    bool publishes;       // a client may receive what the scene publishes
} BuildOptions;

// Returns false with a `status` that names scene file and line, or mesh file and element. The scene
// outlives the world.
bool world_build(World *world, const Scene *scene, const BuildOptions *options, Status *status);

// Hashes everything that determines the motion: rate, gravity, meshes, materials, tools and loads.
// Excludes publishing, network settings and how the start was settled.
uint64_t physics_hash(const Scene *scene, const World *world);

// Warns of scenes that can be simulated but are probably mistakes: lengths in millimetres read as
// metres, a body that nothing fixes. Logs one warning for each unusual number of a scene, with the
// line of the scene file, the number and its likely cause, and one for each key without effect.
// Returns the number of warnings.
int plausible_warn(World *world, const Scene *scene);

#endif
