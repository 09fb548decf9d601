// SPDX-License-Identifier: MIT
// Takes finest cells away from a voxel body: finds those within a tool's reach, divides what is in
// their way, and lets all that follows from the elements follow (README.md, "Cells that go"). Step
// thread, except cut_reach_create.
#ifndef PLIANT_VOXEL_CUT_CUT_REMOVE_H
#define PLIANT_VOXEL_CUT_CUT_REMOVE_H

#include "voxel/cut/cut_blade.h"

// What a remover can reach; bricks are excluded by boxes, as for blades.
typedef struct CutReach {
    BladeMemory memory; // stroke->now: ticks completed after the last search; state
    int64_t divided;    // ticks completed before that in which elements were divided last; -1
    double distance[CUT_REMOVE_MOST]; // of cells from the axis, ascending
    int cell[CUT_REMOVE_MOST], count;
    bool any;       // a cell is within reach
    int (*face)[2]; // [6 * CUT_REMOVE_MOST] that cells that go break
    CutCrossing *crossing;
} CutReach;

// Load time: of bodies from which cells can go.
void cut_reach_create(CutReach *reach, const char *name, const CutBlades *blades, Arena *arena,
                      StateList *state);
void cut_reach_restored(CutReach *reach);

// BodyOps.remove.
bool cut_body_remove(Body *body, const Removal *removal, RemovalOutcome *outcome,
                     TopologyChange *change);
// Takes away cells that cut_lattice_expose has exposed, not the last one of the body, as
// cut_body_remove. `mouth`: where smooth walls go, in the world; NULL: in the middle of links.
bool cut_body_take(Body *body, const int *cell, int count, const Region *mouth,
                   RemovalOutcome *outcome, TopologyChange *change);
// Derives what follows from the cells that are gone.
void cut_body_count_gone(struct VoxelCuts *cuts, Body *body);

#endif
