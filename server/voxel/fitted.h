// SPDX-License-Identifier: MIT
// The smooth surface of a voxel body (README.md, "A smooth surface"): where its outer points are
// shown, and how that follows from its vertices. Load time, unless noted.
#ifndef PLIANT_VOXEL_FITTED_H
#define PLIANT_VOXEL_FITTED_H

#include "body/fit.h"
#include "geometry/surface_field.h"
#include "voxel/lattice_mesh.h"

// Largest component of an offset, and that along an axis on which the solid is one cell thick, in
// cells. With more, triangles fold.
#define FITTED_LIMIT      0.45
#define FITTED_LIMIT_THIN 0.25
#define FITTED_REACH      (1.7320508 * FITTED_LIMIT)

// A point moves by one step towards the zero level of a field; `level` is subtracted from the
// field. Any thread.
void fitted_step(const SurfaceField *field, double level, const double point[3], double offset[3],
                 const double limit[3]);

// Finds the offsets of the outer vertices from their lattice points in cells: [surface_count],
// malloc'ed. Vertices of one point have the same. Sets the value of the field's level that keeps
// the volume.
float (*fitted_offsets(const LatticeMesh *mesh, const Layout *layout, const SurfaceField *field,
                       double *level))[3];

// True if the diagonal between corners 1 and 3 divides a square better than that between 0 and 2.
// `corner`: their places, counter-clockwise; from either side of a square the answer is the same if
// `reversed` tells which it is. Any thread.
bool fitted_turns_diagonal(const double corner[4][3], bool reversed);
// Corners of a square that its two triangles have.
extern const int FITTED_TRIANGLES[2][2][3]; // [turned][half][corner]

#endif
