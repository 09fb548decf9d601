// SPDX-License-Identifier: MIT
// Cuts of triangle surfaces, found exactly: whatever the blade does, the outcome is a sound mesh,
// a blade that goes all the way through separates, and one that ends inside does not.
#include "test.h"

#include "cut_blades.h"
#include "effort.h"
#include "random.h"

enum { CUTS_A_SEQUENCE = 10 };

// Whole planes, arcs, loops, cuts shorter than an edge, along edges and through vertices, of any
// orientation, repeated, and on from where the last one ended.
static Blade random_blade(const CutModel *model, const Blade *before, uint64_t *seed)
{
    const double pi = 3.14159265358979323846;
    double h = model->h, start = random_between(seed, 0.0, 2.0 * pi);
    int face = random_below(seed, model->faces), other = random_below(seed, model->faces);
    int next = levels_beyond(model->level, model->level->face_edge[face][0], face);
    Vec3 n = blade_normal(model, face), at = blade_centroid(model, face),
         half = vec3_scale(4.0 * h, n);
    Blade blade = {0};
    switch (random_below(seed, 11)) {
    case 0:
        return blade_plane(at, blade_direction(seed), seed);
    case 1: // a plane exactly through two centroids, or a vertex
        n = vec3_unit(
            vec3_cross(vec3_sub(blade_centroid(model, other), at), blade_direction(seed)));
        return blade_plane(random_below(seed, 2) ? at : blade_corner(model, face, 0), n, seed);
    case 2:
        return blade_arc(model, face, random_between(seed, 1.5, 8.0) * h, start,
                         start + random_between(seed, 0.5, 5.0), 8, 4.0 * h, seed);
    case 3:
        return blade_arc(model, face, random_between(seed, 0.8, 5.0) * h, start, start + 2.0 * pi,
                         16, 4.0 * h, seed);
    case 4: // shorter than an edge
        blade = blade_arc(model, face, random_between(seed, 0.1, 0.5) * h, start, start + pi, 1,
                          3.0 * h, seed);
        return blade;
    case 5: // exactly along an edge, and a little further or not
        if (random_below(seed, 2))
            return blade_straight(blade_corner(model, face, 0), blade_corner(model, face, 1), half);
        return blade_straight(vec3_madd(blade_corner(model, face, 0), -h, vec3(0.6, 0.8, 0.0)),
                              blade_corner(model, face, 1), half);
    case 6: // through vertices
        return blade_straight(blade_corner(model, face, 0), blade_corner(model, other, 1), half);
    case 7: // from centroid to centroid, or to the middle of an edge
        if (next >= 0 && random_below(seed, 2))
            return blade_straight(at, blade_centroid(model, next), half);
        return blade_straight(at, blade_centroid(model, other), half);
    case 8: // anywhere, twisted, in and out
        for (int k = 0; k < 4; k++)
            blade_add(&blade, vec3_scale(0.09, random_vec3(seed)),
                      vec3_scale(random_between(seed, 0.005, 0.1), blade_direction(seed)));
        return blade;
    case 9: // the same again, or backwards
        if (before->edges == 0)
            return blade_plane(at, blade_direction(seed), seed);
        blade = *before;
        for (int k = 0; random_below(seed, 2) && k < blade.edges; k++)
            blade.edge[k] = before->edge[before->edges - 1 - k];
        return blade;
    default: // on from where the last one ended
        if (before->edges == 0)
            return blade_straight(at, blade_centroid(model, other), half);
        blade.edge[blade.edges++] = before->edge[before->edges - 1];
        blade_add(&blade, at, vec3_scale(random_between(seed, 0.5, 5.0) * h, n));
        return blade;
    }
}

// --- random cuts ---

// Figures of a run, for its report.
typedef struct Tally {
    int cuts, done, repeats, most_pieces, most_tries;
} Tally;

// Of a mesh without older cuts around: every closed loop of links round an inner vertex was met an
// even number of times in all, where no end of the blade is near.
static void expect_even_loops(const CutModel *model)
{
    const Level *level = model->level;
    FREED unsigned char *met = calloc((size_t)level->edge_count, 1);
    for (int i = 0; i < model->finder.links.met_count; i++)
        met[model->finder.links.met[i]] = 1;
    FREED int *sum = calloc((size_t)model->vertices, sizeof *sum);
    for (int e = 0; e < level->edge_count; e++)
        for (int end = 0; end < 2; end++)
            sum[level->edge[e][end]] +=
                level->edge_face[e][0] < 0 || level->edge_face[e][1] < 0 ? 1000000 : met[e];
    for (int v = 0; v < model->vertices; v++)
        assert_true(sum[v] >= 1000000 || sum[v] % 2 == 0);
}

