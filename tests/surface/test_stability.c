// SPDX-License-Identifier: MIT
// The bound of the time step against the truth: largest eigenvalues by power iteration, and the
// step at which a vibration really grows.
#include "test.h"
#include "sim_steps.h"
#include "body/integrator.h"
#include "fixture.h"

#include <fcntl.h>
#include <limits.h>
#include <unistd.h>

typedef void MakeMesh(TriMesh *mesh);
static MakeMesh *const make[3] = {fixture_organ, fixture_sphere, fixture_sheet};

// ---------------------------------------------------------------------------------------------
// The formulas

// Spectral radius of one step for x'' = -lambda x - c x', from the scheme's own definition.
static double growth(IntegratorKind kind, double lambda, double c, double h)
{
    double a, b, d, e; // (x, v) -> (a x + b v, d x + e v)
    if (kind == INTEGRATOR_RK4) {
        // The polynomial 1 + z + z^2/2 + z^3/6 + z^4/24 of the matrix z = h [[0, 1], [-l, -c]].
        double m[4] = {0.0, h, -lambda * h, -c * h}, p[4] = {1.0, 0.0, 0.0, 1.0};
        for (int k = 4; k >= 1; k--) { // Horner: p = 1 + m p / k
            double q[4] = {m[0] * p[0] + m[1] * p[2], m[0] * p[1] + m[1] * p[3],
                           m[2] * p[0] + m[3] * p[2], m[2] * p[1] + m[3] * p[3]};
            for (int i = 0; i < 4; i++)
                p[i] = q[i] / k + (i == 0 || i == 3);
        }
        a = p[0], b = p[1], d = p[2], e = p[3];
    } else { // kick, drift (leapfrog has the same eigenvalues: it starts half a drift earlier)
        d = -h * lambda, e = 1.0 - h * c;
        a = 1.0 + h * d, b = h * e;
    }
    double trace = a + e, determinant = a * e - b * d, under = 0.25 * trace * trace - determinant;
    return under < 0.0 ? sqrt(determinant) : 0.5 * fabs(trace) + sqrt(under);
}

// The largest h up to which no step grows, by bisection [s]. The stable steps form one interval.
static double true_limit(IntegratorKind kind, double lambda, double c)
{
    double low = 0.0, high = 10.0 / sqrt(lambda);
    for (int i = 0; i < 200; i++) {
        double middle = 0.5 * (low + high);
        if (growth(kind, lambda, c, middle) <= 1.0 + 1e-12)
            low = middle;
        else
            high = middle;
    }
    return low;
}

TEST(bound_is_below_the_true_limit_of_an_oscillator)
{
    static const double ratios[] = {0.0, 0.05, 0.1, 0.2, 0.5, 0.9, 1.0, 1.3, 2.0, 5.0};
    for (int k = 0; k < 10; k++) {
        double lambda = 4e4, c = 2.0 * ratios[k] * sqrt(lambda);
        for (int kind = 0; kind < INTEGRATOR_EXPLICIT; kind++) {
            double bound = stability_time_step((IntegratorKind)kind, lambda, c);
            double limit = true_limit((IntegratorKind)kind, lambda, c);
            // Kicks: the formula is exact, and 0.9 of it is taken.
            if (kind != INTEGRATOR_RK4)
                expect_near(bound, 0.9 * limit, 1e-9 * limit);
            expect_at_most(bound, 0.9 * limit * (1.0 + 1e-9));
        }
    }
}

TEST(limits_are_those_of_the_literature)
{
    // 2 sqrt 2 on the imaginary axis, 2.7853 on the real one (Hairer & Wanner), 2 for leapfrog.
    expect_near(true_limit(INTEGRATOR_RK4, 1.0, 0.0), 2.0 * sqrt(2.0), 1e-3);
    expect_near(true_limit(INTEGRATOR_LEAPFROG, 1.0, 0.0), 2.0, 1e-5);
    // x'' = -x - 10.1 x' decays with the rates 10 and 0.1.
    expect_near(10.0 * true_limit(INTEGRATOR_RK4, 1.0, 10.1), 2.7853, 1e-3);
}

TEST(nothing_bounds_a_body_without_forces)
{
    for (int kind = 0; kind < INTEGRATOR_EXPLICIT; kind++) {
        assert_true(isinf(stability_time_step((IntegratorKind)kind, 0.0, 0.0)));
        assert_true(isfinite(stability_time_step((IntegratorKind)kind, 0.0, 1.0)));
        assert_true(isfinite(stability_time_step((IntegratorKind)kind, 1.0, 0.0)));
    }
}

TEST(substeps_cover_the_tick)
{
    assert_int_equal(stability_substeps(1e-3, 1e-3), 1);
    assert_int_equal(stability_substeps(1e-3, 1e-3 * (1.0 - 1e-12)), 1); // rounding of a division
    assert_int_equal(stability_substeps(1e-3, 0.99e-3), 2);
    assert_int_equal(stability_substeps(1e-3, 1e-3 / 7.0), 7);
    assert_int_equal(stability_substeps(1e-3, (double)INFINITY), 1);
    assert_true(stability_substeps(1.0, 1e-300) > INT_MAX / 4);
}

