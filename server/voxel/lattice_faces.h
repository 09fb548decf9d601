// The outer faces of a lattice mesh; part of lattice_mesh.c.
#ifndef PLIANT_VOXEL_LATTICE_FACES_H
#define PLIANT_VOXEL_LATTICE_FACES_H

#include "voxel/lattice_mesh.h"

// Fills the face arrays of a mesh whose vertices are there.
void lattice_faces_create(LatticeMesh *mesh, const Layout *layout);

#endif
