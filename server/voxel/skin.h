// A display surface finer than the elements: a triangle mesh whose nodes are carried by the element
// in or beside which they lie at rest. Interpolated when positions are published; nothing in the
// step knows of it.
#ifndef PLIANT_VOXEL_SKIN_H
#define PLIANT_VOXEL_SKIN_H

#include "base/arena.h"
#include "base/status.h"
#include "dynamics/body.h"
#include "dynamics/rows.h"
#include "geometry/mesh.h"
#include "voxel/lattice_mesh.h"

typedef struct Skin Skin;

// Fills body->mesh with the skin's mesh; ids are those of its file. NULL with a status when a node
// lies farther than SKIN_REACH cells from every element, which is a mistake of scale or place.
enum { SKIN_REACH = 4 };
Skin *skin_create(Body *body, const TriMesh *mesh, const Lattice *lattice, const Layout *layout,
                  const LatticeMesh *elements, const Rows *rows, Arena *arena, Status *status);
// Positions [m] and, unless NULL, velocities [m/s] of all its nodes. Step thread.
void skin_snapshot(const Skin *skin, const Rows *rows, const void *row, float *position,
                   float *velocity);
// Where they are at rest [m].
void skin_snapshot_rest(const Skin *skin, const Rows *rows, float *position);

#endif
