// SPDX-License-Identifier: MIT
// Surface bodies that tear where they are stretched too far.
#include "wall_check.h"

#include "test.h"
#include "sim_steps.h"
#include "fixture.h"

// Held along one short end, pulled at the other with the same force whether or not it has a notch
// from one long side, at its middle.
typedef struct Pull {
    int start_level;
    double notch; // [m]
} Pull;

static const FixedRegion HELD = {
    .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, -0.079, 1.0}};
static const LoadOptions LOAD = {.body = 0,
                                 .center = {0.0, 0.14, 0.0},
                                 .radius = 0.085,
                                 .force = {0.0, 2.0, 0.0},
                                 .duration = 100.0};

static void create(DetailBench *bench, const Pull *pull)
{
    SurfaceOptions options = bench_options(1, pull->start_level);
    options.shape.wanted = false;
    options.material.node_damping = 0.5; // near critical: no waves
    options.tear_stretch = 0.5;
    fix_within(&options.body, &HELD);
    bench_create_on(bench, BENCH_CUTTABLE, fixture_sheet, &options, NULL, &LOAD);
    if (pull->notch <= 0.0)
        return;
    CutOptions notch = {.body = 0};
    for (int k = 0; k < 2; k++) {
        double z = k == 0 ? -0.05 : 0.05;
        notch.before.end[k] = vec3(-0.07, 0.001, z);
        notch.after.end[k] = vec3(-0.06 + pull->notch, 0.001, z);
    }
    CutOutcome outcome;
    char why[256];
    assert_true(sim_apply_cut(bench->sim, &notch, &outcome, why, sizeof why));
    assert_int_equal(outcome.pieces, 1);
}

static int run(DetailBench *bench, int ticks)
{
    for (int i = 0; i < ticks; i++) {
        double mass = bench_mass(bench);
        sim_step(bench->sim);
        expect_near(bench_mass(bench), mass, 1e-12 * mass);
    }
    assert_int_equal(sim_resets(bench->sim), 0);
    return bench->detail->set.cut->piece_count;
}

TEST(a_sheet_within_its_strength_stays_whole)
{
    const Pull pull = {.start_level = 1};
    SCOPED(bench_destroy) DetailBench bench;
    create(&bench, &pull);
    assert_int_equal(run(&bench, 4000), 1);
    assert_int_equal(*bench.detail->set.cut->copies, 0);
    print_message("pulled %.1f mm longer\n", 1e3 * measure_of(bench.body).max_displacement);
}

// A body that goes back to its rest shape after its numbers went bad is as one that never was
// stretched.
TEST(a_sheet_that_went_back_to_rest_stays_whole)
{
    const Pull pull = {.start_level = 1};
    SCOPED(bench_destroy) DetailBench bench;
    create(&bench, &pull);
    run(&bench, 10);
    const DetailCut *cut = bench.detail->set.cut;
    for (int e = 0; e < bench.detail->set.levels.level[bench.detail->set.levels.finest].edge_count;
         e++)
        cut->stretch[e] = 10.0f;
    bench.body->ops->restore(bench.model, RESTORE_SHAPE);
    assert_int_equal(run(&bench, 100), 1);
    assert_int_equal(*cut->copies, 0);
}

TEST(a_notched_sheet_tears_from_its_notch_in_two)
{
    for (int start = 0; start < 2; start++) {
        const Pull pull = {.start_level = start, .notch = 0.055};
        SCOPED(bench_destroy) DetailBench bench;
        create(&bench, &pull);
        int pieces = run(&bench, 4000);
        WallShape shape = wall_expect_manifold(&bench.body->mesh, 0);
        wall_expect_locked(&bench);
        bench_expect_sound(&bench);
        assert_int_equal(shape.pieces, pieces);
        // One crack from the notch to the other side; it may follow the mesh's diagonals.
        const DetailCut *cut = bench.detail->set.cut;
        int faces = bench.detail->set.face_count, upper = 0, lower = 0;
        for (int f = 0; f < faces; f++) {
            upper += cut->piece[f] == cut->node_piece[62];
            lower += cut->piece[f] == cut->node_piece[0];
        }
        double farthest = 0.0; // from the notch's height, before the crack had half of its way
        for (int c = 0; c < *cut->copies; c++)
            if (bench.detail->set.levels.position[cut->origin[c]].x < 0.0)
                farthest =
                    fmax(farthest, fabs(bench.detail->set.levels.position[cut->origin[c]].y));
        print_message(
            "start_level %d: %d of %d faces torn off, %lld copies, %.1f mm off the notch\n", start,
            upper, faces, (long long)*cut->copies, 1e3 * farthest);
        // A chip may come off the lips.
        assert_true(upper + lower >= faces - 8);
        assert_true(upper > faces / 5 && lower > faces / 5);
        expect_at_most(farthest, 0.015); // an edge of the finest level is 10 mm to 14 mm
    }
}
