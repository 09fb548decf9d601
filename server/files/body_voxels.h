// The lattice that a scene asks for, where the body stands in the world.
#ifndef PLIANT_FILES_BODY_VOXELS_H
#define PLIANT_FILES_BODY_VOXELS_H

#include "base/status.h"
#include "files/voxel_source.h"

// Imports a volume or a mesh, or generates, and places. Cells that no face joins to the others are
// kept and warned of. False with `status` naming the file and what is wrong; the lattice belongs to
// the caller when true.
bool body_voxels_make(const VoxelSource *source, Lattice *lattice, Status *status);

#endif
