// SPDX-License-Identifier: MIT
// How a body with levels moves: as one of a single level where it has one, with its momentum and
// mass kept through every change, without a start of its own, in patches as in whole.
#include "detail_bench.h"

#include "body/integrator.h"
#include "test.h"
#include "fixture.h"
#include "geometry/generator.h"
#include "geometry/levels.h"
#include "random.h"

static const LoadOptions PRESS = {.body = 0,
                                  .center = {0.0, 0.0, 0.05},
                                  .radius = 0.025,
                                  .force = {0.0005, 0.0002, -0.002},
                                  .start = 0.0,
                                  .duration = 0.05};

// Position of the node with an id.
static Vec3 find(const Body *body, const Vec3 *position, int id)
{
    for (int i = 0; i < body->mesh.node_count; i++)
        if (body->mesh.id[i] == id)
            return position[i];
    fail_msg("no node %d", id);
    return (Vec3){0};
}

static void compare_with_dense(const SurfaceOptions *options, const LoadOptions *load,
                               double tolerance)
{
    TriMesh mesh;
    SCOPED(bench_destroy) DetailBench adaptive, dense;
    fixture_sphere(&mesh);
    bench_create(&adaptive, BENCH_ADAPTIVE, &mesh, options, NULL, load);
    fixture_sphere(&mesh);
    bench_create(&dense, BENCH_DENSE, &mesh, options, NULL, load);
    assert_int_equal(adaptive.body->mesh.node_count, dense.body->mesh.node_count);
    assert_int_equal(adaptive.body->spring_count, dense.body->spring_count);
    assert_true(fabs(adaptive.body->mass / dense.body->mass - 1.0) < 1e-13);
    // Substeps must be alike, bounds may differ by rounding.
    assert_int_equal(adaptive.body->substeps, dense.body->substeps);
    for (int i = 0; i < 60; i++) {
        sim_step(adaptive.sim);
        sim_step(dense.sim);
    }
    size_t nodes = (size_t)dense.body->mesh.node_count;
    Vec3 *x[2], *v[2];
    for (int k = 0; k < 2; k++) {
        const DetailBench *bench = k == 0 ? &adaptive : &dense;
        x[k] = calloc(nodes, sizeof **x);
        v[k] = calloc(nodes, sizeof **v);
        bench->body->ops->read_state(bench->model, NULL, x[k], v[k]);
    }
    double most = 0.0, worst = 0.0;
    for (size_t i = 0; i < nodes; i++) {
        Vec3 other = find(adaptive.body, x[0], dense.body->mesh.id[i]);
        worst = fmax(worst, vec3_length(vec3_sub(other, x[1][i])));
        most = fmax(most, vec3_length(vec3_sub(x[1][i], dense.dense.position[i])));
    }
    assert_true(most > 1e-5);
    if (!(worst <= tolerance * most))
        fail_msg("level %d, %s, frame %d: differs by %g of %g m", options->start_level,
                 options->body.precision == PRECISION_SINGLE ? "single" : "double",
                 (int)adaptive.model->shape, worst, most);
    for (int k = 0; k < 2; k++) {
        free(x[k]);
        free(v[k]);
    }
}

TEST(a_body_wholly_of_one_level_moves_as_one_without_levels)
{
    for (int level = 0; level <= 2; level++)
        for (int adjust = 0; adjust < 2; adjust++)
            for (int variant = 0; variant < 6; variant++) {
                SurfaceOptions options = bench_options(2, level);
                options.adjust = (SurfaceAdjust)adjust;
                options.body.integrator = (IntegratorKind)(variant % 3);
                options.prestress =
                    variant == 3 ? 0.001 : 0.0; // more and the shell buckles at once
                if (variant == 4)
                    options.shape.frame = SHAPE_BODY;
                if (variant == 5)
                    options.shape = (SurfaceShape){.wanted = false};
                options.body.time_step = 1e-4; // short enough for all: the same substeps
                // Order of additions differs: rounding, grown by 60 ticks of motion.
                compare_with_dense(&options, &PRESS, 1e-10);
                options.body.precision = PRECISION_SINGLE;
                // In single precision 1e-5 is what either keeps to double (test_single).
                compare_with_dense(&options, &PRESS, 2e-5);
            }
}

