// SPDX-License-Identifier: MIT
// What single cuts of a fresh triangle surface come to, and how well their path follows the blade.
#include "test.h"

#include "cut_blades.h"
#include "effort.h"
#include "random.h"

static const double PI = 3.14159265358979323846;

// How often the blade met the loop of links round an inner vertex an odd number of times: its own
// ends passed through there.
static int dead_ends(const CutModel *model)
{
    const Level *level = model->level;
    int *sum = calloc((size_t)model->vertices, sizeof *sum), ends = 0;
    for (int i = 0; i < model->finder.links.met_count; i++)
        for (int end = 0; end < 2; end++)
            sum[level->edge[model->finder.links.met[i]][end]]++;
    for (int e = 0; e < level->edge_count; e++)
        if (level->edge_face[e][0] < 0 || level->edge_face[e][1] < 0)
            sum[level->edge[e][0]] = sum[level->edge[e][1]] = 0;
    for (int v = 0; v < model->vertices; v++)
        ends += sum[v] % 2;
    free(sum);
    return ends;
}

// Whether the face, or one with which it shares a vertex, is at a border.
static bool near_border(const CutModel *model, int face)
{
    const Level *level = model->level;
    for (int k = 0; k < 3; k++) {
        int v = level->face[face][k];
        for (int i = model->ring_start[v]; i < model->ring_start[v + 1]; i++)
            for (int s = 0; s < 3; s++)
                if (levels_beyond(level, level->face_edge[model->ring[i]][s], model->ring[i]) < 0)
                    return true;
    }
    return false;
}

static int inner_face(const CutModel *model, uint64_t *seed)
{
    int face;
    do
        face = random_below(seed, model->faces);
    while (near_border(model, face));
    return face;
}

// --- what cuts come to ---

TEST(a_plane_makes_two_pieces_of_sphere_and_sheet)
{
    for (int shape = CUT_SPHERE; shape <= CUT_SHEET; shape++) {
        SCOPED(cut_model_destroy) CutModel model;
        cut_model_create(&model, (CutShape)shape);
        uint64_t seed = 3;
        for (int trial = 0; trial < EFFORT(150); trial++) {
            cut_model_reset(&model, 0.0);
            Vec3 through =
                vec3_scale(0.8, blade_centroid(&model, random_below(&seed, model.faces)));
            Vec3 normal = blade_direction(&seed);
            Blade blade = blade_plane(through, normal, &seed);
            if (cut_model_cut(&model, blade.edge, 2, CUT_SMOOTHED) == CUT_MET_NOTHING)
                continue;
            const WallShape found = cut_model_expect_sound(&model);
            assert_int_equal(found.pieces, 2);
            assert_int_equal(found.borders, 2);
        }
    }
}

TEST(closed_loops_free_a_disc_unless_the_blade_ends_inside)
{
    for (int shape = 0; shape < CUT_SHAPES; shape++) {
        SCOPED(cut_model_destroy) CutModel model;
        cut_model_create(&model, (CutShape)shape);
        uint64_t seed = 4;
        int freed = 0, ended = 0, trials = EFFORT(150);
        for (int trial = 0; trial < trials; trial++) {
            bool bent = trial % 2;
            cut_model_reset(&model, bent);
            int face = random_below(&seed, model.faces);
            // Where it is much curved the edge would not reach through at the far side.
            bool curved = bent || shape == CUT_TUBE;
            double r = (curved ? random_between(&seed, 1.5, 3.0) : random_between(&seed, 2.5, 5.0));
            Blade blade =
                blade_arc(&model, face, r * model.h, 0.0, 2.0 * PI, 24, 4.0 * model.h, &seed);
            assert_int_equal(cut_model_cut(&model, blade.edge, blade.edges, CUT_SMOOTHED),
                             CUT_DONE);
            const WallShape found = cut_model_expect_sound(&model);
            freed += found.pieces > 1;
            if (found.pieces == 1) {
                assert_true(dead_ends(&model) > 0);
                ended++;
            }
            if (shape == CUT_SPHERE && !bent) {
                assert_int_equal(found.pieces, 2);
                assert_int_equal(found.borders, 2);
            }
        }
        print_message("%s: %d of %d loops free a disc, %d of the blade's ended inside\n",
                      CUT_SHAPE_NAME[shape], freed, trials, ended);
    }
}

TEST(half_a_loop_opens_one_border_and_frees_nothing)
{
    SCOPED(cut_model_destroy) CutModel model;
    cut_model_create(&model, CUT_SPHERE);
    uint64_t seed = 6;
    for (int trial = 0; trial < EFFORT(100); trial++) {
        cut_model_reset(&model, 0.0);
        int face = random_below(&seed, model.faces);
        double r = random_between(&seed, 2.5, 5.0) * model.h;
        Blade blade = blade_arc(&model, face, r, 0.0, PI, 12, 4.0 * model.h, &seed);
        assert_int_equal(cut_model_cut(&model, blade.edge, blade.edges, CUT_SMOOTHED), CUT_DONE);
        const WallShape found = cut_model_expect_sound(&model);
        assert_int_equal(found.pieces, 1);
        assert_int_equal(found.borders, 1);
    }
}

