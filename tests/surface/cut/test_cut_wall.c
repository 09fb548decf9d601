// SPDX-License-Identifier: MIT
// Cuts of surface bodies through the simulation: on meshes that are refined, deformed and moving,
// with everything re-derived from scratch after each.
#include "wall_bench.h"

#include "effort.h"
#include "test.h"
#include "sim_steps.h"
#include "random.h"

#include <time.h>

static int break_edge(DetailBench *bench, int edge)
{
    CutOutcome outcome = {.verdict = CUT_MET_NOTHING};
    detail_begin_change(bench->model);
    assert_true(detail_cut_break(bench->model, &edge, 1, &outcome));
    detail_end_cut(bench->body);
    return outcome.nodes_added;
}

// The edge that goes on from `node` on the other side, as straight as a ring of six has it.
static int edge_opposite(const DetailBench *bench, int node, int edge)
{
    const Level *at = &bench->detail->set.cut->uncut;
    int face = at->edge_face[edge][0];
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            int e = at->face_edge[face][k];
            if (e != edge && (at->edge[e][0] == node || at->edge[e][1] == node)) {
                edge = e;
                break;
            }
        }
        face = levels_beyond(at, edge, face);
    }
    return edge;
}

TEST(one_broken_edge_opens_nothing_two_in_a_row_one_node)
{
    for (int levels = 0; levels < 3; levels++) {
        SurfaceOptions options = wall_options(levels, 0);
        SCOPED(bench_destroy) DetailBench bench;
        wall_create(&bench, WALL_SPHERE, &options, 0.3);
        const Level *at = &bench.detail->set.cut->uncut;
        int edge = at->edge_count / 2, node = at->edge[edge][0];
        assert_int_equal(break_edge(&bench, edge), 0);
        WallShape shape;
        wall_expect_sound(&bench, &shape, 0);
        assert_int_equal(shape.borders, 0);
        assert_int_equal(break_edge(&bench, edge_opposite(&bench, node, edge)), 1);
        wall_expect_sound(&bench, &shape, 0);
        assert_int_equal(shape.borders, 1);
        assert_int_equal(shape.border_edges, 4);
        assert_int_equal(shape.pieces, 1);
    }
}

// Any edges in any order: sums of mass and stiffness stay what they were, to rounding.
TEST(random_edges_keep_every_invariant)
{
    uint64_t random = 15;
    for (int i = 0; i < EFFORT(8); i++) {
        SurfaceOptions options = wall_options(i % 2 + 1, i % 2 + 1);
        SCOPED(bench_destroy) DetailBench bench;
        wall_create(&bench, (WallMesh)(i % WALL_MESHES), &options, 0.5);
        const Level *at = &bench.detail->set.cut->uncut;
        double stiffness = wall_stiffness(&bench), mass = bench_mass(&bench);
        WallShape shape;
        for (int k = 0; k < 150; k++) {
            int edge = random_below(&random, at->edge_count);
            const int *face = at->edge_face[edge];
            bool inner = face[0] >= 0 && face[1] >= 0;
            for (int j = 0; j < 3 && inner; j++)
                inner = at->face_edge[face[0]][j] != edge ||
                        (bench.detail->set.cut->broken[face[0]] >> j & 1) == 0;
            if (!inner)
                continue;
            break_edge(&bench, edge);
            if (k % 10 == 0)
                wall_expect_sound(&bench, &shape, 0);
        }
        // Thousands of additions in another order.
        expect_near(wall_stiffness(&bench), stiffness, 1e-12 * stiffness);
        expect_near(bench_mass(&bench), mass, 1e-12 * mass);
    }
}

// Again at once: how many more links break. If none, the state does not even know that it was
// asked.
static int count_repeated(DetailBench *bench, const CutOptions *options)
{
    uint64_t before = state_hash(&bench->state);
    CutOutcome outcome = wall_cut(bench, options);
    if (outcome.separated == 0)
        assert_true(state_hash(&bench->state) == before);
    return outcome.separated;
}

