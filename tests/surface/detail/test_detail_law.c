// SPDX-License-Identifier: MIT
// Springs that relax and stiffen on bodies whose faces are refined, coarsened and cut.
#include "detail_bench.h"

#include "effort.h"
#include "test.h"
#include "both_ends.h"
#include "sim_steps.h"
#include "fixture.h"
#include "geometry/generator.h"
#include "random.h"

#include "surface/law.h"

static SurfaceOptions law_options(int levels, int precision)
{
    SurfaceOptions options = bench_options(levels, 0);
    options.shape.wanted = false;
    options.body.integrator = INTEGRATOR_LEAPFROG;
    options.body.precision = (Precision)precision;
    options.material.damping_time = 0.0;
    options.material.branch_count = 2;
    options.material.branch[0] = (MaxwellBranch){0.02, 0.25, false};
    options.material.branch[1] = (MaxwellBranch){0.2, 0.35, false};
    options.material.stiffening = (Stiffening){0.2, 10.0};
    return options;
}

static bool is_on(const DetailBench *bench, int node)
{
    return bench->detail->set.status[node] != NODE_OFF;
}

static void throw_body(DetailBench *bench, double speed, uint64_t *random)
{
    SurfaceModel *model = bench->model;
    for (int s = 0; s < model->basis.count; s++) {
        Vec3 x;
        if (model->node[s] < 0)
            continue;
        rows_read(&model->basis, model->rows[model->current], s, &x, NULL);
        rows_write(&model->basis, model->rows[model->current], s, x,
                   vec3_madd(vec3_cross(vec3(2.0, -4.0, 8.0), x), speed, random_vec3(random)));
    }
    detail_hang(&bench->detail->lists, model->basis.precision, model->rows[model->current]);
}

// A body that moves, and changes at random: both ends of each spring agree, what is packed locally
// equals what is built anew, mass and momentum stay.
TEST(changes_keep_both_ends_and_momentum)
{
    for (int precision = 0; precision < PRECISION_COUNT; precision++)
        for (int adjust = 0; adjust < 2; adjust++) {
            SurfaceOptions options = law_options(3, precision);
            options.adjust = (SurfaceAdjust)adjust;
            SCOPED(bench_destroy) DetailBench bench;
            bench_create_on(&bench, BENCH_ADAPTIVE, fixture_sphere, &options, NULL, NULL);
            uint64_t random = 9;
            throw_body(&bench, 0.1, &random);
            double most = 0.0;
            for (int i = 0; i < EFFORT(150); i++) {
                const Vec3 before = bench_momentum(&bench);
                const double energy = measure_of(bench.body).elastic;
                bench_change_at_random(&bench, &random, i < 75 ? 9 : 2);
                expect_both_ends_alike(bench.model);
                bench_expect_sound(&bench);
                most = fmax(most, measure_of(bench.body).elastic / energy - 1.0);
                // Rounding of a sum over some 1000 nodes; choi2005 keeps no momentum.
                if (adjust == ADJUST_CONTINUUM)
                    expect_at_most(vec3_length(vec3_sub(bench_momentum(&bench), before)),
                                   (precision == PRECISION_SINGLE ? 1e-5 : 1e-12) *
                                       bench_mass(&bench));
                sim_step(bench.sim);
                expect_both_ends_alike(bench.model);
            }
            print_message("%s, %s: a change adds at most %.2g of the elastic energy\n",
                          precision == PRECISION_SINGLE ? "single" : "double",
                          adjust == ADJUST_CONTINUUM ? "continuum" : "choi2005", most);
        }
}

