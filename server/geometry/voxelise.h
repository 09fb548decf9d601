// From closed triangle meshes to lattices.
#ifndef PLIANT_GEOMETRY_VOXELISE_H
#define PLIANT_GEOMETRY_VOXELISE_H

#include "geometry/lattice.h"
#include "geometry/mesh.h"

// Cells of edge `size` [m] whose centre lies inside the closed mesh, by the parity of crossings
// along a line in x, all void around cropped; lattice axes are the world's, and the box of the mesh
// and the lattice before it was cropped have the same middle. The orientation of triangles is
// nothing to it: a shell within a shell is a cavity, and where two parts overlap there is none.
// Rows that would pass exactly through an edge or a corner are decided as if moved by an
// infinitesimal step in y and z, so that neighbours agree and parts with common faces share out the
// cells between them. False with a status: mesh with borders, nothing inside, too many cells (and
// the size that would do).
bool voxelise(Lattice *lattice, const TriMesh *mesh, double size, Status *status);

#endif