static void shake(DetailBench *bench, uint64_t *random)
{
    for (int i = 0; i < bench->detail->set.node_count; i++)
        if (bench->detail->set.status[i] == NODE_FREE && !bench->detail->fixed[i])
            for (int c = 0; c < 3; c++)
                model_put(bench->model, bench->model->rows[bench->model->current],
                          (long)bench->model->slot[i] * ROW + 4 + c,
                          random_between(random, -1.0, 1.0));
    detail_hang(&bench->model->detail->lists, bench->model->basis.precision,
                bench->model->rows[bench->model->current]);
}

// The velocity averaged on refinement, shared out on coarsening
// (server/surface/detail/README.md, "Momentum and mass across changes"): M c is the scale of
// momenta, c the speed of waves.
TEST(changes_keep_mass_and_momentum)
{
    uint64_t random = 99;
    for (int kind = 0; kind < 2; kind++) {
        TriMesh mesh;
        SurfaceOptions options = bench_options(3, 0);
        if (kind == 0)
            fixture_organ(&mesh);
        else
            fixture_sheet(&mesh);
        SCOPED(bench_destroy) DetailBench bench;
        bench_create(&bench, BENCH_ADAPTIVE, &mesh, &options, NULL, NULL);
        double mass = bench_mass(&bench), scale = mass * bench.detail->adapt.wave_speed;
        double worst_mass = 0.0, worst_jump = 0.0;
        for (int i = 0; i < 3000; i++) {
            shake(&bench, &random);
            Vec3 before = bench_momentum(&bench);
            bench_change_at_random(&bench, &random, i / 200 % 2 == 0 ? 8 : 3);
            worst_jump =
                fmax(worst_jump, vec3_length(vec3_sub(bench_momentum(&bench), before)) / scale);
            worst_mass = fmax(worst_mass, fabs(bench_mass(&bench) / mass - 1.0));
            worst_mass = fmax(worst_mass, fabs(bench.body->mass / mass - 1.0));
        }
        // Sums of some thousand terms in double: 1e-13 of rounding.
        if (!(worst_mass < 1e-12 && worst_jump < 1e-12))
            fail_msg("mass %g, momentum %g", worst_mass, worst_jump);
    }
}

// Largest |u| and |v| of nodes in use.
static void measure(const DetailBench *bench, double *moved, double *speed)
{
    *moved = *speed = 0.0;
    const SurfaceModel *model = bench->model;
    for (int i = 0; i < bench->detail->set.node_count; i++) {
        if (bench->detail->set.status[i] == NODE_OFF)
            continue;
        Vec3 x, v;
        rows_read(&model->basis, model->rows[model->current], model->slot[i], &x, &v);
        const double *place = model->basis.rest[model->slot[i]];
        Vec3 rest = vec3_add(model->basis.rest_origin, (Vec3){place[0], place[1], place[2]});
        *moved = fmax(*moved, vec3_length(vec3_sub(x, rest)));
        *speed = fmax(*speed, vec3_length(v));
    }
}

// Choi et al. 2005, eq 9: the step follows the finest level that is in use, tick by tick.
TEST(paper_step_follows_the_finest_level_in_use)
{
    const LoadOptions press = {
        .center = {0.0, 0.0, 0.05}, .radius = 0.02, .force = {0.0, 0.0, -0.5}, .duration = 0.2};
    SurfaceOptions options = bench_options(3, 0);
    options.adjust = ADJUST_CHOI2005;
    options.material.damping_time = 0.0;
    options.adapt.check_hz = 1000.0;
    SCOPED(bench_destroy) DetailBench bench;
    bench_create_on(&bench, BENCH_ADAPTIVE, fixture_sphere, &options, NULL, &press);
    const double zero_level =
        stability_time_step(INTEGRATOR_RK4, bench.body->lambda, bench.body->damping);
    int ticks[4] = {0};
    for (int i = 0; i < 2000; i++) {
        sim_step(bench.sim);
        const double step = ldexp(zero_level, -bench.body->finest_level);
        assert_int_equal(bench.body->substeps, stability_substeps(1e-3, step));
        ticks[bench.body->finest_level]++;
    }
    // Pressed it is refined wholly, at ease it comes back.
    print_message("ticks by finest level: %d %d %d %d\n", ticks[0], ticks[1], ticks[2], ticks[3]);
    assert_true(ticks[3] > 100 && ticks[0] > 100);
}

