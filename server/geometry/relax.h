// Spreads the nodes of a closed mesh evenly over a smooth surface. Load time only, private to
// geometry.
#ifndef PLIANT_GEOMETRY_RELAX_H
#define PLIANT_GEOMETRY_RELAX_H

#include "geometry/mesh.h"

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
