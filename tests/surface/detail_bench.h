// SPDX-License-Identifier: MIT
// One body with levels in memory, and what tests of refinement ask of it.
#ifndef PLIANT_TESTS_DETAIL_BENCH_H
#define PLIANT_TESTS_DETAIL_BENCH_H

#include "sim/sim.h"
#include "surface/detail/detail.h"
#include "surface/surface.h"

typedef struct DetailBench {
    Arena arena;
    StateList state;
    TriMesh mesh;  // of level 0
    TriMesh dense; // bench_create_dense: of start_level
    Levels levels;
    Sim *sim;
    Body *body;
    SurfaceModel *model;
    Detail *detail; // NULL: dense
} DetailBench;

// Material of fixture.h's defaults (E2D 80 N/m, 4.2 kg/m2), world shape springs of 50 rad/s, RK4 in
// double; check_hz so low that nothing is ever swept; levels and start_level as given.
SurfaceOptions bench_options(int levels, int start_level);
typedef enum BenchKind { BENCH_ADAPTIVE, BENCH_DENSE, BENCH_CUTTABLE } BenchKind;
// Takes the mesh over. BENCH_DENSE: the body that stays at start_level; BENCH_CUTTABLE: adaptive if
// the options say so. `tools`, `loads` may be
// NULL. Rate 1 kHz.
void bench_create(DetailBench *bench, BenchKind kind, TriMesh *mesh, const SurfaceOptions *options,
                  const ToolOptions *tool, const LoadOptions *load);
// On a mesh that `make` makes.
void bench_create_on(DetailBench *bench, BenchKind kind, void (*make)(TriMesh *),
                     const SurfaceOptions *options, const ToolOptions *tool,
                     const LoadOptions *load);
void bench_destroy(DetailBench *bench);

// Divides a random leaf or takes back a random face that balance allows; `more` of 10 divide.
void bench_change_at_random(DetailBench *bench, uint64_t *random, int more);
// Re-derives everything from the bits by other means and fails the test where it differs: balance,
// who is on and hangs, masses, the published mesh, and bit-equality with building all anew.
void bench_expect_sound(DetailBench *bench);

Vec3 bench_momentum(const DetailBench *bench);
double bench_mass(const DetailBench *bench);

#endif
