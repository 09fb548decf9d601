// Private to the voxel module: one element's part of a local stiffness (patch.c). Step thread.
#ifndef PLIANT_VOXEL_PATCH_H
#define PLIANT_VOXEL_PATCH_H

#include "dynamics/patch.h"
#include "dynamics/vertices.h"
#include "voxel/kernel.h"
#include "voxel/template.h"

// An element with the kernels' numbers, in double precision.
typedef struct PatchElement {
    int count;
    int vertex[NODE_COUNT];
    Vec3 g[NODE_COUNT];          // [1/m]
    Vec3 place[NODE_COUNT];      // X, in edge lengths
    Vec3 lever[NODE_COUNT];      // w M^-1 X, likewise
    double weight[NODE_COUNT];   // w
    double mu, lambda, residual; // V mu, V lambda [N m]; r [N/m]
} PatchElement;

enum { PATCH_SKIPPED = 4, PATCH_ADDED = 128 }; // of the budget: per element

// Adds one vertex with the numbers of its row of a RestTable; returns its part of tr M.
double patch_add_row(VoxelLaw law, const ElementClass *by, const double row[TABLE_ROW], int vertex,
                     PatchElement *piece);
// Sets the parameters of a class with the current scales; damping, which acts on all non-rigid
// motion, is treated like Miyazaki's law. `spread` is tr M in edge lengths squared.
void patch_set_factors(const Vertices *vertices, VoxelLaw law, Patch *patch, const ElementClass *by,
                       double spread, PatchElement *piece);
// Adds the element's stiffness to the patch. `last` as in VoxelPass.
void patch_add_element(const Vertices *vertices, Patch *patch, const PatchElement *piece,
                       const double last[4]);

#endif
