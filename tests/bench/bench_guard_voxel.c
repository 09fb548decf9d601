// SPDX-License-Identifier: MIT
// What the guard costs a step of a voxel body, as in bench_guard.c.
#include "bench_guard.h"
#include "voxel_world.h"

#include "voxel/model.h"

static const VertexKernels *own;

static bool advance_unchecked(const AdvancePass *pass)
{
    AdvancePass without = *pass;
    without.check = false;
    return own->advance(&without);
}

void bench_guard_voxels(Bench *bench)
{
    const char *name = "guard.voxel";
    if (!bench_wants(bench, name))
        return;
    VoxelWorldOptions options = voxel_world_cube(bench->quick ? 8 : 16);
    options.body.body.levels = 0;
    options.body.body.precision = PRECISION_SINGLE;
    options.body.body.isa = bench->isa;
    static const FixedRegion below = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, -0.049}};
    options.body.body.fixed = &below; // or a frame follows the body in the same stage
    options.body.body.fixed_count = 1;
    VoxelWorld world;
    voxel_world_create(&world, &options);
    Vertices *vertices = &((VoxelModel *)world.body->model)->vertices;
    own = vertices->kernels;
    VertexKernels without = *own;
    without.advance = advance_unchecked;
    GuardTimes times = {0};
    const int ticks = 20000 / world.count + 1;
    bench_guard_time(world.sim, ticks, &times.with);
    const int64_t before = sim_stage_ns(world.sim, STAGE_CHECK), first = sim_steps(world.sim);
    for (int r = 0; r < (bench->quick ? 3 : 1000); r++) {
        vertices->kernels = own;
        bench_guard_time(world.sim, ticks, &times.with);
        vertices->kernels = &without;
        bench_guard_time(world.sim, ticks, &times.without);
    }
    vertices->kernels = own;
    const double stage_us = 1e-3 * (double)(sim_stage_ns(world.sim, STAGE_CHECK) - before) /
                            (double)(sim_steps(world.sim) - first);
    bench_guard_rows(bench, name, world.body->element_count, &times, stage_us);
    voxel_world_destroy(&world);
}
