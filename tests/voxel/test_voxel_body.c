// SPDX-License-Identifier: MIT
// The real voxel body in a Sim: free flight, momentum, rest, precision, loads.
#include "test.h"
#include "random.h"
#include "voxel_world.h"

TEST(at_rest_nothing_moves)
{
    for (int precision = 0; precision < PRECISION_COUNT; precision++) {
        VoxelWorldOptions options = voxel_world_cube(8);
        options.body.body.precision = (Precision)precision;
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options);
        FREED Vec3 *rest = calloc((size_t)world.count, sizeof *rest);
        for (int i = 0; i < world.count; i++)
            rest[i] = world.x[i];
        voxel_world_run(&world, 0.1);
        voxel_world_read(&world);
        for (int i = 0; i < world.count; i++) {
            expect_near(vec3_length(vec3_sub(world.x[i], rest[i])), 0.0, 0.0);
            expect_near(vec3_length(world.v[i]), 0.0, 0.0);
        }
    }
}

TEST(a_free_body_falls_as_a_stone)
{
    VoxelWorldOptions options = voxel_world_cube(8);
    options.body.body.gravity = vec3(1.0, -2.0, -9.81);
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    Vec3 start = world.x[5];
    voxel_world_run(&world, 0.5);
    voxel_world_read(&world);
    // Symplectic Euler: n steps of h give h^2 n (n + 1) / 2 g.
    double h = world.body->h, n = 0.5 / h, way = 0.5 * h * h * n * (n + 1.0);
    Vec3 fallen = vec3_sub(world.x[5], start);
    expect_near(fallen.z, -9.81 * way, 1e-9); // rounding of some hundred frames
    expect_near(fallen.x, 1.0 * way, 1e-9);
}

TEST(momentum_is_kept)
{
    VoxelWorldOptions options = voxel_world_cube(8);
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    uint64_t random = 7;
    for (int i = 0; i < world.count; i++) {
        world.x[i] = vec3_madd(world.x[i], 0.002, random_vec3(&random));
        world.v[i] = vec3_add(vec3_cross(vec3(1.0, 2.0, 3.0), world.x[i]), random_vec3(&random));
    }
    voxel_world_write(&world, world.x, world.v);
    voxel_world_read(&world);
    Vec3 p0, l0, p1, l1;
    voxel_world_momentum(&world, &p0, &l0);
    voxel_world_run(&world, 1.0);
    voxel_world_read(&world);
    voxel_world_momentum(&world, &p1, &l1);
    print_message("dP %g dL %g of %g %g\n", vec3_length(vec3_sub(p1, p0)),
                  vec3_length(vec3_sub(l1, l0)), vec3_length(p0), vec3_length(l0));
    expect_near(vec3_length(vec3_sub(p1, p0)) / vec3_length(p0), 0.0, 1e-11);
    expect_near(vec3_length(vec3_sub(l1, l0)) / vec3_length(l0), 0.0, 1e-9);
}
