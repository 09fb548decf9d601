// SPDX-License-Identifier: MIT
// Paths of tools: files of poses are read with clear errors, and velocities belong to the motion.
#include "scratch_folder.h"
#include "test.h"
#include "track.h"

static bool read_text(const char *text, Track *track, PliantError *error)
{
    scratch_write_text("track", text);
    return track_read(track, scratch_at("track"), error);
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(file_of_poses_is_read_with_comments_and_optional_turns)
{
    SCOPED(track_destroy) Track track;
    PliantError error;
    assert_true(read_text("# t x y z\n\n  5.0 0 0 0.1\n5.5\t0.1 0 0.1 0 0 0 1 # turned\n6 .1 0 0\n",
                          &track, &error));
    assert_int_equal(track.count, 3);
    expect_near(track.pose[0].time, 0.0, 0.0);
    expect_near(track_duration(&track), 1.0, 1e-12); // a few roundings of numbers near 5
    expect_near(track.pose[0].orientation[0], 1.0, 0.0);
    expect_near(track.pose[1].orientation[3], 1.0, 0.0);
    expect_near(track.pose[0].linear[0], 0.2, 1e-12);
    // Half a turn about z within 0.5 s.
    expect_near(fabs(track.pose[0].angular[2]), 3.14159265358979 / 0.5, 1e-9);
}

TEST(faulty_files_are_refused_with_their_line)
{
    static const struct {
        const char *text, *says;
    } faults[] = {
        {"", "no pose"},
        {"# nothing\n\n", "no pose"},
        {"0 0 0\n", ":1: expected t x y z"},
        {"0 0 0 0 0\n", ":1: expected t x y z"},
        {"0 0 0 0\n1 0 0 nan\n", ":2: expected t x y z"},
        {"0 0 0 0\n1 0 0 1e999\n", ":2: expected t x y z"},
        {"0 0 0 0x\n", ":1: expected t x y z"},
        {"0 0 0 0 1 0 0 0 0\n", ":1: expected t x y z"},
        {"1 0 0 0\n\n1 0 0 0\n", ":3: time 1 is not at least"},
        {"1 0 0 0\n0.5 0 0 0\n", ":2: time 0.5 is not at least"},
        {"-1 0 0 0\n", ":1: time -1 outside"},
        {"0 0 0 1001\n", ":1: position 1001 outside"},
        {"0 0 0 0 1 1 0 0\n", ":1: quaternion of length 1.41421"},
        {"0 0 0 0 0 0 0 0\n", ":1: quaternion of length 0"},
    };
    for (size_t k = 0; k < sizeof faults / sizeof faults[0]; k++) {
        Track track;
        PliantError error = {0};
        assert_false(read_text(faults[k].text, &track, &error));
        if (!strstr(error.text, faults[k].says))
            fail_msg("'%s' does not say '%s'", error.text, faults[k].says);
    }
}

TEST(file_that_is_not_there_is_named)
{
    Track track;
    PliantError error;
    assert_false(track_read(&track, "no-such-file", &error));
    expect_in(error.text, "no-such-file: No such file");
}

TEST(press_goes_in_rests_and_comes_back)
{
    const double start[3] = {0.1, 0.2, 0.3}, down[3] = {0.0, 0.0, -1.0};
    SCOPED(track_destroy) Track track;
    TrackPose pose;
    track_press(&track, start, down, 0.02, 0.01, 1.0, 2); // 2 s in, 1 s rest, 2 s out, twice
    expect_near(track_duration(&track), 10.0, 1e-12);
    static const double expected[][2] = {{0.0, 0.0},  {1.0, 0.01}, {2.0, 0.02}, {2.5, 0.02},
                                         {4.0, 0.01}, {5.0, 0.0},  {6.0, 0.01}, {7.5, 0.02},
                                         {10.0, 0.0}, {99.0, 0.0}, {-1.0, 0.0}};
    for (size_t k = 0; k < sizeof expected / sizeof expected[0]; k++) {
        track_at(&track, expected[k][0], &pose);
        expect_near(pose.position[0], 0.1, 1e-15);
        expect_near(pose.position[2], 0.3 - expected[k][1], 1e-12); // roundings of numbers below 10
    }
    track_at(&track, 1.0, &pose);
    expect_near(pose.linear[2], -0.01, 1e-12);
    track_at(&track, 2.5, &pose);
    expect_near(pose.linear[2], 0.0, 0.0);
    track_at(&track, 99.0, &pose);
    expect_near(pose.linear[2], 0.0, 0.0);
}

TEST(press_without_rest_or_depth_has_finite_velocities)
{
    const double start[3] = {0}, side[3] = {1.0, 0.0, 0.0};
    for (int k = 0; k < 4; k++) {
        SCOPED(track_destroy) Track track;
        TrackPose pose;
        track_press(&track, start, side, k & 1 ? 0.01 : 0.0, 0.1, k & 2 ? 0.5 : 0.0, 3);
        for (double t = 0.0; t < 1.0; t += 0.01) {
            track_at(&track, t, &pose);
            assert_true(isfinite(pose.position[0]) && isfinite(pose.linear[0]));
        }
    }
}

static void rotate(const double q[4], const double v[3], double out[3])
{
    const double *u = q + 1;
    double t[3];
    for (int k = 0; k < 3; k++)
        t[k] = 2.0 * (u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3]);
    for (int k = 0; k < 3; k++)
        out[k] =
            v[k] + q[0] * t[k] + u[(k + 1) % 3] * t[(k + 2) % 3] - u[(k + 2) % 3] * t[(k + 1) % 3];
}

