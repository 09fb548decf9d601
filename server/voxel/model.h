// SPDX-License-Identifier: MIT
// Private to the voxel module: the arrays of one voxel body. Constant after creation unless noted.
//
// Vertices on the outer faces come first, then the inner ones, then those that cuts and divisions
// add.
#ifndef PLIANT_VOXEL_MODEL_H
#define PLIANT_VOXEL_MODEL_H

#include "body/rows.h"
#include "body/vertices.h"
#include "voxel/batch.h"
#include "voxel/kernel.h"
#include "voxel/lattice_mesh.h"
#include "voxel/template.h"
#include "voxel/voxel.h"

typedef struct VoxelModel {
    Vertices vertices; // first, for their operations; ids as in LatticeMesh
    VoxelLaw law;
    bool viscous; // see VoxelPass
    const VoxelStiffening *stiffening;
    const int *element_at_level; // [VOXEL_LEVELS_MAX + 1]
    int points[3];               // of the lattice, of which ids are made
    BatchRuns *batches;          // what the kernels evaluate; its rotations are state
    int surface_count; // the first vertices: on the outer faces of the body before any cut
    // Vertices of the published nodes, unless there is a skin.
    const int *node;           // [*node_count]
    const int64_t *node_count; // grows in bodies that are cut
    struct Skin *skin;         // or NULL
    struct FittedBody *fitted; // of a smooth surface (fitted_body.h), or NULL
    struct VoxelError *error;  // estimates what the elements leave out (error.h), or NULL
    struct VoxelCuts *cuts;    // what a body that can be cut has besides (cut/cut_body.h), or NULL
} VoxelModel;

extern const BodyOps voxel_ops[2];                   // [it adapts]
extern const BodyOps voxel_ops_of_cuttable[2][2][2]; // [it adapts][it tears][it heats]

// Returns what the kernels need to evaluate these rows; batch.h adds the batches.
VoxelPass voxel_pass(const VoxelModel *model, const void *rows);

// patch.c: BodyOps.gather_patch.
bool voxel_gather_patch(const void *self, Patch *patch, int budget);

// outer.c. Load time: creates what tools and loads act on, and what is published, from the outer
// faces.
void voxel_create_surface(VoxelModel *model, Body *body, const LatticeMesh *mesh,
                          const VoxelOptions *options, Arena *arena);
void voxel_create_mesh(VoxelModel *model, Body *body, const LatticeMesh *mesh, bool all,
                       const char *name, Arena *arena);
// BodyOps.snapshot_elements, of a body without skin.
void voxel_snapshot_elements(const Body *body, int first, int end, unsigned char *level,
                             uint16_t *tag);

// --- create.c. Load time ---

// Intermediate results of the creation of a body.
typedef struct VoxelMaking {
    const VoxelOptions *options;
    const VoxelKernels *kernels;
    Layout layout;
    LatticeMesh mesh; // before any cut
    int start;        // vertices of the mesh that the body has at load, the first ones
    int capacity;     // most vertices; those of the mesh unless the body can be cut
    VertexId *by_id;  // [vertex_count]
    bool *fixed;      // [vertex_count]
    double *hung;     // [vertex_count] masses that hang there [kg], or NULL

    // --- elements ---
    ElementClass *classes; // [element_count]
    unsigned *mask;        // [element_count]
    double *density;       // [element_count] [kg/m3]
    double beta;           // of damping [s]
    double step;           // dt0: the smallest critical step of the elements [s]
    double lambda;         // bounds of M^-1 K to fast strains at the cap, of the linear law alone,
    double elastic;        // and, per unit of beta, of M^-1 C [1/s2]
    double damping_lambda;

    // --- of a body that adapts, at rest: as coarse as it can be (cut_body_find_rest) ---
    int kept;               // vertices that are kept for ever, the first ones of the mesh
    int rest_count;         // vertices: the first `start` of the mesh, then corners in void
    int *rest_id;           // [rest_count]; NULL: it starts as the mesh
    unsigned char *divided; // [element of the cut lattice] as in CutLattice
} VoxelMaking;

// Stiffness of an element, and the time step that it requires.
typedef struct ElementBounds {
    double lambda;  // of M^-1 K [1/s2]
    double damping; // of M^-1 C, per unit of beta [1/s2]
    double step;    // critical step of a plain cube [s]
} ElementBounds;

// Returns the bounds and the class of a cube of this edge [m] and shape. Its damping is that for
// beta = 1 s.
ElementBounds stiffness_of_element(VoxelLaw law, const SolidMaterial *material, double edge,
                                   const Template *shape, ElementClass *out);

#endif
