// SPDX-License-Identifier: MIT
// What nothing loads or stretches stays at rest when it is cut: the lips that move onto the blade
// are at rest where they are put.
#include "wall_bench.h"

#include "test.h"
#include "geometry/generator.h"
#include "random.h"

#include <float.h>

// What is cut, and how its shape is held.
typedef struct RestCase {
    WallMesh mesh;
    int levels, start_level;
    bool adaptive, shape;
    ShapeFrame frame;
    Precision precision;
} RestCase;

static void create(DetailBench *bench, const RestCase *at)
{
    SurfaceOptions options = wall_options(at->levels, at->start_level);
    options.adaptive = at->adaptive;
    options.adapt.check_hz = 200.0;
    options.shape.wanted = at->shape;
    options.shape.frame = at->frame;
    options.body.precision = at->precision;
    options.prestress = 0.0;
    TriMesh mesh;
    Status status = {0};
    bool made = at->mesh == WALL_SPHERE ? generate_sphere(&mesh, 114, 0.05, &status)
                                        : generate_sheet(&mesh, 9, 9, 0.12, 0.12, &status);
    if (!made)
        fail_msg("%s", status.text);
    bench_create(bench, BENCH_CUTTABLE, &mesh, &options, NULL, NULL);
}

// Through points up to 3 cm from the middle, 6 cm wide and far, in any direction: oblique to edges.
static CutOptions random_cut(uint64_t *random)
{
    Vec3 along = vec3_unit(random_vec3(random));
    Vec3 forward = vec3_unit(vec3_cross(along, random_vec3(random)));
    double size = random_below(random, 2) == 0 ? 0.3 : 0.06;
    return wall_sweep_at(vec3_scale(0.03, random_vec3(random)), along, forward, size, size);
}

static double speed_now(const DetailBench *bench)
{
    double most = 0.0;
    for (int i = 0; i < bench->detail->set.node_count; i++) {
        Vec3 x, v;
        if (bench->detail->set.status[i] == NODE_OFF)
            continue;
        bench->body->ops->read_nodes(bench->model, &i, 1, &x, &v);
        most = fmax(most, vec3_length(v));
    }
    return most;
}

// Largest speed of any node now and after each of so many ticks [m/s].
static double speed_over(DetailBench *bench, int ticks)
{
    double most = speed_now(bench);
    for (int i = 0; i < ticks; i++) {
        sim_step(bench->sim);
        most = fmax(most, speed_now(bench));
    }
    return most;
}

// Both meshes; unrefined, of the finest level, refined by what cuts it; held by nothing, by the
// world, by its own frame; both precisions.
static RestCase choose(int i)
{
    return (RestCase){.mesh = i % 2 == 0 ? WALL_SPHERE : WALL_SHEET,
                      .levels = i / 2 % 3 == 0 ? 0 : 2,
                      .start_level = i / 2 % 3 == 1 ? 2 : 0,
                      .adaptive = i / 2 % 3 == 2,
                      .shape = i / 6 % 3 != 0,
                      .frame = i / 6 % 3 == 2 ? SHAPE_BODY : SHAPE_WORLD,
                      .precision = i / 18 % 2 == 0 ? PRECISION_DOUBLE : PRECISION_SINGLE};
}

// Rest places and rows that differ by a rounding of single precision at the body's size swing at no
// more than its highest frequency. (Lips that are off by a tenth of an edge: 0.1 m/s.)
static double speed_of_rounding(const DetailBench *bench)
{
    return 0.5 * (double)FLT_EPSILON * 0.12 * sqrt(bench->detail->pack.lambda);
}

TEST(an_unloaded_wall_stays_at_rest_when_it_is_cut)
{
    uint64_t random = 8;
    double most = 0.0;
    for (int i = 0; i < 72; i++) {
        const RestCase at = choose(i);
        SCOPED(bench_destroy) DetailBench bench;
        create(&bench, &at);
        speed_over(&bench, 5);
        // Another into what has been cut, at once, and one later; then over a second.
        const int ticks[3] = {0, 20, i < 36 ? 1000 : 50};
        int separated = 0;
        for (int k = 0; k < 3; k++) {
            CutOptions cut = random_cut(&random);
            separated += wall_cut(&bench, &cut).separated;
            double speed = speed_over(&bench, ticks[k]);
            expect_at_most(speed, speed_of_rounding(&bench));
            most = fmax(most, speed);
        }
        assert_true(separated > 0);
        assert_true(2 * bench.detail->set.cut->lips.count > separated);
    }
    print_message("largest speed %.2g m/s\n", most);
}
