// Voxel bodies: solid organs as elements that pull their vertices towards a rotated reference
// shape, small at the surface and large inside (Miyazaki et al. 2004).
#ifndef PLIANT_VOXEL_VOXEL_H
#define PLIANT_VOXEL_VOXEL_H

#include "base/arena.h"
#include "base/precision.h"
#include "base/state.h"
#include "base/status.h"
#include "base/team.h"
#include "dynamics/body.h"
#include "dynamics/fixed.h"
#include "geometry/lattice.h"
#include "geometry/mesh.h"
#include "voxel/element.h"

typedef struct VoxelMaterial {
    double youngs_modulus; // E [Pa]
    double poisson_ratio;  // nu, [0, 0.49]; 0 with VOXEL_MIYAZAKI2004
    double density;        // rho [kg/m3]
} VoxelMaterial;

typedef struct VoxelOptions {
    const char *name;
    const Lattice *lattice; // not needed after creation
    int dimensions;         // 3, or 2: the plane case
    int levels;             // coarsest level of elements, [0, VOXEL_LEVELS_MAX] (layout.h)
    VoxelLaw law;
    int material_count;
    const VoxelMaterial *material; // [material_count] by label - 1
    double damping;                // beta as a multiple of the body's critical step dt0
    IntegratorKind integrator;     // symplectic_euler or leapfrog
    Precision precision;
    double time_step; // [s]; 0: from the stability bound
    bool unsafe_time_step;
    int fixed_count;
    const FixedRegion *fixed; // nodes: indices of lattice points
    // Initial state by ascending vertex id [m], [m/s], or NULL: at rest.
    int initial_count;
    const Vec3 *initial_position, *initial_velocity;
    Vec3 gravity;
    double contact_ratio, contact_damping, friction; // see dynamics/body.h
    bool without_contacts;                           // tools cannot touch it
    bool without_loads;                              // loads cannot act on it
    bool publish_all;                                // also inner vertices
    bool cuttable;       // blades can cut it; otherwise the rest of this group is ignored
    int split_budget;    // elements divided per tick
    double tear_stress;  // strength of the tissue [Pa]; 0: no tearing by stress
    double tear_force;   // the paper's threshold on the external force on a vertex [N]; 0: none
    int vertex_capacity; // most vertices and outer triangles; 0: enough for a fully divided body
    int face_capacity;
    const TriMesh *skin; // display surface in place of the outer faces, or NULL
    const char *isa;     // "auto" or a name of isa.h
    Team *team;          // shares the elements of large bodies; NULL: one thread; outlives the body
} VoxelOptions;

// Builds a body in space; one in the plane is made by plane_create. Allocates from `arena` and adds
// its arrays to `state`. False with `status` if the options do not fit.
bool voxel_create(Body *body, const VoxelOptions *options, Arena *arena, StateList *state,
                  Status *status);

// Returns the critical step dt0 of a cube of this material [s], h sqrt(rho (1 - 2 nu) / E)
// (README.md, "Critical time step").
double voxel_critical_step(const VoxelMaterial *material, double size);

#endif
