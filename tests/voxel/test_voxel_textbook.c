// SPDX-License-Identifier: MIT
// The textbook's element, which the benchmark compares with, does the work that it claims to do.
#include "bench/voxel_textbook.h"
#include "test.h"
#include "random.h"
#include "voxel_bench.h"

static void create_both(VoxelBench *bench, VoxelTextbook *textbook, double nu)
{
    VoxelBenchOptions options = voxel_bench_options(0);
    options.poisson_ratio = nu;
    options.damping = 0.2;
    voxel_bench_box(bench, 5, 4, 3, 0.003, &options);
    FREED double(*place)[3] = calloc((size_t)bench->vertex_count, sizeof *place);
    FREED int(*corner)[8] = calloc((size_t)bench->element_count, sizeof *corner);
    assert_true(place != NULL && corner != NULL);
    for (int i = 0; i < bench->vertex_count; i++) {
        place[i][0] = bench->rest[i].x;
        place[i][1] = bench->rest[i].y;
        place[i][2] = bench->rest[i].z;
    }
    for (int e = 0; e < bench->element_count; e++) {
        for (int i = 0; i < 8; i++)
            corner[e][i] = bench->mesh.vertex[e][i];
    }
    voxel_textbook_create(textbook, bench->vertex_count, (const double(*)[3])place, NULL,
                          bench->element_count, (const int(*)[8])corner, bench->size,
                          options.youngs_modulus, nu, options.density, 0.2 * bench->critical_step);
}

static Vec3 as_vec3(const double a[3])
{
    return vec3(a[0], a[1], a[2]);
}

// The same forces in one state, then the same way over 200 steps.
TEST(moves_as_the_readable_element_does)
{
    uint64_t random = 91;
    for (int n = 0; n < 2; n++) {
        SCOPED(voxel_bench_destroy) VoxelBench bench;
        SCOPED(voxel_textbook_destroy) VoxelTextbook textbook;
        create_both(&bench, &textbook, n == 0 ? 0.0 : 0.3);
        for (int i = 0; i < bench.vertex_count; i++) {
            Vec3 move = vec3_scale(0.15 * bench.size, random_vec3(&random));
            Vec3 v = vec3_scale(0.1, random_vec3(&random));
            VoxelTextbookVertex *out = &textbook.vertex[i];
            bench.position[i] = vec3_add(bench.rest[i], move);
            bench.velocity[i] = v;
            out->x[0] = bench.position[i].x, out->v[0] = v.x;
            out->x[1] = bench.position[i].y, out->v[1] = v.y;
            out->x[2] = bench.position[i].z, out->v[2] = v.z;
            expect_near(out->mass, bench.mass[i], 1e-15 * out->mass * 8.0);
        }
        voxel_bench_forces(&bench);
        voxel_textbook_forces(&textbook);
        // Its rotation is iterated to 1e-12 (1e-10 where inverted), its inertia raised by 1e-9.
        double scale = bench.mu * bench.size * bench.size;
        for (int i = 0; i < bench.vertex_count; i++) {
            Vec3 difference = vec3_sub(as_vec3(textbook.vertex[i].f), bench.force[i]);
            expect_at_most(vec3_length(difference), 1e-8 * scale);
        }
        for (int s = 0; s < 200; s++) {
            voxel_bench_step(&bench, 0.6 * bench.critical_step);
            voxel_textbook_step(&textbook, 0.6 * bench.critical_step);
        }
        for (int i = 0; i < bench.vertex_count; i++) {
            Vec3 difference = vec3_sub(as_vec3(textbook.vertex[i].x), bench.position[i]);
            expect_at_most(vec3_length(difference), 1e-5 * bench.size); // that, accumulated
        }
    }
}
