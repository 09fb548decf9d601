// SPDX-License-Identifier: MIT
// Order of convergence of each scheme against closed forms: a whole body displaced rigidly on its
// shape-preserving springs is a damped oscillator at every node.
#include "test.h"
#include "fixture.h"

static const double FREQUENCY = 50.0; // w [rad/s]
static const double AWAY = 0.01;      // start [m], at rest

// The closed form of x'' + 2 z w x' + w^2 x = 0 from x(0) = AWAY, x'(0) = 0.
static double oscillator(double ratio, double t)
{
    double w = FREQUENCY * sqrt(1.0 - ratio * ratio), decay = ratio * FREQUENCY;
    return AWAY * exp(-decay * t) * (cos(w * t) + decay / w * sin(w * t));
}

// Largest error over 0.1 s (not quite a period) with steps of tick / substeps [m].
static double error_of(IntegratorKind kind, double ratio, ShapeFrame frame, int substeps)
{
    const double tick = 0.005;
    TriMesh mesh;
    fixture_sphere(&mesh);
    FREED Vec3 *x = malloc((size_t)mesh.node_count * sizeof *x);
    for (int i = 0; i < mesh.node_count; i++)
        x[i] = vec3_add(mesh.position[i], vec3(0.6 * AWAY, 0.0, 0.8 * AWAY));
    FixtureOptions options = {
        // Soft springs: a rigid displacement does not stretch them, and they do not bound the step.
        .material = {.youngs_modulus_2d = 1e-3, .areal_density = 4.2},
        .shape = {.wanted = true,
                  .angular_frequency = FREQUENCY,
                  .damping_ratio = ratio,
                  .frame = frame},
        .integrator = kind,
        .rate_hz = 1.0 / tick,
        .time_step = tick / substeps,
        .initial_position = x,
    };
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create(&fixture, &mesh, &options);
    assert_int_equal(fixture.body->substeps, substeps);
    double worst = 0.0;
    for (int i = 1; i <= 20; i++) {
        fixture_run(&fixture, 1);
        double u = oscillator(ratio, i * tick);
        Vec3 expected = vec3_add(fixture.mesh.position[7], vec3(0.6 * u, 0.0, 0.8 * u));
        worst = fmax(worst, vec3_length(vec3_sub(fixture.x[7], expected)));
    }
    return worst;
}

// Halving the step divides the error by 2^order.
static void expect_order_of(IntegratorKind kind, double ratio, double order)
{
    double last = error_of(kind, ratio, SHAPE_WORLD, 4);
    for (int substeps = 8; substeps <= 32; substeps *= 2) {
        double error = error_of(kind, ratio, SHAPE_WORLD, substeps);
        // The next term of the error's series shifts the order by about h w = 0.03 to 0.06; RK4's
        // last error is 1e-10 m, well above rounding.
        expect_near(log2(last / error), order, 0.15);
        last = error;
    }
}

TEST(rk4_converges_with_order_four)
{
    expect_order_of(INTEGRATOR_RK4, 0.0, 4.0);
    expect_order_of(INTEGRATOR_RK4, 0.3, 4.0);
}

TEST(leapfrog_converges_with_order_two)
{
    expect_order_of(INTEGRATOR_LEAPFROG, 0.0, 2.0);
}

TEST(explicit_damping_lowers_leapfrog_to_order_one)
{
    // The kick takes the damping from the velocity before it (that keeps one evaluation a step):
    // its error is of order c h, small for the light damping of organs.
    expect_order_of(INTEGRATOR_LEAPFROG, 0.3, 1.0);
}

TEST(symplectic_euler_converges_with_order_one)
{
    expect_order_of(INTEGRATOR_SYMPLECTIC_EULER, 0.0, 1.0);
    expect_order_of(INTEGRATOR_SYMPLECTIC_EULER, 0.3, 1.0);
}

TEST(constant_gravity_gives_the_parabola)
{
    for (int kind = 0; kind < INTEGRATOR_EXPLICIT; kind++) {
        FixtureOptions options = {.material = fixture_material(2e-4),
                                  .gravity = {0.0, 0.0, -9.81},
                                  .integrator = (IntegratorKind)kind};
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create_on(&fixture, fixture_sheet, &options);
        fixture_run(&fixture, 500);
        double t = sim_time(fixture.sim), h = fixture.body->h;
        double fall = 0.5 * 9.81 * t * t;
        if (kind == INTEGRATOR_SYMPLECTIC_EULER) // n (n + 1) / 2 instead of n^2 / 2 steps
            fall += 0.5 * 9.81 * t * h;
        for (int i = 0; i < fixture.mesh.node_count; i++) {
            // All three are exact for a constant force, up to the rounding of some 1000 additions.
            expect_near(fixture.x[i].z, fixture.mesh.position[i].z - fall, 1e-11);
            expect_near(fixture.x[i].x, fixture.mesh.position[i].x, 1e-11);
            expect_near(fixture.v[i].z, -9.81 * t, 1e-11);
        }
    }
}

TEST(node_damping_decays_exponentially)
{
    // v' = -(gamma / m) v for a body in rigid translation, mass equal at every node.
    const double rate = 4.0; // gamma / m [1/s]
    TriMesh mesh;
    fixture_organ(&mesh);
    FREED Vec3 *v = malloc((size_t)mesh.node_count * sizeof *v);
    for (int i = 0; i < mesh.node_count; i++)
        v[i] = vec3(0.2, -0.1, 0.3);
    FixtureOptions options = {.material = {.uniform = true,
                                           .spring_stiffness = 20.0,
                                           .node_mass = 1e-3,
                                           .node_damping = rate * 1e-3},
                              .integrator = INTEGRATOR_RK4,
                              .initial_velocity = v};
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create(&fixture, &mesh, &options);
    fixture_run(&fixture, 400);
    double left = exp(-rate * sim_time(fixture.sim));
    for (int i = 0; i < fixture.mesh.node_count; i++) {
        // RK4's error is (rate h)^5 / 120 a step: below 1e-13 in 400.
        expect_near(fixture.v[i].x, 0.2 * left, 1e-11);
        expect_near(fixture.v[i].y, -0.1 * left, 1e-11);
        expect_near(fixture.x[i].z - fixture.mesh.position[i].z, 0.3 * (1.0 - left) / rate, 1e-11);
    }
}

TEST(stages_are_consistent)
{
    for (int kind = 0; kind < INTEGRATOR_EXPLICIT; kind++) {
        const Integrator *integrator = integrator_get((IntegratorKind)kind);
        double weights = 0.0;
        for (int s = 0; s < integrator->evaluation_count; s++)
            weights += integrator->evaluation[s].weight;
        expect_near(weights, 1.0, 1e-15); // the substep's whole impulse; three roundings
        if (integrator->kicks)
            expect_near(integrator->first_drift + integrator->last_drift, 1.0, 0.0);
    }
}
