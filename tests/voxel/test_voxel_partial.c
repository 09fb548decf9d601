// SPDX-License-Identifier: MIT
// Rest shapes of partly filled elements: against sums over their cells and corners, one by one, and
// what balance, mass and the fit need of them.
#include "test.h"
#include "effort.h"
#include "voxel_fill.h"

#include "voxel/template.h"

// Sums of at most thirty terms of size one; the definition's have up to 4096.
static const double ROUNDING = 2e-14, SUM = 2e-13;

// --- the definition, slowly ---

// a = sum over solid cells and their corners of N_i a_cell, w = 8 sum N_i / 8 / cells.
static void sum_slowly(unsigned mask, int level, const uint64_t *solid, double area[NODE_COUNT][3],
                       double weight[NODE_COUNT])
{
    const int edge = 1 << level, cells = fill_count(solid, level);
    memset(area, 0, NODE_COUNT * sizeof *area);
    memset(weight, 0, NODE_COUNT * sizeof *weight);
    for (int cell = 0; cell < edge * edge * edge; cell++)
        for (int corner = 0; corner < 8 && fill_has(solid, cell); corner++) {
            const int at[3] = {cell % edge, cell / edge % edge, cell / edge / edge};
            double place[3], by[NODE_COUNT];
            for (int d = 0; d < 3; d++)
                place[d] = (at[d] + (corner >> d & 1)) / (double)edge;
            fill_weights(mask, place, by);
            for (int n = 0; n < NODE_COUNT; n++) {
                weight[n] += by[n] / cells;
                for (int d = 0; d < 3; d++)
                    area[n][d] += by[n] * ((corner >> d & 1) != 0 ? 0.25 : -0.25) / (edge * edge);
            }
        }
}

static void expect_definition(const Template *t, unsigned mask, int level, const uint64_t *solid)
{
    double area[NODE_COUNT][3], weight[NODE_COUNT];
    sum_slowly(mask, level, solid, area, weight);
    for (int i = 0; i < t->count; i++) {
        const int n = t->node[i];
        expect_near(t->weight[i], weight[n], SUM);
        expect_near(t->area[i].x, area[n][0], SUM);
        expect_near(t->area[i].y, area[n][1], SUM);
        expect_near(t->area[i].z, area[n][2], SUM);
    }
}

// --- what the element's law needs ---

// No resultant (sum a = 0), the exact mean gradient of the solid part (sum X a^T = share), masses
// that keep their centre (sum w = 8, sum w X = 0), and M^-1.
static void expect_identities(const Template *t, unsigned mask, int level, const uint64_t *solid)
{
    double area[3] = {0}, gradient[3][3] = {{0}}, weight = 0.0, moment[3] = {0}, m[3][3] = {{0}};
    const Sym3 v = t->inverse;
    const double inverse[3][3] = {{v.xx, v.xy, v.zx}, {v.xy, v.yy, v.yz}, {v.zx, v.yz, v.zz}};
    assert_int_equal(t->mask, mask);
    expect_near(t->share, fill_count(solid, level) / (double)(1 << 3 * level), 0.0);
    for (int i = 0; i < t->count; i++) {
        const double x[3] = {t->rest[i].x, t->rest[i].y, t->rest[i].z},
                     a[3] = {t->area[i].x, t->area[i].y, t->area[i].z};
        // Corners always have some: every cell moves with the middle of its block.
        expect_at_least(t->weight[i], t->node[i] < NODE_CORNERS ? 1e-3 : 0.0);
        weight += t->weight[i];
        for (int r = 0; r < 3; r++) {
            area[r] += a[r];
            moment[r] += t->weight[i] * x[r];
            for (int c = 0; c < 3; c++) {
                gradient[r][c] += x[r] * a[c];
                m[r][c] += t->weight[i] * x[r] * x[c];
            }
        }
    }
    expect_near(weight, 8.0, ROUNDING);
    for (int r = 0; r < 3; r++) {
        expect_near(area[r], 0.0, ROUNDING);
        expect_near(moment[r], 0.0, ROUNDING);
        expect_near(t->spread[r], m[r][r], ROUNDING);
        for (int c = 0; c < 3; c++) {
            const double one =
                m[r][0] * inverse[0][c] + m[r][1] * inverse[1][c] + m[r][2] * inverse[2][c];
            expect_near(gradient[r][c], r == c ? t->share : 0.0, ROUNDING);
            expect_near(one, r == c ? 1.0 : 0.0, 10.0 * ROUNDING); // M's condition is up to ten
        }
    }
    // The solid cells are never spread out more than the weights.
    expect_at_least(t->softer, 1e-3);
    expect_at_most(t->softer, 1.0);
}

static void expect_partial(unsigned mask, int level, const uint64_t *solid)
{
    Template t;
    template_create_partial(&t, mask, level, solid);
    expect_definition(&t, mask, level, solid);
    expect_identities(&t, mask, level, solid);
}

TEST(every_fill_of_two_cells_a_side_has_the_sums_of_its_cells)
{
    uint64_t random = 3;
    for (uint64_t solid = 1; solid < 255; solid++)
        for (int k = 0; k < EFFORT(6); k++)
            expect_partial(k == 0 ? 0 : fill_random_mask(&random), 1, &solid);
}

TEST(fills_of_four_and_eight_cells_a_side_have_the_sums_of_their_cells)
{
    uint64_t random = 4, solid[FILL_WORDS];
    for (int level = 2; level <= FILL_LEVELS; level++)
        for (int k = 0; k < EFFORT(level == 2 ? 300 : 40); k++) {
            fill_random(solid, level, &random);
            expect_partial(fill_random_mask(&random), level, solid);
        }
}

TEST(a_full_block_is_the_whole_cube)
{
    const uint64_t solid[FILL_WORDS] = {~(uint64_t)0, ~(uint64_t)0, ~(uint64_t)0, ~(uint64_t)0,
                                        ~(uint64_t)0, ~(uint64_t)0, ~(uint64_t)0, ~(uint64_t)0};
    uint64_t random = 5;
    for (int level = 1; level <= FILL_LEVELS; level++)
        for (int k = 0; k < 20; k++) {
            const unsigned mask = fill_random_mask(&random);
            const uint64_t *bits = level == 1 ? (const uint64_t[]){0xff} : solid;
            Template part, whole;
            template_create_partial(&part, mask, level, bits);
            template_create(&whole, mask);
            assert_memory_equal(&part, &whole, sizeof whole);
        }
}

// By hand: of a slab of share tau the weights' spread across it is 8 p (1 - p), p = tau / 2, the
// cells' 8 tau^2 / 12; they bend 3 times too stiffly by a half, 7 times by a quarter.
TEST(slabs_bend_as_what_is_solid_of_them)
{
    uint64_t quarter = 0xffff, half = 0x0f;
    Template t;
    template_create_partial(&t, 0, 1, &half);
    expect_near(t.softer, 1.0 / 3.0, ROUNDING);
    template_create_partial(&t, 0, 2, &quarter);
    expect_near(t.softer, 1.0 / 7.0, ROUNDING);
    expect_near(t.rest[0].z, -1.0 / 8.0, ROUNDING); // the centre is an eighth above the floor
}
