// SPDX-License-Identifier: MIT
// Distances against an exact reference that shares nothing with the code: every pair of features
// (corner, side, face) of the two simplices is solved as a small least-squares problem in quadruple
// precision, and the nearest pair whose weights are all positive wins.
#include "test.h"
#include "random.h"

#include "geometry/distance.h"

#include <float.h>

__extension__ typedef __float128 Quad;

// Coordinates are about 1, so one rounding is about 1e-16; the longest chain of operations loses
// two to three digits.
static const double TOLERANCE = 1e-12;

// Solves the k x k symmetric system in place by elimination; false when it is singular: then
// features of lower dimension hold the nearest pair.
static bool solve(Quad matrix[3][3], Quad right[3], int k)
{
    for (int i = 0; i < k; i++) {
        // Gram matrices need no exchange of rows; a vanishing pivot is a vanishing direction.
        if (!(matrix[i][i] > (Quad)1e-60))
            return false;
        for (int r = i + 1; r < k; r++) {
            Quad factor = matrix[r][i] / matrix[i][i];
            for (int c = i; c < k; c++)
                matrix[r][c] -= factor * matrix[i][c];
            right[r] -= factor * right[i];
        }
    }
    for (int i = k - 1; i >= 0; i--) {
        for (int c = i + 1; c < k; c++)
            right[i] -= matrix[i][c] * right[c];
        right[i] /= matrix[i][i];
    }
    return true;
}

static void difference(Vec3 a, Vec3 b, Quad out[3])
{
    out[0] = (Quad)a.x - (Quad)b.x;
    out[1] = (Quad)a.y - (Quad)b.y;
    out[2] = (Quad)a.z - (Quad)b.z;
}

