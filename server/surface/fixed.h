// Which nodes of a surface body the scene holds.
#ifndef PLIANT_SURFACE_FIXED_H
#define PLIANT_SURFACE_FIXED_H

#include "surface/surface.h"

// Sets fixed[] (zeroed; one for each node of `mesh`, or of the finest level of options->hierarchy,
// whose nodes all have their entry). Regions take nodes of level 0; a midpoint is held when both
// its parents are. False with `status` for nodes that the mesh does not have.
bool fixed_mark(const TriMesh *mesh, const SurfaceOptions *options, bool *fixed, Status *status);

#endif
