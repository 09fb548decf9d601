// SPDX-License-Identifier: MIT
// Voxel bodies: solid organs as elements that pull their vertices towards a rotated reference
// shape, small at the surface and large inside (Miyazaki et al. 2004).
#ifndef PLIANT_VOXEL_VOXEL_H
#define PLIANT_VOXEL_VOXEL_H

#include "base/check.h"
#include "base/memory.h"
#include "body/body.h"
#include "body/maxwell.h"
#include "body/stiffening.h"
#include "geometry/lattice.h"
#include "geometry/mesh.h"
#include "geometry/surface_field.h"
#include "voxel/element.h"

// A mass that hangs on the vertices in a region, each of which has the same share of it.
typedef struct HungMass {
    FixedRegion region;
    double mass; // [kg]
} HungMass;

// A ball in which the elements of a body that adapts are the finest, always.
typedef struct FineRegion {
    Vec3 centre;   // [m]
    double radius; // [m]
} FineRegion;

// Coagulated tissue is several times as stiff (Bharat et al. 2005, Ultrasound Med. Biol. 31, 415).
#define HEAT_STIFFER 4.0

typedef struct VoxelOptions {
    BodyOptions body;       // levels up to VOXEL_LEVELS_MAX (layout.h); integrator symplectic_euler
                            // or leapfrog; fixed nodes: indices of lattice points
    const Lattice *lattice; // not needed after creation
    VoxelLaw law;
    int material_count;
    const SolidMaterial *material; // [material_count] by label - 1
    const char *const *tissue;     // [material_count] their names, or NULL: that of the body
    double damping;                // beta as a multiple of the body's critical step dt0, or 0 and
    double damping_time;           // beta [s], of damping in proportion to the stiffness
    double drag;                   // on the vertices, per mass [1/s]
    int branch_count;              // affine law: what relaxes
    MaxwellBranch branch[MAXWELL_BRANCHES];
    Stiffening stiffening; // affine law
    int weight_count;      // of a body that cannot be cut
    const HungMass *weight;
    bool publish_all; // also inner vertices
    // Coarsest level of elements at the surface while nothing is near; body.levels is that of inner
    // ones. 0: the body does not adapt, its surface is of the finest elements always.
    int surface_level;
    // Of a body that adapts: the coarsest level at the surface by cell of the lattice
    // (thickness.h); NULL: surface_level.
    const unsigned char *coarsest;
    int fine_count;
    const FineRegion *fine;
    // If it can be cut:
    int split_budget;            // elements divided per tick
    double tear_stress;          // strength of the tissue [Pa]; 0: no tearing by stress
    bool heats;                  // diathermy can act on it (cut/cut_heat.h)
    double coagulated_stiffness; // of what it coagulates, over that before; from 1 on
    double tear_force;   // the paper's threshold on the external force on a vertex [N]; 0: none
    double tick;         // [s]; of a body that has a field
    const TriMesh *skin; // display surface in place of the outer faces, or NULL
    const SurfaceField *field; // outer faces are published as its smooth surface; NULL: as they are
} VoxelOptions;

// True if the elements of a body can change: it is stored as one that can be cut.
static inline bool voxel_changes(const VoxelOptions *options)
{
    return options->body.cuttable || options->surface_level > 0;
}

// Builds a body. Allocates from `arena` and adds
// its arrays to `state`. False with `status` if the options do not fit.
bool voxel_create(Body *body, const VoxelOptions *options, Arena *arena, StateList *state,
                  Status *status);

// Returns the critical step dt0 of a cube of this material [s], h sqrt(rho (1 - 2 nu) / E)
// (README.md, "Critical time step").
double voxel_critical_step(const SolidMaterial *material, double size);

#endif
