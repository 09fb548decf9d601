// SPDX-License-Identifier: MIT
// Surface bodies: hollow organs as triangle mass-spring meshes with shape-preserving springs (Choi
// et al. 2005), with one or several levels of detail.
#ifndef PLIANT_SURFACE_SURFACE_H
#define PLIANT_SURFACE_SURFACE_H

#include "base/check.h"
#include "base/memory.h"
#include "body/body.h"
#include "body/maxwell.h"
#include "body/stiffening.h"
#include "geometry/levels.h"
#include "geometry/mesh.h"

// Material in physical units, or the uniform values of the paper.
typedef struct SurfaceMaterial {
    bool uniform;
    // physical: k_e = E2D (A_1 + A_2)/L^2 (Van Gelder 1998), m_i = rho_A A_i, k_d = damping_time
    // k_e
    double youngs_modulus_2d; // E2D [N/m]
    double areal_density;     // rho_A [kg/m2]
    double damping_time;      // beta [s]
    double thickness;         // t of the wall, for its bending [m]; 0: none
    // uniform: the same for every spring and node
    double spring_stiffness; // k_s [N/m]
    double spring_damping;   // k_d [N s/m]
    double node_mass;        // [kg]
    // both: gamma of eq 1, the same for every node
    double node_damping; // [N s/m]
    // both: D, instead of a thickness; adjust = "continuum" only (bending.h)
    double bending_stiffness; // [N m]; 0: none
    // both: what relaxes of the springs; explicit steps of kicks only (law.h)
    int branch_count;
    MaxwellBranch branch[MAXWELL_BRANCHES];
    double loss_factor; // that the branches follow from; 0: given themselves
    Stiffening stiffening;
} SurfaceMaterial;

typedef enum ShapeFrame { SHAPE_WORLD, SHAPE_BODY } ShapeFrame;

// The part of a node's velocity that its shape spring damps: all of it, or only the part along the
// spring, as eq 10 is printed; then nothing slows a node that circles around its rest position.
typedef enum ShapeDamping { SHAPE_DAMPS_ALL, SHAPE_DAMPS_RADIAL } ShapeDamping;

// Shape-preserving springs (eq 10).
typedef struct SurfaceShape {
    bool wanted;
    bool per_node;            // stiffness and damping given per node instead of angular_frequency
    double angular_frequency; // w_s [rad/s]: k'_s = m w_s^2
    double damping_ratio;     // z_s: k'_d = 2 z_s w_s m
    double stiffness;         // k'_s per node [N/m]
    double damping;           // k'_d per node [N s/m]
    ShapeFrame frame;         // frame of the virtual nodes
    ShapeDamping direction;   // SHAPE_DAMPS_RADIAL: in the world's frame, explicit steps only
} SurfaceShape;

// What a closed wall encloses (cavity.h): a gas, a fluid, or else a constant pressure.
typedef struct SurfaceCavity {
    bool wanted, gas, fluid;
    double pressure;     // above that outside, at rest [Pa]
    double ambient;      // outside, of a gas [Pa]
    double bulk_modulus; // of a fluid [Pa]; 0: as stiff as doubles the bound of the springs
    double density;      // of what leaks [kg/m3]; 0: that of air or water
} SurfaceCavity;

// How the properties of springs and nodes depend on the level of detail (network.h).
typedef enum SurfaceAdjust { ADJUST_CONTINUUM, ADJUST_CHOI2005 } SurfaceAdjust;

// Refinement criteria: each value is where the criterion requires the next level (detail/README.md,
// "Refinement criteria").
typedef struct SurfaceAdapt {
    double force; // traction on a node times the edge length of its level, over E2D
    double speed; // of a node relative to the body's rigid motion, over the wave speed times 2^l
    double curvature; // change of the angle between two faces [rad]
    double check_hz;  // how often all faces are examined [Hz]
    int coarsest;     // no face is merged into one of a level below; start_level is at least that
    double error;     // BodyOptions.adapt_error
} SurfaceAdapt;

// The theta method (implicit.h); zeros select the defaults.
typedef struct SurfaceImplicit {
    double theta;     // weight of the step's end in the forces, in [0.5, 1]; 1: backward Euler
    double tolerance; // relative residual at which the linear system counts as solved
    int iterations;   // at most
} SurfaceImplicit;

// Returns the most leapfrog substeps per tick that take no longer than an implicit tick of the same
// mesh, estimated from counts alone: the same on every machine. `iterations`: at most, of the
// linear solver; 0: its default.
int surface_auto_substeps(int springs, int nodes, int iterations);

typedef struct SurfaceOptions {
    BodyOptions body; // implicit bodies always use double precision
    SurfaceMaterial material;
    SurfaceShape shape;
    SurfaceCavity cavity;
    int start_level;         // in [0, levels]
    SurfaceAdjust adjust;    // no effect with levels = 0
    bool adaptive;           // refines and coarsens; else it stays at start_level
    SurfaceAdapt adapt;      // if adaptive
    bool heats;              // diathermy can act on it, if it can be cut
    double tear_stretch;     // stretch of a bond at which it breaks; 0: no tearing
    const Levels *hierarchy; // of the mesh, `levels` deep; NULL with levels = 0, unless the body is
                             // cuttable
    double prestress;        // rest lengths shortened by this fraction, [0, 0.9]
    SurfaceImplicit implicit;
    // Leapfrog where the bound of the springs requires at most surface_auto_substeps per `tick`
    // [s], else implicit; `integrator` is ignored.
    bool automatic;
    double tick; // if automatic
} SurfaceOptions;

// False if the integrator does not know the springs' law: the key of the material, and what it
// needs.
bool surface_law_fits(const SurfaceOptions *options, const char **key, const char **needs);

// True if faces of the body are created and removed: it is built from level 0 and keeps the
// hierarchy.
static inline bool surface_changes(const SurfaceOptions *options)
{
    return options->adaptive || options->body.cuttable;
}

// Builds a body from a valid mesh (mesh_check); with levels from the mesh of start_level
// (levels_mesh). The hierarchy must outlive the body if surface_changes, otherwise only this call.
// Initial rows are those of this mesh. Allocates from `arena` and adds its arrays to `state`.
// Warnings (a clamped damping) go to the log. False with `status` if the options do not fit.
bool surface_create(Body *body, const TriMesh *mesh, const SurfaceOptions *options, Arena *arena,
                    StateList *state, Status *status);

#endif
