// SPDX-License-Identifier: MIT
// Faces of surface bodies that are removed, among cuts, tears and levels that come and go.
#include "wall_bench.h"

#include "effort.h"
#include "expect.h"
#include "geometry/distance.h"
#include "geometry/generator.h"
#include "random.h"
#include "sim_steps.h"
#include "test.h"

TEST(random_removals_and_cuts_keep_every_invariant)
{
    uint64_t random = 371;
    int removed = 0, removals = 0, most_pieces = 0, copies = 0;
    const char *wanted = getenv("PLIANT_TEST_CUTS");
    const int sequences = wanted != NULL ? atoi(wanted) / 10 : EFFORT(20);
    for (int sequence = 0; sequence < sequences; sequence++) {
        SurfaceOptions options = wall_options(random_below(&random, 4), 0);
        options.start_level = random_below(&random, options.body.levels + 1);
        options.adaptive = options.body.levels > 0 && random_below(&random, 2) == 0;
        options.adapt.check_hz = 200.0;
        options.heats = true;
        options.tear_stretch = random_below(&random, 2) == 0 ? 0.3 : 0.0;
        options.body.precision =
            random_below(&random, 2) == 0 ? PRECISION_DOUBLE : PRECISION_SINGLE;
        options.shape.frame = random_below(&random, 2) == 0 ? SHAPE_WORLD : SHAPE_BODY;
        const int kind = random_below(&random, 4);
        if (kind == 0)
            options.body.integrator = INTEGRATOR_IMPLICIT;
        if (kind == 1) {
            options.body.integrator = INTEGRATOR_LEAPFROG;
            options.material.branch_count = 1;
            options.material.branch[0] = (MaxwellBranch){0.02, 0.25, false};
        }
        SCOPED(bench_destroy) DetailBench bench;
        const WallMesh mesh = (WallMesh)random_below(&random, WALL_MESHES);
        wall_create(&bench, mesh, &options, random_between(&random, 0.0, 1.0));
        CutOptions last = {.body = 0};
        WallShape shape;
        for (int i = 0; i < 10; i++) {
            if (options.adaptive)
                for (int k = 0; k < 4; k++)
                    bench_change_at_random(&bench, &random, 6);
            sim_ticks(bench.sim, random_below(&random, 6));
            if (random_below(&random, 3) == 0) {
                last = wall_random_sweep(&bench, &random, &last);
                wall_cut(&bench, &last);
            } else {
                const Vec3 from = wall_random_node(&bench, &random);
                const double far = random_between(&random, 0.0, 0.02);
                const Region mouth = {REGION_CAPSULE, from,
                                      vec3_madd(from, far, random_vec3(&random)),
                                      random_between(&random, 1e-3, 0.03)};
                const bool sucks = random_below(&random, 2) == 0,
                           burns = random_below(&random, 4) == 0;
                const double amount = sucks ? random_between(&random, 0.0, 2e-4) : (double)INFINITY;
                const RemovalOutcome went =
                    wall_remove(&bench, sucks ? REMOVER_SUCTION : REMOVER_DRILL, &mouth, amount);
                assert_true(!cut_refuses(went.verdict));
                expect_at_most(went.area, amount);
                if (burns)
                    wall_remove(&bench, REMOVER_DIATHERMY, &mouth,
                                random_between(&random, 0.0, 3000.0));
                removed += went.removed;
                removals++;
            }
            wall_expect_sound(&bench, &shape, 0);
            most_pieces = shape.pieces > most_pieces ? shape.pieces : most_pieces;
        }
        copies += (int)*bench.detail->set.cut->copies;
        assert_int_equal(sim_resets(bench.sim), 0);
    }
    print_message("%d removals of %d faces, %d copies, at most %d pieces\n", removals, removed,
                  copies, most_pieces);
    assert_true(removed > 2 * removals);
}

