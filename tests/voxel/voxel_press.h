// SPDX-License-Identifier: MIT
// The press by which graded bodies are compared with the ordinary voxel model: a cube of 0.1 m
// (E 10 kPa, nu 0) that stands on a plane, and a ball of 30 mm pressed 20 mm into its middle.
#ifndef PLIANT_TESTS_VOXEL_PRESS_H
#define PLIANT_TESTS_VOXEL_PRESS_H

#include "voxel_world.h"

typedef struct VoxelPress {
    VoxelWorld world;
    Vec3 *rest; // [world.count]
    int tick;
} VoxelPress;

enum { VOXEL_PRESS_TICKS = 600 }; // until it has come to rest: 1.2 s at 500 Hz

// n^3 cells. isa as in VoxelOptions.
void voxel_press_create(VoxelPress *press, int n, int levels, Precision precision, const char *isa);
void voxel_press_destroy(VoxelPress *press);
// The ball goes down at 50 mm/s, then stays.
void voxel_press_tick(VoxelPress *press);
// A tick without the ball: it is withdrawn.
void voxel_press_release(VoxelPress *press);
// Of all outer vertices: the root of the sum of squared differences of displacements over that of
// the displacements of `full`, which has the same cells.
double voxel_press_error(VoxelPress *press, VoxelPress *full);
double voxel_press_force(const VoxelPress *press);   // on the tool, upwards, of the last tick [N]
double voxel_press_kinetic(const VoxelPress *press); // [J]

#endif
