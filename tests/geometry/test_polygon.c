// SPDX-License-Identifier: MIT
// Polygons cut into triangles: inside the polygon, once, and alike however it is written down.
#include "test.h"
#include "random.h"

#include "geometry/mesh.h"
#include "geometry/repair.h"

enum { MOST = 64 };

// A polygon in a plane that stands anyhow in space.
static Vec3 lift(double x, double y)
{
    Vec3 u = vec3_unit(vec3(1, 2, -0.5)), v = vec3_unit(vec3_cross(u, vec3(0.3, -1, 2)));
    return vec3_add(vec3(5, -7, 3), vec3_add(vec3_scale(x, u), vec3_scale(y, v)));
}

static Vec3 area_vector(const Vec3 *x, const int *corner, int count)
{
    Vec3 sum = {0, 0, 0};
    for (int i = 1; i + 1 < count; i++)
        sum = vec3_add(sum, vec3_cross(vec3_sub(x[corner[i]], x[corner[0]]),
                                       vec3_sub(x[corner[i + 1]], x[corner[0]])));
    return vec3_scale(0.5, sum);
}

// Cuts, and checks what must hold for every simple polygon: the triangles turn as the polygon does,
// none is flat, and their areas sum up to its area, so that they neither overlap nor reach outside.
static void expect_cut(const Vec3 *x, int count, int (*triangle)[3])
{
    int key[MOST], all[MOST];
    for (int i = 0; i < count; i++)
        key[i] = all[i] = i;
    assert_true(polygon_triangulate(x, key, count, triangle));
    Vec3 whole = area_vector(x, all, count), normal = vec3_unit(whole);
    double sum = 0.0;
    for (int t = 0; t < count - 2; t++) {
        Vec3 part = area_vector(x, triangle[t], 3);
        expect_at_least(vec3_dot(part, normal), 0.0);
        expect_at_least(mesh_relative_height(x, triangle[t]), MESH_SMALLEST_HEIGHT);
        sum += vec3_length(part);
    }
    // rounding of some dozen areas of size 1 at coordinates of size 10
    expect_near(sum, vec3_length(whole), 1e-12);
}

TEST(convex_polygons_are_covered_once)
{
    for (int count = 4; count <= 40; count++) {
        Vec3 x[MOST];
        int triangle[MOST][3];
        for (int i = 0; i < count; i++)
            x[i] = lift(cos(6.283 * i / count), 0.7 * sin(6.283 * i / count));
        expect_cut(x, count, triangle);
    }
}

TEST(concave_polygons_are_cut_inside)
{
    uint64_t random = 7;
    for (int round = 0; round < 300; round++) {
        // Stars about the origin with random spikes are simple.
        Vec3 x[MOST];
        int triangle[MOST][3], count = 5 + random_below(&random, 40);
        for (int i = 0; i < count; i++) {
            double radius = random_between(&random, 0.2, 1.0), angle = 6.283185 * i / count;
            x[i] = lift(radius * cos(angle), radius * sin(angle));
        }
        expect_cut(x, count, triangle);
    }
}

TEST(an_arrow_is_cut_at_its_notch)
{
    const Vec3 x[4] = {{0, 0, 0}, {2, 1, 0}, {0, 2, 0}, {0.5, 1, 0}};
    int triangle[2][3];
    expect_cut(x, 4, triangle);
    for (int t = 0; t < 2; t++) // both hold the tip and the notch
        assert_true(memchr(triangle[t], 1, sizeof triangle[t]) != NULL &&
                    memchr(triangle[t], 3, sizeof triangle[t]) != NULL);
}

TEST(corners_in_the_middle_of_a_side_leave_no_flat_triangle)
{
    // A tall triangle whose base has corners on it, some off the line by rounding: cutting off the
    // tip would be the best ear but leave them as a sliver.
    for (int round = 0; round < 3; round++) {
        double off = round == 0 ? 0.0 : round == 1 ? 1e-8 : -1e-8;
        const Vec3 x[6] = {lift(0, 0),     lift(1, off), lift(2, 0),
                           lift(2.5, off), lift(3, 0),   lift(1.5, 9)};
        int triangle[4][3];
        expect_cut(x, 6, triangle);
        for (int t = 0; t < 4; t++) // the thinnest: a half of the base's length by 9
            expect_at_least(mesh_relative_height(x, triangle[t]), 0.04);
    }
}

