// SPDX-License-Identifier: MIT
// One surface body in memory for a case: the default material on shape-preserving springs.
#ifndef PLIANT_TESTS_BENCH_WORLD_H
#define PLIANT_TESTS_BENCH_WORLD_H

#include "sim/sim.h"
#include "surface/surface.h"

typedef struct BenchWorldOptions {
    IntegratorKind integrator;
    double rate_hz;
    Precision precision;
    double time_step;                // [s]; 0: from the bound
    const Vec3 *initial_velocity;    // [node_count] or NULL
    const ToolOptions *tool;         // or NULL
    const SurfaceMaterial *material; // NULL: bench_material()
    SurfaceCavity cavity;
    bool held_below; // nodes below half the radius (0.2 m) are held
    bool may_load;
    const char *isa; // NULL: best
} BenchWorldOptions;

typedef struct BenchWorld {
    Arena arena;
    StateList state;
    Sim *sim;
    Body *body;
} BenchWorld;

// What bench_world_create builds with: for twins of the body.
SurfaceMaterial bench_material(void);
SurfaceShape bench_shape(void);

// False with `status`; destroy in either case.
bool bench_world_create(BenchWorld *world, const TriMesh *mesh, const BenchWorldOptions *options,
                        Status *status);
void bench_world_destroy(BenchWorld *world);

#endif
