// SPDX-License-Identifier: MIT
// A cuttable lattice with all that it shows and is cut by, whose vertices are where a test puts
// them: no forces, no dynamics.
#ifndef PLIANT_TESTS_CUT_BENCH_H
#define PLIANT_TESTS_CUT_BENCH_H

#include "voxel/cut/cut_blade.h"
#include "voxel/cut/cut_faces.h"

typedef struct CutBench {
    Lattice lattice;
    Layout layout;
    LatticeMesh mesh;
    Arena arena;
    StateList state;
    CutLattice cut;
    CutPieces pieces;
    CutFaces faces;
    CutBlades blades;
    Vertices vertices; // rows, masses and inverse masses only; double
    CutMasses masses;
    BaseFrame frame;
    CutStroke stroke;
    Body body;
    TopologyChange change;
    void *start; // the state as it was created
} CutBench;

typedef struct CutBenchOptions {
    int levels, split_budget, face_capacity;
    bool publish_all;
    int surface_level; // 0: it does not adapt; else it starts with its surface fine
} CutBenchOptions;

// Takes the lattice over. Room for all vertices that there can be.
void cut_bench_create(CutBench *bench, Lattice lattice, CutBenchOptions options);
void cut_bench_destroy(CutBench *bench);
// Back to the uncut body at rest.
void cut_bench_reset(CutBench *bench);
// Puts all vertices somewhere, at rest; or moves them there in a tick of CUT_BENCH_TICK.
#define CUT_BENCH_TICK 1e-3
typedef Vec3 CutBenchShape(const void *context, Vec3 rest);
void cut_bench_shape(CutBench *bench, CutBenchShape *shape, const void *context);
void cut_bench_move(CutBench *bench, CutBenchShape *shape, const void *context);
// Breaks {cell, axis} and divides what the budget allows; true when anything changed.
bool cut_bench_break(CutBench *bench, const int (*face)[2], int count);
// What a body does with a sweep of its blade 0; returns how many links broke. Fails the test when
// the sweep is refused.
int cut_bench_sweep(CutBench *bench, CutPhase phase, BladeEdge before, BladeEdge after);
// Divides until nothing wants to be divided.
void cut_bench_settle(CutBench *bench);
// Divides a leaf, and what must be before it. True if it was divided.
bool cut_bench_divide(CutBench *bench, int element);
// Merges what can, once each; their new vertices are where the shape says. Returns how many merged.
int cut_bench_merge(CutBench *bench, CutBenchShape *shape, const void *context);
// Loops of four links around an edge of the lattice of which an odd number is broken.
int cut_bench_odd_loops(const CutBench *bench);
// Broken links whose ends hold together by others: of a cut that leaks, all of them.
int cut_bench_dead_ends(const CutBench *bench);
// Pieces by their links, counted in another way than cut_pieces.c; sides of unbroken links must
// agree with it.
int cut_bench_pieces(const CutBench *bench);

// Fails the test unless every edge of every triangle is shared with exactly one other, which runs
// along it the other way. Those of free squares, negative in `square` unless that is NULL, have no
// neighbours.
void cut_bench_expect_closed(const BodySurface *surface, const int *square);

#endif
