// Makes the nodes of a closed mesh even on a smooth surface. Load time only, private to geometry.
#ifndef PLIANT_GEOMETRY_RELAX_H
#define PLIANT_GEOMETRY_RELAX_H

#include "geometry/mesh.h"

// The point of a surface that belongs to x, a point near it.
typedef Vec3 (*RelaxProject)(Vec3 x);

// Turns edges until no two triangles would be better shaped with the other diagonal, then `sweeps`
// times lets nodes push each other apart along the surface and turns edges again. The mesh must be
// closed and valid; node and triangle counts stay.
void relax_mesh(TriMesh *mesh, RelaxProject project, int sweeps);

// Sweeps that a mesh of so many nodes gets: many for a small one, few for a large one, so that the
// time stays bounded; the even spiral that generators start from needs little.
int relax_sweeps(int node_count);

#endif
