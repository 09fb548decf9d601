// SPDX-License-Identifier: MIT
// A scene that has been built, and copies of its state for checkpoints. The step thread counts
// inputs and takes copies; the rest is for load time.
#ifndef PLIANT_SIM_WORLD_H
#define PLIANT_SIM_WORLD_H

#include "base/memory.h"
#include "base/team.h"
#include "sim/sim.h"
#include "geometry/lattice.h"
#include "geometry/mesh.h"

// Data of a voxel body's lattice, which is placed in the world.
enum { WORLD_LEVELS = 6 };
typedef struct WorldCells {
    uint64_t hash; // of everything that determines its elements
    int count[3];
    long solid;
    double size; // of a cell [m]
    LatticeShells shells;
    // Of a body that adapts: solid cells by the coarsest level that its thickness allows there.
    long coarsest[WORLD_LEVELS];
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
    WorldCells *cells;                   // [body_count] of voxel bodies; else zero
    const char *scene_path, *scene_text; // owned by the scene
    uint64_t physics; // hash of everything in the scene that determines the motion
    // Inputs applied since tick `inputs_step`, the newest tick: the state already contains them, so
    // a run that continues from it skips them in a log of inputs.
    int64_t inputs_step, inputs;
} World;

void world_destroy(World *world);

// Counts an input that is applied before the next tick. For the thread that steps the world.
void world_count_input(World *world);
// Returns the number of inputs counted since the newest tick.
int64_t world_inputs(const World *world);

// What a checkpoint holds, copied between two ticks into memory reserved at load time. `block`
// holds state_bytes(); the rest is indexed by node slot (BodyMesh).
typedef struct WorldImage {
    void *block;
    int *node_count; // [body]
    int **id; // [body][node_count] of bodies whose mesh changes; else NULL: the body's own ids hold
    Vec3 **position; // [body][node_count]
    Vec3 **velocity; // [body][node_count]
    double time;
    int64_t step;
    int64_t inputs;    // applied since that step (world_inputs)
    const char *fault; // what no run could start from, NULL: nothing (world_fault)
} WorldImage;

// Returns what of the present state no run can start from, or NULL: the name of a body, or "" for
// tools, loads, strokes and attachments.
const char *world_fault(const World *world);

// Reserves the image from the arena (the world's own, for a run's checkpoints). Load time.
void world_image_reserve(WorldImage *image, Arena *arena, const World *world);
// Copies the state; step thread, between two ticks.
void world_image_take(WorldImage *image, const World *world);

#endif
