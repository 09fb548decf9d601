// Voxel bodies with dimensions = 2: the plane case of Miyazaki et al. 2004, a horizontal sheet one
// cell thick. Its vertices stay in its middle plane: forces, gravity and loads act with their x and
// y components, z is left out. Tools act by their section there: what they meet is the outline as a
// strip as high as the sheet is thick. What a ball feels along z is not exactly nothing (under 1 %
// of its force): the two triangles of an edge do not mirror each other.
#ifndef PLIANT_VOXEL_PLANE_PLANE_H
#define PLIANT_VOXEL_PLANE_PLANE_H

#include "voxel/voxel.h"

// As voxel_create, which calls it. Refuses lattices of more than one layer and those turned about
// another axis than z, skins, and integrators other than kicks. Fixed nodes are vertex ids
// (plane_mesh.h); what tools and loads meet are nodes of the strip, two for each vertex of the
// outline.
bool plane_create(Body *body, const VoxelOptions *options, Arena *arena, StateList *state,
                  Status *status);

#endif
