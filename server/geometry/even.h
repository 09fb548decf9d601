// SPDX-License-Identifier: MIT
// What makes the meshes of the generators even: triangles between points, and nodes that are spread
// over a surface. Load time only, private to geometry.
#ifndef PLIANT_GEOMETRY_EVEN_H
#define PLIANT_GEOMETRY_EVEN_H

#include "base/vec.h"
#include "geometry/mesh.h"

#include <stdbool.h>

// --- hull ---
// Of points in convex position (every point is a corner), such as points on a sphere.

// Writes the 2 count - 4 triangles of the hull, outward. The points are distinct, of size about 1
// and not all in one plane; count >= 4. Four points coplanar within rounding get either diagonal.
// False, with undefined triangles, if some point is not a corner of the hull.
bool hull_triangulate(const Vec3 *point, int count, int (*triangle)[3]);

// --- relaxation of a closed mesh on a smooth surface ---

// Returns the point of the surface that belongs to x, a point near it.
typedef Vec3 (*RelaxProject)(Vec3 x);

// Turns edges until the other diagonal improves no pair of triangles; then, `sweeps` times, moves
// nodes apart along the surface and turns edges again. The mesh must be closed and valid; the
// numbers of nodes and triangles do not change.
void relax_mesh(TriMesh *mesh, RelaxProject project, int sweeps);

// Returns the number of sweeps for a mesh: many for a small one, few for a large one, which bounds
// the time. The even spiral from which generators start needs few.
int relax_sweeps(int node_count);

#endif
