// Builds a Sim, ready for its first tick, from a scene: makes or imports meshes, reads initial
// states, creates bodies, tools and loads, and lets the bodies settle.
#ifndef PLIANT_SCENE_BUILD_H
#define PLIANT_SCENE_BUILD_H

#include "dynamics/world.h"
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

#endif
