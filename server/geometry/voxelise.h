// Conversion of closed triangle meshes to lattices.
#ifndef PLIANT_GEOMETRY_VOXELISE_H
#define PLIANT_GEOMETRY_VOXELISE_H

#include "geometry/lattice.h"
#include "geometry/mesh.h"

// Fills a lattice with the cells of edge `size` [m] whose centre lies inside the closed mesh, by
// the parity of crossings along a line in x. Void margins are cropped. The lattice axes are the
// world's; before cropping, the boxes of mesh and lattice have the same middle. The orientation of
// triangles has no effect: a shell within a shell is a cavity, and the overlap of two parts is
// void. Rows exactly through an edge or a corner are decided as if moved by an infinitesimal step
// in y and z, so that parts with common faces divide the cells between them without gap or overlap.
// False with a status: a mesh with borders, nothing inside, or too many cells (with the size that
// would fit).
bool voxelise(Lattice *lattice, const TriMesh *mesh, double size, Status *status);

#endif
