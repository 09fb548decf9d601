// Creation of bodies with levels, for surface_create.
#ifndef PLIANT_SURFACE_DETAIL_CREATE_H
#define PLIANT_SURFACE_DETAIL_CREATE_H

#include "geometry/winged_edge.h"
#include "surface/model.h"
#include "surface/network.h"

// Fills in a model, whose kernels, precision and damping are set, and its body, from the mesh of
// level 0 and options->hierarchy.
void detail_create(Body *body, SurfaceModel *model, const TriMesh *mesh, const WingedMesh *winged,
                   const SpringNetwork *network, const SurfaceOptions *options, Arena *arena,
                   StateList *state);

#endif
