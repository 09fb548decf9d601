// From closed triangle meshes to lattices.
#ifndef PLIANT_GEOMETRY_VOXELISE_H
#define PLIANT_GEOMETRY_VOXELISE_H

#include "geometry/lattice.h"
#include "geometry/mesh.h"

// Cells of edge `size` [m] whose centre lies inside the closed, outward-oriented mesh, by the
// parity of crossings along a line in x, all void around cropped; lattice axes are the world's.
// Rows that would pass exactly through an edge or a corner are decided as if moved by an
// infinitesimal step in y and z, so that neighbours agree. False with a status: mesh with borders,
// nothing inside, too many cells.
bool voxelise(Lattice *lattice, const TriMesh *mesh, double size, Status *status);

#endif
