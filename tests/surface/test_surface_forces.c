// SPDX-License-Identifier: MIT
// Forces of a surface body: invariants that hold whatever the numbers.
#include "test.h"
#include "sim_steps.h"
#include "fixture.h"
#include "random.h"

// Accelerations at a state, by one step of symplectic Euler so short that the positions do not
// move: v' = v + h a(x, v), with h so small that its square is nothing beside x, and v known
// exactly. From velocities near zero a is exact to rounding.
static const double SHORT = 1e-9; // [s]

static void accelerations(const FixtureOptions *like, void (*make)(TriMesh *), const Vec3 *x,
                          const Vec3 *v, Vec3 *a)
{
    FixtureOptions options = *like;
    options.integrator = INTEGRATOR_SYMPLECTIC_EULER;
    options.rate_hz = 1.0 / SHORT;
    options.initial_position = x;
    options.initial_velocity = v;
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_on(&fixture, make, &options);
    assert_int_equal(fixture.body->substeps, 1);
    fixture_run(&fixture, 1);
    for (int i = 0; i < fixture.mesh.node_count; i++)
        a[i] = vec3_scale(1.0 / sim_tick(fixture.sim),
                          vec3_sub(fixture.v[i], v != NULL ? v[i] : vec3(0.0, 0.0, 0.0)));
}

static double largest(const Vec3 *a, int count)
{
    double most = 0.0;
    for (int i = 0; i < count; i++)
        most = fmax(most, vec3_length(a[i]));
    return most;
}

enum { NODES = 188 }; // of the largest mesh used here

static void rigid(const TriMesh *mesh, Vec3 rotation, Vec3 translation, Vec3 *x)
{
    Quat q = quat_from_rotation(rotation);
    for (int i = 0; i < mesh->node_count; i++)
        x[i] = vec3_add(quat_rotate(q, mesh->position[i]), translation);
}

TEST(nothing_moves_at_rest)
{
    void (*const make[])(TriMesh *) = {fixture_organ, fixture_sphere, fixture_sheet};
    for (int m = 0; m < 3; m++)
        for (int shape = 0; shape < 3; shape++) {
            FixtureOptions options = {.material = fixture_material(2e-4)};
            if (shape > 0)
                options.shape = fixture_shape(shape == 1 ? SHAPE_WORLD : SHAPE_BODY);
            Vec3 a[NODES];
            SCOPED(mesh_destroy) TriMesh mesh;
            make[m](&mesh);
            accelerations(&options, make[m], NULL, NULL, a);
            // k/m is about 2e4 1/s2, a spring about 0.015 m: rounding of its length gives about
            // 2e4 * 0.015 * 1e-16 m/s2 a spring.
            expect_at_most(largest(a, mesh.node_count), 1e-11);
        }
}

TEST(rigid_motion_gives_no_spring_force)
{
    static const Vec3 turns[] = {
        {0.0, 0.0, 0.0}, {0.3, -0.2, 0.9}, {1.9, 1.1, -0.7}, {0.0, 0.0, 3.14159265358979312}};
    FixtureOptions options = {.material = fixture_material(2e-4)};
    SCOPED(mesh_destroy) TriMesh mesh;
    fixture_organ(&mesh);
    Vec3 x[NODES], v[NODES], a[NODES];
    for (int k = 0; k < 4; k++) {
        rigid(&mesh, turns[k], vec3(0.4, -0.3, 0.2), x);
        // The velocities of a rigid motion stretch no spring: no damping force.
        for (int i = 0; i < mesh.node_count; i++)
            v[i] = vec3_add(vec3(0.01, 0.02, -0.03), vec3_cross(vec3(0.1, -0.2, 0.05), x[i]));
        accelerations(&options, fixture_organ, x, v, a);
        // Positions near 0.5 m are rounded to 1e-16 m: 2e4 1/s2 * 1e-16 m a spring; velocities
        // near 0.1 m/s are rounded to 1e-17 m/s, which divided by the step is 1e-8 m/s2.
        expect_at_most(largest(a, mesh.node_count), 1e-7);
    }
}

TEST(body_frame_follows_any_rigid_motion)
{
    // Half turns too: there the fit's gradient vanishes at the rotation that it starts from.
    static const Vec3 turns[] = {{0.0, 0.0, 0.0},
                                 {0.3, -0.2, 0.9},
                                 {1.9, 1.1, -0.7},
                                 {3.14159265358979312, 0.0, 0.0},
                                 {0.0, 0.0, 3.14159265358979312},
                                 {1.813799364234218, 1.813799364234218, 1.813799364234218}};
    FixtureOptions options = {.material = fixture_material(2e-4),
                              .shape = fixture_shape(SHAPE_BODY)};
    SCOPED(mesh_destroy) TriMesh mesh;
    fixture_organ(&mesh);
    Vec3 x[NODES], v[NODES], a[NODES];
    for (int k = 0; k < 6; k++) {
        rigid(&mesh, turns[k], vec3(0.4, -0.3, 0.2), x);
        for (int i = 0; i < mesh.node_count; i++)
            v[i] = vec3_add(vec3(0.01, 0.02, -0.03), vec3_cross(vec3(0.1, -0.2, 0.05), x[i]));
        accelerations(&options, fixture_organ, x, v, a);
        expect_at_most(largest(a, mesh.node_count), 1e-7); // as above
    }
}

