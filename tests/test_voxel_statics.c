// Patch tests of bodies with elements of different sizes: uniform deformation is in balance, and
// bars and blocks deform as the continuum says. The paper's law (Miyazaki et al. 2004) runs beside:
// weights that only scale a vertex's place cannot give the forces of a uniform stress where a large
// element meets small ones (a corner between a divided and a whole face would need the area
// vector (H/4, H/2), which is not along its place (H/2, H/2)); how far it is off is part of what
// these tests say.
#include "effort.h"
#include "expect.h"
#include "random.h"
#include "voxel_bench.h"

#include <stdlib.h>

// 0: the affine law; 1: the paper's with weights of 1, as it has them; 2: the paper's with the
// weights of the templates.
static VoxelBenchOptions with_law(int levels, double poisson_ratio, int law)
{
    VoxelBenchOptions options = voxel_bench_options(levels);
    options.poisson_ratio = poisson_ratio;
    options.law = law == 0 ? VOXEL_AFFINE : VOXEL_MIYAZAKI2004;
    options.unit_weights = law == 1;
    return options;
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

// The largest force on an inner vertex, over mu h^2 |S - 1|.
static double patch_residual(VoxelBench *bench, uint64_t *random)
{
    double strain = deform(bench, random), worst = 0.0;
    voxel_bench_forces(bench);
    for (int i = bench->mesh.surface_count; i < bench->vertex_count; i++)
        worst = fmax(worst, vec3_length(bench->force[i]));
    return worst / (bench->mu * bench->size * bench->size * strain);
}

// 16 cells are the fewest with elements of level 2.
static void uniform_deformation_is_in_balance_at_every_level(void **state)
{
    (void)state;
    uint64_t random = 51;
    for (int law = 0; law < 3; law++) {
        VoxelBench bench;
        VoxelBenchOptions options = with_law(2, law == 0 ? 0.3 : 0.0, law);
        voxel_bench_box(&bench, 16, 16, 16, 0.01, &options);
        double worst = 0.0;
        for (int n = 0; n < 3; n++)
            worst = fmax(worst, patch_residual(&bench, &random));
        print_message("law %d: residual %.2g\n", law, worst);
        // Rounding of places at 1e-16 of 16 h, over 26 area vectors. The paper's law leaves forces
        // as large as those on a vertex at the surface.
        if (law == 0)
            expect_at_most(worst, 1e-11);
        else
            expect_at_least(worst, 0.5);
        voxel_bench_destroy(&bench);
    }
}

static void uniform_deformation_is_in_balance_in_random_bodies(void **state)
{
    (void)state;
    uint64_t random = 52;
    int hanging = 0;
    for (int n = 0; n < EFFORT(12); n++) {
        VoxelBench bench;
        VoxelBenchOptions options = with_law(2, n % 2 == 0 ? 0.0 : 0.45, 0);
        voxel_bench_blob(&bench, n % 3 == 0 ? 20 : 12, 0.003, &random, &options);
        expect_at_most(patch_residual(&bench, &random), 1e-11);
        for (int e = 0; e < bench.element_count; e++)
            hanging += bench.class[bench.class_of[e]].shape.count > NODE_CORNERS;
        voxel_bench_destroy(&bench);
    }
    assert_true(hanging > 0);
}

// A bar of 8 x 8 x 16 cells (levels 0 and 1) pulled by 5 % along z between smooth plates.
typedef struct Tension {
    double modulus_error; // of E, from the plates' force and the bar's section
    double place_error;   // largest, over the plates' displacement
} Tension;

static Tension pull(const VoxelBenchOptions *options)
{
    VoxelBench bench;
    voxel_bench_box(&bench, 8, 8, 16, 0.01, options);
    int n = bench.vertex_count;
    bool *fixed = calloc((size_t)(3 * n), sizeof *fixed);
    assert_non_null(fixed);
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
    assert_true(voxel_bench_solve(&bench, fixed, NULL, 1e-12 * scale));
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
    free(fixed);
    voxel_bench_destroy(&bench);
    return out;
}

// The law is linear in the stretches (Biot strain), so that a bar in tension has exactly E and nu
// at any strain.
static void a_bar_of_several_levels_has_its_modulus_and_thins_as_it_should(void **state)
{
    (void)state;
    for (int n = 0; n < 3; n++) {
        static const double RATIO[] = {0.0, 0.3, 0.45};
        VoxelBenchOptions options = with_law(2, RATIO[n], 0);
        Tension t = pull(&options);
        print_message("nu %.2f: E off by %.2g, places by %.2g\n", RATIO[n], t.modulus_error,
                      t.place_error);
        // Forces are balanced to 1e-12; the softest mode of the bar is 1e2 to 1e3 times softer
        // than an element.
        expect_near(t.modulus_error, 0.0, 1e-9);
        expect_at_most(t.place_error, 1e-9);
    }
}

// Vertices within give way where sizes change: E is off by a percent or several, and places by
// more. Ranges, as neither is a value that another model confirms.
static void a_bar_of_the_paper_s_elements_is_off_by_percents(void **state)
{
    (void)state;
    for (int law = 1; law < 3; law++) {
        VoxelBenchOptions options = with_law(2, 0.0, law);
        Tension t = pull(&options);
        print_message("law %d: E off by %.2g, places by %.2g\n", law, t.modulus_error,
                      t.place_error);
        expect_at_least(fabs(t.modulus_error), 1e-3);
        expect_at_most(fabs(t.modulus_error), 0.1);
        expect_at_least(t.place_error, 1e-3);
        expect_at_most(t.place_error, 0.15);
    }
}

// All of the surface held as in simple shear: the inside has to follow. Over gamma h.
static double shear(const VoxelBenchOptions *options, uint64_t *random)
{
    static const double GAMMA = 0.1;
    VoxelBench bench;
    voxel_bench_box(&bench, 10, 8, 12, 0.01, options);
    int n = bench.vertex_count;
    bool *fixed = calloc((size_t)(3 * n), sizeof *fixed);
    assert_non_null(fixed);
    for (int i = 0; i < n; i++) {
        Vec3 x = bench.rest[i];
        bool surface = i < bench.mesh.surface_count;
        for (int c = 0; c < 3; c++)
            fixed[3 * i + c] = surface;
        bench.position[i] = surface ? vec3_add(x, vec3(GAMMA * x.z, 0.0, 0.0))
                                    : vec3_madd(x, 0.2 * bench.size, random_vec3(random));
    }
    double scale = bench.mu * bench.size * bench.size * GAMMA, worst = 0.0;
    assert_true(voxel_bench_solve(&bench, fixed, NULL, 1e-12 * scale));
    for (int i = 0; i < n; i++) {
        Vec3 x = bench.rest[i], expected = vec3_add(x, vec3(GAMMA * x.z, 0.0, 0.0));
        worst = fmax(worst, vec3_length(vec3_sub(bench.position[i], expected)));
    }
    free(fixed);
    double size = bench.size;
    voxel_bench_destroy(&bench);
    return worst / (GAMMA * size);
}

static void inside_of_a_sheared_block_follows_exactly(void **state)
{
    (void)state;
    uint64_t random = 53;
    for (int n = 0; n < 4; n++) {
        VoxelBenchOptions options = with_law(2, n == 1 ? 0.3 : 0.0, n < 2 ? 0 : n - 1);
        double error = shear(&options, &random);
        print_message("%d: shear off by %.2g gamma h\n", n, error);
        if (n < 2)
            expect_at_most(error, 1e-9);
        else // the paper's: a good part of a cell's own shear
            expect_at_least(error, 0.02);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(uniform_deformation_is_in_balance_at_every_level),
        cmocka_unit_test(uniform_deformation_is_in_balance_in_random_bodies),
        cmocka_unit_test(a_bar_of_several_levels_has_its_modulus_and_thins_as_it_should),
        cmocka_unit_test(a_bar_of_the_paper_s_elements_is_off_by_percents),
        cmocka_unit_test(inside_of_a_sheared_block_follows_exactly),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
