// SPDX-License-Identifier: MIT
// Bending of a wall: forces and energy of the hinges. What a whole wall does: test_bending_walls.c.
#include "test.h"
#include "sim_steps.h"
#include "fixture.h"
#include "random.h"
#include "surface/bending.h"

// An eighth of an edge at most: no face comes near the size at which hinges fade.
static void deform(const TriMesh *mesh, uint64_t seed, Vec3 *x)
{
    for (int i = 0; i < mesh->node_count; i++)
        x[i] = vec3_add(mesh->position[i], vec3_scale(0.0005, random_vec3(&seed)));
}

enum { NODES = 188 };

static void forces_in(Precision precision, const Vec3 *x, double modulus, void (*make)(TriMesh *),
                      Vec3 *force)
{
    TriMesh mesh;
    make(&mesh);
    FixtureOptions options = fixture_hinged(modulus);
    options.precision = precision;
    fixture_forces(&mesh, &options, x, force);
}

static void forces(const Vec3 *x, double modulus, void (*make)(TriMesh *), Vec3 *force)
{
    forces_in(PRECISION_DOUBLE, x, modulus, make, force);
}

static double energy_at(const Vec3 *x, double modulus, void (*make)(TriMesh *))
{
    FixtureOptions options = fixture_hinged(modulus);
    options.initial_position = x;
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_on(&fixture, make, &options);
    double energy = measure_of(fixture.body).elastic;
    return energy;
}

TEST(force_is_minus_the_gradient_of_the_energy)
{
    void (*const make[])(TriMesh *) = {fixture_organ, fixture_sphere, fixture_sheet};
    for (int m = 0; m < 3; m++) {
        SCOPED(mesh_destroy) TriMesh mesh;
        make[m](&mesh);
        Vec3 x[NODES], force[NODES];
        deform(&mesh, 3, x);
        forces(x, 1e-6, make[m], force);
        double most = 0.0;
        for (int i = 0; i < mesh.node_count; i++)
            most = fmax(most, vec3_length(force[i]));
        assert_true(most > 1e-4); // the hinges do act
        const double step = 1e-8;
        for (int i = 0; i < mesh.node_count; i += 17) {
            double *const part[3] = {&x[i].x, &x[i].y, &x[i].z};
            const double at[3] = {force[i].x, force[i].y, force[i].z};
            for (int c = 0; c < 3; c++) {
                const double here = *part[c];
                *part[c] = here + step;
                double more = energy_at(x, 1e-6, make[m]);
                *part[c] = here - step;
                double less = energy_at(x, 1e-6, make[m]);
                *part[c] = here;
                // The third derivative adds (step / height)^2 = 1e-11, rounding of the energy
                // about 1e-7.
                expect_near(at[c], -(more - less) / (2.0 * step), 1e-6 * most);
            }
        }
    }
}

TEST(single_precision_agrees_with_double)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    fixture_organ(&mesh);
    Vec3 x[NODES], force[2][NODES];
    deform(&mesh, 3, x);
    double most = 0.0;
    for (int k = 0; k < 2; k++)
        forces_in((Precision)k, x, 1e-6, fixture_organ, force[k]);
    for (int i = 0; i < mesh.node_count; i++)
        most = fmax(most, vec3_length(force[0][i]));
    // Angles are right to a few roundings of 6e-8, forces are differences of the moments of twelve
    // hinges that turn by about 0.1.
    for (int i = 0; i < mesh.node_count; i++)
        expect_at_most(vec3_length(vec3_sub(force[0][i], force[1][i])), 1e-5 * most);
    // At rest there is none, up to the rounding of springs.
    for (int k = 0; k < 2; k++) {
        forces_in((Precision)k, mesh.position, 1e-6, fixture_organ, force[k]);
        for (int i = 0; i < mesh.node_count; i++)
            expect_at_most(vec3_length(force[k][i]), 1e-9 * most);
    }
}

static void keeps_momentum(IntegratorKind integrator)
{
    TriMesh mesh;
    fixture_sphere(&mesh);
    Vec3 v[NODES];
    uint64_t seed = 5;
    for (int i = 0; i < mesh.node_count; i++)
        v[i] = vec3_add(vec3(0.1, 0.0, 0.05), vec3_scale(0.1, random_vec3(&seed)));
    FixtureOptions options = fixture_hinged(80.0);
    options.integrator = integrator;
    options.initial_velocity = v;
    options.material.damping_time = 1e-4; // hinges are damped too
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create(&fixture, &mesh, &options);
    Vec3 p[2], l[2];
    for (int k = 0; k < 2; k++) {
        fixture_read(&fixture);
        p[k] = l[k] = vec3(0.0, 0.0, 0.0);
        for (int i = 0; i < fixture.mesh.node_count; i++) {
            Vec3 part = vec3_scale(fixture.body->surface.node_mass[i], fixture.v[i]);
            p[k] = vec3_add(p[k], part);
            l[k] = vec3_add(l[k], vec3_cross(fixture.x[i], part));
        }
        if (k == 0)
            fixture_run(&fixture, 500);
    }
    assert_true(fixture_is_finite(&fixture));
    // Rounding of a few thousand steps.
    expect_at_most(vec3_length(vec3_sub(p[1], p[0])), 1e-11 * vec3_length(p[0]));
    expect_at_most(vec3_length(vec3_sub(l[1], l[0])), 1e-11 * 0.05 * vec3_length(p[0]));
}

