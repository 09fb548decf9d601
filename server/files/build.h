// From a scene as written to a Sim ready for its first tick: meshes made or imported, initial
// states read, bodies, tools and loads created, settled.
#ifndef PLIANT_FILES_BUILD_H
#define PLIANT_FILES_BUILD_H

#include "base/arena.h"
#include "base/state.h"
#include "base/team.h"
#include "files/scene.h"

typedef struct BuildOptions {
    const char *isa;      // "auto" or a level
    const char *prepared; // file of prepared models, or NULL: the scene's, if it names one
    bool may_load;        // loads can come at run time: false only off line without an input log
    bool publishes;       // somebody may hear what the scene publishes
} BuildOptions;

// What is kept of a voxel body's lattice, which stands in the world.
typedef struct WorldCells {
    uint64_t hash; // of everything that its elements follow from
    int count[3];
    long solid;
    double size; // of a cell [m]
} WorldCells;

// A scene built. The arena owns the sim; destroy in one call.
typedef struct World {
    Arena arena;
    StateList state;
    Sim *sim;
    Team *team;    // shares the step; without workers until team_start; NULL: scene.threads is 1
    TriMesh *mesh; // [body_count] of the scene, at the level of the body, nodes in file order;
                   // empty for bodies that are not made from one
    int mesh_count;
    WorldCells *cells; // [body_count] of voxel bodies; else zero
    // Inputs applied since tick `inputs_step`, the newest: what a log of them holds for it is, in
    // part, behind the state already.
    int64_t inputs_step, inputs;
} World;

// The thread that steps the world: one more input is applied before the next tick.
void world_count_input(World *world);
// How many have been, since the newest tick.
int64_t world_inputs(const World *world);

// False with `status` naming scene file and line, or mesh file and element.
bool world_build(World *world, const Scene *scene, const BuildOptions *options, Status *status);
void world_destroy(World *world);

#endif
