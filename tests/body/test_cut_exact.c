// SPDX-License-Identifier: MIT
// The exact test of a moving link against a moving blade: known cases, an independent count in
// rational arithmetic, and what makes it leak-free: loops of links are crossed an even number of
// times, whatever is degenerate, twisted or folded.
#include "body/cut.h"
#include "effort.h"
#include "test.h"
#include "random.h"

// --- known cases, in units of 1024 q ---

static CutPoint at(double x, double y, double z)
{
    return (CutPoint){{llround(1024 * x), llround(1024 * y), llround(1024 * z)}};
}

static CutPath still(double x, double y, double z)
{
    return (CutPath){{at(x, y, z), at(x, y, z)}};
}

static CutPath moving(CutPoint from, CutPoint to)
{
    return (CutPath){{from, to}};
}

// From y = -1 to 1 in the plane x = 0.1.
static const double X = 0.1;

static void sweep(CutPath edge[2])
{
    edge[0] = moving(at(X, -1, -1), at(X, 1, -1));
    edge[1] = moving(at(X, -1, 1), at(X, 1, 1));
}

TEST(a_resting_link_is_met_once)
{
    CutPath edge[2], link[2] = {still(-1, 0, 0.125), still(1, 0, 0.125)};
    sweep(edge);
    assert_true(cut_may_meet(edge, link));
    assert_int_equal(cut_count(edge, link), 1);
}

TEST(a_resting_edge_is_met_by_a_link_that_moves)
{
    const CutPath edge[2] = {still(X, 0, -1), still(X, 0, 1)};
    const CutPath link[2] = {moving(at(-1, 1, 0.1), at(-1, -1, 0.1)),
                             moving(at(1, 1, 0.1), at(1, -1, 0.1))};
    assert_true(cut_may_meet(edge, link));
    assert_int_equal(cut_count(edge, link), 1);
}

TEST(what_moves_along_with_the_blade_is_not_met)
{
    static const double start[2] = {-1.5, -0.5};
    for (int k = 0; k < 2; k++) {
        double y = start[k];
        CutPath edge[2];
        sweep(edge);
        const CutPath link[2] = {moving(at(-1, y, 0.1), at(-1, y + 2, 0.1)),
                                 moving(at(1, y, 0.1), at(1, y + 2, 0.1))};
        assert_int_equal(cut_count(edge, link), 0);
    }
}

TEST(a_link_that_turns_past_the_blade_is_met)
{
    CutPath edge[2];
    sweep(edge);
    const CutPath link[2] = {moving(at(-1, -0.5, 0.1), at(-1, 1.5, 0.2)),
                             moving(at(1, -0.5, 0.1), at(1, 0.5, 0.1))};
    assert_int_equal(cut_count(edge, link), 1);
}

TEST(a_link_without_length_is_never_met)
{
    CutPath edge[2];
    sweep(edge);
    CutPath link[2] = {still(X, 0, 0), still(X, 0, 0)};
    assert_int_equal(cut_count(edge, link), 0);
    link[0] = link[1] = moving(at(0, 0, 0), at(1, 0, 0));
    assert_int_equal(cut_count(edge, link), 0);
}

TEST(what_hangs_on_rounding_is_called_degenerate)
{
    CutPath edge[2];
    sweep(edge);
    const CutPath link[2] = {still(X, -1, 0), still(X, 0.5, 0)}; // in the plane of the sweep
    assert_int_equal(cut_count(edge, link), CUT_DEGENERATE);
    // Through a corner of the link.
    const CutPath touching[2] = {still(X, 0, 0.25), still(1, 0, 0.25)};
    assert_int_equal(cut_count(edge, touching), CUT_DEGENERATE);
}

TEST(nothing_is_met_where_nothing_moves)
{
    const CutPath edge[2] = {still(0, 0, -1), still(0, 0, 1)};
    const CutPath link[2] = {still(-1, 0, 0), still(1, 0, 0)};
    assert_int_equal(cut_count(edge, link), 0);
}

// --- against rational arithmetic ---

__extension__ typedef __int128 Wide;

// Two triangles in space and time meet where a weighted mean of the one's corners is one of the
// other's: five equations (four of the place, and both pairs of weights are affine) solved by
// Cramer's rule in integers. Small coordinates only. 1 inside, 0 apart, -1: on the rim, or no
// unique answer.
typedef struct Corner4 {
    int64_t x[4];
} Corner4;

