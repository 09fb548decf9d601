// Private to the plane body: its arrays. Constant after creation unless said.
//
// Vertices have rows of displacements (dynamics/rows.h) in the lattice's axes, with z = 0; one
// spare row at the end takes what the padding of batches writes. Forces gather in an array of their
// own, which contacts, loads and elements add to and which the advance of vertices clears.
#ifndef PLIANT_VOXEL_PLANE_PLANE_MODEL_H
#define PLIANT_VOXEL_PLANE_PLANE_MODEL_H

#include "dynamics/rows.h"
#include "voxel/plane/plane.h"
#include "voxel/plane/plane_kernel.h"
#include "voxel/plane/plane_mesh.h"

// What SET can change; plain data, part of the state.
typedef struct PlaneParameters {
    double gravity[3]; // world [m/s2]; z is not used
    double stiffness_scale, damping_scale;
} PlaneParameters;

// For the energy.
typedef struct PlaneForm {
    const PlaneShape *shape;
    PlaneStiffness stiffness;
    double size;              // [m]
    int vertex[PLANE_PLACES]; // [shape->count]
} PlaneForm;

typedef struct PlaneModel {
    int vertex_count; // without the spare one
    int element_count;
    int element_at_level[VOXEL_LEVELS_MAX + 1];
    PlaneForm *form; // [element_count]
    PlaneBatches batches;
    VoxelLaw law;
    bool damped;
    const PlaneKernels *kernels;

    Rows rows;          // of vertex_count + 1
    double *mass;       // [vertex_count] of every vertex, fixed ones too [kg]
    void *inverse_mass; // Real [vertex_count + 1] [1/kg]; 0: fixed
    int *vertex;        // [vertex_count] all of them, in their order: what is published
    int *id;            // [vertex_count]

    // --- state: `current` says which of the two is the present one ---
    void *row[2]; // Real [vertex_count + 1][ROW]
    int current;
    const void *present; // rows to be evaluated next
    void *force;         // Real [vertex_count + 1][4]; zero between evaluations
    bool bad;            // the tick's last rows were out of bounds
    double position_limit;
    PlaneParameters *parameters; // part of the state

    // --- nodes of the strip: 2 k below and 2 k + 1 above the k-th vertex of the outline ---
    int node_count;
    int *node_vertex; // [node_count]
    double half;      // half the thickness [m]

    // --- constant loads; NULL: none can act ---
    double (*load)[2]; // [vertex_count] in the world [N]; part of the state
    int *loaded;       // [loaded_count] vertices that have one, ascending; follows from `load`
    int loaded_count;
} PlaneModel;

extern const BodyOps plane_ops;

// From the present loads: which vertices have one.
void plane_list_loads(PlaneModel *model);

// plane_batches.c. Load time: the batches of model->form.
void plane_create_batches(PlaneModel *model, const char *name, Arena *arena);
// plane_surface.c. Load time: what tools and loads meet, and what is published.
void plane_create_surface(PlaneModel *model, Body *body, const PlaneMesh *mesh,
                          const VoxelOptions *options, Arena *arena);
void plane_create_mesh(PlaneModel *model, Body *body, const PlaneMesh *mesh, const char *name,
                       Arena *arena);

#endif