TEST(exact_half_turn_is_found)
{
    FixtureOptions options = {.material = fixture_material(2e-4),
                              .shape = fixture_shape(SHAPE_BODY)};
    SCOPED(mesh_destroy) TriMesh mesh;
    fixture_organ(&mesh);
    Vec3 x[NODES], a[NODES];
    for (int axis = 0; axis < 3; axis++) {
        for (int i = 0; i < mesh.node_count; i++) { // by signs alone: no rounding breaks the tie
            Vec3 p = mesh.position[i];
            x[i] = axis == 0   ? vec3(p.x, -p.y, -p.z)
                   : axis == 1 ? vec3(-p.x, p.y, -p.z)
                               : vec3(-p.x, -p.y, p.z);
        }
        accelerations(&options, fixture_organ, x, NULL, a);
        expect_at_most(largest(a, mesh.node_count), 1e-10); // as at rest, and the fit's rounding
    }
}

// A random state about the rest shape, up to a fifth of an edge away.
static void deform(const TriMesh *mesh, uint64_t seed, Vec3 *x)
{
    for (int i = 0; i < mesh->node_count; i++)
        x[i] = vec3_madd(mesh->position[i], 0.003, random_vec3(&seed));
}

static void to_rows(const Vec3 *x, int count, double (*rows)[3])
{
    for (int i = 0; i < count; i++) {
        rows[i][0] = x[i].x;
        rows[i][1] = x[i].y;
        rows[i][2] = x[i].z;
    }
}

TEST(force_is_minus_the_gradient_of_the_energy)
{
    for (int shape = 0; shape < 3; shape++) {
        FixtureOptions options = {.material = fixture_material(0.0), .prestress = 0.05};
        if (shape > 0)
            options.shape = fixture_shape(shape == 1 ? SHAPE_WORLD : SHAPE_BODY);
        TriMesh mesh;
        fixture_organ(&mesh);
        Vec3 x[NODES], a[NODES];
        deform(&mesh, 5, x);
        accelerations(&options, fixture_organ, x, NULL, a);

        SCOPED(fixture_destroy) Fixture fixture;
        SCOPED(reference_destroy) Reference reference;
        fixture_create(&fixture, &mesh, &options);
        fixture_reference(&fixture, &options, &reference);
        int n = reference.node_count;
        to_rows(x, n, reference.x);
        const double step = 1e-6; // [m]
        for (int i = 0; i < n; i += 7) {
            double force[3] = {reference.mass[i] * a[i].x, reference.mass[i] * a[i].y,
                               reference.mass[i] * a[i].z};
            for (int c = 0; c < 3; c++) {
                double there = reference.x[i][c], energy[2];
                for (int side = 0; side < 2; side++) {
                    reference.x[i][c] = there + (side == 0 ? -step : step);
                    energy[side] =
                        reference_elastic_energy(&reference, (const double(*)[3])reference.x);
                }
                reference.x[i][c] = there;
                // The energy (0.1 J) is rounded to 1e-17 J: 1e-11 N by the step; the third
                // derivative, about k / L^2 = 1e5 N/m3, gives 1e-12 * 1e5 N.
                expect_near(force[c], -(energy[1] - energy[0]) / (2.0 * step), 1e-6);
            }
        }
    }
}

TEST(inner_forces_have_no_sum_and_no_moment)
{
    // Action and reaction: springs, and shape-preserving springs on a frame of the body.
    for (int shape = 0; shape < 2; shape++) {
        FixtureOptions options = {.material = fixture_material(2e-4), .prestress = 0.1};
        if (shape == 1)
            options.shape = fixture_shape(SHAPE_BODY);
        TriMesh mesh;
        fixture_organ(&mesh);
        Vec3 x[NODES], v[NODES], a[NODES];
        deform(&mesh, 9, x);
        uint64_t random = 17;
        for (int i = 0; i < mesh.node_count; i++)
            v[i] = vec3_scale(0.01, random_vec3(&random));
        accelerations(&options, fixture_organ, x, v, a);

        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create(&fixture, &mesh, &options);
        Vec3 sum = {0.0, 0.0, 0.0}, moment = sum;
        double sizes = 0.0;
        for (int i = 0; i < fixture.mesh.node_count; i++) {
            Vec3 force = vec3_scale(fixture.body->surface.node_mass[i], a[i]);
            sum = vec3_add(sum, force);
            moment = vec3_add(moment, vec3_cross(x[i], force));
            sizes += vec3_length(force);
        }
        // Velocities of 0.01 m/s are rounded to 1e-18 m/s, which by the step is 1e-9 m/s2 a node
        // of 1 g; the forces themselves to 1e-16 of their size.
        expect_at_least(sizes, 1.0);
        expect_at_most(vec3_length(sum), 1e-9);
        expect_at_most(vec3_length(moment), 1e-10);
    }
}