static Wide determinant4(const int64_t m[4][4])
{
    Wide sum = 0;
    for (int c = 0; c < 4; c++) {
        int64_t minor[3][3];
        for (int i = 0; i < 3; i++)
            for (int j = 0, k = 0; j < 4; j++)
                if (j != c)
                    minor[i][k++] = m[i + 1][j];
        Wide d = 0;
        for (int j = 0; j < 3; j++)
            d += (Wide)minor[0][j] * ((Wide)minor[1][(j + 1) % 3] * minor[2][(j + 2) % 3] -
                                      (Wide)minor[1][(j + 2) % 3] * minor[2][(j + 1) % 3]);
        sum += (c % 2 == 0 ? 1 : -1) * m[0][c] * d;
    }
    return sum;
}

static int solve_triangles(const Corner4 a[3], const Corner4 b[3])
{
    // a0 + s (a1 - a0) + t (a2 - a0) = b0 + u (b1 - b0) + v (b2 - b0)
    int64_t m[4][4], right[4];
    for (int r = 0; r < 4; r++) {
        m[r][0] = a[1].x[r] - a[0].x[r];
        m[r][1] = a[2].x[r] - a[0].x[r];
        m[r][2] = b[0].x[r] - b[1].x[r];
        m[r][3] = b[0].x[r] - b[2].x[r];
        right[r] = b[0].x[r] - a[0].x[r];
    }
    Wide d = determinant4((const int64_t(*)[4])m), weight[4];
    if (d == 0)
        return -1;
    for (int c = 0; c < 4; c++) {
        int64_t with[4][4];
        memcpy(with, m, sizeof with);
        for (int r = 0; r < 4; r++)
            with[r][c] = right[r];
        weight[c] = determinant4((const int64_t(*)[4])with) * (d > 0 ? 1 : -1);
    }
    d = d > 0 ? d : -d;
    const Wide side[6] = {weight[0], weight[1], d - weight[0] - weight[1],
                          weight[2], weight[3], d - weight[2] - weight[3]};
    bool rim = false;
    for (int k = 0; k < 6; k++) {
        if (side[k] < 0)
            return 0;
        rim |= side[k] == 0;
    }
    return rim ? -1 : 1;
}

static Corner4 corner(const CutPath *path, int late)
{
    const int64_t *x = path->at[late].x;
    return (Corner4){{x[0], x[1], x[2], late}};
}

// The triangles {p0, q0, p1} and {q0, q1, p1} of both.
static int count_by_solving(const CutPath edge[2], const CutPath link[2])
{
    int count = 0;
    for (int i = 0; i < 4; i++) {
        const CutPath *side[2] = {edge, link};
        Corner4 triangle[2][3];
        for (int k = 0; k < 2; k++) {
            bool second = (k == 0 ? i / 2 : i % 2) == 1;
            const CutPath *p = side[k];
            triangle[k][0] = second ? corner(&p[1], 0) : corner(&p[0], 0);
            triangle[k][1] = second ? corner(&p[1], 1) : corner(&p[1], 0);
            triangle[k][2] = corner(&p[0], 1);
        }
        int meet = solve_triangles(triangle[0], triangle[1]);
        if (meet < 0)
            return CUT_DEGENERATE;
        count += meet;
    }
    return count;
}

static CutPath random_path(uint64_t *random, int size)
{
    CutPath path;
    for (int k = 0; k < 2; k++)
        for (int c = 0; c < 3; c++)
            path.at[k].x[c] = random_below(random, 2 * size + 1) - size;
    return path;
}

TEST(the_count_is_that_of_the_solved_equations)
{
    uint64_t random = 11;
    long met = 0, degenerate = 0;
    for (int size = 2; size <= 2048; size *= 4)
        for (int i = 0; i < EFFORT(60000); i++) {
            const CutPath edge[2] = {random_path(&random, size), random_path(&random, size)};
            const CutPath link[2] = {random_path(&random, size), random_path(&random, size)};
            int count = cut_count(edge, link), expected = count_by_solving(edge, link);
            // The solver cannot tell triangles apart that lie in one flat of three dimensions.
            if (expected == CUT_DEGENERATE) {
                degenerate++;
                continue;
            }
            assert_int_equal(count, expected);
            met += count > 0;
            if (count > 0)
                assert_true(cut_may_meet(edge, link));
        }
    assert_true(met > EFFORT(10000));
    print_message("met %ld, left out %ld\n", met, degenerate);
}