// Sucks at one place until nothing is in reach; returns the area [m2].
static double suck_all(DetailBench *bench, Vec3 at, double radius)
{
    const Region mouth = {REGION_CAPSULE, at, at, radius};
    double area = 0.0;
    for (int i = 0; i < 1000; i++) {
        const RemovalOutcome went = wall_remove(bench, REMOVER_SUCTION, &mouth, (double)INFINITY);
        if (went.verdict == CUT_MET_NOTHING)
            return area;
        area += went.area;
    }
    fail_msg("it does not end");
    return area;
}

// What a ball covers of a flat sheet is a disc. Faces are taken or left whole, by their middles:
// the rim's error, some h wide, averages out along it.
TEST(suction_takes_a_disc_from_a_sheet)
{
    const double radius = 0.03;
    double last = 0.0;
    for (int levels = 0; levels < 4; levels++) {
        double square = 0.0, h = 0.0;
        enum { PLACES = 9 };
        for (int i = 0; i < PLACES; i++) {
            SurfaceOptions options = wall_options(levels, 0);
            SCOPED(bench_destroy) DetailBench bench;
            TriMesh mesh;
            assert_true(generate_sheet(&mesh, 7, 9, 0.12, 0.16, &(Status){0}));
            bench_create(&bench, BENCH_CUTTABLE, &mesh, &options, NULL, NULL);
            h = bench.detail->set.cut->finder.h;
            const Vec3 at = {0.005 * (i % 3 - 1) + 0.001, 0.008 * (i / 3 - 1), 0.0};
            const double disc = M_PI * radius * radius, area = suck_all(&bench, at, radius);
            square += pow((area - disc) / disc, 2.0) / PLACES;
            WallShape shape;
            wall_expect_sound(&bench, &shape, 0);
            assert_int_equal(shape.pieces, 1);
            assert_int_equal(shape.borders, 2);
        }
        print_message("h = %.4f m: area off by %.2f %% rms\n", h, 100.0 * sqrt(square));
        // A layer of faces along the rim would be 2 h / r.
        expect_at_most(sqrt(square), 0.2 * h / radius);
        assert_true(levels == 0 || sqrt(square) < 0.6 * last);
        last = sqrt(square);
    }
}

// A body always has a face left, and what is left can be simulated.
TEST(the_last_face_stays)
{
    for (int levels = 0; levels < 2; levels++) {
        SurfaceOptions options = wall_options(levels, 0);
        options.shape.frame = SHAPE_BODY;
        SCOPED(bench_destroy) DetailBench bench;
        wall_create(&bench, WALL_SPHERE, &options, 0.3);
        suck_all(&bench, vec3(0.0, 0.0, 0.0), 1.0);
        WallShape shape;
        wall_expect_sound(&bench, &shape, 0);
        assert_int_equal(shape.faces, 1);
        assert_int_equal(shape.nodes, 3);
        sim_ticks(bench.sim, 200);
        assert_int_equal(sim_resets(bench.sim), 0);
        sim_reset(bench.sim);
        wall_expect_sound(&bench, &shape, 0);
        assert_int_equal(shape.nodes, 114);
    }
}

static double stored_heat(const DetailBench *bench)
{
    double sum = 0.0;
    for (int f = 0; f < bench->detail->set.face_count; f++)
        sum += bench->detail->set.cut->heat->energy[f];
    return sum;
}

// What a tissue of 70 % water takes from body temperature until it is gone [J/kg].
#define TO_BOIL_AWAY (3600.0 * (100.0 - 37.0) + 0.7 * 2.26e6)

