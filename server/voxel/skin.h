// SPDX-License-Identifier: MIT
// A display surface finer than the elements: a triangle mesh whose nodes are interpolated from the
// element in or next to which they are at rest. Computed when positions are published; the step
// does not use it.
#ifndef PLIANT_VOXEL_SKIN_H
#define PLIANT_VOXEL_SKIN_H

#include "base/check.h"
#include "base/memory.h"
#include "body/body.h"
#include "body/rows.h"
#include "geometry/mesh.h"
#include "voxel/lattice_mesh.h"

typedef struct Skin Skin;

// Fills body->mesh with the skin's mesh; ids are those of its file. Allocates from the arena. NULL
// with a status when a node is farther than SKIN_REACH cells from every element, which indicates a
// wrong scale or position.
enum { SKIN_REACH = 4 };
Skin *skin_create(Body *body, const TriMesh *mesh, const Lattice *lattice, const Layout *layout,
                  const LatticeMesh *elements, const Rows *rows, Arena *arena, Status *status);
// Writes the positions [m] and, unless NULL, velocities [m/s] of all nodes. Step thread.
void skin_snapshot(const Skin *skin, const Rows *rows, const void *row, float *position,
                   float *velocity);
// Returns the vertex that a node follows most.
int skin_vertex(const Skin *skin, int node);
int skin_node_count(const Skin *skin);
// Writes their rest positions [m].
void skin_snapshot_rest(const Skin *skin, const Rows *rows, float *position);

#endif