TEST(shaft_points_back_along_the_press)
{
    static const double directions[][3] = {{0, 0, -1}, {0, 0, 1},       {1, 0, 0},
                                           {0, -1, 0}, {0.6, 0.0, 0.8}, {-0.48, 0.6, -0.64}};
    const double start[3] = {0}, z[3] = {0.0, 0.0, 1.0};
    for (size_t k = 0; k < sizeof directions / sizeof directions[0]; k++) {
        SCOPED(track_destroy) Track track;
        double shaft[3];
        track_press(&track, start, directions[k], 0.01, 0.1, 0.0, 1);
        rotate(track.pose[0].orientation, z, shaft);
        for (int axis = 0; axis < 3; axis++)
            expect_near(shaft[axis], -directions[k][axis],
                        1e-12); // a few roundings of numbers near 1
    }
}

// The twist is the derivative of the pose: a central difference over 2e must agree to O(e^2).
TEST(twist_is_the_derivative_of_the_pose)
{
    SCOPED(track_destroy) Track track;
    PliantError error;
    assert_true(read_text("0 0 0 0 1 0 0 0\n2 0.1 -0.2 0.3 0.5 0.5 -0.5 0.5\n", &track, &error));
    const double e = 1e-5, point[3] = {0.3, -0.7, 1.1}; // fixed in the tool
    for (double t = 0.2; t < 2.0; t += 0.3) {
        TrackPose at, before, after;
        double x[3], x0[3], x1[3];
        track_at(&track, t, &at);
        track_at(&track, t - e, &before);
        track_at(&track, t + e, &after);
        rotate(at.orientation, point, x);
        rotate(before.orientation, point, x0);
        rotate(after.orientation, point, x1);
        for (int k = 0; k < 3; k++) {
            int a = (k + 1) % 3, b = (k + 2) % 3;
            double turning = at.angular[a] * x[b] - at.angular[b] * x[a];
            // e^2 times third derivatives below 1, and roundings of 1e-16 over 2e.
            expect_near((x1[k] - x0[k]) / (2.0 * e), turning, 1e-9);
            expect_near((after.position[k] - before.position[k]) / (2.0 * e), at.linear[k], 1e-9);
        }
    }
    TrackPose end;
    track_at(&track, 2.0, &end);
    expect_near(end.orientation[2], -0.5, 1e-12);
}
