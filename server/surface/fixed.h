// Marks the nodes of a surface body that the scene fixes.
#ifndef PLIANT_SURFACE_FIXED_H
#define PLIANT_SURFACE_FIXED_H

#include "surface/surface.h"

// Sets fixed[] (zeroed; one entry per node of `mesh`, or of the finest level of
// options->hierarchy). Regions select nodes of level 0; a midpoint is fixed when both its parents
// are. False with `status` if a region names nodes that the mesh does not have.
bool fixed_mark(const TriMesh *mesh, const SurfaceOptions *options, bool *fixed, Status *status);

#endif