TEST(degenerate_cases_are_never_taken_for_clear_ones)
{
    uint64_t random = 12;
    // On a tiny grid nearly everything touches something.
    for (int i = 0; i < EFFORT(100000); i++) {
        const CutPath edge[2] = {random_path(&random, 1), random_path(&random, 1)};
        const CutPath link[2] = {random_path(&random, 1), random_path(&random, 1)};
        int count = cut_count(edge, link), solved = count_by_solving(edge, link);
        if (solved != CUT_DEGENERATE)
            assert_int_equal(count, solved);
        // One unit of 8 does not turn a clear case round.
        if (count > 0)
            assert_true(cut_may_meet(edge, link));
    }
}

TEST(far_apart_and_fine_steps_stay_exact)
{
    uint64_t random = 13;
    // The same figures shifted by a large whole number: differences are the same.
    for (int i = 0; i < EFFORT(20000); i++) {
        CutPath edge[2] = {random_path(&random, 100), random_path(&random, 100)};
        CutPath link[2] = {random_path(&random, 100), random_path(&random, 100)};
        int here = cut_count(edge, link);
        bool may = cut_may_meet(edge, link);
        for (int k = 0; k < 2; k++)
            for (int t = 0; t < 2; t++)
                for (int c = 0; c < 3; c++) {
                    edge[k].at[t].x[c] += CUT_REACH / 4 - 100;
                    link[k].at[t].x[c] += CUT_REACH / 4 - 100;
                }
        assert_int_equal(cut_count(edge, link), here);
        assert_int_equal(cut_may_meet(edge, link), may);
    }
}

// --- closed loops of links ---

// A blade that goes round nothing: after a sweep that begins and ends away from a loop of points,
// and whose own ends never come near it, the loop has been crossed an even number of times.
TEST(closed_loops_are_crossed_an_even_number_of_times)
{
    enum { POINTS = 4, SIZE = 1024 };
    uint64_t random = 21;
    int odd_links = 0, redone = 0;
    for (int i = 0; i < EFFORT(20000); i++) {
        // Moving points; every second loop lies on a lattice, where blades in its planes touch.
        bool lattice = i % 2 == 0;
        CutPath point[POINTS];
        for (int k = 0; k < POINTS; k++) {
            point[k] = random_path(&random, SIZE);
            if (lattice)
                for (int c = 0; c < 3; c++)
                    point[k].at[0].x[c] = point[k].at[1].x[c] =
                        SIZE * (random_below(&random, 3) - 1);
        }
        // The edge is far longer than the loop is wide, and crosses all of it in several ticks.
        const int64_t far = 64 * SIZE;
        int ticks = 1 + random_below(&random, 3), tries = 0, crossed;
        int64_t lean = lattice ? 0 : random_below(&random, SIZE) - SIZE / 2;
    again:
        crossed = 0;
        for (int t = 0; t < ticks && crossed >= 0; t++) {
            CutPath edge[2];
            for (int k = 0; k < 2; k++)
                for (int late = 0; late < 2; late++) {
                    CutPoint shift = cut_shift(tries, k);
                    int64_t y = -4 * SIZE + 8 * SIZE * (int64_t)(t + late) / ticks;
                    edge[k].at[late] =
                        (CutPoint){{shift.x[0] + (k == 0 ? lean : -lean), y + shift.x[1],
                                    (k == 0 ? -far : far) + shift.x[2]}};
                }
            for (int p = 0; p < POINTS && crossed >= 0; p++) {
                int q = (p + 1) % POINTS, low = p < q ? p : q, high = p < q ? q : p;
                CutPath part[2] = {cut_part(point[low], t, 1), cut_part(point[high], t, 1)};
                for (int k = 0; k < 2; k++) {
                    // The points' way, divided like the blade's.
                    CutPath whole = point[k == 0 ? low : high];
                    for (int late = 0; late < 2; late++)
                        for (int c = 0; c < 3; c++)
                            part[k].at[late].x[c] =
                                whole.at[0].x[c] +
                                (whole.at[1].x[c] - whole.at[0].x[c]) * (t + late) / ticks;
                }
                int count = cut_count(edge, part);
                if (count == CUT_DEGENERATE) {
                    crossed = -1;
                    break;
                }
                odd_links += count % 2;
                crossed += count;
            }
        }
        if (crossed < 0) {
            redone++;
            assert_in_range(++tries, 1, CUT_TRIES);
            goto again;
        }
        assert_int_equal(crossed % 2, 0);
    }
    assert_true(odd_links > EFFORT(10000));
    assert_true(redone > EFFORT(1000)); // the lattice was degenerate
}

// --- sub-ticks ---