// ---------------------------------------------------------------------------------------------
// The bound of a network

TEST(network_bound_is_above_the_largest_eigenvalue_but_not_far)
{
    const FixedRegion side = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, -0.02, 1.0}};
    for (int m = 0; m < 3; m++)
        for (int variant = 0; variant < 8; variant++) {
            bool uniform = variant & 1, shape = variant & 2, extra = variant & 4;
            FixtureOptions options = {.material = fixture_material(0.0),
                                      .prestress = extra ? 0.1 : 0.0,
                                      .fixed_count = extra ? 1 : 0,
                                      .fixed = &side};
            if (uniform)
                options.material = (SurfaceMaterial){
                    .uniform = true, .spring_stiffness = 60.0, .node_mass = 1.2e-3};
            if (shape)
                options.shape = fixture_shape(SHAPE_WORLD);
            SCOPED(fixture_destroy) Fixture fixture;
            SCOPED(reference_destroy) Reference reference;
            fixture_create_on(&fixture, make[m], &options);
            fixture_reference(&fixture, &options, &reference);
            double lambda = reference_largest_eigenvalue(&reference, 1500, NULL);
            // 1.59 to 2.41 (server/surface/README.md, "Stability bounds").
            expect_at_least(fixture.body->lambda / lambda, 1.5);
            expect_at_most(fixture.body->lambda / lambda, 2.5);
        }
}

// Whether the stiffest vibration of a body, started small, is larger after many steps of h.
static bool blows_up(const FixtureOptions *like, MakeMesh *mesh_of, double h,
                     const double (*mode)[3])
{
    TriMesh mesh;
    mesh_of(&mesh);
    FREED Vec3 *x = malloc((size_t)mesh.node_count * sizeof *x);
    const double small = 1e-9; // [m]: springs stay linear while it grows by 1e4
    for (int i = 0; i < mesh.node_count; i++)
        x[i] = vec3_madd(mesh.position[i], small, vec3(mode[i][0], mode[i][1], mode[i][2]));
    FixtureOptions options = *like;
    options.rate_hz = 1.0 / h;
    options.time_step = h;
    options.unsafe_time_step = true;
    options.initial_position = x;
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create(&fixture, &mesh, &options);
    double farthest = 0.0;
    for (int step = 0; step < 800 && farthest < 1e4 * small; step++) {
        fixture_run(&fixture, 1);
        for (int i = 0; i < fixture.mesh.node_count; i++)
            farthest =
                fmax(farthest, vec3_length(vec3_sub(fixture.x[i], fixture.mesh.position[i])));
    }
    return farthest >= 1e4 * small;
}

TEST(bodies_blow_up_just_above_the_prediction)
{
    // Damping ratios of the stiffest vibration, beta w / 2. Between 0.2 and 5 RK4's prediction
    // costs more than it must: see the oscillator above.
    static const double ratios[] = {0.0, 0.05, 0.2, 5.0};
    for (int kind = 0; kind < INTEGRATOR_EXPLICIT; kind++)
        for (int k = 0; k < 4; k++) {
            FixtureOptions options = {
                .material = {.uniform = true, .spring_stiffness = 60.0, .node_mass = 1.2e-3},
                .integrator = (IntegratorKind)kind};
            SCOPED(fixture_destroy) Fixture fixture;
            SCOPED(reference_destroy) Reference reference;
            fixture_create_sphere(&fixture, &options);
            fixture_reference(&fixture, &options, &reference);
            FREED double(*mode)[3] = calloc((size_t)reference.node_count, sizeof *mode);
            double lambda = reference_largest_eigenvalue(&reference, 3000, mode);

            double beta = 2.0 * ratios[k] / sqrt(lambda);
            options.material.spring_damping = beta * options.material.spring_stiffness;
            double predicted =
                stability_time_step((IntegratorKind)kind, lambda, beta * lambda) / 0.9;
            // RK4 1.09 to 1.18 (1.02 overdamped), kicks 1.00 to 1.18
            // (server/surface/README.md, "Stability bounds").
            double least = kind == INTEGRATOR_RK4 ? 1.02 : 0.99;
            assert_false(
                blows_up(&options, fixture_sphere, predicted * least, (const double(*)[3])mode));
            assert_true(
                blows_up(&options, fixture_sphere, predicted * 1.18, (const double(*)[3])mode));
        }
}

