// SPDX-License-Identifier: MIT
// What a voxel body has to publish its smooth surface (fitted.h): the vertices that the nodes
// follow from. Nodes stay those of the outer faces.
#ifndef PLIANT_VOXEL_FITTED_BODY_H
#define PLIANT_VOXEL_FITTED_BODY_H

#include "body/body.h"
#include "voxel/fitted.h"
#include "voxel/model.h"

typedef struct FittedBody {
    BodyFit fit;                // also that of body->mesh
    const int *vertex;          // [row]
    const int (*around)[8];     // [node] the cells around its point, by octant; -1: none. NULL: the
                                // body can be cut
    double size;                // edge of a cell [m]
    float *position, *velocity; // for snapshots: of rows
    double *scratch;
} FittedBody;

// Load time. Makes the published mesh of the outer faces smooth: after voxel_create_mesh.
void fitted_create(VoxelModel *model, Body *body, const LatticeMesh *mesh, const Layout *layout,
                   const VoxelOptions *options, Arena *arena);
// Load time: the memory of snapshots.
void fitted_reserve(FittedBody *fitted, const char *name, Arena *arena);

// BodyOps.fit_node of a body that cannot be cut.
void fitted_node(const FittedBody *fitted, const Rows *rows, int node, FitNode *out);
// BodyOps.snapshot_rows, .snapshot of `position` and `velocity`, which are these rows, as if all
// fades had ended, and .snapshot_rest.
void fitted_snapshot_rows(const FittedBody *fitted, const Rows *rows, const void *row,
                          float *position, float *velocity);
void fitted_snapshot(const FittedBody *fitted, int node_count, float *position, float *velocity);
void fitted_snapshot_rest(const FittedBody *fitted, const Rows *rows, int node_count,
                          float *position);

#endif
