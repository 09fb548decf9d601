// SPDX-License-Identifier: MIT
// Voxel bodies with dimensions = 2: the plane case of Miyazaki et al. 2004, a horizontal sheet one
// cell thick. Its vertices stay in its middle plane: forces, gravity and loads act with their x and
// y components only. Tools act through their cross-section there: they touch the outline as a strip
// as high as the sheet is thick. A small force on a ball along z remains (under 1 % of the force),
// because the two triangles of an edge are not mirror images.
#ifndef PLIANT_PLANE_H
#define PLIANT_PLANE_H

#include "base/check.h"
#include "base/memory.h"
#include "body/body.h"
#include "geometry/lattice.h"
#include "plane/shape.h"

typedef struct PlaneOptions {
    BodyOptions body;       // levels up to PLANE_LEVELS_MAX (mesh.h); integrator symplectic_euler
                            // or leapfrog; fixed nodes: vertex ids (mesh.h)
    const Lattice *lattice; // of one layer; not needed after creation
    PlaneLaw law;
    int material_count;
    const SolidMaterial *material; // [material_count] by label - 1
    double damping;                // beta as a multiple of the body's critical step dt0
    double drag;                   // on the vertices, per mass [1/s]
    double tear_force; // if it can be cut: the paper's threshold on the external force on a vertex
                       // [N]; 0: no tearing
} PlaneOptions;

// Builds a body. Allocates from `arena` and adds its arrays to `state`. False with `status`:
// lattices of more than one layer and those rotated about another axis than z, integrators other
// than kicks, and options that do not fit. Tools and loads act on nodes of the strip, two for each
// vertex of the outline.
bool plane_create(Body *body, const PlaneOptions *options, Arena *arena, StateList *state,
                  Status *status);

#endif
