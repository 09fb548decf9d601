// Private to the voxel room: the arrays of one voxel body. Constant after creation unless said.
//
// Vertices have rows of displacements (dynamics/rows.h) in the lattice's axes, in both precisions:
// those on the outer faces come first, then the inner ones; one spare row at the end takes what
// the padding of batches writes. Forces gather in an array of their own, four numbers a vertex,
// which the elements add to, batch by batch, and which the advance of vertices clears.
#ifndef PLIANT_VOXEL_MODEL_H
#define PLIANT_VOXEL_MODEL_H

#include "dynamics/rows.h"
#include "voxel/batch.h"
#include "voxel/kernel.h"
#include "voxel/lattice_mesh.h"
#include "voxel/tables.h"
#include "voxel/voxel.h"

// What SET can change; plain data, part of the state.
typedef struct VoxelParameters {
    double gravity[3]; // world [m/s2]
    double stiffness_scale, damping_scale;
} VoxelParameters;

typedef struct VoxelModel {
    int vertex_count;  // without the spare one
    int surface_count; // the first ones: on the outer faces, what tools and loads meet
    int element_count;
    int element_at_level[VOXEL_LEVELS_MAX + 1];

    // --- elements ---
    Batches batches;
    const RestTable *tables;
    double (*last)[LANES][4]; // [batches_total] see VoxelPass; part of the state
    VoxelLaw law;
    bool damped;
    const VoxelKernels *kernels;

    // --- vertices ---
    Rows rows;          // of vertex_count + 1
    double *mass;       // [vertex_count] of every vertex, fixed ones too [kg]
    void *inverse_mass; // Real [vertex_count + 1] [1/kg]; 0: fixed
    int *id;            // [vertex_count] LatticeMesh.id

    // --- state: `current` says which of the two is the present one ---
    void *row[2]; // Real [vertex_count + 1][ROW]
    int current;
    const void *present; // rows to be evaluated next
    void *force;         // Real [vertex_count + 1][4]; zero between evaluations
    bool bad;            // the tick's last rows were out of bounds
    double position_limit;
    VoxelParameters *parameters; // part of the state

    // --- constant loads; NULL: none can act ---
    double (*load)[3]; // [surface_count] in the world [N]; part of the state
    int *loaded;       // [loaded_count] those that are not zero, ascending; follows from `load`
    int loaded_count;  // -1: to be listed anew

    // --- out ---
    int *node; // [node_count] vertex of a published node, unless there is a skin
    int node_count;
    struct Skin *skin; // or NULL
} VoxelModel;

extern const BodyOps voxel_ops;

// From the present loads: what is loaded.
void voxel_list_loads(VoxelModel *model);

// All vertices, by their index; returns their number.
int voxel_read_state(const void *model, int *id, Vec3 *position, Vec3 *velocity);
// Rotations start at none.
void voxel_forget_rotations(VoxelModel *model);

// outer.c. Load time: what tools and loads meet, and what is published, from the outer faces.
void voxel_create_surface(VoxelModel *model, Body *body, const LatticeMesh *mesh,
                          const VoxelOptions *options, Arena *arena);
void voxel_create_mesh(VoxelModel *model, Body *body, const LatticeMesh *mesh, bool all,
                       const char *name, Arena *arena);

#endif
