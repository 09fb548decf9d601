// SPDX-License-Identifier: MIT
// Surface bodies to be cut, sweeps to cut them with, and what must hold after each.
#ifndef PLIANT_TESTS_WALL_BENCH_H
#define PLIANT_TESTS_WALL_BENCH_H

#include "wall_check.h"

typedef enum WallMesh { WALL_SPHERE, WALL_SHEET, WALL_MESHES } WallMesh;

// bench_options with a tenth of prestress, and walls of 2 mm that bend.
SurfaceOptions wall_options(int levels, int start_level);
// A cuttable body on fixture_sphere or fixture_sheet, swollen, twisted and moving as much as said,
// in [0, 1]; adaptive if the options say so. `tool` may be NULL.
void wall_create_with(DetailBench *bench, WallMesh kind, SurfaceOptions *options, double much,
                      const ToolOptions *tool);
void wall_create(DetailBench *bench, WallMesh kind, SurfaceOptions *options, double much);

// Returns where a random node is that is on [m].
Vec3 wall_random_node(const DetailBench *bench, uint64_t *random);
// A blade `length` wide that goes `way` far through a point, along unit vectors.
CutOptions wall_sweep_at(Vec3 middle, Vec3 along, Vec3 forward, double length, double way);
// Whole planes, short and long cuts, sweeps exactly through nodes and along the line between two,
// sweeps that begin where the last one ended, twisted ones.
CutOptions wall_random_sweep(const DetailBench *bench, uint64_t *random, const CutOptions *last);
// Reads where a node is and moves, not where it is shown.
void wall_read_row(const DetailBench *bench, int node, Vec3 *x, Vec3 *v);
// Cuts; fails the test unless mass and momentum stay.
CutOutcome wall_cut(DetailBench *bench, const CutOptions *options);
// Takes away at most `amount` [m2], or what boils with so much more heat [J]; fails the test unless
// mass, momentum and area of what is left and of what went are what was there.
RemovalOutcome wall_remove(DetailBench *bench, RemoverKind kind, const Region *mouth,
                           double amount);
// Everything of wall_check.h and bench_expect_sound.
void wall_expect_sound(DetailBench *bench, WallShape *shape, int handles);

#endif