static void one_cut(CutModel *model, Blade *last, CutCare care, Tally *tally, uint64_t *seed)
{
    Blade blade = random_blade(model, last, seed);
    FREED unsigned char *bits = malloc((size_t)model->faces);
    memcpy(bits, model->broken, (size_t)model->faces);
    int nodes = model->node_count;
    CutVerdict verdict = cut_model_cut(model, blade.edge, blade.edges, care);
    assert_true(verdict == CUT_DONE || verdict == CUT_MET_NOTHING || verdict == CUT_WAS_CUT ||
                verdict == CUT_TOO_TWISTED);
    if (verdict != CUT_DONE) {
        assert_memory_equal(bits, model->broken, (size_t)model->faces);
        assert_int_equal(nodes, model->node_count);
    }
    for (int f = 0; f < model->faces; f++)
        assert_int_equal(bits[f] & ~model->broken[f], 0);
    const int pieces = cut_model_expect_sound(model).pieces;
    assert_true(cut_model_copies(model) <= 2 * 3 * model->faces);
    tally->cuts++;
    tally->done += verdict == CUT_DONE;
    tally->most_pieces = pieces > tally->most_pieces ? pieces : tally->most_pieces;
    const int tries = (int)model->finder.links.attempt;
    tally->most_tries = tries > tally->most_tries ? tries : tally->most_tries;
    // The same again changes nothing, though snapping has moved what it met.
    if (random_below(seed, 6) == 0) {
        memcpy(bits, model->broken, (size_t)model->faces);
        nodes = model->node_count;
        verdict = cut_model_cut(model, blade.edge, blade.edges, care);
        assert_true(verdict != CUT_DONE && verdict != CUT_UNRESOLVED);
        assert_memory_equal(bits, model->broken, (size_t)model->faces);
        assert_int_equal(nodes, model->node_count);
        tally->repeats++;
    }
    *last = blade;
}

// Lips apart: copies move each their own way, by up to a tenth of an edge.
static void part_lips(CutModel *model, uint64_t *seed)
{
    for (int n = model->vertices; n < model->node_count; n++)
        model->x[n] = vec3_madd(model->x[n], 0.1 * model->h, random_vec3(seed));
}

static void random_cuts(int sequences)
{
    for (int shape = 0; shape < CUT_SHAPES; shape++) {
        SCOPED(cut_model_destroy) CutModel model;
        cut_model_create(&model, (CutShape)shape);
        Tally tally = {0};
        uint64_t seed = UINT64_C(77) + (uint64_t)shape;
        for (int sequence = 0; sequence < sequences; sequence++) {
            cut_model_reset(&model, 0.0);
            CutCare care = (CutCare)(sequence % 3);
            bool opens = sequence / 3 % 2, bent = sequence / 6 % 2;
            Blade last = {0};
            for (int cut = 0; cut < CUTS_A_SEQUENCE; cut++) {
                if (bent)
                    cut_model_deform(&model, 1.0 + 0.1 * (opens ? cut : 0));
                if (opens)
                    part_lips(&model, &seed);
                one_cut(&model, &last, care, &tally, &seed);
            }
        }
        print_message("%s: %d cuts, %d broke links, %d repeated, at most %d pieces, %d tries\n",
                      CUT_SHAPE_NAME[shape], tally.cuts, tally.done, tally.repeats,
                      tally.most_pieces, tally.most_tries);
    }
}

TEST(random_cuts_leave_a_sound_mesh)
{
    const char *many = getenv("PLIANT_TEST_SEQUENCES"); // of each shape; 10,000 cuts: 334
    random_cuts(many ? atoi(many) : EFFORT(60));
}

// --- what is expected of a fresh mesh ---

// The sides of centroids, in the finder's own units.
static void expect_bits_are_sides(const CutModel *model, Vec3 through, Vec3 normal)
{
    for (int f = 0; f < model->faces; f++)
        for (int k = 0; k < 3; k++) {
            int g = levels_beyond(model->level, model->level->face_edge[f][k], f);
            if (g < 0)
                continue;
            double a = vec3_dot(normal, vec3_sub(blade_centroid(model, f), through));
            double b = vec3_dot(normal, vec3_sub(blade_centroid(model, g), through));
            // Points are rounded to units q, and the edge's ends are shifted by up to 7 in each
            // direction, 13 in all: nearer than that either answer is right.
            if (fabs(a) < 15.0 * model->finder.links.q || fabs(b) < 15.0 * model->finder.links.q)
                continue;
            assert_int_equal(model->broken[f] >> k & 1, (a < 0.0) != (b < 0.0));
        }
}

TEST(whole_planes_separate_along_the_sides_of_centroids)
{
    for (int shape = 0; shape < CUT_SHAPES; shape++) {
        SCOPED(cut_model_destroy) CutModel model;
        cut_model_create(&model, (CutShape)shape);
        uint64_t seed = 5;
        int more[2] = {0, 0};
        for (int trial = 0; trial < EFFORT(100); trial++)
            for (int care = CUT_PLAIN; care <= CUT_SMOOTHED; care++) {
                cut_model_reset(&model, trial % 2);
                Vec3 through = blade_centroid(&model, random_below(&seed, model.faces));
                Vec3 normal = blade_direction(&seed);
                // Not through a few faces at its outermost only: all of those may be smoothed away.
                through = vec3_scale(model.shape == CUT_TUBE ? 1.0 : 0.7, through);
                Blade blade = blade_plane(through, normal, &seed);
                CutVerdict verdict = cut_model_cut(&model, blade.edge, 2, (CutCare)care);
                const int pieces = cut_model_expect_sound(&model).pieces;
                if (care == CUT_PLAIN)
                    expect_bits_are_sides(&model, through, normal);
                expect_even_loops(&model);
                if (verdict == CUT_MET_NOTHING)
                    continue; // past it
                assert_int_equal(verdict, CUT_DONE);
                assert_true(pieces >= 2);
                more[care] += pieces > 2;
            }
        print_message("%s: more than two pieces %d plain, %d smoothed\n", CUT_SHAPE_NAME[shape],
                      more[0], more[1]);
    }
}