TEST(a_body_at_rest_stays_at_rest_whatever_its_levels)
{
    uint64_t random = 4;
    for (int variant = 0; variant < 8; variant++) {
        SurfaceOptions options = bench_options(3, 0);
        options.adjust = variant & 1 ? ADJUST_CHOI2005 : ADJUST_CONTINUUM;
        options.body.precision = variant & 2 ? PRECISION_SINGLE : PRECISION_DOUBLE;
        options.shape.frame = variant & 4 ? SHAPE_BODY : SHAPE_WORLD;
        SCOPED(bench_destroy) DetailBench bench;
        bench_create_on(&bench, BENCH_ADAPTIVE, fixture_organ, &options, NULL, NULL);
        for (int i = 0; i < 120; i++) {
            bench_change_at_random(&bench, &random, i < 80 ? 9 : 3);
            sim_step(bench.sim);
        }
        double moved, speed;
        measure(&bench, &moved, &speed);
        // Displacements in single are zero exactly; positions round to 1e-17 m, and 50 rad/s of
        // shape springs make some 1e-15 m/s of that.
        if (!(moved < 1e-14 && speed < 1e-12))
            fail_msg("variant %d: %g m, %g m/s", variant, moved, speed);
    }
}

// With choi2005 a new node lies where the butterfly of the present positions has it: divided all
// over, a level is the one that butterfly_midpoints makes of the level above as it is now.
TEST(the_papers_new_nodes_lie_on_the_present_butterfly)
{
    uint64_t random = 12;
    for (int variant = 0; variant < 6; variant++) {
        TriMesh mesh;
        SurfaceOptions options = bench_options(1, 0);
        options.adjust = ADJUST_CHOI2005;
        options.body.precision = variant % 2 == 0 ? PRECISION_DOUBLE : PRECISION_SINGLE;
        if (variant / 2 == 0)
            fixture_organ(&mesh);
        else if (variant / 2 == 1)
            fixture_sheet(&mesh);
        else
            fixture_sphere(&mesh);
        SCOPED(bench_destroy) DetailBench bench;
        bench_create(&bench, BENCH_ADAPTIVE, &mesh, &options, NULL, NULL);
        const SurfaceModel *model = bench.model;
        int nodes = bench.mesh.node_count;
        FREED Vec3 *now = calloc((size_t)nodes, sizeof *now);
        for (int i = 0; i < nodes; i++) {
            now[i] = vec3_madd(bench.mesh.position[i], 0.003, random_vec3(&random));
            rows_write(&model->basis, model->rows[model->current], model->slot[i], now[i],
                       (Vec3){0.0, 0.0, 0.0});
        }
        SCOPED(winged_destroy) WingedMesh winged;
        winged_create(&winged, &bench.mesh);
        FREED Vec3 *middle = calloc((size_t)winged.edge_count, sizeof *middle);
        // Which corners of a border are sharp is a matter of the rest shape: of displacements,
        // then.
        FREED Vec3 *rest = calloc((size_t)winged.edge_count, sizeof *rest);
        const int(*face)[3] = (const int(*)[3])bench.mesh.triangle;
        butterfly_midpoints(&winged, face, bench.mesh.position, rest);
        butterfly_midpoints(&winged, face, now, middle);
        for (int f = 0; f < bench.mesh.triangle_count; f++) {
            detail_begin_change(bench.model);
            detail_refine(bench.model, 0, f);
            detail_end_change(bench.body);
        }
        for (int e = 0; e < winged.edge_count; e++) {
            if (winged_is_boundary_edge(&winged, e))
                continue;
            Vec3 x;
            rows_read(&model->basis, model->rows[model->current], model->slot[nodes + e], &x, NULL);
            // Displacements of 3 mm, in single precision to 1e-7 of that.
            double tolerance = options.body.precision == PRECISION_DOUBLE ? 1e-15 : 1e-9;
            assert_true(vec3_length(vec3_sub(x, middle[e])) < tolerance);
            assert_true(vec3_length(vec3_sub(x, rest[e])) > 1e-5);
        }
    }
}
