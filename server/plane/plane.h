// Voxel bodies with dimensions = 2: the plane case of Miyazaki et al. 2004, a horizontal sheet one
// cell thick. Its vertices stay in its middle plane: forces, gravity and loads act with their x and
// y components only. Tools act through their cross-section there: they touch the outline as a strip
// as high as the sheet is thick. A small force on a ball along z remains (under 1 % of the force),
// because the two triangles of an edge are not mirror images.
#ifndef PLIANT_PLANE_H
#define PLIANT_PLANE_H

#include "voxel/voxel.h"

// Creates a plane body, with the contract of voxel_create. Refuses lattices of more
// than one layer and those rotated about another axis than z, skins, and integrators other than
// kicks. Fixed nodes are vertex ids (mesh.h); tools and loads act on nodes of the strip, two
// for each vertex of the outline.
bool plane_create(Body *body, const VoxelOptions *options, Arena *arena, StateList *state,
                  Status *status);

#endif