static Quad dot(const Quad a[3], const Quad b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Squared distance of the features spanned by the corners in two masks; -1 when the nearest points
// of their planes are not inside both.
static Quad feature_distance(const Vec3 *a, int a_mask, const Vec3 *b, int b_mask)
{
    Quad direction[4][3], gap[3];
    int count[2] = {0, 0}, first[2] = {-1, -1}, k = 0;
    for (int side = 0; side < 2; side++) {
        const Vec3 *x = side == 0 ? a : b;
        int mask = side == 0 ? a_mask : b_mask;
        for (int i = 0; i < 3; i++) {
            if ((mask >> i & 1) == 0)
                continue;
            if (first[side] < 0) {
                first[side] = i;
                continue;
            }
            if (k == 3) // two faces; not needed
                return -1;
            difference(x[i], x[first[side]], direction[k]);
            for (int c = 0; side == 1 && c < 3; c++)
                direction[k][c] = -direction[k][c];
            k++;
            count[side]++;
        }
    }
    difference(a[first[0]], b[first[1]], gap);
    Quad matrix[3][3], weight[3];
    for (int i = 0; i < k; i++) {
        for (int j = 0; j < k; j++)
            matrix[i][j] = dot(direction[i], direction[j]);
        weight[i] = -dot(direction[i], gap);
    }
    if (!solve(matrix, weight, k))
        return -1;
    Quad left[2] = {1, 1};
    for (int i = 0; i < k; i++) {
        left[i < count[0] ? 0 : 1] -= weight[i];
        if (weight[i] < 0)
            return -1;
        for (int c = 0; c < 3; c++)
            gap[c] += weight[i] * direction[i][c];
    }
    return left[0] < 0 || left[1] < 0 ? -1 : dot(gap, gap);
}

// Distance of two simplices with 1 to 3 corners.
static double exact_distance(const Vec3 *a, int a_count, const Vec3 *b, int b_count)
{
    Quad best = -1;
    for (int i = 1; i < 1 << a_count; i++) {
        for (int j = 1; j < 1 << b_count; j++) {
            Quad squared = feature_distance(a, i, b, j);
            if (squared >= 0 && (best < 0 || squared < best))
                best = squared;
        }
    }
    return (double)sqrtl((long double)best);
}

// Six random points, made degenerate in one of many ways.
static void make_case(uint64_t *random, int kind, Vec3 x[6])
{
    for (int i = 0; i < 6; i++)
        x[i] = random_vec3(random);
    double small = pow(10.0, random_between(random, -17.0, -1.0));
    int i = random_below(random, 6), j = random_below(random, 6), k = random_below(random, 6);
    double t = random_between(random, -0.5, 1.5), s = random_between(random, -0.5, 1.5);
    switch (kind % 8) {
    case 1: // two points fall together
        x[i] = x[j];
        break;
    case 2: // nearly together
        x[i] = vec3_madd(x[j], small, x[i]);
        break;
    case 3: // three in line
        x[i] = vec3_madd(x[j], t, vec3_sub(x[k], x[j]));
        break;
    case 4: // nearly in line: slivers and long thin triangles
        x[i] = vec3_madd(vec3_madd(x[j], t, vec3_sub(x[k], x[j])), small, x[i]);
        break;
    case 5: // nearly parallel sides
        x[1] = vec3_madd(vec3_madd(x[0], t, vec3_sub(x[3], x[2])), small, x[1]);
        break;
    case 6: // nearly in one plane
        x[i] = vec3_madd(
            vec3_madd(vec3_madd(x[j], t, vec3_sub(x[k], x[j])), s, vec3_sub(x[(k + 1) % 6], x[j])),
            small, x[i]);
        break;
    case 7: // everything on a coarse grid: ties, right angles, exact contact
        for (int n = 0; n < 6; n++)
            x[n] = vec3(random_below(random, 3), random_below(random, 3), random_below(random, 3));
        break;
    default:
        break;
    }
}

static void expect_pair_is_valid(const ClosestPair *pair, Vec3 p, Vec3 q, const Vec3 x[3])
{
    Vec3 on_triangle = {0.0, 0.0, 0.0};
    double sum = 0.0;
    for (int k = 0; k < 3; k++) {
        expect_at_least(pair->weight[k], 0.0);
        on_triangle = vec3_madd(on_triangle, pair->weight[k], x[k]);
        sum += pair->weight[k];
    }
    // a few roundings of numbers up to 2
    expect_near(sum, 1.0, 4.0 * DBL_EPSILON);
    expect_near(vec3_length(vec3_sub(on_triangle, pair->on_triangle)), 0.0, 1e-14);
    expect_at_least(pair->along, 0.0);
    expect_at_most(pair->along, 1.0);
    Vec3 on_segment = vec3_madd(p, pair->along, vec3_sub(q, p));
    expect_near(vec3_length(vec3_sub(on_segment, pair->on_segment)), 0.0, 1e-14);
    expect_near(vec3_length(vec3_sub(pair->on_segment, pair->on_triangle)), pair->distance, 1e-15);
}

TEST(point_and_triangle_match_the_exact_distance)
{
    uint64_t random = 1;
    for (int i = 0; i < 150000; i++) {
        Vec3 x[6];
        make_case(&random, i, x);
        ClosestPair pair;
        distance_point_triangle(x[0], &x[1], &pair);
        expect_pair_is_valid(&pair, x[0], x[0], &x[1]);
        expect_near(pair.distance, exact_distance(x, 1, &x[1], 3), TOLERANCE);
    }
}

TEST(two_segments_match_the_exact_distance)
{
    uint64_t random = 2;
    for (int i = 0; i < 150000; i++) {
        Vec3 x[6];
        double s, t;
        make_case(&random, i, x);
        distance_segment_segment(x[0], x[1], x[2], x[3], &s, &t);
        expect_at_least(fmin(s, t), 0.0);
        expect_at_most(fmax(s, t), 1.0);
        Vec3 gap = vec3_sub(vec3_madd(x[0], s, vec3_sub(x[1], x[0])),
                            vec3_madd(x[2], t, vec3_sub(x[3], x[2])));
        expect_near(vec3_length(gap), exact_distance(x, 2, &x[2], 2), TOLERANCE);
    }
}

TEST(segment_and_triangle_match_the_exact_distance)
{
    uint64_t random = 3;
    for (int i = 0; i < 40000; i++) {
        Vec3 x[6];
        make_case(&random, i, x);
        ClosestPair pair[DISTANCE_PAIRS];
        double along, weight[3], least = HUGE_VAL;
        distance_segment_triangle_pairs(x[0], x[1], &x[2], pair);
        for (int k = 0; k < DISTANCE_PAIRS; k++) {
            expect_pair_is_valid(&pair[k], x[0], x[1], &x[2]);
            least = fmin(least, pair[k].distance);
        }
        if (distance_segment_crosses(x[0], x[1], &x[2], &along, weight))
            least = 0.0;
        expect_near(least, exact_distance(x, 2, &x[2], 3), TOLERANCE);
    }
}

TEST(point_and_segment_match_the_exact_distance)
{
    uint64_t random = 4;
    for (int i = 0; i < 100000; i++) {
        Vec3 x[6];
        make_case(&random, i, x);
        expect_near(distance_point_segment(x[0], x[1], x[2]), exact_distance(x, 1, &x[1], 2),
                    TOLERANCE);
    }
}

TEST(crossing_point_is_on_both)
{
    uint64_t random = 5;
    int crossings = 0;
    for (int i = 0; i < 100000; i++) {
        Vec3 x[5];
        for (int k = 0; k < 5; k++)
            x[k] = random_vec3(&random);
        double along, weight[3];
        if (!distance_segment_crosses(x[0], x[1], &x[2], &along, weight))
            continue;
        crossings++;
        Vec3 on_segment = vec3_madd(x[0], along, vec3_sub(x[1], x[0])), on_triangle = {0, 0, 0};
        for (int k = 0; k < 3; k++) {
            expect_at_least(weight[k], 0.0);
            on_triangle = vec3_madd(on_triangle, weight[k], x[2 + k]);
        }
        // Rounding over the sine between segment and plane; 1e5 random ones reach down to 1e-5.
        expect_near(vec3_length(vec3_sub(on_segment, on_triangle)), 0.0, 1e-10);
    }
    assert_true(crossings > 1000); // the test has tested something
}

TEST(crossing_knows_which_side_of_the_border)
{
    const Vec3 x[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    double along, weight[3];
    assert_true(
        distance_segment_crosses(vec3(0.25, 0.25, 1), vec3(0.25, 0.25, -3), x, &along, weight));
    expect_near(along, 0.25, 0.0); // powers of two: exact
    expect_near(weight[0], 0.5, 0.0);
    // a touch counts, from either side; ending before or lying in the plane does not
    assert_true(
        distance_segment_crosses(vec3(0.25, 0.25, 0), vec3(0.25, 0.25, -3), x, &along, weight));
    assert_true(
        distance_segment_crosses(vec3(0.25, 0.25, 1), vec3(0.25, 0.25, 0), x, &along, weight));
    assert_false(
        distance_segment_crosses(vec3(0.25, 0.25, 1), vec3(0.25, 0.25, 0.1), x, &along, weight));
    assert_false(distance_segment_crosses(vec3(0.1, 0.1, 0), vec3(0.5, 0.1, 0), x, &along, weight));
    assert_false(
        distance_segment_crosses(vec3(0.6, 0.6, 1), vec3(0.6, 0.6, -1), x, &along, weight));
    // degenerate triangles are crossed by nothing
    const Vec3 line[3] = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
    assert_false(distance_segment_crosses(vec3(0.5, 0, 1), vec3(0.5, 0, -1), line, &along, weight));
}

TEST(no_segment_slips_through_a_shared_side)
{
    uint64_t random = 6;
    for (int i = 0; i < 100000; i++) {
        // Two triangles left and right of a side, and a segment aimed at a point of it.
        Vec3 a = random_vec3(&random), b = random_vec3(&random);
        Vec3 left[3] = {a, b, random_vec3(&random)};
        Vec3 out = vec3_cross(vec3_sub(b, a), vec3_sub(left[2], a));
        Vec3 in_plane = vec3_cross(vec3_unit(out), vec3_sub(b, a));
        Vec3 right[3] = {b, a, vec3_sub(a, in_plane)};
        Vec3 target = vec3_madd(a, random_between(&random, 0.01, 0.99), vec3_sub(b, a));
        Vec3 p = vec3_add(target, vec3_unit(out)), q = vec3_madd(target, -1.0, vec3_unit(out));
        double along, weight[3];
        assert_true(distance_segment_crosses(p, q, left, &along, weight) ||
                    distance_segment_crosses(p, q, right, &along, weight));
    }
}