TEST(free_body_keeps_its_momentum)
{
    keeps_momentum(INTEGRATOR_LEAPFROG);
    keeps_momentum(INTEGRATOR_IMPLICIT);
}

// Nodes that meet, faces without area, folds of half a turn: nothing but finite numbers.
TEST(folded_faces_give_finite_forces)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    fixture_sphere(&mesh);
    for (int way = 0; way < 4; way++) {
        Vec3 x[NODES], force[NODES];
        for (int i = 0; i < mesh.node_count; i++) {
            Vec3 p = mesh.position[i];
            x[i] = way == 0   ? vec3(p.x, p.y, 0.0)
                   : way == 1 ? vec3(p.x, 0.0, 0.0)
                   : way == 2 ? vec3(0.0, 0.0, 0.0)
                              : vec3(-p.x, p.y, p.z);
        }
        forces(x, 80.0, fixture_sphere, force);
        for (int i = 0; i < mesh.node_count; i++)
            assert_true(vec3_finite(force[i]));
        // From there it moves on, at the step of the bounds.
        FixtureOptions options = fixture_hinged(80.0);
        options.material.damping_time = 2e-4;
        options.shape = fixture_shape(SHAPE_WORLD);
        options.initial_position = x;
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create_sphere(&fixture, &options);
        fixture_run(&fixture, 1000);
        double farthest = 0.0;
        for (int i = 0; i < mesh.node_count; i++)
            farthest = fmax(farthest, vec3_length(fixture.x[i]));
        print_message("way %d: within %.3g m after 1 s\n", way, farthest);
        // It started within 0.05 m, with energy to swing, and loses it.
        assert_true(fixture_is_finite(&fixture) && farthest < 0.1);
    }
}

// The largest eigenvalue of M^-1 K of the hinges alone lies below the bound, and not far: found by
// power iteration with forces of small displacements.
TEST(bound_holds_the_largest_eigenvalue)
{
    void (*const make[])(TriMesh *) = {fixture_organ, fixture_sphere, fixture_sheet};
    for (int m = 0; m < 3; m++) {
        SCOPED(mesh_destroy) TriMesh mesh;
        make[m](&mesh);
        FixtureOptions options = fixture_hinged(1e-6);
        SCOPED(fixture_destroy) Fixture fixture;
        TriMesh same;
        make[m](&same);
        fixture_create(&fixture, &same, &options);
        Vec3 u[NODES], x[NODES], force[NODES];
        uint64_t seed = 7;
        for (int i = 0; i < mesh.node_count; i++)
            u[i] = random_vec3(&seed);
        double eigenvalue = 0.0;
        for (int k = 0; k < 60; k++) {
            double norm = 0.0, next = 0.0;
            for (int i = 0; i < mesh.node_count; i++)
                norm += vec3_dot(u[i], u[i]);
            // So small that angles stay linear to 1e-4.
            for (int i = 0; i < mesh.node_count; i++) {
                u[i] = vec3_scale(1e-7 / sqrt(norm), u[i]);
                x[i] = vec3_add(mesh.position[i], u[i]);
            }
            forces(x, 1e-6, make[m], force);
            for (int i = 0; i < mesh.node_count; i++) {
                u[i] = vec3_scale(-1.0 / fixture.body->surface.node_mass[i], force[i]);
                next += vec3_dot(u[i], u[i]);
            }
            eigenvalue = sqrt(next) / 1e-7;
        }
        // Twice for smaller faces, and what row sums lose.
        print_message("bound %.3g, eigenvalue %.3g 1/s2\n", fixture.body->lambda, eigenvalue);
        expect_at_most(eigenvalue, fixture.body->lambda);
        expect_at_least(eigenvalue, fixture.body->lambda / 8.0);
    }
}

TEST(refuses_free_hanging_nodes_and_what_is_no_wall)
{
    FixtureOptions options = fixture_hinged(80.0);
    options.levels = 1;
    options.adjust = ADJUST_CHOI2005;
    fixture_expect_refusal(&options, "bending");
    options = fixture_hinged(80.0);
    options.material.bending_stiffness = 0.0;
    options.material.thickness = 0.11; // of a sphere of 0.1 m
    fixture_expect_refusal(&options, "thickness");
}

TEST(thickness_gives_the_stiffness_of_a_plate)
{
    SurfaceMaterial material = {.youngs_modulus_2d = 80.0, .thickness = 4e-3};
    // 20 kPa (4 mm)^3 / (12 (1 - 1/9)).
    expect_near(bending_stiffness(&material), 20e3 * 64e-9 / (12.0 * 8.0 / 9.0), 1e-18);
}
