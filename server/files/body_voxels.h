// The lattice that a scene asks for, where the body stands in the world.
#ifndef PLIANT_FILES_BODY_VOXELS_H
#define PLIANT_FILES_BODY_VOXELS_H

#include "files/voxel_source.h"
#include "geometry/lattice.h"

// Generates the cells, or reads them from the volume or mesh, and places them. False with `status`;
// the lattice belongs to the caller in any case.
bool body_voxels_make(const VoxelSource *source, Lattice *lattice, Status *status);

#endif
