// SPDX-License-Identifier: MIT
// A scene of one surface body and its tools in memory, for the tests of contact: the material and
// the sizes of the measurements that the contact law was chosen by (hollow spheres of 50 mm, soft
// wall), poses taken at once, no clock but the ticks.
#ifndef PLIANT_TESTS_CONTACT_BENCH_H
#define PLIANT_TESTS_CONTACT_BENCH_H

#include "sim/contact/contact_data.h"
#include "sim/sim_data.h"
#include "geometry/mesh.h"
#include "sim_steps.h"
#include "surface/surface.h"

#define BENCH_RADIUS 0.05 // of the spheres [m]

typedef enum BenchFixing {
    BENCH_FREE,   // nothing is fixed
    BENCH_SEATED, // nodes below z = -25 mm
    BENCH_FROZEN, // every node: a body that does not yield
} BenchFixing;

typedef struct BenchOptions {
    TriMesh mesh; // taken over by bench_create
    const Vec3 *initial_position;
    bool has_twin; // a second body of the same mesh, moved by twin_at
    Vec3 twin_at;
    BenchFixing fixing;
    double youngs_modulus_2d; // [N/m]
    double contact_ratio;     // a
    double contact_damping;   // [s]
    double friction;          // mu
    double shape_frequency;   // [rad/s]; 0: no shape-preserving springs
    double shape_damping;     // ratio
    bool body_frame;          // of the shape-preserving springs, else the world's
    IntegratorKind integrator;
    double theta; // of an implicit body; 0: its default
    double rate_hz;
    double time_step; // [s]; 0: from the bound; else taken even beyond it
    double tool_timeout_s;
    Vec3 gravity;
    int tool_count;
    ToolOptions tool[4];
    bool contact_stiffness; // told
    double error_hz;        // likewise the errors; 0: none
} BenchOptions;

typedef struct Bench {
    TriMesh mesh; // at rest
    Arena arena;
    StateList state;
    Sim *sim;
    Body *body;  // the first
    Vec3 *x, *v; // [node_count] of the first body, filled by bench_read
} Bench;

// Soft wall, leapfrog at 1 kHz, a = 0.5, mu = 0.3, no tool, no mesh.
BenchOptions bench_options(void);
// The same with a mesh and one tool.
BenchOptions bench_with_tool(TriMesh mesh, ToolOptions tool);
// Aborts the test when the scene is refused. Sets flush-to-zero, as the daemon does.
void bench_create(Bench *bench, const BenchOptions *options);
void bench_destroy(Bench *bench);

// 10 * 4^s + 2 nodes.
TriMesh bench_ico_sphere(int subdivisions);
TriMesh bench_uv_sphere(void); // 8 x 14: 114 nodes
// Equilateral faces with sides `edge` [m] in z = 0, normal +z, wide enough for a tool within 30 mm
// of the middle, where there is a node.
TriMesh bench_sheet(double edge, int cells);
// Outermost node along a direction, and the face whose centre lies nearest to a point.
int bench_node_towards(const TriMesh *mesh, Vec3 direction);
int bench_face_near(const TriMesh *mesh, Vec3 point);
Vec3 bench_face_center(const TriMesh *mesh, int face);

// A probe with one sphere, or one capsule along its x axis with the origin in the middle.
ToolOptions bench_ball(double radius);
ToolOptions bench_capsule(double length, double radius);
ToolOptions bench_table(Vec3 point, Vec3 normal);

// The tool's pose from the next tick on, at once.
void bench_place(Bench *bench, int tool, Vec3 position, Quat orientation);
void bench_move(Bench *bench, int tool, Vec3 position); // the same, not turned
void bench_withdraw(Bench *bench, int tool);
void bench_run(Bench *bench, double seconds);
// One tick with the tool at a position; the force on it [N].
Vec3 bench_touch(Bench *bench, int tool, Vec3 position);
// In a straight line at constant speed [m/s], one pose per tick.
void bench_travel(Bench *bench, int tool, Vec3 from, Vec3 to, double speed);

// x and v of now.
void bench_read(Bench *bench);
// Reads x and v, and sums up.
Momentum bench_momentum(Bench *bench);

#endif
