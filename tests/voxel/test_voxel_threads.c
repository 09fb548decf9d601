// SPDX-License-Identifier: MIT
// Threads that share the elements of a voxel body.
#include "test.h"
#include "effort.h"
#include "sim_steps.h"
#include "voxel_world.h"

// State after some ticks of a cube that swings under a load on its top; `soft`: damped by a time
// and by drag, and free.
static uint64_t run(int n, int threads, Precision precision, VoxelLaw law, bool soft)
{
    Team *team = threads > 1 ? team_create(threads) : NULL;
    Status status = {0};
    if (team != NULL && !team_start(team, threads, NULL, &status))
        fail_msg("%s", status.text);
    VoxelWorldOptions options = voxel_world_cube(n);
    const FixedRegion below = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, -0.049}};
    options.body.body.fixed = &below;
    options.body.body.fixed_count = soft ? 0 : 1;
    if (soft) {
        options.body.damping = 0.0;
        options.body.damping_time = 1e-3;
        options.body.drag = 4.0;
    }
    options.body.body.precision = precision;
    options.body.law = law;
    options.body.body.team = team;
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    const LoadOptions load = {.body = 0,
                              .center = {0.0, 0.0, 0.05},
                              .radius = 0.03,
                              .force = {1.0, 0.0, -2.0},
                              .duration = 10.0};
    apply_well(sim_apply_load, world.sim, &load);
    voxel_world_run(&world, EFFORT(50) * sim_tick(world.sim));
    uint64_t hash = state_hash(&world.state);
    voxel_world_read(&world);
    double most = 0.0;
    for (int i = 0; i < world.count; i++)
        most = fmax(most, vec3_length(world.v[i]));
    expect_at_least(most, 0.01); // it moves
    team_destroy(team);
    return hash;
}

// 16^3 cells: 2528 elements, most with hanging vertices in batches of one shape and in mixed ones;
// 8^3: too few to be shared.
TEST(any_number_of_threads_gives_the_same_bits)
{
    for (int n = 8; n <= 16; n += 8)
        for (int precision = 0; precision < PRECISION_COUNT; precision++)
            for (int variant = 0; variant < 4; variant++) {
                const VoxelLaw law = (VoxelLaw)(variant % 2);
                const bool soft = variant > 1;
                uint64_t one = run(n, 1, (Precision)precision, law, soft);
                for (int threads = 2; threads <= 3; threads++)
                    assert_int_equal(run(n, threads, (Precision)precision, law, soft), one);
            }
}
