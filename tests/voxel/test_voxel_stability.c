// SPDX-License-Identifier: MIT
// The critical step dt0 = h sqrt(rho (1 - 2 nu) / E): no element has a frequency above 2 / dt0
// against its share of the masses, and so no assembly has. In a body the bound is reached. With
// damping beta = xi dt0 symplectic Euler is stable up to dt0 (sqrt(1 + xi^2) - xi): 0.82 for 0.2.
#include "effort.h"
#include "test.h"
#include "sim_steps.h"
#include "random.h"
#include "voxel_bench.h"
#include "voxel_world.h"

// The largest energy over so many steps of dt / dt0, over that of the start: 8^3 cells of levels 0
// and 1 (the finest elements have the highest frequencies, so that larger ones add nothing), noise
// of 5 % of a cell.
static double growth(double step, double poisson_ratio, double damping)
{
    uint64_t random = 71;
    SCOPED(voxel_bench_destroy) VoxelBench bench;
    VoxelBenchOptions options = voxel_bench_options(1);
    options.poisson_ratio = poisson_ratio;
    options.damping = damping;
    voxel_bench_box(&bench, 8, 8, 8, 0.003, &options);
    for (int i = 0; i < bench.vertex_count; i++)
        bench.position[i] = vec3_madd(bench.rest[i], 0.05 * bench.size, random_vec3(&random));
    double start = voxel_bench_forces(&bench), worst = 0.0;
    for (int n = 0; n < EFFORT(800) && worst < 100.0; n++) {
        voxel_bench_step(&bench, step * bench.critical_step);
        double kinetic = voxel_bench_kinetic(&bench) / start;
        worst = fmax(worst, isfinite(kinetic) ? kinetic : 1e300);
    }
    print_message("dt %.2f dt0, nu %.2f, beta %.1f dt0: kinetic energy up to %.3g\n", step,
                  poisson_ratio, damping, worst);
    return worst;
}

// Kinetic energy at the ends of steps is not the conserved one: near the bound it may be twice as
// large. An instability grows until elements turn over, some hundred times the energy of the start.
TEST(the_bound_is_safe_and_sharp)
{
    expect_at_most(growth(0.95, 0.0, 0.0), 5.0);
    expect_at_most(growth(1.00, 0.0, 0.0), 5.0);
    expect_at_least(growth(1.05, 0.0, 0.0), 100.0);
}

TEST(the_bound_holds_for_nearly_incompressible_bodies)
{
    expect_at_most(growth(1.00, 0.45, 0.0), 5.0);
}

TEST(damping_lowers_the_bound_as_predicted)
{
    expect_at_most(growth(0.81, 0.0, 0.2), 5.0);
    expect_at_least(growth(0.90, 0.0, 0.2), 100.0);
}

// The same of the server's own body: 16^3 cells of levels 0 to 2, 4000 ticks of one step.
static double growth_of_body(double step, double poisson_ratio, double damping)
{
    uint64_t random = 72;
    VoxelWorldOptions options = voxel_world_cube(16);
    options.material.poisson_ratio = poisson_ratio;
    options.body.damping = damping;
    options.body.body.unsafe_time_step = true;
    options.body.body.time_step =
        step * voxel_critical_step(&options.material, options.lattice.size);
    options.rate_hz = 1.0 / options.body.body.time_step;
    const double size = options.lattice.size;
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    assert_int_equal(world.body->substeps, 1);
    for (int i = 0; i < world.count; i++)
        world.x[i] = vec3_madd(world.x[i], 0.05 * size, random_vec3(&random));
    voxel_world_write(&world, world.x, world.v);
    BodyMeasure now = measure_of(world.body);
    const double start = now.elastic;
    double worst = 0.0;
    for (int n = 0; n < EFFORT(4000) && worst < 100.0; n++) {
        sim_step(world.sim);
        if (n % 10 != 9)
            continue;
        now = measure_of(world.body);
        worst = fmax(worst, sim_resets(world.sim) == 0 ? now.kinetic / start : 1e300);
    }
    print_message("body, dt %.2f dt0, nu %.2f, beta %.1f dt0: kinetic energy up to %.3g\n", step,
                  poisson_ratio, damping, worst);
    return worst;
}

// Beyond the bound of nu = 0.45 only what fills a cube's corners could be unstable, and a free cube
// has little of it: 1.10 is stable too.
TEST(the_body_in_a_scene_has_the_same_bound)
{
    expect_at_most(growth_of_body(0.95, 0.0, 0.0), 5.0);
    expect_at_most(growth_of_body(1.00, 0.0, 0.0), 5.0);
    expect_at_least(growth_of_body(1.05, 0.0, 0.0), 100.0);
    expect_at_least(growth_of_body(1.15, 0.0, 0.0), 100.0);
    expect_at_most(growth_of_body(1.00, 0.45, 0.0), 5.0);
    expect_at_most(growth_of_body(1.10, 0.45, 0.0), 5.0);
    expect_at_most(growth_of_body(0.81, 0.0, 0.2), 5.0);
    expect_at_least(growth_of_body(0.90, 0.0, 0.2), 100.0);
}