// A flat sheet that is strained alike everywhere and partly relaxed: dividing faces and taking them
// back changes no energy, and what is relaxed is the same everywhere.
TEST(a_homogeneous_strain_keeps_its_energy)
{
    TriMesh mesh;
    SurfaceOptions options = law_options(3, PRECISION_DOUBLE);
    options.material.areal_density = 1e15; // nothing moves
    assert_true(generate_sheet(&mesh, 9, 7, 0.2, 0.15, &(Status){0}));
    SCOPED(bench_destroy) DetailBench bench;
    bench_create(&bench, BENCH_ADAPTIVE, &mesh, &options, NULL, NULL);
    SurfaceModel *model = bench.model;
    for (int i = 0; i < bench.detail->set.node_count; i++) {
        if (!is_on(&bench, i))
            continue;
        const Vec3 x = bench.levels.position[i];
        rows_write(&model->basis, model->rows[model->current], model->slot[i],
                   vec3(1.15 * x.x + 0.05 * x.y, 0.95 * x.y, 0.0), vec3(0.0, 0.0, 0.0));
    }
    uint64_t random = 3;
    for (int i = 0; i < EFFORT(100); i++) {
        sim_step(bench.sim);
        const double before = measure_of(bench.body).elastic;
        bench_change_at_random(&bench, &random, i < 60 ? 9 : 2);
        // Rounding, and the sheet's own motion of 1e-10.
        expect_near(measure_of(bench.body).elastic / before, 1.0, 1e-9);
    }
    assert_true(bench.detail->adapt.sweep->coarsened > 5);
}

// With hanging nodes: forces are the slope of the energy, by one kick that is too short to move
// anything. Hanging nodes follow their masters.
TEST(forces_are_the_gradient_of_the_energy)
{
    SurfaceOptions options = law_options(2, PRECISION_DOUBLE);
    options.prestress = 0.05;
    SCOPED(bench_destroy) DetailBench bench;
    bench_create_on(&bench, BENCH_ADAPTIVE, fixture_sheet, &options, NULL, NULL);
    uint64_t random = 12;
    throw_body(&bench, 0.2, &random);
    for (int i = 0; i < 30; i++) {
        bench_change_at_random(&bench, &random, 8);
        sim_step(bench.sim);
    }
    SurfaceModel *model = bench.model;
    const DetailLists *lists = &bench.detail->lists;
    assert_true(lists->hanging_count > 5);
    const double h = 1e-9, step = 1e-7;
    const int count = model->basis.count;
    FREED Vec3 *x = calloc((size_t)count, sizeof *x), *d = calloc((size_t)count, sizeof *d);
    void *rows = model->rows[model->current];
    double energy[2], slope = 0.0, size = 0.0;
    for (int s = 0; s < count; s++)
        if (model->node[s] >= 0) {
            rows_read(&model->basis, rows, s, &x[s], NULL);
            d[s] = random_vec3(&random);
        }
    for (int side = 0; side < 3; side++) {
        for (int s = 0; s < count; s++)
            if (model->node[s] >= 0)
                rows_write(&model->basis, rows, s, vec3_madd(x[s], (side - 1) * step, d[s]),
                           vec3(0.0, 0.0, 0.0));
        detail_hang(lists, model->basis.precision, rows);
        if (side != 1)
            energy[side / 2] = measure_of(bench.body).elastic;
    }
    for (int s = 0; s < count; s++)
        if (model->node[s] >= 0)
            rows_write(&model->basis, rows, s, x[s], vec3(0.0, 0.0, 0.0));
    detail_hang(lists, model->basis.precision, rows);
    Evaluation kick = integrator_evaluation(integrator_get(INTEGRATOR_SYMPLECTIC_EULER), 0, true);
    bench.body->ops->drift(model, 0.0);
    bench.body->ops->evaluate(model, &kick, h);
    assert_true(bench.body->ops->commit(model));
    for (int i = 0; i < bench.detail->set.node_count; i++) {
        Vec3 at, v;
        if (bench.detail->set.status[i] != NODE_FREE)
            continue;
        rows_read(&model->basis, model->rows[model->current], model->slot[i], &at, &v);
        const Vec3 f = vec3_scale(model->mass[i] / h, v);
        slope -= vec3_dot(f, d[model->slot[i]]);
        size += vec3_length(f);
    }
    // Differences 1e-7 m apart err by 1e-10, and branches are felt h / 2 later.
    expect_near((energy[1] - energy[0]) / (2.0 * step), slope, 1e-6 * size);
}