TEST(random_cuts_keep_every_invariant)
{
    uint64_t random = 20261;
    int severed = 0, most_pieces = 0, copies = 0, repeats = 0, cuts = 0;
    const char *wanted = getenv("PLIANT_TEST_CUTS");
    int sequences = wanted != NULL ? atoi(wanted) / 10 : EFFORT(20);
    for (int sequence = 0; sequence < sequences; sequence++) {
        SurfaceOptions options = wall_options(random_below(&random, 4), 0);
        options.start_level = random_below(&random, options.body.levels + 1);
        options.adaptive = options.body.levels > 0 && random_below(&random, 2) == 0;
        options.adapt.check_hz = 200.0;
        options.body.precision =
            random_below(&random, 2) == 0 ? PRECISION_DOUBLE : PRECISION_SINGLE;
        options.shape.frame = random_below(&random, 2) == 0 ? SHAPE_WORLD : SHAPE_BODY;
        SCOPED(bench_destroy) DetailBench bench;
        // One after the other: the order in which arguments are drawn is the compiler's.
        WallMesh mesh = (WallMesh)random_below(&random, WALL_MESHES);
        wall_create(&bench, mesh, &options, random_between(&random, 0.0, 1.0));
        CutOptions last = {.body = 0};
        WallShape shape;
        for (int i = 0; i < 10; i++) {
            if (options.adaptive && options.body.levels > 0)
                for (int k = 0; k < 4; k++)
                    bench_change_at_random(&bench, &random, 6);
            int steps = random_below(&random, 6);
            sim_ticks(bench.sim, steps);
            last = wall_random_sweep(&bench, &random, &last);
            CutOutcome outcome = wall_cut(&bench, &last);
            assert_true(!cut_refuses(outcome.verdict) || outcome.verdict == CUT_TOO_TWISTED);
            severed += outcome.separated;
            cuts++;
            repeats += count_repeated(&bench, &last);
            wall_expect_sound(&bench, &shape, 0);
            most_pieces = shape.pieces > most_pieces ? shape.pieces : most_pieces;
        }
        copies += (int)*bench.detail->set.cut->copies;
        assert_int_equal(sim_resets(bench.sim), 0);
    }
    print_message("%d cuts: %d links severed, %d copies, at most %d pieces, %d links by repeats\n",
                  cuts, severed, copies, most_pieces, repeats);
    // 2000 cuts sever 14.7 links each, the first 200 10.6, the first 40, which a sanitizer
    // runs, 6.9.
    assert_true(severed > (sequences < 20 ? 5 : 10) * cuts);
    assert_int_equal(repeats, 0); // lips are shown on the blade; links stay where they were
}

// The most that can be said of a cut across the whole body, at rest.
TEST(a_whole_plane_makes_two_pieces_of_a_sphere)
{
    uint64_t random = 5;
    for (int i = 0; i < EFFORT(12); i++) {
        SurfaceOptions options = wall_options(2, i % 3);
        options.adaptive = i % 2 == 0;
        SCOPED(bench_destroy) DetailBench bench;
        wall_create(&bench, WALL_SPHERE, &options, 0.0);
        Vec3 along = vec3_unit(random_vec3(&random));
        Vec3 forward = vec3_unit(vec3_cross(along, random_vec3(&random)));
        Vec3 middle = vec3_scale(0.02, random_vec3(&random));
        CutOptions plane = wall_sweep_at(middle, along, forward, 0.3, 0.3);
        CutOutcome outcome = wall_cut(&bench, &plane);
        assert_int_equal(outcome.verdict, CUT_DONE);
        assert_int_equal(outcome.pieces, 2);
        assert_int_equal(outcome.small_pieces, 0);
        WallShape shape;
        wall_expect_sound(&bench, &shape, 0);
        assert_int_equal(shape.borders, 2);
        // Each node of one border has its copy on the other: nothing was deleted.
        assert_int_equal(shape.border_edges, 2 * outcome.separated);
        assert_int_equal(outcome.nodes_added, outcome.separated);
    }
}

// 75 mm along the sphere of radius 50 mm, into a body of level 2; how long it takes is printed.
TEST(a_long_cut_opens_under_prestress)
{
    SurfaceOptions options = wall_options(2, 0);
    SCOPED(bench_destroy) DetailBench bench;
    wall_create(&bench, WALL_SPHERE, &options, 0.0);
    // The blade reaches 0.03 m deep and turns about the middle of the sphere.
    double half = 0.75, longest = 0.0;
    for (int k = 0; k < 8; k++) {
        double at[2] = {-half + 2.0 * half * k / 8.0, -half + 2.0 * half * (k + 1) / 8.0};
        CutOptions sweep = {.body = 0};
        for (int end = 0; end < 2; end++) {
            double r = end == 0 ? 0.03 : 0.06;
            sweep.before.end[end] = vec3(r * sin(at[0]), 0.001, r * cos(at[0]));
            sweep.after.end[end] = vec3(r * sin(at[1]), 0.001, r * cos(at[1]));
        }
        clock_t begin = clock();
        CutOutcome outcome = wall_cut(&bench, &sweep);
        double spent = (double)(clock() - begin) / CLOCKS_PER_SEC;
        longest = spent > longest ? spent : longest;
        assert_true(outcome.verdict == CUT_DONE);
    }
    WallShape shape;
    wall_expect_sound(&bench, &shape, 0);
    assert_int_equal(shape.pieces, 1);
    assert_int_equal(shape.borders, 1);
    sim_ticks(bench.sim, 500);
    assert_int_equal(sim_resets(bench.sim), 0);
    // How far copies are from their originals.
    double widest = 0.0;
    const DetailCut *state = bench.detail->set.cut;
    for (int c = 0; c < *state->copies; c++) {
        int pair[2] = {state->origin[c], state->base_count + c};
        Vec3 x[2];
        bench.body->ops->read_nodes(bench.model, pair, 2, x, NULL);
        widest = fmax(widest, vec3_length(vec3_sub(x[0], x[1])));
    }
    print_message("%lld copies, lips %.2f mm apart; the longest part took %.3f ms\n",
                  (long long)*state->copies, 1e3 * widest, 1e3 * longest);
    // Springs shortened by a tenth over a cut of 75 mm: millimetres.
    expect_at_least(widest, 1e-3);
}
