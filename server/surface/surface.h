// Surface bodies: hollow organs as triangle mass-spring meshes with shape-preserving springs
// (Choi et al. 2005), at one level of detail or at several.
#ifndef PLIANT_SURFACE_SURFACE_H
#define PLIANT_SURFACE_SURFACE_H

#include "base/arena.h"
#include "base/precision.h"
#include "base/state.h"
#include "base/status.h"
#include "base/team.h"
#include "dynamics/body.h"
#include "dynamics/fixed.h"
#include "geometry/levels.h"
#include "geometry/mesh.h"

// Material in physical units, or the paper's uniform values.
typedef struct SurfaceMaterial {
    bool uniform;
    // physical: k_e = E2D (A_1 + A_2)/L^2 (Van Gelder 1998), m_i = rho_A A_i, k_d = damping_time
    // k_e
    double youngs_modulus_2d; // E2D [N/m]
    double areal_density;     // rho_A [kg/m2]
    double damping_time;      // beta [s]
    // uniform: the same for every spring and node
    double spring_stiffness; // k_s [N/m]
    double spring_damping;   // k_d [N s/m]
    double node_mass;        // [kg]
    // both: gamma of eq 1, the same for every node
    double node_damping; // [N s/m]
} SurfaceMaterial;

typedef enum ShapeFrame { SHAPE_WORLD, SHAPE_BODY } ShapeFrame;

// Shape-preserving springs (eq 10, damping on the full velocity vector).
typedef struct SurfaceShape {
    bool wanted;
    bool per_node; // stiffness and damping given for each node instead of angular_frequency
    double angular_frequency; // w_s [rad/s]: k'_s = m w_s^2
    double damping_ratio;     // z_s: k'_d = 2 z_s w_s m
    double stiffness;         // k'_s [N/m] a node
    double damping;           // k'_d [N s/m] a node
    ShapeFrame frame;         // where the virtual nodes live
} SurfaceShape;

// How the properties of springs and nodes follow the level of detail (level_rules.h).
typedef enum SurfaceAdjust { ADJUST_CONTINUUM, ADJUST_CHOI2005 } SurfaceAdjust;

// When a body refines: each is the value at which the criterion asks for the next level (surface.md
// section 6).
typedef struct SurfaceAdapt {
    double force; // traction on a node times the edge length of its level, over E2D
    double speed; // of a node against the body's rigid motion, over the speed of waves times 2^l
    double curvature; // change of the angle between two faces [rad]
    double check_hz;  // how often all faces are looked at
} SurfaceAdapt;

// The theta method (implicit.h); zeros: the defaults.
typedef struct SurfaceImplicit {
    double theta;     // [0.5, 1]: share of the step's end in the forces; 1: backward Euler
    double tolerance; // at which the linear system counts as solved, relative
    int iterations;   // at most
} SurfaceImplicit;

// From so many substeps of leapfrog on the implicit method is chosen: a tick of it costs as much as
// 17 to 110 of them (tests/bench, `implicit`), by stiffness and size.
enum { SURFACE_AUTO_SUBSTEPS = 64 };

typedef struct SurfaceOptions {
    const char *name;
    SurfaceMaterial material;
    SurfaceShape shape;
    int levels;                       // finest level of detail; 0: the mesh and nothing finer
    int start_level;                  // in [0, levels]
    SurfaceAdjust adjust;             // of no effect with levels = 0
    bool adaptive;                    // refines and coarsens; else it stays at start_level
    SurfaceAdapt adapt;               // if adaptive
    bool cuttable;                    // blades can cut it
    double tear_stretch;              // of a bond, at which it breaks; 0: it does not tear
    int node_capacity, face_capacity; // most that may be in use at a time; 0: what levels can give
    const Levels *hierarchy;          // of the mesh, `levels` deep; NULL with levels = 0, unless
                                      // the body is cuttable
    double prestress;                 // rest lengths shortened by this fraction, [0, 0.9]
    IntegratorKind integrator;
    SurfaceImplicit implicit;
    // Leapfrog where the bound of the body's springs asks for at most SURFACE_AUTO_SUBSTEPS in
    // `tick` [s], else implicit; `integrator` is not looked at.
    bool automatic;
    double tick;         // if automatic
    Precision precision; // of the kernels: single is for speed, double is the reference; implicit
                         // bodies are double always
    double time_step;    // [s]; 0: from the stability bound
    bool unsafe_time_step;
    int fixed_count;
    const FixedRegion *fixed;
    // initial state in mesh order [node_count], or NULL: at rest
    const Vec3 *initial_position, *initial_velocity;
    Vec3 gravity;
    double contact_ratio, contact_damping, friction; // see dynamics/body.h
    bool without_contacts; // nothing can touch or hold it: no arrays for such forces
    bool without_loads;    // no load can act on it either: no array for outside forces
    const char *isa;       // "auto" or a level of surface_isa_*
    Team *team;            // shares the evaluation of forces; NULL: one thread; outlives the body
} SurfaceOptions;

// Whether faces of the body come and go: it is built from level 0 and keeps the hierarchy.
static inline bool surface_changes(const SurfaceOptions *options)
{
    return options->adaptive || options->cuttable;
}

// Builds a body from a valid mesh (mesh_validate); with levels, from that of start_level
// (levels_mesh), and the hierarchy is needed no longer afterwards; unless it changes. Initial rows
// are those of this mesh. Allocates from `arena`, lists its state. Warnings (a clamped damping) go
// to the log. False with `status`: what does not fit the options.
bool surface_create(Body *body, const TriMesh *mesh, const SurfaceOptions *options, Arena *arena,
                    StateList *state, Status *status);

// Double-precision readers for checkpoints and tests: [node_count] in mesh order.
void surface_read_state(const Body *body, Vec3 *position, Vec3 *velocity);

#endif
