// SPDX-License-Identifier: MIT
// What a voxel body does, a second time and in readable form: the same options, one element at a
// time by element.h in double precision, positions in the world, and the integrators written out.
// Nothing of batches, tables, kernels, rows or base frames.
#ifndef PLIANT_TESTS_VOXEL_REFERENCE_H
#define PLIANT_TESTS_VOXEL_REFERENCE_H

#include "voxel/element.h"
#include "voxel/template.h"
#include "voxel/voxel.h"

typedef struct ReferenceElement {
    Element rest; // of the arrays below
    Vec3 corner[NODE_COUNT], area[NODE_COUNT];
    double weight[NODE_COUNT];
    int vertex[NODE_COUNT]; // [rest.count]
    ElementStiffness stiffness;
    Quat last;
} ReferenceElement;

typedef struct VoxelReference {
    int element_count, vertex_count, surface_count;
    ReferenceElement *element;
    Vec3 *rest, *position, *velocity; // [vertex] in the world, in the order of the real body's
    Vec3 *force, *load;               // [vertex] [N]
    double *mass;                     // [vertex] [kg]
    bool *fixed;                      // [vertex]
    Vec3 gravity;                     // [m/s2]
    double stiffness_scale, damping_scale;
    IntegratorKind integrator;
    double critical_step; // the smallest dt0 of the elements [s]
} VoxelReference;

// Three dimensions, boxes and spheres as fixed regions; what is not of motion is ignored.
void voxel_reference_create(VoxelReference *reference, const VoxelOptions *options);
void voxel_reference_destroy(VoxelReference *reference);

// Sets `force` to that of the elements and loads; returns the elastic energy [J].
double voxel_reference_forces(VoxelReference *reference);
// `substeps` steps of h [s]: a tick.
void voxel_reference_tick(VoxelReference *reference, int substeps, double h);
// Elements whose F has no positive determinant.
int voxel_reference_inverted(const VoxelReference *reference);

#endif
