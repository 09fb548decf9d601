// SPDX-License-Identifier: MIT
// A field around a solid whose zero level is its smooth surface, positive inside: samples at every
// half cell of a lattice, linear between them. Made at load time from labels or a closed mesh.
#ifndef PLIANT_GEOMETRY_SURFACE_FIELD_H
#define PLIANT_GEOMETRY_SURFACE_FIELD_H

#include "geometry/lattice.h"

enum {
    FIELD_PARTS = 2,  // samples per cell and axis
    FIELD_MARGIN = 2, // cells around the lattice that have samples too
};

typedef struct SurfaceField {
    int count[3];  // samples along the lattice's axes
    double low[3]; // place of the first one, in cells from the lattice's low corner
    float *value;  // x fastest; malloc'ed, owned; NULL: no field
    double volume; // of the solid [cells]; 0: the zero level is right as it is
} SurfaceField;

// Blocks of voxels that are inside or not. Its axes are those of the lattice.
typedef struct SolidBlocks {
    int count[3];
    double low[3];               // low corner of the first voxel, in cells of the lattice
    double spacing[3];           // edges of a voxel [cells]
    const unsigned char *inside; // [z][y][x]
} SolidBlocks;

// Makes the field from blocks, smoothed by a Gaussian as wide as cells and voxels ask for. Its
// values are -0.5 to 0.5.
void surface_field_of_blocks(SurfaceField *field, const Lattice *lattice,
                             const SolidBlocks *blocks);
// Makes it from the lattice's own cells.
void surface_field_of_cells(SurfaceField *field, const Lattice *lattice);
// Makes it from the closed mesh that the lattice was made of (voxelise): the distance in cells, no
// farther than the field is needed. Of a mesh of too many cells: as from cells.
void surface_field_of_mesh(SurfaceField *field, const Lattice *lattice, const TriMesh *mesh);
void surface_field_destroy(SurfaceField *field);

// Returns the value at a place in cells from the lattice's low corner, and its gradient.
double surface_field_at(const SurfaceField *field, const double at[3], double gradient[3]);

#endif
