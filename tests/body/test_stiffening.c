// SPDX-License-Identifier: MIT
// The curve of stiffening: against its definition, and against integrals of it.
#include "test.h"

#include "body/stiffening.h"

static const double CAPS[] = {1.0, 1.001, 2.0, 10.0, 50.0, 100.0};
enum { CAPS_COUNT = sizeof CAPS / sizeof *CAPS };

TEST(the_knee_is_where_the_tangent_reaches_the_cap)
{
    for (int k = 0; k < CAPS_COUNT; k++) {
        const StiffeningCurve curve = stiffening_curve(CAPS[k]);
        const double q = curve.knee;
        expect_near((1.0 + 2.0 * q) * exp(q), CAPS[k], 1e-13 * CAPS[k]); // rounding
        expect_near(curve.at_knee, exp(q), 1e-15 * exp(q));
        assert_true(q >= 0.0 && q < 2.75); // what the kernels' exponential covers
    }
}

// Stress along one axis is e G'(e^2) in units of the strain of the law: its slope is the tangent,
// grows up to the knee and is the cap from there on; G is its integral by Simpson's rule.
TEST(stress_is_a_curve_that_grows_straight_beyond_the_knee)
{
    for (int k = 0; k < CAPS_COUNT; k++) {
        const StiffeningCurve curve = stiffening_curve(CAPS[k]);
        const double step = 1e-5;
        double before = 0.0, integral = 0.0;
        for (int i = 0; i < 4000; i++) {
            // No interval contains the knee in its middle, where G'' jumps, but at its ends.
            const double e = 1e-3 * i, middle = e + 5e-4, end = e + 1e-3, q = middle * middle;
            const double low = (middle - step) * (middle - step),
                         high = (middle + step) * (middle + step);
            const double slope = ((middle + step) * stiffening_factor(&curve, high) -
                                  (middle - step) * stiffening_factor(&curve, low)) /
                                 (2.0 * step);
            const double tangent = stiffening_tangent(&curve, q);
            // The slope's own slope jumps at the knee: off by that times the step.
            expect_near(slope, tangent, 2e-4 * CAPS[k]);
            assert_true(tangent >= before - 1e-12 * CAPS[k]);
            expect_at_most(tangent, CAPS[k] * (1.0 + 1e-15));
            before = tangent;
            integral += (e * stiffening_factor(&curve, e * e) +
                         4.0 * middle * stiffening_factor(&curve, q) +
                         end * stiffening_factor(&curve, end * end)) *
                        1e-3 / 6.0;
            // 2 times: dG = G' dq = G' 2 e de. Off by the jump, an interval wide, cubed.
            expect_near(stiffening_energy(&curve, end * end), 2.0 * integral,
                        1e-7 * CAPS[k] * (end * end + 1e-6));
        }
    }
}

TEST(damping_has_the_roots_of_the_numbers)
{
    for (int k = 0; k < CAPS_COUNT; k++) {
        const StiffeningCurve curve = stiffening_curve(CAPS[k]);
        for (double q = 0.0; q < 50.0; q += 0.01) {
            const double factor = stiffening_factor(&curve, q), by = stiffening_damping(&curve, q);
            expect_at_most(by * by, factor * (1.0 + 1e-14)); // a concave function of two means
            expect_at_most(by, sqrt(CAPS[k]) * (1.0 + 1e-15));
            if (q <= curve.knee)
                expect_near(by * by, factor, 1e-14 * factor);
        }
    }
}

TEST(without_a_cap_above_one_nothing_stiffens)
{
    assert_false(stiffening_is_on(&(Stiffening){0.0, 0.0}));
    assert_false(stiffening_is_on(&(Stiffening){0.1, 1.0}));
    assert_true(stiffening_is_on(&(Stiffening){0.1, 1.5}));
    assert_true(stiffening_cap(&(Stiffening){0.0, 0.0}) == 1.0);
    const StiffeningCurve curve = stiffening_curve(1.0);
    for (double q = 0.0; q < 10.0; q += 0.5) {
        expect_near(stiffening_factor(&curve, q), 1.0, 0.0);
        expect_near(stiffening_energy(&curve, q), q, 0.0);
    }
}
