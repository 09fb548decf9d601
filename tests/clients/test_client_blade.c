// SPDX-License-Identifier: MIT
// Paths of blades: files with clear errors, planes, and the poses of a tool that follows them.
#include "blade.h"
#include "scratch_folder.h"
#include "test.h"

static bool read_text(const char *text, BladePath *path, PliantError *error)
{
    scratch_write_text("blade", text);
    *path = (BladePath){0};
    return blade_read(path, scratch_at("blade"), error);
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(sweeps_go_from_place_to_place_until_the_blade_is_lifted)
{
    SCOPED(blade_destroy) BladePath path;
    PliantError error;
    assert_true(read_text("# two strokes\n0 0 0 0 0 1\n 1 0 0\t1 0 1 # on\n2 0 0 2 0 1\n\nlift\n"
                          "0 5 0 0 5 1\nlift\n0 6 0 0 6 1\n1 6 0 1 6 1\n",
                          &path, &error));
    assert_int_equal(path.count, 6);
    assert_int_equal(blade_sweeps(&path), 3);
    int at = blade_next_sweep(&path, -1);
    assert_int_equal(at, 0);
    at = blade_next_sweep(&path, at);
    assert_int_equal(at, 1);
    at = blade_next_sweep(&path, at);
    assert_int_equal(at, 4); // the lonely place is none
    assert_int_equal(blade_next_sweep(&path, at), -1);
    expect_near(path.position[1].end[1][2], 1.0, 0.0);
}

TEST(faulty_files_are_refused_with_their_line)
{
    static const struct {
        const char *text, *says;
    } faults[] = {
        {"", "no sweep"},
        {"0 0 0 0 0 1\n", "no sweep"},
        {"0 0 0 0 0 1\nlift\n0 1 0 0 1 1\n", "no sweep"},
        {"0 0 0 0 0\n", ":1: expected x y z x y z"},
        {"0 0 0 0 0 1 2\n", ":1: expected x y z x y z"},
        {"0 0 0 0 0 1\n0 0 0 0 0 nan\n", ":2: expected x y z x y z"},
        {"0 0 0 0 0 1\n0 0 0 0 0 1e999\n", ":2: expected x y z x y z"},
        {"0 0 0 0 0 1x\n", ":1: expected x y z x y z"},
        {"lifted\n", ":1: expected x y z x y z"},
        {"\n\n0 0 0 0 0 1001\n", ":3: position 1001 outside"},
    };
    for (size_t k = 0; k < sizeof faults / sizeof faults[0]; k++) {
        SCOPED(blade_destroy) BladePath path;
        PliantError error = {0};
        assert_false(read_text(faults[k].text, &path, &error));
        if (!strstr(error.text, faults[k].says))
            fail_msg("'%s' does not say '%s'", error.text, faults[k].says);
    }
}

TEST(a_plane_is_swept_by_a_square_across_its_normal)
{
    static const double point[3] = {0.1, -0.2, 0.3};
    static const double normals[4][3] = {{0, 0, 2}, {1, 0, 0}, {0, -3, 0}, {1, -2, 0.5}};
    for (int n = 0; n < 4; n++) {
        SCOPED(blade_destroy) BladePath path = {0};
        blade_plane(&path, point, normals[n], 0.5);
        assert_int_equal(blade_sweeps(&path), 1);
        double center[3] = {0, 0, 0};
        for (int p = 0; p < 2; p++)
            for (int end = 0; end < 2; end++) {
                double across = 0.0, away = 0.0;
                for (int k = 0; k < 3; k++) {
                    double d = path.position[p].end[end][k] - point[k];
                    across += d * normals[n][k];
                    away += d * d;
                    center[k] += 0.25 * path.position[p].end[end][k];
                }
                expect_near(across, 0.0, 1e-15); // roundings of numbers below one
                expect_near(sqrt(away), 0.5 * sqrt(0.5), 1e-15);
            }
        for (int k = 0; k < 3; k++)
            expect_near(center[k], point[k], 1e-15);
    }
}

// A unit vector along z turned by a quaternion.
static void turned_z(const double q[4], double z[3])
{
    z[0] = 2.0 * (q[1] * q[3] + q[0] * q[2]);
    z[1] = 2.0 * (q[2] * q[3] - q[0] * q[1]);
    z[2] = 1.0 - 2.0 * (q[1] * q[1] + q[2] * q[2]);
}

TEST(a_tool_carries_its_edge_along_the_path)
{
    static const double edge[][2][3] = {
        {{0, 0, 0}, {0, 0, -0.05}}, // straight down: half a turn from the tool's own frame
        {{0.1, 0, 0}, {0.1, 0.001, -0.05}},
        {{0.1, 0.2, 0}, {0.15, 0.2, 0}},
        {{0.1, 0.2, 0}, {0.05, 0.2, 0}}, // turned right round
    };
    enum { COUNT = sizeof edge / sizeof *edge };
    SCOPED(blade_destroy) BladePath path = {0};
    for (int i = 0; i < COUNT; i++)
        assert_true(blade_add(&path, edge[i], i == 0));
    SCOPED(track_destroy) Track track;
    assert_int_equal(blade_track(&path, 0, 0.1, &track), COUNT);
    assert_int_equal(track.count, COUNT);
    expect_near(track.pose[1].time, sqrt(0.1 * 0.1 + 1e-6) / 0.1, 1e-12); // its farther end
    for (int i = 0; i < COUNT; i++) {
        const double *q = track.pose[i].orientation;
        double z[3], length = 0.0, norm = 0.0;
        for (int k = 0; k < 4; k++)
            norm += q[k] * q[k];
        expect_near(norm, 1.0, 1e-14); // a few products of four numbers
        turned_z(q, z);
        for (int k = 0; k < 3; k++)
            length += pow(edge[i][1][k] - edge[i][0][k], 2.0);
        for (int k = 0; k < 3; k++) {
            expect_near(track.pose[i].position[k], edge[i][0][k], 0.0);
            expect_near(z[k], (edge[i][1][k] - edge[i][0][k]) / sqrt(length), 1e-14);
        }
    }
}

TEST(each_stroke_has_a_track_of_its_own)
{
    SCOPED(blade_destroy) BladePath path = {0};
    for (int i = 0; i < 6; i++) {
        const double end[2][3] = {{0.1 * i, 0, 0}, {0.1 * i, 0, 0.1}};
        assert_true(blade_add(&path, end, i == 0 || i == 4));
    }
    SCOPED(track_destroy) Track track;
    assert_int_equal(blade_track(&path, 0, 1.0, &track), 4);
    assert_int_equal(track.count, 4);
    expect_near(track_duration(&track), 0.3, 1e-15);
    track_destroy(&track);
    assert_int_equal(blade_track(&path, 4, 1.0, &track), 6);
    assert_int_equal(track.count, 2);
}
