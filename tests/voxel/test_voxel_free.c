// SPDX-License-Identifier: MIT
// The real body without damping, free: what a symplectic integrator keeps over 1e5 steps, and how
// far its energy swings on the way.
#include "effort.h"
#include "test.h"
#include "sim_steps.h"
#include "random.h"
#include "voxel_world.h"

// 6^3 cells: the fewest with hanging vertices. Ten steps of so much of the bound a tick.
static void create(VoxelWorld *world, IntegratorKind integrator, double nu, double part)
{
    VoxelWorldOptions options = voxel_world_cube(6);
    options.body.body.levels = 1;
    options.body.damping = 0.0;
    options.body.body.integrator = integrator;
    options.material.poisson_ratio = nu;
    const double step = part * voxel_critical_step(&options.material, options.lattice.size);
    options.body.body.time_step = step;
    options.rate_hz = 1.0 / (10.0 * step);
    voxel_world_create(world, &options);
    assert_int_equal(world->body->substeps, 10);
    assert_true(world->body->element_count < 216);
}

// Bent, stretched and turning, with noise of so much of a cell.
static void disturb(VoxelWorld *world, double noise, double speed)
{
    uint64_t random = 3;
    const double cell = world->lattice.size;
    for (int i = 0; i < world->count; i++) {
        Vec3 x = world->x[i], *to = &world->x[i];
        to->x += 0.03 * x.x + 1.0 * x.z * x.z;
        to->y -= 0.02 * x.y + 0.5 * x.x * x.y;
        to->z += 0.02 * x.x - 0.5 * x.z * x.x;
        *to = vec3_madd(*to, noise * cell, random_vec3(&random));
        world->v[i] = vec3_cross(vec3(0.3, -0.5, 1.0), x);
        world->v[i] = vec3_madd(world->v[i], speed, random_vec3(&random));
        world->v[i] = vec3_add(world->v[i], vec3(0.02, -0.01, 0.03));
    }
    voxel_world_write(world, world->x, world->v);
}

typedef struct Sums {
    Vec3 linear, angular;
    double linear_size, angular_size; // of the vertices' own magnitudes
} Sums;

static Sums sums(VoxelWorld *world)
{
    Sums sum = {.linear_size = 0.0};
    voxel_world_read(world);
    voxel_world_momentum(world, &sum.linear, &sum.angular);
    for (int i = 0; i < world->count; i++) {
        double p = world->mass[i] * vec3_length(world->v[i]);
        sum.linear_size += p;
        sum.angular_size += p * vec3_length(world->x[i]);
    }
    return sum;
}

// Within a window energy swings by the order of omega dt (Euler) or its square (leapfrog): a drift
// shows in the windows' means.
TEST(energy_and_momentum_last_for_many_steps)
{
    for (int k = 0; k < 2; k++) {
        SCOPED(voxel_world_destroy) VoxelWorld world;
        create(&world, k == 1 ? INTEGRATOR_LEAPFROG : INTEGRATOR_SYMPLECTIC_EULER,
               k == 1 ? 0.3 : 0.0, 0.5);
        disturb(&world, 0.05, 0.05);
        Sums start = sums(&world);
        const int windows = TRIALS(4, 10), ticks = 1000;
        double first = 0.0, worst = 0.0;
        for (int w = 0; w < windows; w++) {
            double mean = 0.0;
            for (int i = 0; i < ticks; i++) {
                sim_step(world.sim);
                mean += energy_of(world.body) / ticks;
            }
            first = w == 0 ? mean : first;
            worst = fmax(worst, fabs(mean / first - 1.0));
        }
        Sums end = sums(&world);
        double linear = vec3_length(vec3_sub(end.linear, start.linear)) / start.linear_size;
        double angular = vec3_length(vec3_sub(end.angular, start.angular)) / start.angular_size;
        print_message("%s, %d steps: energy drifts by %.2g, momentum by %.2g, angular by %.2g\n",
                      integrator_name(world.body->integrator), 10 * ticks * windows, worst, linear,
                      angular);
        expect_at_most(worst, 0.01);
        // Rounding of 1e5 sums.
        expect_at_most(linear, 1e-9);
        expect_at_most(angular, 1e-9);
        assert_int_equal(world.body->resets, 0);
    }
}

// The slow modes alone, which leapfrog follows with errors of the order of (omega dt)^2 / 8.
TEST(energy_of_a_smooth_motion_is_constant)
{
    SCOPED(voxel_world_destroy) VoxelWorld world;
    create(&world, INTEGRATOR_LEAPFROG, 0.3, 0.2);
    disturb(&world, 0.0, 0.0);
    BodyMeasure measure = measure_of(world.body);
    const double start = energy_of(world.body);
    double low = start, high = start, least = measure.elastic, most = measure.elastic;
    for (int i = 0; i < 300; i++) {
        sim_step(world.sim);
        measure = measure_of(world.body);
        low = fmin(low, measure.kinetic + measure.elastic);
        high = fmax(high, measure.kinetic + measure.elastic);
        least = fmin(least, measure.elastic);
        most = fmax(most, measure.elastic);
    }
    print_message("energy from %.4g to %.4g of %.4g J, elastic from %.3g to %.3g J\n", low, high,
                  start, least, most);
    expect_at_least(low, 0.99 * start);
    expect_at_most(high, 1.01 * start);
    // It went to and fro between the two.
    expect_at_least(most - least, 0.3 * most);
}