TEST(motion_stays_bounded_at_the_bound)
{
    for (int m = 0; m < 3; m++)
        for (int kind = 0; kind < INTEGRATOR_EXPLICIT; kind++)
            for (int damped = 0; damped < 2; damped++) {
                TriMesh mesh;
                make[m](&mesh);
                int n = mesh.node_count;
                FREED Vec3 *x = malloc((size_t)n * sizeof *x);
                // The worst small motion: neighbours apart.
                for (int i = 0; i < n; i++)
                    x[i] =
                        vec3_madd(mesh.position[i], i % 2 == 0 ? 1e-4 : -1e-4, vec3(0.3, 0.5, 0.8));
                FixtureOptions options = {.material = fixture_material(damped ? 5e-4 : 0.0),
                                          .shape = fixture_shape(SHAPE_WORLD),
                                          .integrator = (IntegratorKind)kind,
                                          .initial_position = x};
                Fixture fixture;
                fixture_create(&fixture, &mesh, &options);
                // Ticks as long as the bound, then again with them.
                options.rate_hz = 1.0 / fixture.body->time_step_limit;
                fixture_destroy(&fixture);
                make[m](&mesh);
                fixture_create(&fixture, &mesh, &options);
                assert_int_equal(fixture.body->substeps, 1);
                double start = 0.0, end = 0.0;
                BodyMeasure measure = measure_of(fixture.body);
                start = measure.kinetic + measure.elastic;
                fixture_run(&fixture, 3000);
                measure = measure_of(fixture.body);
                end = measure.kinetic + measure.elastic;
                // Kicks keep a nearby energy: the true one swings by a factor 1 / (1 - (hw/2)^2),
                // which is 1 / (1 - 0.81 / 1.5) at most.
                expect_at_most(end, 2.5 * start);
                assert_int_equal(sim_resets(fixture.sim), 0);
                fixture_destroy(&fixture);
            }
}

// ---------------------------------------------------------------------------------------------
// What a scene is told

TEST(step_above_the_bound_is_refused_unless_asked_for)
{
    for (int kind = 0; kind < INTEGRATOR_EXPLICIT; kind++) {
        FixtureOptions options = {.material = fixture_material(2e-4),
                                  .integrator = (IntegratorKind)kind,
                                  .rate_hz = 50.0,
                                  .time_step = 0.02};
        const char *const said[] = {"body", "time_step 0.02", "stability bound",
                                    integrator_name((IntegratorKind)kind), "unsafe_time_step"};
        for (int k = 0; k < 5; k++)
            fixture_expect_refusal(&options, said[k]);
        options.unsafe_time_step = true;
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create_sphere(&fixture, &options);
        assert_int_equal(fixture.body->substeps, 1);
        expect_near(fixture.body->h, 0.02, 1e-15);
    }
}

TEST(step_is_the_tick_in_equal_parts_within_the_bound)
{
    static const double rates[] = {30.0, 100.0, 1000.0, 10000.0};
    for (int kind = 0; kind < INTEGRATOR_EXPLICIT; kind++)
        for (int k = 0; k < 4; k++) {
            FixtureOptions options = {.material = fixture_material(2e-4),
                                      .integrator = (IntegratorKind)kind,
                                      .rate_hz = rates[k]};
            SCOPED(fixture_destroy) Fixture fixture;
            fixture_create_on(&fixture, fixture_organ, &options);
            const Body *body = fixture.body;
            expect_near(body->h * body->substeps, 1.0 / rates[k], 1e-15);
            expect_at_most(body->h, body->time_step_limit * (1.0 + 1e-9));
            // One part fewer would be too long.
            if (body->substeps > 1)
                expect_at_least(1.0 / rates[k] / (body->substeps - 1), body->time_step_limit);
        }
}

TEST(too_many_substeps_are_refused)
{
    FixtureOptions options = {.material = fixture_material(2e-4), .time_step = 1e-12};
    fixture_expect_refusal(&options, "substeps");
}

// Runs with stderr going to a pipe; its text is in `text`.
static void capture(const FixtureOptions *options, Fixture *fixture, char *text, size_t size)
{
    int ends[2], kept = dup(STDERR_FILENO);
    assert_int_equal(pipe(ends), 0);
    fflush(stderr);
    dup2(ends[1], STDERR_FILENO);
    fixture_create_sphere(fixture, options);
    fflush(stderr);
    dup2(kept, STDERR_FILENO);
    close(kept);
    close(ends[1]);
    ssize_t got = read(ends[0], text, size - 1);
    text[got > 0 ? got : 0] = '\0';
    close(ends[0]);
}

TEST(too_long_a_damping_time_is_shortened_with_a_warning)
{
    char text[512];
    Fixture fixture;
    FixtureOptions options = {.material = fixture_material(1e-4)};
    capture(&options, &fixture, text, sizeof text);
    assert_string_equal(text, "");
    fixture_destroy(&fixture);

    options.material.damping_time = 1.0;
    capture(&options, &fixture, text, sizeof text);
    assert_non_null(strstr(text, "warning"));
    assert_non_null(strstr(text, "damping_time 1 s"));
    // beta <= 0.8 / w, so that c = beta w^2 <= 0.8 w
    // (server/surface/README.md, "Springs and masses from the material").
    expect_at_most(fixture.body->damping, 0.8 * sqrt(fixture.body->lambda) * (1.0 + 1e-12));
    expect_at_least(fixture.body->damping, 0.79 * sqrt(fixture.body->lambda));
    fixture_destroy(&fixture);
}
