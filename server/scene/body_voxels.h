// The lattice of a voxel body as the scene describes it, and its placement in the world.
#ifndef PLIANT_SCENE_BODY_VOXELS_H
#define PLIANT_SCENE_BODY_VOXELS_H

#include "base/status.h"
#include "scene/voxel_source.h"

// Imports a volume or a mesh, or generates the lattice, and places it. Keeps cells that share no
// face with the others, with a warning. Returns false with a `status` that names the file and the
// fault; if true, the lattice belongs to the caller.
bool body_voxels_make(const VoxelSource *source, Lattice *lattice, Status *status);

#endif
