// SPDX-License-Identifier: MIT
// A study of voxels: the finest reference of a box has half its cells, and the same points.
#include "test.h"
#include "study_bench.h"

#include "study/sampler.h"
#include "study/run.h"

#define BLOCK(voxels)                                                                              \
    "rate_hz = 500.0;\n"                                                                           \
    "bodies = ( { name = \"block\"; model = \"voxel\"; voxels = { " voxels " };\n"                 \
    "  levels = 1; material = { youngs_modulus = 1.0e4; density = 1000.0; damping = 0.2; };\n"     \
    "  fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.0199]); } ); } );\n"                   \
    "loads = ( { center = [0.0, 0.0, 0.02]; radius = 0.012; force = [0.0, 0.0, -0.2];"             \
    " duration = 10.0; } );\n"
#define BOX "generator = \"box\"; count = [4, 4, 4]; size = 0.01;"

static const StudyOptions SHORT = {.duration_s = 0.1, .repeats = 1, .quick = true};

AROUND_ALL(scratch_begin, scratch_end)

TEST(a_box_has_its_points_in_half_cells_too)
{
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, BLOCK(BOX), &SHORT);
    const StudyPoints *points = &bench.context.points;
    assert_true(bench.context.may_halve);
    assert_int_equal(points->count, 5 * 5 * 5 - 3 * 3 * 3); // the outer vertices
    for (int p = 0; p < points->count; p++)
        assert_true(points->fine_id[p] >= 0);
    expect_near(bench.context.rest_volume, 0.04 * 0.04 * 0.04, 1e-9); // of float positions
}

// Both lattices tell of the same places: the one with half the cells moves nearly as the other
// does, point by point. The faces of a cube of four cells bend too little by tenths; points that
// were taken for each other would be off by as much as there is.
TEST(half_cells_move_as_whole_ones)
{
    SCOPED(bench_destroy) Bench bench;
    StudyRun run;
    StudyTrace *trace[2];
    bench_create(&bench, BLOCK(BOX), &SHORT);
    for (int k = 0; k < 2; k++) {
        StudyCase what = study_scene_case(&bench.scene);
        what.is_scene = false;
        what.precision = PRECISION_DOUBLE;
        what.detail = DETAIL_HELD;
        what.level = -k;
        trace[k] = study_trace_create(bench.context.sample_count, bench.context.points.count);
        assert_true(study_trace_case(&bench.context, &what, 1, &run, trace[k]));
        assert_string_equal(run.why, "");
        assert_int_equal(run.links, k == 0 ? 64 : 512);
    }
    StudyErrors errors = study_errors(trace[0], trace[1]);
    print_message("cells of 1 cm against half of it: patch %.3g, points %.3g, volume %.3g\n",
                  errors.patch, errors.surface, errors.volume);
    expect_at_most(errors.patch, 0.25);
    expect_at_most(errors.surface, 0.4);
    assert_true(errors.patch > 1e-3); // they are not the same run
    free(trace[0]);
    free(trace[1]);
}

TEST(what_is_no_box_is_not_cut_finer)
{
    static StudyCase cases[STUDY_CASES];
    static StudyResult result;
    SCOPED(bench_destroy) Bench bench;
    Status status = {0};
    bench_create(&bench, BLOCK("generator = \"ball\"; radius = 0.02; size = 0.01;"), &SHORT);
    assert_false(bench.context.may_halve);
    cases[0] = study_scene_case(&bench.scene);
    assert_true(study_make_references(&bench.context, cases, 1, NULL, NULL, &result, &status));
    expect_in(result.finest.what, "levels 0");
    assert_false(result.finest.known); // one run tells nothing of its own error
    assert_true(result.mesh[0].reference.known);
    // Leapfrog with damping taken explicitly: order 1 at least.
    assert_true(result.mesh[0].reference.order > 0.9);
}
