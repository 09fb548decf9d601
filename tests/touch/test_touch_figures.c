// SPDX-License-Identifier: MIT
// The figures of a certificate on signals with known answers.
#include "test.h"

#include "touch/figures.h"

#define RATE 1000.0
enum { COUNT = 1000 };

static const double PI = 3.14159265358979323846;

// A sine in the band has its size and its rms; what is outside, and a straight drift, has none.
TEST(band_has_the_sine_that_is_in_it)
{
    static double x[COUNT + 1];
    for (int i = 0; i <= COUNT; i++) {
        const double t = i / RATE;
        x[i] = 5.0 + 3.0 * t + 0.5 * sin(2.0 * PI * 50.0 * t) + 2.0 * sin(2.0 * PI * 10.0 * t) +
               sin(2.0 * PI * 400.0 * t);
    }
    double peak;
    const double rms = figure_band(x, COUNT + 1, RATE, 20.0, 300.0, &peak);
    // Whole periods: the rounding of a thousand sums of numbers below 10.
    expect_near(rms, 0.5 / sqrt(2.0), 1e-10);
    expect_near(peak, 0.5, 1e-10);
}

TEST(band_ends_at_half_the_rate)
{
    static double x[COUNT + 1];
    for (int i = 0; i <= COUNT; i++)
        x[i] = i % 2 ? 1.0 : -1.0; // half the rate itself
    double peak;
    expect_at_most(figure_band(x, COUNT + 1, RATE, 20.0, 600.0, &peak), 1e-10); // as above
}

TEST(ramp_rises_to_nine_tenths_in_nine_tenths_of_its_time)
{
    static double x[COUNT];
    for (int i = 0; i < COUNT; i++)
        x[i] = 2.0 + 3.0 * fmin(1.0, i / 200.0);
    // Exact up to the rounding of a thousand sums.
    expect_near(figure_rise(x, COUNT, 100), 180.0, 1e-9);
    for (int i = 0; i < COUNT; i++)
        x[i] = 1.0 - exp(-i / 50.0);
    // -ln 0.1 of its time constants; between samples it is taken as straight: below h^2 / 8 of its
    // curvature, 0.1 / 50^2 / 8 / (0.1 / 50) = 2.5e-3 samples.
    expect_near(figure_rise(x, COUNT, 100), 50.0 * log(10.0), 5e-3);
}

TEST(what_falls_has_no_rise)
{
    static const double x[] = {1.0, 0.5, 0.2, 0.2};
    assert_true(isnan(figure_rise(x, 4, 2)));
}

TEST(change_is_over_the_way_and_not_over_samples)
{
    static double way[COUNT], x[COUNT];
    for (int i = 0; i < COUNT; i++) {
        way[i] = 2e-5 * i;
        x[i] = 300.0 * way[i] + (i >= 500 ? 0.25 : 0.0);
    }
    // The slope over 0.1 mm, and the step in it; rounding of sums below 1.
    expect_near(figure_change(way, x, COUNT, 1e-4), 300.0 * 1e-4 + 0.25, 1e-12);
}

TEST(fall_is_from_what_was_reached_before)
{
    static const double up[] = {0.0, 1.0, 1.0, 2.0}, down[] = {0.0, 2.0, 1.5, 1.75, 0.5, 3.0};
    assert_true(figure_fall(up, 4) == 0.0);
    assert_true(figure_fall(down, 6) == 1.5);
}

TEST(tick_is_of_the_vector)
{
    static const Vec3 force[] = {{0.0, 0.0, 0.0}, {3.0, 0.0, 0.0}, {0.0, 4.0, 0.0}};
    assert_true(figure_tick(force, 3) == 5.0);
    assert_true(figure_largest(force, 3) == 4.0);
}

// A spring of K gives back what it got, if the force is that of each moment; held for a sample it
// gives K h^2 / 2 a step too much on the way out, which is what a device feels.
TEST(spring_gives_nothing_and_a_held_one_gives_half_a_step_each)
{
    enum { STEPS = 100 };
    const double k = 1000.0, step = 1e-4;
    static Vec3 hand[2 * STEPS + 1], force[2 * STEPS + 1];
    for (int i = 0; i <= 2 * STEPS; i++) {
        const double depth = step * (i <= STEPS ? i : 2 * STEPS - i);
        hand[i] = vec3(0.0, -depth, 0.0);
        force[i] = vec3(0.0, k * depth, 0.0);
    }
    // Sums of 200 numbers below 1 mJ: rounding alone.
    expect_at_most(figure_energy(hand, force, 2 * STEPS + 1, false), 1e-15);
    // In, it takes that much less; out, it gives as much more: 2 STEPS of them.
    expect_near(figure_energy(hand, force, 2 * STEPS + 1, true), k * step * step * STEPS, 1e-12);
}

TEST(every_figure_has_a_name_of_its_own)
{
    for (int a = 0; a < FIGURE_COUNT; a++) {
        assert_non_null(FIGURES[a].name);
        assert_non_null(FIGURES[a].unit);
        assert_non_null(FIGURES[a].meaning);
        assert_true(FIGURES[a].low < FIGURES[a].high);
        for (int b = 0; b < a; b++)
            assert_string_not_equal(FIGURES[a].name, FIGURES[b].name);
    }
}
