// SPDX-License-Identifier: MIT
// From any state back to the rest shape: all vertices thrown into a ball, flattened, mirrored,
// noise of more than a cell, each turning; for soft and hard, compressible and hardly compressible
// bodies. dt 0.6 dt0 and damping 0.2 dt0, the defaults. 6^3 cells: the fewest with hanging
// vertices.
#include "effort.h"
#include "test.h"
#include "random.h"
#include "voxel_bench.h"

typedef enum Start { BLOB, FLAT, MIRRORED, NOISE } Start;

// h: of the elements.
static void scatter_vertices(VoxelBench *bench, Start start, double h, double speed,
                             uint64_t *random)
{
    for (int i = 0; i < bench->vertex_count; i++) {
        Vec3 x = bench->rest[i], *to = &bench->position[i];
        switch (start) {
        case BLOB:
            *to = vec3_scale(3.2 * h, random_vec3(random));
            break;
        case FLAT: // exactly, and square to an axis: no element knows which side it was on
            *to = vec3(x.x, x.y, 0.0);
            break;
        case MIRRORED:
            *to = vec3(x.x, x.y, -x.z);
            break;
        default:
            *to = vec3_madd(x, 1.5 * h, random_vec3(random));
        }
        Vec3 turn = vec3_cross(vec3(0.3, -0.5, 1.0), *to);
        bench->velocity[i] = vec3_add(vec3_scale(speed / (6.0 * h), turn),
                                      vec3_scale(speed, vec3(0.02, -0.01, 0.03)));
    }
}

// One corner of a ball of radius 5 cells is fine, the rest has elements of up to four cells a side,
// partly filled.
static bool away_from_corner(const int cell[3], int level)
{
    return level == 1 || cell[0] + cell[1] + cell[2] > 0;
}

static void create_ball(VoxelBench *bench, VoxelBenchOptions *options)
{
    Lattice lattice;
    assert_true(lattice_create(&lattice, (const int[3]){12, 12, 12}, 0.003, &(Status){0}));
    for (int c = 0; c < 12 * 12 * 12; c++) {
        const double x = c % 12 - 5.2, y = c / 12 % 12 - 5.5, z = c / 144 - 5.7;
        lattice.label[c] = x * x + y * y + z * z < 25.0;
    }
    options->coarse = 2;
    options->may_be_coarse = away_from_corner;
    voxel_bench_create(bench, &lattice, options);
}

static void expect_recovery_of(bool ball, Start start, double modulus, double nu, int steps,
                               double left)
{
    uint64_t random = 81;
    SCOPED(voxel_bench_destroy) VoxelBench bench;
    VoxelBenchOptions options = voxel_bench_options(1);
    options.youngs_modulus = modulus;
    options.poisson_ratio = nu;
    options.damping = 0.2;
    if (ball)
        create_ball(&bench, &options);
    else
        voxel_bench_box(&bench, 6, 6, 6, 0.003, &options);
    // A tenth of the speed of sound: a spin that strains by less than a tenth.
    double speed = 0.1 * sqrt(modulus / options.density);
    scatter_vertices(&bench, start, (ball ? 3.0 : 1.0) * bench.size, speed, &random);
    Vec3 linear, angular, start_linear, start_angular;
    voxel_bench_momentum(&bench, &start_linear, &start_angular);
    double energy = voxel_bench_forces(&bench);
    int first = voxel_bench_inverted(&bench), settled = 0;
    for (int s = 0; s < steps; s++) {
        voxel_bench_step(&bench, 0.6 * bench.critical_step);
        if (voxel_bench_inverted(&bench) > 0)
            settled = s + 1;
    }
    double end = voxel_bench_forces(&bench) / energy;
    voxel_bench_momentum(&bench, &linear, &angular);
    // Against the momentum of the whole mass at that speed.
    double mass = 0.0;
    for (int i = 0; i < bench.vertex_count; i++)
        mass += bench.mass[i];
    double lost = vec3_length(vec3_sub(linear, start_linear)) / (mass * speed);
    double turned =
        vec3_length(vec3_sub(angular, start_angular)) / (mass * speed * 3.0 * bench.size);
    print_message("start %d, E %.0e, nu %.2f: %d inverted, none after %d steps; energy left %.2g, "
                  "momentum off by %.2g, angular %.2g\n",
                  start, modulus, nu, first, settled, end, lost, turned);
    assert_true(first > 0);
    expect_at_most(settled, steps - 1);
    expect_at_most(end, left);
    // Rounding of thousands of sums.
    expect_at_most(lost, 1e-11);
    expect_at_most(turned, 1e-11);
}

static void expect_recovery(Start start, double modulus, double nu, int steps, double left)
{
    expect_recovery_of(false, start, modulus, nu, steps, left);
}

TEST(a_random_blob_recovers)
{
    expect_recovery(BLOB, 1e4, 0.0, 1000, 1e-4);
}

TEST(a_flattened_body_recovers)
{
    expect_recovery(FLAT, 1e4, 0.0, 1000, 1e-4);
}

TEST(a_mirrored_body_recovers)
{
    expect_recovery(MIRRORED, 1e4, 0.0, 1000, 1e-4);
}

TEST(noise_of_more_than_a_cell_vanishes_at_any_stiffness)
{
    expect_recovery(NOISE, 1e3, 0.0, 1000, 1e-4);
    expect_recovery(NOISE, 1e9, 0.0, 1000, 1e-4);
}

TEST(hardly_compressible_bodies_recover)
{
    expect_recovery(NOISE, 1e4, 0.3, 1000, 1e-4);
    expect_recovery(NOISE, 1e4, 0.45, 1000, 1e-3);
    expect_recovery(NOISE, 1e4, 0.49, 2000, 1e-2);
}

// At the step of the finest cells, of which there are few. Twice as large a body swings out in
// twice the steps.
TEST(partly_filled_elements_recover)
{
    for (Start start = BLOB; start <= NOISE; start++)
        expect_recovery_of(true, start, 1e4, 0.3, 2000, 1e-4);
}
