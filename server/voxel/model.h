// Private to the voxel room: the arrays of one voxel body. Constant after creation unless said.
//
// Vertices on the outer faces come first, then the inner ones.
#ifndef PLIANT_VOXEL_MODEL_H
#define PLIANT_VOXEL_MODEL_H

#include "dynamics/rows.h"
#include "voxel/batch.h"
#include "voxel/kernel.h"
#include "voxel/lattice_mesh.h"
#include "voxel/tables.h"
#include "voxel/vertices.h"
#include "voxel/voxel.h"

// Half of a body's batches, as kernels take them.
typedef struct BatchHalf {
    PlainBatches plain;
    HangingBatches hanging;
    int first_plain, first_hanging; // of VoxelModel.last
} BatchHalf;

typedef struct VoxelModel {
    int surface_count; // the first ones: on the outer faces, what tools and loads meet
    int element_count;
    int element_at_level[VOXEL_LEVELS_MAX + 1];

    // --- elements ---
    Batches batches;
    const RestTable *tables;
    double (*last)[LANES][4]; // [batches_total] see VoxelPass; part of the state
    BatchHalf half[2];        // of bodies whose forces gather in two arrays (Vertices.more)
    VoxelLaw law;

    Vertices vertices; // ids as LatticeMesh's; loads on those of the outer faces

    // --- out ---
    int *node; // [node_count] vertex of a published node, unless there is a skin
    int node_count;
    struct Skin *skin; // or NULL
} VoxelModel;

extern const BodyOps voxel_ops;

// Rotations start at none.
void voxel_forget_rotations(VoxelModel *model);

// patch.c: BodyOps.gather_patch.
bool voxel_gather_patch(const void *self, Patch *patch, int budget);

// outer.c. Load time: what tools and loads meet, and what is published, from the outer faces.
void voxel_create_surface(VoxelModel *model, Body *body, const LatticeMesh *mesh,
                          const VoxelOptions *options, Arena *arena);
void voxel_create_mesh(VoxelModel *model, Body *body, const LatticeMesh *mesh, bool all,
                       const char *name, Arena *arena);

#endif
