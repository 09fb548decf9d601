// SPDX-License-Identifier: MIT
#include "voxel_trials.h"

#include "base/check.h"
#include "random.h"
#include "scoped.h"

#include <stdlib.h>

static const double LENGTH = 0.2, WIDTH = 0.05; // of the cantilever [m]

double trial_cantilever(int n, int levels, const VoxelBenchOptions *options)
{
    VoxelBenchOptions own = *options;
    own.levels = levels;
    SCOPED(voxel_bench_destroy) VoxelBench bench;
    voxel_bench_box(&bench, 4 * n, n, n, WIDTH / n, &own);
    int count = bench.vertex_count;
    FREED bool *fixed = zeroed((size_t)(3 * count), sizeof *fixed);
    FREED double *load = zeroed((size_t)(3 * count), sizeof *load);
    FREED Vec3 *move = zeroed((size_t)count, sizeof *move);
    for (int i = 0; i < count; i++) {
        const int *p = bench.mesh.point[i];
        if (p[0] == 0)
            fixed[3 * i] = fixed[3 * i + 1] = fixed[3 * i + 2] = true;
        // A square of the end gives a quarter to each corner; the sum is 1 N.
        double share = 1.0 / (n * n);
        for (int d = 1; d < 3; d++)
            share *= p[d] == 0 || p[d] == n ? 0.5 : 1.0;
        if (p[0] == 4 * n)
            load[3 * i + 2] = share;
    }
    voxel_bench_solve_linear(&bench, fixed, load, move);
    double mean = 0.0; // weighted as the load: its work
    for (int i = 0; i < count; i++)
        mean += load[3 * i + 2] * move[i].z;
    double modulus = options->youngs_modulus, area = WIDTH * WIDTH;
    double shear = modulus / (2.0 * (1.0 + options->poisson_ratio));
    double inertia = area * area / 12.0;
    return mean / (LENGTH * LENGTH * LENGTH / (3.0 * modulus * inertia) +
                   LENGTH / (5.0 / 6.0 * shear * area));
}

// F = R S with stretches of 0.7 to 1.4 along random axes, applied to every vertex. Returns |S - 1|.
static double deform(VoxelBench *bench, uint64_t *random)
{
    Quat left = quat_from_rotation(vec3_scale(3.0, random_vec3(random)));
    Quat right = quat_from_rotation(vec3_scale(3.0, random_vec3(random)));
    double stretch[3], square = 0.0;
    for (int c = 0; c < 3; c++) {
        stretch[c] = random_between(random, 0.7, 1.4);
        square += (stretch[c] - 1.0) * (stretch[c] - 1.0);
    }
    for (int i = 0; i < bench->vertex_count; i++) {
        Vec3 x = quat_rotate(quat_conjugate(right), bench->rest[i]);
        x = vec3(stretch[0] * x.x, stretch[1] * x.y, stretch[2] * x.z);
        bench->position[i] = quat_rotate(left, x);
    }
    return sqrt(square);
}

double trial_patch(VoxelBench *bench, uint64_t *random)
{
    double strain = deform(bench, random), worst = 0.0;
    voxel_bench_forces(bench);
    for (int i = bench->mesh.surface_count; i < bench->vertex_count; i++)
        worst = fmax(worst, vec3_length(bench->force[i]));
    return worst / (bench->mu * bench->size * bench->size * strain);
}

Tension trial_tension(const VoxelBenchOptions *options)
{
    SCOPED(voxel_bench_destroy) VoxelBench bench;
    voxel_bench_box(&bench, 8, 8, 16, 0.01, options);
    int n = bench.vertex_count;
    FREED bool *fixed = zeroed((size_t)(3 * n), sizeof *fixed);
    static const double STRAIN = 0.05;
    for (int i = 0; i < n; i++) {
        const int *p = bench.mesh.point[i];
        if (p[2] == 0 || p[2] == 16) {
            fixed[3 * i + 2] = true;
            bench.position[i].z = bench.rest[i].z * (1.0 + STRAIN);
        }
        // Neither drifting nor turning about z: the middle of a plate stays, and one of its edge
        // keeps its side.
        if (p[2] == 0 && p[1] == 4 && p[0] == 4)
            fixed[3 * i] = fixed[3 * i + 1] = true;
        if (p[2] == 0 && p[1] == 4 && p[0] == 8)
            fixed[3 * i + 1] = true;
    }
    double scale = bench.mu * bench.size * bench.size * STRAIN;
    ASSERT(voxel_bench_solve(&bench, fixed, NULL, 1e-12 * scale));
    double force = 0.0;
    Tension out = {0.0, 0.0};
    double across = 1.0 - options->poisson_ratio * STRAIN, length = 16 * bench.size * STRAIN;
    for (int i = 0; i < n; i++) {
        if (bench.mesh.point[i][2] == 16)
            force -= bench.force[i].z;
        Vec3 x = bench.rest[i];
        Vec3 expected = vec3(across * x.x, across * x.y, (1.0 + STRAIN) * x.z);
        double error = vec3_length(vec3_sub(bench.position[i], expected));
        out.place_error = fmax(out.place_error, error / length);
    }
    double section = 64.0 * bench.size * bench.size;
    out.modulus_error = force / (section * STRAIN) / options->youngs_modulus - 1.0;
    return out;
}

double trial_shear(const VoxelBenchOptions *options, uint64_t *random)
{
    static const double GAMMA = 0.1;
    SCOPED(voxel_bench_destroy) VoxelBench bench;
    voxel_bench_box(&bench, 10, 8, 12, 0.01, options);
    int n = bench.vertex_count;
    FREED bool *fixed = zeroed((size_t)(3 * n), sizeof *fixed);
    for (int i = 0; i < n; i++) {
        Vec3 x = bench.rest[i];
        bool surface = i < bench.mesh.surface_count;
        for (int c = 0; c < 3; c++)
            fixed[3 * i + c] = surface;
        bench.position[i] = surface ? vec3_add(x, vec3(GAMMA * x.z, 0.0, 0.0))
                                    : vec3_madd(x, 0.2 * bench.size, random_vec3(random));
    }
    double scale = bench.mu * bench.size * bench.size * GAMMA, worst = 0.0;
    ASSERT(voxel_bench_solve(&bench, fixed, NULL, 1e-12 * scale));
    for (int i = 0; i < n; i++) {
        Vec3 x = bench.rest[i], expected = vec3_add(x, vec3(GAMMA * x.z, 0.0, 0.0));
        worst = fmax(worst, vec3_length(vec3_sub(bench.position[i], expected)));
    }
    double size = bench.size;
    return worst / (GAMMA * size);
}
