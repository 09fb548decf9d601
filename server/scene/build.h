// Builds a Sim, ready for its first tick, from a scene: makes or imports meshes, reads initial
// states, creates bodies, tools and loads, and lets the bodies settle.
#ifndef PLIANT_SCENE_BUILD_H
#define PLIANT_SCENE_BUILD_H

#include "base/arena.h"
#include "base/state.h"
#include "base/team.h"
#include "scene/scene.h"

typedef struct BuildOptions {
    const char *isa;      // "auto" or a level
    const char *prepared; // file of prepared models, or NULL: the scene's, if any
    bool may_load;        // loads may come at run time: false only offline without an input log
    bool publishes;       // a client may receive what the scene publishes
} BuildOptions;

// Data of a voxel body's lattice, which is placed in the world.
typedef struct WorldCells {
    uint64_t hash; // of everything that determines its elements
    int count[3];
    long solid;
    double size; // of a cell [m]
} WorldCells;

// A scene that has been built. The arena owns the sim; world_destroy frees everything.
typedef struct World {
    Arena arena;
    StateList state;
    Sim *sim;
    Team *team;    // shares the step; without workers until team_start; NULL: scene.threads is 1
    TriMesh *mesh; // [body_count] of the scene, at the level of the body, nodes in file order;
                   // empty for bodies that are not made from one
    int mesh_count;
    WorldCells *cells; // [body_count] of voxel bodies; else zero
    // Inputs applied since tick `inputs_step`, the newest tick: the state already contains them, so
    // a run that continues from it skips them in a log of inputs.
    int64_t inputs_step, inputs;
} World;

// Counts an input that is applied before the next tick. For the thread that steps the world.
void world_count_input(World *world);
// Returns the number of inputs counted since the newest tick.
int64_t world_inputs(const World *world);

// Returns false with a `status` that names scene file and line, or mesh file and element.
bool world_build(World *world, const Scene *scene, const BuildOptions *options, Status *status);
void world_destroy(World *world);

#endif