// The set of triangles as a number that does not depend on order and first corner.
static uint64_t fingerprint(int (*triangle)[3], int count, const int *name)
{
    uint64_t sum = 0;
    for (int t = 0; t < count; t++) {
        uint64_t product = 1;
        for (int k = 0; k < 3; k++)
            product *= (uint64_t)(2 * name[triangle[t][k]] + 3);
        sum += product;
    }
    return sum;
}

TEST(cuts_do_not_depend_on_first_corner_and_direction)
{
    // A square has two equally good diagonals; a notched one more corners.
    static const double flat[2][6][2] = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}},
                                         {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}};
    static const int counts[2] = {4, 6};
    for (int p = 0; p < 2; p++) {
        int count = counts[p];
        uint64_t expected = 0;
        for (int way = 0; way < 2 * count; way++) {
            Vec3 x[6];
            int name[6], triangle[4][3];
            for (int i = 0; i < count; i++) {
                name[i] = ((way % 2 ? i : count - i) + way / 2) % count;
                x[i] = vec3(flat[p][name[i]][0], flat[p][name[i]][1], 0.0);
            }
            assert_true(polygon_triangulate(x, name, count, triangle));
            uint64_t found = fingerprint(triangle, count - 2, name);
            assert_true(way == 0 || found == expected);
            expected = found;
            // and the triangles turn the way that the polygon runs
            Vec3 area = area_vector(x, triangle[0], 3);
            assert_true((area.z > 0.0) == (way % 2 == 1));
        }
    }
}

TEST(a_polygon_without_area_is_cut_anyhow)
{
    const Vec3 x[5] = {{0, 0, 0}, {1, 1, 1}, {3, 3, 3}, {2, 2, 2}, {0.5, 0.5, 0.5}};
    const int key[5] = {4, 3, 2, 1, 0};
    int triangle[3][3];
    assert_true(polygon_triangulate(x, key, 5, triangle));
}

TEST(a_polygon_that_crosses_itself_is_refused)
{
    const Vec3 x[4] = {{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}};
    const int key[4] = {0, 1, 2, 3};
    int triangle[2][3];
    assert_false(polygon_triangulate(x, key, 4, triangle));
}

TEST(a_hole_reached_by_a_bridge_stays_a_hole)
{
    // A square of side 3 with a hole of side 1: corners 0 and 4 are walked through twice.
    static const double flat[10][2] = {{0, 0}, {3, 0}, {3, 3}, {0, 3}, {0, 0},
                                       {1, 1}, {1, 2}, {2, 2}, {2, 1}, {1, 1}};
    static const int key[10] = {0, 1, 2, 3, 0, 4, 5, 6, 7, 4};
    Vec3 x[10];
    int triangle[8][3];
    for (int i = 0; i < 10; i++)
        x[i] = vec3(flat[i][0], flat[i][1], 0.0);
    assert_true(polygon_triangulate(x, key, 10, triangle));
    double area = 0.0;
    for (int t = 0; t < 8; t++) {
        Vec3 part = area_vector(x, triangle[t], 3);
        expect_at_least(part.z, 0.0);
        area += part.z;
    }
    expect_near(area, 8.0, 1e-14); // exact but for rounding
}

TEST(huge_polygons_are_cut_if_convex_and_refused_otherwise)
{
    enum { CORNERS = 5000 };
    static Vec3 x[CORNERS];
    static int key[CORNERS], triangle[CORNERS][3];
    for (int i = 0; i < CORNERS; i++) {
        x[i] = vec3(cos(6.283 * i / CORNERS), sin(6.283 * i / CORNERS), 0.0);
        key[i] = i;
    }
    assert_true(polygon_triangulate(x, key, CORNERS, triangle));
    x[CORNERS / 4] = vec3(0, 0, 0);
    assert_false(polygon_triangulate(x, key, CORNERS, triangle));
}
