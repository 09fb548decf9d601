// SPDX-License-Identifier: MIT
// Bodies that move freely: what symplectic Euler keeps over many steps, up to where it is stable.
#include "effort.h"
#include "test.h"
#include "random.h"
#include "voxel_bench.h"

// Bent, stretched and noisy by these shares of a cell, turning and drifting.
static void disturb(VoxelBench *bench, double bend, double noise, double spin, uint64_t *random)
{
    for (int i = 0; i < bench->vertex_count; i++) {
        Vec3 x = bench->rest[i];
        double cells = x.x / bench->size;
        Vec3 move = vec3(0.1 * cells, 0.05 * cells * cells, -0.03 * cells * x.z / bench->size);
        bench->position[i] = vec3_madd(x, bend * bench->size, move);
        bench->position[i] =
            vec3_madd(bench->position[i], noise * bench->size, random_vec3(random));
        bench->velocity[i] = vec3_cross(vec3(0.3 * spin, -0.5 * spin, spin), x);
        bench->velocity[i] = vec3_add(bench->velocity[i], vec3(0.002, -0.001, 0.003));
    }
}

// A step, and the energy at its beginning: velocities are half a step off the places, so that the
// mean of before and after belongs to these, to second order.
static double energy_step(VoxelBench *bench, double dt)
{
    double energy = voxel_bench_forces(bench);
    for (int i = 0; i < bench->vertex_count; i++) {
        Vec3 *v = &bench->velocity[i], before = *v;
        *v = vec3_madd(before, dt / bench->mass[i], bench->force[i]);
        Vec3 middle = vec3_scale(0.5, vec3_add(before, *v));
        energy += 0.5 * bench->mass[i] * vec3_dot(middle, middle);
        bench->position[i] = vec3_madd(bench->position[i], dt, *v);
    }
    return energy;
}

typedef struct Momentum {
    Vec3 linear, angular;
    double linear_scale, angular_scale; // the sums of the vertices' own magnitudes
} Momentum;

static Momentum momentum(const VoxelBench *bench)
{
    Momentum m = {.linear_scale = 0.0};
    voxel_bench_momentum(bench, &m.linear, &m.angular);
    for (int i = 0; i < bench->vertex_count; i++) {
        double p = bench->mass[i] * vec3_length(bench->velocity[i]);
        m.linear_scale += p;
        m.angular_scale += p * vec3_length(bench->position[i]);
    }
    return m;
}

// Relative to the start's scale: nothing that was gained since may hide a loss.
static void expect_kept(Momentum start, const VoxelBench *bench, double tolerance)
{
    Momentum now = momentum(bench);
    double linear = vec3_length(vec3_sub(now.linear, start.linear)) / start.linear_scale;
    double angular = vec3_length(vec3_sub(now.angular, start.angular)) / start.angular_scale;
    print_message("momentum changes by %.2g, angular by %.2g\n", linear, angular);
    expect_at_most(linear, tolerance);
    expect_at_most(angular, tolerance);
}

// Energy within a window of steps swings by the order of (omega dt)^2; a drift would show in the
// windows' means. 1e5 steps of a small body, fewer of one with hanging vertices.
TEST(an_undamped_body_keeps_energy_and_momentum)
{
    for (int n = 0; n < 2; n++) {
        uint64_t random = 61;
        SCOPED(voxel_bench_destroy) VoxelBench bench;
        VoxelBenchOptions options = voxel_bench_options(1);
        options.poisson_ratio = n == 0 ? 0.0 : 0.3;
        if (n == 0)
            voxel_bench_box(&bench, 3, 2, 2, 0.003, &options);
        else
            voxel_bench_box(&bench, 6, 6, 6, 0.003, &options);
        disturb(&bench, 0.2, 0.05, 20.0, &random);
        Momentum start = momentum(&bench);
        int windows = n == 0 ? EFFORT(100) : EFFORT(5), steps = n == 0 ? 1000 : 500;
        double first = 0.0, worst = 0.0;
        for (int w = 0; w < windows; w++) {
            double mean = 0.0;
            for (int s = 0; s < steps; s++)
                mean += energy_step(&bench, 0.5 * bench.critical_step) / steps;
            if (w == 0)
                first = mean;
            worst = fmax(worst, fabs(mean / first - 1.0));
        }
        print_message("%d vertices: energy drifts by %.2g\n", bench.vertex_count, worst);
        expect_at_most(worst, 0.01);
        // Rounding of 1e5 sums of terms that are larger than the sum.
        expect_kept(start, &bench, 1e-9);
    }
}

// Damping takes energy from what is no rigid motion, and nothing from momentum.
TEST(a_damped_body_keeps_its_momentum)
{
    uint64_t random = 62;
    SCOPED(voxel_bench_destroy) VoxelBench bench;
    VoxelBenchOptions options = voxel_bench_options(1);
    options.damping = 0.2;
    voxel_bench_box(&bench, 6, 6, 6, 0.003, &options);
    disturb(&bench, 0.2, 0.3, 20.0, &random);
    Momentum kept = momentum(&bench);
    double start = voxel_bench_kinetic(&bench) + voxel_bench_forces(&bench);
    for (int s = 0; s < EFFORT(4000); s++)
        voxel_bench_step(&bench, 0.6 * bench.critical_step);
    double end = voxel_bench_kinetic(&bench) + voxel_bench_forces(&bench);
    // Rounding of 4000 sums.
    expect_kept(kept, &bench, 1e-11);
    expect_at_most(end, start);
}
