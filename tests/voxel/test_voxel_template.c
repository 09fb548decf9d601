// SPDX-License-Identifier: MIT
#include "test.h"
#include "effort.h"
#include "random.h"

#include "voxel/template.h"

enum { MASKS = 1 << (NODE_COUNT - NODE_CORNERS) };

// Sums of fewer than thirty terms of size one, each rounded once or twice.
static const double ROUNDING = 1e-14;

static bool is_present(unsigned mask, int node)
{
    return node < NODE_CORNERS || (mask >> (node - NODE_CORNERS) & 1);
}

TEST(places_follow_the_mask)
{
    uint64_t seed = 11;
    for (int round = 0; round < 1000; round++) {
        unsigned mask = (unsigned)random_below(&seed, MASKS);
        Template t;
        template_create(&t, mask);
        assert_int_equal(t.mask, mask);
        int next = 0;
        for (int node = 0; node < NODE_COUNT; node++) {
            if (!is_present(mask, node))
                continue;
            assert_int_equal(t.node[next], node);
            const signed char *o = NODE_OFFSET[node];
            assert_true(t.rest[next].x == 0.5 * o[0] - 0.5);
            assert_true(t.rest[next].y == 0.5 * o[1] - 0.5);
            assert_true(t.rest[next].z == 0.5 * o[2] - 0.5);
            next++;
        }
        assert_int_equal(t.count, next);
    }
}

TEST(offsets_name_corners_then_edges_then_faces)
{
    for (int node = 0; node < NODE_COUNT; node++) {
        const signed char *o = NODE_OFFSET[node];
        int middles = (o[0] == 1) + (o[1] == 1) + (o[2] == 1);
        assert_int_equal(middles, node < 8 ? 0 : node < 20 ? 1 : 2);
        if (node < NODE_CORNERS)
            assert_int_equal(node, o[0] / 2 + o[1] / 2 * 2 + o[2] / 2 * 4);
        assert_int_equal(node_at_offset(o[0], o[1], o[2]), node);
    }
    assert_int_equal(node_at_offset(1, 1, 1), -1);
}

// What conserves momentum (sum a = 0), gives the exact gradient of every linear field (sum X a^T =
// 1), shares mass without moving it (sum w = 8, sum w X = 0) and lets the least-squares fit divide
// by three numbers (M diagonal).
static void expect_identities(const Template *t)
{
    const double *m = t->spread;
    double area[3] = {0}, gradient[3][3] = {{0}}, weight = 0, moment[3] = {0}, spread[3][3] = {{0}};
    for (int i = 0; i < t->count; i++) {
        double x[3] = {t->rest[i].x, t->rest[i].y, t->rest[i].z};
        double a[3] = {t->area[i].x, t->area[i].y, t->area[i].z};
        expect_at_least(t->weight[i], 0.2);
        weight += t->weight[i];
        for (int r = 0; r < 3; r++) {
            area[r] += a[r];
            moment[r] += t->weight[i] * x[r];
            for (int c = 0; c < 3; c++) {
                gradient[r][c] += x[r] * a[c];
                spread[r][c] += t->weight[i] * x[r] * x[c];
            }
        }
    }
    expect_near(weight, 8.0, ROUNDING);
    for (int r = 0; r < 3; r++) {
        expect_near(area[r], 0.0, ROUNDING);
        expect_near(moment[r], 0.0, ROUNDING);
        for (int c = 0; c < 3; c++) {
            expect_near(gradient[r][c], r == c ? 1.0 : 0.0, ROUNDING);
            expect_near(spread[r][c], r == c ? m[r] : 0.0, ROUNDING);
        }
    }
}

// Whatever vertices hang: also those that no layout without cuts shows.
TEST(identities_hold_for_every_mask)
{
    for (unsigned i = 0; i < EFFORT(MASKS); i++) {
        Template t;
        template_create(&t, i * 40503u % MASKS); // an odd factor: each mask once
        expect_identities(&t);
    }
}

TEST(cube_of_eight_corners_is_that_of_the_paper)
{
    Template t;
    template_create(&t, 0);
    assert_int_equal(t.count, 8);
    for (int i = 0; i < 8; i++) {
        assert_true(t.weight[i] == 1.0);
        assert_true(t.area[i].x == 0.5 * t.rest[i].x);
        assert_true(t.area[i].y == 0.5 * t.rest[i].y);
        assert_true(t.area[i].z == 0.5 * t.rest[i].z);
    }
    for (int d = 0; d < 3; d++)
        assert_true(t.spread[d] == 2.0);
}

TEST(full_cube_weighs_its_nodes_by_kind)
{
    Template t;
    template_create(&t, MASKS - 1);
    assert_int_equal(t.count, NODE_COUNT);
    for (int i = 0; i < NODE_COUNT; i++)
        assert_true(t.weight[i] == (i < NODE_CORNERS ? 1.0 / 4.0 : 1.0 / 3.0));
}

// The volume above a face when one of its vertices is pushed outwards by 1, by hand: a quarter of
// the area of each square around that vertex, so bilinear is the roof over them. Squares have an
// area of 1/4 on the refined face +x and of 1 on -x.
TEST(refined_face_swells_by_its_roof)
{
    // face +x with its four mid-edges and its middle
    unsigned mask = 0;
    for (int node = NODE_CORNERS; node < NODE_COUNT; node++)
        if (NODE_OFFSET[node][0] == 2)
            mask |= 1u << (node - NODE_CORNERS);
    Template t;
    template_create(&t, mask);
    for (int i = 0; i < t.count; i++) {
        const signed char *o = NODE_OFFSET[t.node[i]];
        int squares = (o[1] == 1 ? 2 : 1) * (o[2] == 1 ? 2 : 1);
        double roof = o[0] == 2 ? squares * 0.25 / 4.0 : -1.0 / 4.0;
        expect_near(t.area[i].x, roof, ROUNDING);
    }
}