// A body built anew, as in another process, goes on from a state with the same bits: five ticks.
// (Its topology has another number.)
static void expect_same_elsewhere(const DetailBench *bench, const SurfaceOptions *options,
                                  const void *state)
{
    SCOPED(bench_destroy) DetailBench other;
    bench_create_on(&other, BENCH_CUTTABLE, fixture_sphere, options, NULL, NULL);
    resume(&other.state, other.sim, state);
    sim_ticks(other.sim, 5);
    const SurfaceModel *a = bench->model, *b = other.model;
    const Relaxation *from = a->relaxation, *to = b->relaxation;
    const size_t real = model_real_size(a),
                 numbers = (size_t)(from->layout.groups * from->count * LANES);
    assert_memory_equal(a->rows[a->current], b->rows[b->current],
                        (size_t)a->basis.count * ROW * real);
    assert_memory_equal(from->strain[from->current], to->strain[to->current], numbers * real);
}

// A moving body is cut, refined around the cut: its springs keep their dashpots, so that the cut
// adds no energy but what refining adds; states repeat from before and after.
TEST(cuts_keep_the_dashpots)
{
    for (int levels = 0; levels < 3; levels++)
        for (int precision = 0; precision < PRECISION_COUNT; precision++) {
            SurfaceOptions options = law_options(levels, precision);
            options.shape = (SurfaceShape){.wanted = true,
                                           .angular_frequency = 30.0,
                                           .damping_ratio = 0.1,
                                           .frame = SHAPE_BODY};
            SCOPED(bench_destroy) DetailBench bench;
            bench_create_on(&bench, BENCH_CUTTABLE, fixture_sphere, &options, NULL, NULL);
            uint64_t random = 5;
            throw_body(&bench, 0.1, &random);
            sim_ticks(bench.sim, 20);
            FREED void *middle = copy_state(&bench.state);
            uint64_t hash[2];
            for (int pass = 0; pass < 2; pass++) {
                double most = 0.0;
                int separated = 0;
                for (int i = 0; i < 8; i++) { // strokes one after the other
                    char why[256];
                    const double z = -0.06 + 0.015 * i;
                    const CutOptions cut = {
                        .body = 0,
                        .before = {{{-0.2, 0.004, z}, {-0.2, 0.004, z + 0.015}}},
                        .after = {{{0.2, 0.004, z}, {0.2, 0.004, z + 0.015}}}};
                    CutOutcome sum = {0};
                    const double before = measure_of(bench.body).elastic;
                    assert_true(sim_apply_cut(bench.sim, &cut, &sum, why, sizeof why));
                    separated += sum.separated;
                    most = fmax(most, measure_of(bench.body).elastic / before - 1.0);
                    expect_both_ends_alike(bench.model);
                    sim_step(bench.sim);
                    expect_both_ends_alike(bench.model);
                }
                assert_true(separated > 10);
                if (pass == 0)
                    print_message("%d levels, %s: a cut adds at most %.2g of the elastic energy\n",
                                  levels, precision == PRECISION_SINGLE ? "single" : "double",
                                  most);
                sim_ticks(bench.sim, 20);
                hash[pass] = state_hash(&bench.state);
                // Also from a state after the cut.
                FREED void *after = copy_state(&bench.state);
                sim_ticks(bench.sim, 5);
                const uint64_t end = state_hash(&bench.state);
                expect_same_elsewhere(&bench, &options, after);
                resume(&bench.state, bench.sim, after);
                sim_ticks(bench.sim, 5);
                assert_true(state_hash(&bench.state) == end);
                resume(&bench.state, bench.sim, middle);
            }
            assert_true(hash[0] == hash[1]);
        }
}