TEST(free_body_keeps_its_momentum)
{
    for (int kind = 0; kind < INTEGRATOR_EXPLICIT; kind++)
        for (int shape = 0; shape < 2; shape++)
            for (int damped = 0; damped < 2; damped++) {
                TriMesh mesh;
                fixture_organ(&mesh);
                Vec3 x[NODES], v[NODES];
                deform(&mesh, 21, x);
                uint64_t random = 8;
                for (int i = 0; i < mesh.node_count; i++) {
                    v[i] = vec3_cross(vec3(3.0, -5.0, 8.0), x[i]); // 10 rad/s
                    v[i] = vec3_add(v[i], vec3(0.3, 0.2, -0.1));
                    v[i] = vec3_madd(v[i], 0.1, random_vec3(&random));
                }
                FixtureOptions options = {.material = fixture_material(damped ? 2e-4 : 0.0),
                                          .integrator = (IntegratorKind)kind,
                                          .initial_position = x,
                                          .initial_velocity = v};
                if (shape == 1)
                    options.shape = fixture_shape(SHAPE_BODY);
                SCOPED(fixture_destroy) Fixture fixture;
                fixture_create(&fixture, &mesh, &options);
                fixture_read(&fixture);
                const Momentum first = fixture_momentum(&fixture);
                fixture_run(&fixture, 500);
                const Momentum last = fixture_momentum(&fixture);
                // Rounding of 500 ticks of a few substeps; kicks keep the angular momentum as well,
                // RK4 only to its order (server/surface/README.md, "What is conserved").
                expect_at_most(vec3_length(vec3_sub(last.linear, first.linear)),
                               1e-11 * vec3_length(first.linear));
                expect_at_most(vec3_length(vec3_sub(last.angular, first.angular)),
                               (kind == INTEGRATOR_RK4 ? 1e-4 : 3e-11) *
                                   vec3_length(first.angular));
            }
}

TEST(damping_only_takes_energy)
{
    for (int kind = 0; kind < INTEGRATOR_EXPLICIT; kind++)
        for (int shape = 0; shape < 3; shape++) {
            TriMesh mesh;
            fixture_sphere(&mesh);
            Vec3 x[NODES];
            deform(&mesh, 4, x);
            FixtureOptions options = {.material = fixture_material(2e-4),
                                      .integrator = (IntegratorKind)kind,
                                      // Short beside the fastest period (10 ms), so that the
                                      // energy that the kicks' own scheme keeps is the true one.
                                      .time_step = 5e-5,
                                      .initial_position = x};
            if (shape > 0)
                options.shape = fixture_shape(shape == 1 ? SHAPE_WORLD : SHAPE_BODY);
            SCOPED(fixture_destroy) Fixture fixture;
            fixture_create(&fixture, &mesh, &options);
            const double start = energy_of(fixture.body);
            double last = start;
            for (int tick = 0; tick < 300; tick++) {
                fixture_run(&fixture, 1);
                const double now = energy_of(fixture.body);
                // The kicks' energy swings by about h w = 3 % of what vibrates; RK4's does not.
                expect_at_most(now, last + (kind == INTEGRATOR_RK4 ? 1e-9 : 0.03) * last);
                last = now;
            }
            // Springs damp the fast vibrations within milliseconds.
            expect_at_most(last, 0.5 * start);
        }
}

TEST(measured_energy_is_that_of_the_reference)
{
    for (int shape = 0; shape < 3; shape++) {
        TriMesh mesh;
        fixture_sheet(&mesh);
        Vec3 x[NODES], v[NODES];
        deform(&mesh, 31, x);
        uint64_t random = 2;
        for (int i = 0; i < mesh.node_count; i++)
            v[i] = random_vec3(&random);
        FixtureOptions options = {.material = fixture_material(0.0),
                                  .prestress = 0.03,
                                  .initial_position = x,
                                  .initial_velocity = v};
        if (shape > 0)
            options.shape = fixture_shape(shape == 1 ? SHAPE_WORLD : SHAPE_BODY);
        SCOPED(fixture_destroy) Fixture fixture;
        SCOPED(reference_destroy) Reference reference;
        fixture_create(&fixture, &mesh, &options);
        fixture_reference(&fixture, &options, &reference);
        BodyMeasure measure = measure_of(fixture.body);
        double elastic = reference_elastic_energy(&reference, (const double(*)[3])reference.x);
        double kinetic = reference_kinetic_energy(&reference);
        // Sums of some hundred terms in another order.
        expect_near(measure.elastic, elastic, 1e-12 * elastic);
        expect_near(measure.kinetic, kinetic, 1e-12 * kinetic);
        double total = 0.0;
        for (int i = 0; i < reference.node_count; i++)
            total += reference.mass[i];
        expect_near(fixture.body->mass, total, 1e-13 * total);
    }
}
