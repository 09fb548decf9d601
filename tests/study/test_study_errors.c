// SPDX-License-Identifier: MIT
// Measures of error against closed forms, and what Richardson's extrapolation says of sequences
// whose order is known.
#include "test.h"

#include "study/sampler.h"

enum { SAMPLES = 200, POINTS = 3 };
static const double PERIOD = 40.0; // samples; a whole number of periods is sampled

// Three points: one swings as sin(w t + phase) * size along x, one twice that, one rests.
static StudyTrace *make_swing(double size, double phase)
{
    StudyTrace *trace = study_trace_create(SAMPLES, POINTS);
    assert_non_null(trace);
    trace->has_volume = trace->has_force = true;
    trace->rest_volume = 2.0;
    for (int s = 0; s < SAMPLES; s++) {
        double u = size * sin(2.0 * 3.14159265358979323846 * s / PERIOD + phase);
        StudySample *sample = study_trace_sample(trace, s);
        sample->patch = vec3(u, 0.0, 0.0);
        sample->force = vec3(0.0, 3.0 * u, 0.0);
        sample->volume = 2.0 + 0.1 * u;
        sample->kinetic = 0.25 * size * size;
        sample->elastic = 0.75 * size * size;
        study_trace_points(trace, s)[0] = vec3(u, 0.0, 0.0);
        study_trace_points(trace, s)[1] = vec3(0.0, 2.0 * u, 0.0);
    }
    trace->used = SAMPLES;
    return trace;
}

// |sin(x + p) - sin(x)| = 2 |sin(p / 2) cos(x + p / 2)|: over whole periods the L2 norms have the
// ratio 2 sin(p / 2). Rounding only: 1e-12.
TEST(a_late_swing_has_the_error_of_its_phase)
{
    FREED StudyTrace *reference = make_swing(0.3, 0.0), *late = make_swing(0.3, 0.2);
    StudyErrors errors = study_errors(late, reference);
    expect_near(errors.patch, 2.0 * sin(0.1), 1e-12);
    expect_near(errors.force, 2.0 * sin(0.1), 1e-12);
}

TEST(a_larger_swing_is_off_by_its_share)
{
    FREED StudyTrace *reference = make_swing(1.0, 0.0), *larger = make_swing(1.05, 0.0);
    StudyErrors errors = study_errors(larger, reference);
    expect_near(errors.patch, 0.05, 1e-12);
    expect_near(errors.force, 0.05, 1e-12);
    // Sample 10 is at the crest: the point that swings twice as far is 0.1 off, of 2.
    expect_near(errors.surface, 0.05, 1e-12);
    expect_near(errors.volume, 0.1 * 0.05 / 2.0, 1e-12);
    expect_near(errors.energy, 1.05 * 1.05 - 1.0, 1e-12);
}

TEST(what_a_scene_lacks_has_no_error)
{
    FREED StudyTrace *reference = make_swing(1.0, 0.0), *trace = make_swing(1.1, 0.0);
    trace->has_force = false;
    reference->has_volume = false;
    StudyErrors errors = study_errors(trace, reference);
    assert_true(isnan(errors.force));
    assert_true(isnan(errors.volume));
    assert_false(isnan(errors.patch));
    trace->used = 0;
    assert_true(isnan(study_errors(trace, reference).patch));
}

// Solutions whose error is c h^p, with h, h / 2 and h / 4.
static StudyReference make_sequence(double c, double p)
{
    const double e[3] = {c, c * exp2(-p), c * exp2(-2.0 * p)};
    return (StudyReference){.difference = {e[0] - e[1], e[1] - e[2]}};
}

TEST(order_and_error_of_a_power_law_are_found)
{
    for (int p = 1; p <= 4; p++) {
        StudyReference reference = make_sequence(0.01, p);
        study_richardson(&reference, 8.0);
        double finest = 0.01 * exp2(-2.0 * p);
        assert_true(reference.known);
        expect_near(reference.order, p, 1e-9);
        expect_near(reference.own_error, finest, 1e-9 * finest);
    }
}

// A sequence may fall faster than the method can, by chance: that is not believed.
TEST(an_order_beyond_the_method_is_not_believed)
{
    StudyReference reference = make_sequence(0.01, 6.0);
    study_richardson(&reference, 2.0);
    expect_near(reference.order, 6.0, 1e-9);
    expect_near(reference.own_error, reference.difference[1] / 3.0, 1e-15);
}

TEST(differences_that_do_not_fall_are_the_error)
{
    StudyReference rising = {.difference = {0.01, 0.02}}, slow = {.difference = {0.02, 0.018}};
    StudyReference missing = {.difference = {(double)NAN, 0.02}};
    study_richardson(&rising, 4.0);
    assert_true(rising.known);
    assert_true(isnan(rising.order));
    expect_near(rising.own_error, 0.02, 0.0);
    study_richardson(&slow, 4.0);
    expect_near(slow.own_error, 0.02, 0.0);
    study_richardson(&missing, 4.0);
    assert_false(missing.known);
    assert_true(isnan(missing.own_error));
}
