// Private to the voxel module: intermediate results of the creation of a body. Load time only.
#ifndef PLIANT_VOXEL_MAKING_H
#define PLIANT_VOXEL_MAKING_H

#include "dynamics/vertices.h"
#include "voxel/kernel.h"
#include "voxel/lattice_mesh.h"
#include "voxel/voxel.h"

typedef struct VoxelMaking {
    const VoxelOptions *options;
    const VoxelKernels *kernels;
    Layout layout;
    LatticeMesh mesh; // before any cut
    int capacity;     // most vertices; those of the mesh unless the body can be cut
    VertexId *by_id;  // [vertex_count]
    bool *fixed;      // [vertex_count]

    // --- elements ---
    ElementClass *classes; // [element_count]
    unsigned *mask;        // [element_count]
    double *density;       // [element_count] [kg/m3]
    double step;           // dt0: the smallest critical step of the elements [s]
    double lambda;         // bounds of M^-1 K and, per unit of beta, of M^-1 C [1/s2]
    double damping_lambda;
} VoxelMaking;

#endif
