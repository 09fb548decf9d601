// SPDX-License-Identifier: MIT
// What one tool did, against closed forms.
#include "score_parts.h"

#include "test.h"

enum { ROWS = 20000 };
static ScoreRow row[ROWS];
static ScoreTool tool;

typedef Vec3 Path(double time);
typedef double Force(double time);

static double no_force(double time)
{
    (void)time;
    return 0.0;
}

static Vec3 stays(double time)
{
    (void)time;
    return vec3(0.0, 0.0, 0.0);
}

// Fills rows of [from, to] at a rate, from `first` on; returns the number after the last.
static int64_t fill(int64_t first, double from, double to, double rate, Path *path, Force *force)
{
    const int64_t count = (int64_t)floor((to - from) * rate + 0.5) + 1;
    assert_true(first + count <= ROWS);
    for (int64_t i = 0; i < count; i++) {
        const double time = from + (double)i / rate;
        row[first + i] =
            (ScoreRow){.time = time, .position = path(time), .force = vec3(0.0, 0.0, -force(time))};
    }
    return first + count;
}

static void measure(int64_t rows, double limit)
{
    score_tool(row, rows, limit, 0.0, 10.0, &tool);
}

// --- a movement of least jerk --------------------------------------------------------------------

// 0.1 m in one second, which has the least jerk: 10 s^3 - 15 s^4 + 6 s^5 (Flash and Hogan 1985).
static Vec3 least_jerk(double time)
{
    const double s = fmin(fmax(time, 0.0), 1.0);
    return vec3(0.1 * s * s * s * (10.0 + s * (6.0 * s - 15.0)), 0.0, 0.0);
}

static Vec3 twice_as_slow(double time)
{
    return vec3_scale(3.0, least_jerk(0.5 * time));
}

// The share of its speed's spectrum at a frequency, of that at 0 Hz, by Simpson's rule.
static double spectrum(double hz)
{
    enum { STEPS = 2000 };
    double re = 0.0, im = 0.0;
    for (int i = 0; i <= STEPS; i++) {
        const double s = (double)i / STEPS, weight = i == 0 || i == STEPS ? 1.0 : i % 2 ? 4.0 : 2.0;
        const double speed = 30.0 * s * s * (1.0 - s) * (1.0 - s);
        re += weight * speed * cos(2.0 * M_PI * hz * s);
        im += weight * speed * sin(2.0 * M_PI * hz * s);
    }
    return hypot(re, im) / (3.0 * STEPS);
}

// The length of that curve up to the last frequency where the share is 0.05.
static double exact_arc_length(void)
{
    enum { STEPS = 2000 };
    double last = 10.0, length = 0.0;
    while (spectrum(last) < 0.05)
        last -= 1e-3;
    double before = spectrum(0.0);
    for (int i = 1; i <= STEPS; i++) {
        const double here = spectrum(last * i / STEPS);
        length += hypot(1.0 / STEPS, here - before);
        before = here;
    }
    return -length;
}

TEST(a_movement_of_least_jerk_has_its_path_speed_and_smoothness)
{
    measure(fill(0, 0.0, 1.0, 1000.0, least_jerk, no_force), 0.0);
    expect_near(tool.time_s, 1.0, 1e-12);
    expect_near(tool.path_m, 0.1, 1e-12);
    expect_near(tool.mean_speed_m_s, 0.1, 1e-12);
    assert_int_equal(tool.movements, 1);
    // Speeds are means over 1/60 s, which takes 2e-3 of the share at 2 Hz; the padding resolves
    // the cut-off to 1/64 Hz.
    print_message("smoothness %.5f, exact %.5f\n", tool.smoothness, exact_arc_length());
    expect_near(tool.smoothness, exact_arc_length(), 0.01);
}

TEST(smoothness_depends_neither_on_duration_nor_on_size_nor_on_the_rate)
{
    measure(fill(0, 0.0, 1.0, 1000.0, least_jerk, no_force), 0.0);
    const double smoothness = tool.smoothness;
    measure(fill(0, 0.0, 2.0, 1000.0, twice_as_slow, no_force), 0.0);
    expect_near(tool.smoothness, smoothness, 0.01);
    measure(fill(0, 0.0, 1.0, 60.0, least_jerk, no_force), 0.0);
    expect_near(tool.smoothness, smoothness, 0.01);
    expect_near(tool.path_m, 0.1, 1e-12);
}

// The same way in two movements that overlap.
static Vec3 in_two(double time)
{
    return vec3_scale(0.5, vec3_add(least_jerk(time), least_jerk(time - 0.7)));
}

TEST(a_movement_in_two_parts_is_less_smooth)
{
    measure(fill(0, 0.0, 1.7, 1000.0, least_jerk, no_force), 0.0);
    const double smoothness = tool.smoothness;
    measure(fill(0, 0.0, 1.7, 1000.0, in_two, no_force), 0.0);
    assert_int_equal(tool.movements, 1);
    expect_at_most(tool.smoothness, smoothness - 0.3);
}

static Vec3 moves_then_rests(double time)
{
    return time < 2.0 ? vec3(0.05 * time, 0.0, 0.0) : vec3(0.1, 0.0, 0.0);
}

