// Private to the voxel module: the arrays of one voxel body. Constant after creation unless noted.
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

// Half of a body's batches, in the form of the kernels.
typedef struct BatchHalf {
    PlainBatches plain;
    HangingBatches hanging;
    int first_plain, first_hanging; // indices in VoxelModel.last
} BatchHalf;

typedef struct VoxelModel {
    int surface_count; // the first vertices: on the outer faces, where tools and loads act
    int element_count;
    int element_at_level[VOXEL_LEVELS_MAX + 1];

    // --- elements ---
    Batches batches;
    const RestTable *tables;
    double (*last)[LANES][4]; // [batches_total] see VoxelPass; part of the state
    BatchHalf half[2];        // of bodies whose forces are summed in two arrays (Vertices.more)
    VoxelLaw law;

    Vertices vertices; // ids as in LatticeMesh; loads on those of the outer faces

    // --- output ---
    int *node; // [node_count] vertex of a published node, unless there is a skin
    int node_count;
    struct Skin *skin; // or NULL
} VoxelModel;

extern const BodyOps voxel_ops;

// Resets all rotations to none.
void voxel_forget_rotations(VoxelModel *model);

// patch.c: BodyOps.gather_patch.
bool voxel_gather_patch(const void *self, Patch *patch, int budget);

// outer.c. Load time: creates what tools and loads act on, and what is published, from the outer
// faces.
void voxel_create_surface(VoxelModel *model, Body *body, const LatticeMesh *mesh,
                          const VoxelOptions *options, Arena *arena);
void voxel_create_mesh(VoxelModel *model, Body *body, const LatticeMesh *mesh, bool all,
                       const char *name, Arena *arena);

#endif