TEST(heat_is_in_the_wall_or_left_with_what_boiled)
{
    uint64_t random = 8;
    SurfaceOptions options = wall_options(1, 0);
    options.heats = true;
    SCOPED(bench_destroy) DetailBench bench;
    wall_create(&bench, WALL_SPHERE, &options, 0.3);
    double given = 0.0, boiled = 0.0, coagulated = 0.0;
    int spared = 0;
    // All in the time between two ticks, in which nothing cools.
    for (int i = 0; i < 60; i++) {
        const Vec3 at = wall_random_node(&bench, &random);
        const Region tip = {REGION_CAPSULE, at, at, random_between(&random, 1e-3, 0.02)};
        const double heat = pow(10.0, random_between(&random, -2.0, 4.0));
        const RemovalOutcome went = wall_remove(&bench, REMOVER_DIATHERMY, &tip, heat);
        expect_at_most(went.heat, heat * (1.0 + 1e-12));
        spared += went.heat < 0.99 * heat; // all that it touches boils
        given += went.heat;
        boiled += went.mass * TO_BOIL_AWAY;
        coagulated = went.coagulated;
        expect_near(stored_heat(&bench) + boiled, given, 1e-12 * given);
    }
    WallShape shape;
    wall_expect_sound(&bench, &shape, 0);
    assert_true(boiled > 0.0 && stored_heat(&bench) > 0.0 && spared > 0 && coagulated > 0.0);
    // Blood cools it with a time constant of 1 / 0.015 s until it is heated again.
    sim_ticks(bench.sim, 500);
    const double before = stored_heat(&bench);
    const Vec3 at = wall_random_node(&bench, &random);
    const Region tip = {REGION_CAPSULE, at, at, 1e-3};
    const RemovalOutcome went = wall_remove(&bench, REMOVER_DIATHERMY, &tip, 1e-3);
    assert_int_equal(went.removed, 0);
    expect_near(stored_heat(&bench), before * exp(-0.015 * 0.5) + 1e-3, 1e-12 * before);
}

// Of nodes of the hole's rim, from the way of the mouth, in h.
static void measure_rim(const DetailBench *bench, Vec3 from, Vec3 to, double radius, double *rms,
                        double *most)
{
    const BodySurface *surface = &bench->body->surface;
    double square = 0.0;
    int count = 0;
    *most = 0.0;
    for (int f = 0; f < surface->face_used; f++)
        for (int k = 0; k < 3 && surface->face[f][0] != surface->face[f][1]; k++) {
            Vec3 x;
            if (surface->face_neighbor[f][k] >= 0)
                continue;
            bench->body->ops->read_nodes(bench->model, &surface->face[f][k], 1, &x, NULL);
            if (fabs(x.x) > 0.0599 || fabs(x.y) > 0.0799)
                continue; // the sheet's own border
            const double off = fabs(distance_point_segment(x, from, to) - radius) /
                               bench->detail->set.cut->finder.h;
            square += off * off;
            *most = fmax(*most, off);
            count++;
        }
    *rms = sqrt(square / count);
}

TEST(a_rim_goes_along_the_mouth)
{
    for (int kind = 0; kind < 2; kind++)
        for (int way = 0; way < 2; way++) {
            TriMesh mesh;
            SurfaceOptions options = wall_options(2, 0);
            SCOPED(bench_destroy) DetailBench bench;
            assert_true(generate_sheet(&mesh, 7, 9, 0.12, 0.16, &(Status){0}));
            bench_create(&bench, BENCH_CUTTABLE, &mesh, &options, NULL, NULL);
            const Vec3 from = {0.001, -0.02, 0.0}, to = {0.004, way == 0 ? -0.02 : 0.03, 0.0};
            for (int i = 0; i < 200; i++) {
                const Vec3 at = vec3_madd(from, i / 199.0, vec3_sub(to, from));
                const Region mouth = {REGION_CAPSULE, at, at, 0.02};
                wall_remove(&bench, kind == 0 ? REMOVER_SUCTION : REMOVER_DRILL, &mouth,
                            (double)INFINITY);
            }
            double rms, most;
            measure_rim(&bench, from, to, 0.02, &rms, &most);
            print_message("%s, %s: rim off by %.2f h rms, %.2f h at most\n",
                          kind == 0 ? "suction" : "drill", way == 0 ? "at rest" : "drawn", rms,
                          most);
            // Without lips a drill's rim is off by 0.5 and 1.0 h: it takes all that it touches.
            expect_at_most(rms, 0.35);
            expect_at_most(most, 0.8);
        }
}