TEST(cuts_that_end_inside_leave_one_piece)
{
    for (int shape = 0; shape < CUT_SHAPES; shape++) {
        SCOPED(cut_model_destroy) CutModel model;
        cut_model_create(&model, (CutShape)shape);
        uint64_t seed = 8;
        for (int trial = 0; trial < EFFORT(200); trial++) {
            cut_model_reset(&model, trial % 2);
            int face = inner_face(&model, &seed);
            Vec3 at = blade_centroid(&model, face), n = blade_normal(&model, face);
            Vec3 along = vec3_unit(vec3_cross(n, blade_direction(&seed)));
            double length = random_between(&seed, 0.2, 4.0) * model.h;
            // It begins within a face that is not at a border: one there hangs on one link perhaps,
            // and may well come off.
            Blade blade =
                blade_straight(at, vec3_madd(at, length, along), vec3_scale(2.0 * model.h, n));
            cut_model_cut(&model, blade.edge, 2, CUT_SMOOTHED);
            assert_int_equal(cut_model_expect_sound(&model).pieces, 1);
        }
    }
}

// A cut that runs into an older one, and half an edge beyond, separates.
TEST(t_cuts_with_half_an_edge_of_overlap_separate)
{
    SCOPED(cut_model_destroy) CutModel model;
    cut_model_create(&model, CUT_SHEET);
    uint64_t seed = 9;
    for (int trial = 0; trial < EFFORT(200); trial++) {
        cut_model_reset(&model, 0.0);
        double turn = random_between(&seed, 0.0, 2.0 * PI), lean = random_between(&seed, -0.7, 0.7);
        Vec3 normal = vec3(cos(turn), sin(turn), 0.0), along = vec3(-normal.y, normal.x, 0.0);
        Vec3 middle = vec3_scale(
            0.02, vec3(random_between(&seed, -1.0, 1.0), random_between(&seed, -1.0, 1.0), 0.0));
        Blade first = blade_plane(middle, normal, &seed);
        assert_int_equal(cut_model_cut(&model, first.edge, 2, CUT_SMOOTHED), CUT_DONE);
        Vec3 way = vec3_add(vec3_scale(cos(lean), normal), vec3_scale(sin(lean), along));
        Vec3 end = vec3_madd(middle, 0.5 * model.h / cos(lean), way);
        Blade second = blade_straight(vec3_madd(end, -0.2, way), end, vec3(0.0, 0.0, 0.02));
        assert_int_equal(cut_model_cut(&model, second.edge, 2, CUT_SMOOTHED), CUT_DONE);
        assert_true(cut_model_expect_sound(&model).pieces >= 3);
    }
}

// --- single links ---

TEST(one_broken_link_copies_no_node_and_the_next_one_copies_one)
{
    for (int shape = 0; shape < CUT_SHAPES; shape++) {
        SCOPED(cut_model_destroy) CutModel model;
        cut_model_create(&model, (CutShape)shape);
        uint64_t seed = 10;
        for (int trial = 0; trial < 30; trial++) {
            cut_model_reset(&model, 0.0);
            int face = inner_face(&model, &seed);
            // Beside its first side, across the half link there.
            Vec3 n = blade_normal(&model, face), a = blade_corner(&model, face, 0);
            Vec3 side = vec3_sub(blade_corner(&model, face, 1), a);
            Vec3 beside = vec3_madd(a, 0.2, vec3_cross(n, side));
            Blade blade = blade_straight(vec3_madd(beside, 0.3, side), vec3_madd(beside, 0.8, side),
                                         vec3_scale(0.3 * model.h, n));
            assert_int_equal(cut_model_cut(&model, blade.edge, 2, CUT_SMOOTHED), CUT_DONE);
            assert_int_equal(model.finder.count, 1);
            assert_int_equal(cut_model_copies(&model), 0);
            cut_model_expect_sound(&model);
            // Any edge that goes on from its end.
            int e = model.finder.edge[0], v = model.level->edge[e][0], next = -1;
            for (int i = model.ring_start[v]; i < model.ring_start[v + 1] && next < 0; i++)
                for (int k = 0; k < 3; k++) {
                    int other = model.level->face_edge[model.ring[i]][k];
                    bool at_v =
                        model.level->edge[other][0] == v || model.level->edge[other][1] == v;
                    next = at_v && other != e ? other : next;
                }
            model.finder.edge[0] = next;
            cut_model_break(&model);
            assert_int_equal(cut_model_copies(&model), 1);
            cut_model_expect_sound(&model);
        }
    }
}