TEST(a_tool_that_rests_half_of_the_time_is_idle_half)
{
    measure(fill(0, 0.0, 4.0, 1000.0, moves_then_rests, no_force), 0.0);
    expect_near(tool.idle_fraction, 0.5, 1.0 / 240.0); // one of 240 speeds
    expect_near(tool.path_m, 0.1, 1e-12);
}

static Vec3 circle(double time)
{
    return vec3(0.03 * cos(2.0 * M_PI * time), 0.03 * sin(2.0 * M_PI * time), 0.01);
}

TEST(the_path_of_a_circle_is_its_circumference)
{
    measure(fill(0, 0.0, 1.0, 1000.0, circle, no_force), 0.0);
    // Of 1000 chords: shorter by (2 pi / 1000)^2 / 24.
    expect_near(tool.path_m, 2.0 * M_PI * 0.03, 2e-6 * 2.0 * M_PI * 0.03);
}

// --- gaps ----------------------------------------------------------------------------------------

static Vec3 far_away(double time)
{
    return vec3_add(vec3(5.0, 0.0, 0.0), circle(time));
}

TEST(a_time_without_rows_adds_neither_time_nor_path_nor_force)
{
    int64_t rows = fill(0, 0.0, 1.0, 60.0, circle, no_force);
    measure(rows, 0.0);
    const double path = tool.path_m;
    rows = fill(rows, 4.0, 5.0, 60.0, far_away, no_force);
    measure(rows, 0.0);
    assert_int_equal(tool.gaps, 1);
    expect_near(tool.time_s, 2.0, 1e-12);
    expect_near(tool.path_m, 2.0 * path, 1e-12);
    expect_near(tool.rate_hz, 60.0, 1e-6);
}

TEST(nothing_is_known_of_a_tool_without_rows)
{
    measure(0, 1.0);
    assert_true(isnan(tool.smoothness) && isnan(tool.mean_speed_m_s) && isnan(tool.idle_fraction) &&
                isnan(tool.mean_force_n) && isnan(tool.peak_time_s) && isnan(tool.rate_hz));
    assert_int_equal(tool.rows, 0);
    expect_near(tool.path_m, 0.0, 0.0);
    measure(fill(0, 1.0, 1.0, 60.0, circle, no_force), 1.0);
    assert_true(isnan(tool.smoothness) && isnan(tool.mean_speed_m_s));
    expect_near(tool.time_s, 0.0, 0.0);
}

TEST(rows_at_ten_hertz_show_no_smoothness)
{
    measure(fill(0, 0.0, 1.0, 10.0, least_jerk, no_force), 0.0);
    assert_true(isnan(tool.smoothness) && isnan(tool.idle_fraction));
    expect_near(tool.path_m, 0.1, 1e-12);
}

// --- forces --------------------------------------------------------------------------------------

// Up to 4 N and down again in two seconds, once every three.
static double triangle(double time)
{
    const double in = fmod(time, 3.0);
    return in < 1.0 ? 4.0 * in : in < 2.0 ? 4.0 * (2.0 - in) : 0.0;
}

TEST(a_force_has_its_peak_its_integral_and_its_time_above_the_limit)
{
    measure(fill(0, 0.0, 6.0, 1000.0, stays, triangle), 3.0);
    expect_near(tool.peak_force_n, 4.0, 1e-12);
    expect_near(tool.peak_time_s, 1.0, 1e-12);
    expect_near(tool.force_time_n_s, 8.0, 1e-9);
    // Lines are measured as lines: no tick is lost.
    expect_near(tool.over_limit_s, 2.0 * 0.5, 1e-9);
    expect_near(tool.over_limit_fraction, 1.0 / 6.0, 1e-9);
    assert_int_equal(tool.over_limit_count, 2);
    // Half a row at each of four ends.
    expect_near(tool.contact_time_s, 4.0, 2.001e-3);
    expect_near(tool.mean_force_n, 2.0, 2e-3);
}

TEST(sixty_rows_a_second_measure_a_slow_force_as_a_thousand_do)
{
    measure(fill(0, 0.0, 6.0, 60.0, stays, triangle), 3.0);
    expect_near(tool.force_time_n_s, 8.0, 1e-9);
    expect_near(tool.over_limit_s, 1.0, 1e-9);
    assert_int_equal(tool.over_limit_count, 2);
}

TEST(without_a_limit_nothing_is_above_it)
{
    measure(fill(0, 0.0, 6.0, 60.0, stays, triangle), 0.0);
    assert_true(isnan(tool.over_limit_s) && isnan(tool.over_limit_fraction));
    assert_int_equal(tool.over_limit_count, 0);
}

TEST(the_curve_keeps_every_peak)
{
    const int64_t rows = fill(0, 0.0, 10.0, 1000.0, circle, no_force);
    row[4321].force = vec3(0.0, 9.0, 0.0);
    measure(rows, 0.0);
    double peak = 0.0;
    for (int i = 0; i < tool.curve.count; i++)
        peak = fmax(peak, tool.curve.force[i]);
    expect_near(peak, 9.0, 0.0);
    assert_true(tool.curve.path_count > SCORE_CURVE / 4 && tool.curve.path_count <= SCORE_CURVE);
}
