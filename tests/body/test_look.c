// SPDX-License-Identifier: MIT
// Colours of nodes by where they lie at rest.
#include "test.h"
#include "body/look.h"

enum { N = 6 };
static const double STEP = 0.002; // [m]

// A grid of N^3 voxels, turned and off the origin.
static LookGrid turned_grid(const unsigned char *value)
{
    const Quat turn = quat_from_rotation(vec3(0.3, -0.7, 1.1));
    const Vec3 step[3] = {quat_rotate(turn, vec3(STEP, 0, 0)), quat_rotate(turn, vec3(0, STEP, 0)),
                          quat_rotate(turn, vec3(0, 0, STEP))};
    return look_grid((const int[3]){N, N, N}, vec3(0.1, -0.2, 0.05), step, value);
}

// The place with these coordinates in the grid.
static void place_at(double i, double j, double k, float rest[3])
{
    const Quat turn = quat_from_rotation(vec3(0.3, -0.7, 1.1));
    const Vec3 x =
        vec3_add(vec3(0.1, -0.2, 0.05), quat_rotate(turn, vec3_scale(STEP, vec3(i, j, k))));
    rest[0] = (float)x.x, rest[1] = (float)x.y, rest[2] = (float)x.z;
}

TEST(an_image_that_is_linear_is_found_as_it_is_between_its_voxels)
{
    static unsigned char value[N * N * N][3];
    for (int k = 0, at = 0; k < N; k++)
        for (int j = 0; j < N; j++)
            for (int i = 0; i < N; i++, at++) {
                value[at][0] = (unsigned char)(40 * i);
                value[at][1] = (unsigned char)(20 + 30 * j);
                value[at][2] = (unsigned char)(250 - 8 * i - 16 * k);
            }
    const BodyLook look = {.usual = {{1, 2, 3}, {4, 5, 6}}, .image = turned_grid(*value)};
    for (int n = 0; n < 200; n++) {
        const double i = 0.11 + 4.7 * (n % 11) / 11.0, j = 0.2 + 4.7 * (n % 7) / 7.0,
                     k = 0.3 + 4.6 * (n % 5) / 5.0;
        float rest[3];
        place_at(i, j, k, rest);
        const LookColours colours = look_colours(&look, rest);
        // Rounded once; positions of single precision are off by 1e-5 of a voxel.
        expect_near(colours.inside[0], 40.0 * i, 0.501);
        expect_near(colours.inside[1], 20.0 + 30.0 * j, 0.501);
        expect_near(colours.inside[2], 250.0 - 8.0 * i - 16.0 * k, 0.501);
        assert_int_equal(colours.outside[0], 1); // the outside has no image
    }
}

TEST(an_image_goes_on_beyond_its_border)
{
    static unsigned char value[N * N * N][3];
    for (int at = 0; at < N * N * N; at++)
        value[at][0] = (unsigned char)(40 * (at % N));
    const BodyLook look = {.image = turned_grid(*value)};
    static const double far[] = {-0.4, -3.0, -1e6};
    for (int n = 0; n < 3; n++) {
        float rest[3];
        place_at(far[n], 2.0, 2.0, rest);
        assert_int_equal(look_colours(&look, rest).inside[0], 0);
        place_at(N - 1.0 - far[n], 2.0, 2.0, rest);
        assert_int_equal(look_colours(&look, rest).inside[0], 40 * (N - 1));
    }
}

TEST(labels_mix_between_their_voxels_and_reach_two_voxels_beyond_the_cells)
{
    static unsigned char value[N * N * N];
    // Two slabs of labels, void above them.
    for (int k = 0, at = 0; k < N; k++)
        for (int j = 0; j < N; j++)
            for (int i = 0; i < N; i++, at++)
                value[at] = (unsigned char)(k > 2 ? 0 : i < 3 ? 7 : 9);
    BodyLook look = {.usual = {{1, 1, 1}, {1, 1, 1}}, .labels = turned_grid(value)};
    look.of_label[7] = (LookColours){{70, 0, 0}, {71, 0, 0}};
    look.of_label[9] = (LookColours){{90, 0, 0}, {91, 0, 0}};
    static const struct {
        double i, j, k;
        int outside;
    } at[] = {{0.0, 2.0, 0.0, 70},  {2.4, 2.0, 2.3, 78}, {2.6, 2.0, 2.3, 82},
              {1.0, 2.0, 3.4, 70},  {4.0, 2.0, 4.4, 90}, {2.4, 2.0, 3.0, 70},
              {-1.2, 2.0, 1.0, 70}, {4.0, 2.0, 5.4, 1},  {1e9, 0.0, 0.0, 1}};
    for (size_t n = 0; n < sizeof at / sizeof *at; n++) {
        float rest[3];
        place_at(at[n].i, at[n].j, at[n].k, rest);
        const LookColours colours = look_colours(&look, rest);
        assert_int_equal(colours.outside[0], at[n].outside);
        assert_int_equal(colours.inside[0], at[n].outside == 1 ? 1 : at[n].outside + 1);
    }
}