TEST(subticks_bound_the_twist_and_are_powers_of_two)
{
    uint64_t random = 31;
    for (int i = 0; i < 10000; i++) {
        CutSweep whole = {.phase = CUT_GOES_ON}, half;
        for (int k = 0; k < 2; k++) {
            whole.before.end[k] = random_vec3(&random);
            whole.after.end[k] = random_vec3(&random);
        }
        double tolerance = random_between(&random, 0.04, 1.0);
        int m = cut_subticks(&whole, tolerance);
        Vec3 twist = vec3_sub(vec3_sub(whole.after.end[0], whole.before.end[0]),
                              vec3_sub(whole.after.end[1], whole.before.end[1]));
        double figure = 0.25 * vec3_length(twist);
        assert_true(m > 0 && (m & (m - 1)) == 0);
        expect_at_most(figure / m, tolerance);
        if (m > 1)
            expect_at_least(figure / (m / 2), tolerance);
        // Half of the way takes half as many, so both divisions end in the same places.
        half = whole;
        for (int k = 0; k < 2; k++)
            half.after.end[k] = vec3_scale(0.5, vec3_add(whole.before.end[k], whole.after.end[k]));
        if (m > 1)
            assert_int_equal(2 * cut_subticks(&half, tolerance), m);
    }
    CutSweep wild = {.after = {{{1.0, 0.0, 0.0}, {-1.0, 0.0, 0.0}}}};
    assert_int_equal(cut_subticks(&wild, 0.001), 0);
}

TEST(parts_of_a_way_share_their_ends)
{
    uint64_t random = 32;
    for (int i = 0; i < 1000; i++) {
        CutPath whole = random_path(&random, 1000000);
        for (int m = 1; m <= CUT_SUBTICKS_MOST; m *= 2) {
            CutPath last = cut_part(whole, 0, m);
            assert_true(cut_points_equal(last.at[0], whole.at[0]));
            for (int k = 1; k < m; k++) {
                CutPath part = cut_part(whole, k, m);
                assert_true(cut_points_equal(part.at[0], last.at[1]));
                last = part;
            }
            assert_true(cut_points_equal(last.at[1], whole.at[1]));
        }
    }
}

// --- quantities ---

TEST(places_are_rounded_once_and_far_ones_refused)
{
    CutPoint point;
    assert_true(cut_quantise(vec3(0.51, -0.51, 2.49), vec3(0, 0, 0), 1.0, &point));
    assert_int_equal(point.x[0], 1);
    assert_int_equal(point.x[1], -1);
    assert_int_equal(point.x[2], 2);
    assert_true(cut_quantise(vec3(1.5, 0, 0), vec3(1.0, 0, 0), 0.25, &point));
    assert_int_equal(point.x[0], 2);
    assert_false(cut_quantise(vec3(2e11, 0, 0), vec3(0, 0, 0), 1.0, &point));
    assert_false(cut_quantise(vec3((double)NAN, 0, 0), vec3(0, 0, 0), 1.0, &point));
    assert_false(cut_quantise(vec3(0, 0, (double)INFINITY), vec3(0, 0, 0), 1.0, &point));
}

TEST(shifts_are_small_and_differ)
{
    for (int k = 0; k < 2; k++) {
        CutPoint none = cut_shift(0, k);
        assert_true(cut_points_equal(none, (CutPoint){{0, 0, 0}}));
    }
    for (int64_t i = 1; i <= CUT_TRIES; i++) {
        assert_false(cut_points_equal(cut_shift(i, 0), cut_shift(i, 1)));
        assert_false(cut_points_equal(cut_shift(i, 0), cut_shift(i - 1, 0)));
        for (int c = 0; c < 3; c++)
            assert_true(llabs((long long)cut_shift(i, 0).x[c]) <= 7);
    }
}

TEST(every_verdict_has_a_sentence)
{
    char text[192];
    for (int v = CUT_DONE; v <= CUT_TOO_LARGE; v++) {
        CutOutcome outcome = {.verdict = (CutVerdict)v, .separated = 3, .needed = 5, .room = 2};
        text[0] = '\0';
        cut_describe(&outcome, "liver", text, sizeof text);
        assert_non_null(strstr(text, "'liver'"));
    }
    CutOutcome done = {.separated = 1, .nodes_added = 2, .pieces = 3, .small_pieces = 1};
    cut_describe(&done, "liver", text, sizeof text);
    assert_string_equal(text,
                        "body 'liver': 1 link severed, 2 nodes added, 3 pieces, 1 of them tiny");
}
