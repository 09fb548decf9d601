// SPDX-License-Identifier: MIT
// One surface body in memory, ready to step, and the reference solver's twin of it.
#ifndef PLIANT_TESTS_FIXTURE_H
#define PLIANT_TESTS_FIXTURE_H

#include "sim/sim.h"
#include "reference.h"
#include "sim_steps.h"
#include "surface/model.h"
#include "surface/surface.h"

// Everything that a scene with one body "body" says. A zeroed one is: no springs' damping, no shape
// springs, 1 kHz, RK4, at rest.
typedef struct FixtureOptions {
    SurfaceMaterial material;
    SurfaceShape shape;
    SurfaceCavity cavity;
    double prestress;
    int levels, start_level;
    SurfaceAdjust adjust;
    IntegratorKind integrator;
    SurfaceImplicit implicit;
    bool automatic;      // integrator = "auto"
    Precision precision; // double when zeroed
    double time_step;    // 0: from the bound
    bool unsafe_time_step;
    double rate_hz; // 0: 1000
    Vec3 gravity;
    double settle_s;
    int fixed_count;
    const FixedRegion *fixed;
    const Vec3 *initial_position, *initial_velocity; // in the order of the body's nodes, or NULL
    bool may_load;
    int load_count;
    const LoadOptions *load;
    int tool_count;
    const ToolOptions *tool;
    const char *isa; // NULL: best
    Team *team;      // NULL: one thread
} FixtureOptions;

typedef struct Fixture {
    Arena arena;
    StateList state;
    TriMesh mesh; // of start_level
    Sim *sim;
    Body *body;
    Vec3 *x, *v; // [node_count], filled by fixture_read
} Fixture;

// E2D 80 N/m, rho 4.2 kg/m2, damping time as given [s].
SurfaceMaterial fixture_material(double damping_time);
// Shape springs of 50 rad/s and damping ratio 0.1.
SurfaceShape fixture_shape(ShapeFrame frame);

// Takes the mesh over (also when it fails). False with `status`.
bool fixture_try(Fixture *fixture, TriMesh *mesh, const FixtureOptions *options, Status *status);
// The same for what must not fail.
void fixture_create(Fixture *fixture, TriMesh *mesh, const FixtureOptions *options);
void fixture_destroy(Fixture *fixture);
// Positions and velocities after the last tick.
void fixture_read(Fixture *fixture);
void fixture_run(Fixture *fixture, int ticks);
SurfaceModel *fixture_model(const Fixture *fixture);
// Replaces positions and velocities of all nodes.
void fixture_write(Fixture *fixture, const Vec3 *x, const Vec3 *v);
// Forces on all nodes [N] of such a body at x, by one step that is too short to move anything.
// Takes the mesh over.
void fixture_forces(TriMesh *mesh, const FixtureOptions *like, const Vec3 *x, Vec3 *force);

// A damped sphere on shape springs, one kick per tick, that takes loads.
FixtureOptions fixture_loadable(void);
// A wall that bends and hardly stretches, so that nothing hides the hinges.
FixtureOptions fixture_hinged(double modulus);
// On a mesh that `make` makes, and on that of fixture_sphere.
void fixture_create_on(Fixture *fixture, void (*make)(TriMesh *), const FixtureOptions *options);
void fixture_create_sphere(Fixture *fixture, const FixtureOptions *options);
// Fails the test unless a sphere of such options is refused as invalid, in words that say that.
void fixture_expect_refusal(const FixtureOptions *options, const char *says);
// Takes every node of it for 10 ms; 0.3 N along x.
extern const LoadOptions fixture_everywhere;
// Of x and v as read.
Momentum fixture_momentum(const Fixture *fixture);
// Whether all numbers that fixture_read gave are finite.
bool fixture_is_finite(const Fixture *fixture);

// The same body for the reference: material, shape, gravity, prestress, fixed nodes and initial
// state; loads are the test's.
void fixture_reference(const Fixture *fixture, const FixtureOptions *options, Reference *reference);
ReferenceScheme fixture_scheme(IntegratorKind kind);

// Meshes that are no lattice. The organ has 188 nodes and is 0.2 m long; the sphere, of radius
// 0.05 m, 114 evenly spread nodes; the sheet 7 x 9 nodes over 0.12 x 0.16 m, its inner nodes moved
// at random in the plane and out of it, so that it has borders and valences 2 to 6.
void fixture_organ(TriMesh *mesh);
void fixture_sphere(TriMesh *mesh);
void fixture_sheet(TriMesh *mesh);

#endif
