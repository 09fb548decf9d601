// SPDX-License-Identifier: MIT
// A scene of one voxel body and its tools in memory: a real body in a real Sim, poses taken at
// once, no clock but the ticks.
#ifndef PLIANT_TESTS_VOXEL_WORLD_H
#define PLIANT_TESTS_VOXEL_WORLD_H

#include "sim/sim_data.h"
#include "voxel/voxel.h"

typedef struct VoxelWorldOptions {
    Lattice lattice; // taken over by voxel_world_create
    VoxelOptions body;
    SolidMaterial material; // of every label
    double rate_hz;
    int tool_count;
    ToolOptions tool[4];
    bool contact_stiffness; // told
} VoxelWorldOptions;

typedef struct VoxelWorld {
    Lattice lattice;
    SolidMaterial material[LATTICE_MATERIALS]; // all the same, unless the body has its own
    Arena arena;
    StateList state;
    Sim *sim;
    Body *body;
    int count;    // vertices, by the order of read_state; 0 of a plane body: its are not read
    int *id;      // filled once
    Vec3 *x, *v;  // filled by voxel_world_read
    double *mass; // [count] [kg]
} VoxelWorld;

// A free cube of n cells, edge 0.1 m, at the origin, levels 2 (0 below n = 8): E 10 kPa, nu 0, rho
// 1000 kg/m3, damping 0.2, double, 1 kHz, no gravity, no tools.
VoxelWorldOptions voxel_world_cube(int n);
// The same body as a block of so many cells of a size [m], without levels.
VoxelWorldOptions voxel_world_block(int x, int y, int z, double size);
// The same body as a ball, radius 5 cells of 10 mm.
VoxelWorldOptions voxel_world_ball(void);
// Two arms of 12 x 6 x 6 cells of 8 mm at a right angle, of three materials; their table, by
// label - 1.
extern const SolidMaterial VOXEL_WORLD_MATERIALS[3];
VoxelWorldOptions voxel_world_corner(void);
// Afterwards the options refer to the lattice and materials of the world. Aborts the test when the
// body is refused. Sets flush-to-zero, as the daemon does.
void voxel_world_create(VoxelWorld *world, VoxelWorldOptions *options);
void voxel_world_destroy(VoxelWorld *world);
void voxel_world_run(VoxelWorld *world, double seconds);

void voxel_world_read(VoxelWorld *world);
// Replaces the state of all vertices.
void voxel_world_write(VoxelWorld *world, const Vec3 *x, const Vec3 *v);
// Lets it spin, each vertex with a random velocity besides; reads the state.
void voxel_world_throw(VoxelWorld *world);
// True if a point is outside of the body as it is now, by the solid angle of its faces (van
// Oosterom and Strackee 1983, eq. 8).
bool voxel_world_is_outside(const VoxelWorld *world, Vec3 point);
// Sums over the vertices, about the origin, of x and v as read.
void voxel_world_momentum(const VoxelWorld *world, Vec3 *linear, Vec3 *angular);

#endif
