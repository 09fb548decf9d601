// SPDX-License-Identifier: MIT
// What a wall encloses: the pressure on its nodes, and the balloon that it makes of a sphere. Cuts,
// levels and scenes: test_scene_cavity.c.
#include "test.h"
#include "fixture.h"
#include "random.h"

#include "geometry/generator.h"

enum { NODES = 188 };

// The volume by the divergence theorem.
static double volume_of(const TriMesh *mesh, const Vec3 *x)
{
    double six = 0.0;
    for (int f = 0; f < mesh->triangle_count; f++) {
        const int *n = mesh->triangle[f];
        six += vec3_dot(x[n[0]], vec3_cross(x[n[1]], x[n[2]]));
    }
    return six / 6.0;
}

static FixtureOptions filled(double pressure)
{
    FixtureOptions options = {.material = fixture_material(0.0)};
    options.integrator = INTEGRATOR_LEAPFROG;
    options.cavity = (SurfaceCavity){.wanted = true, .pressure = pressure};
    return options;
}

static void forces_in(Precision precision, const Vec3 *x, void (*make)(TriMesh *), double pressure,
                      Vec3 *force)
{
    TriMesh mesh;
    make(&mesh);
    FixtureOptions options = filled(pressure);
    options.precision = precision;
    options.material.youngs_modulus_2d = 1e-9;
    fixture_forces(&mesh, &options, x, force);
}

TEST(pressure_acts_along_the_gradient_of_the_volume)
{
    const double pressure = 700.0;
    void (*const make[])(TriMesh *) = {fixture_organ, fixture_sphere};
    for (int m = 0; m < 2; m++)
        for (int precision = 0; precision < 2; precision++) {
            SCOPED(mesh_destroy) TriMesh mesh;
            make[m](&mesh);
            Vec3 x[NODES], force[NODES];
            uint64_t random = 7;
            for (int i = 0; i < mesh.node_count; i++)
                x[i] = vec3_add(mesh.position[i], vec3_scale(0.004, random_vec3(&random)));
            forces_in((Precision)precision, x, make[m], pressure, force);
            double most = 0.0;
            for (int i = 0; i < mesh.node_count; i++)
                most = fmax(most, vec3_length(force[i]));
            assert_true(most > 0.1);
            // The volume is linear in each coordinate: differences have rounding only, 1e-16 of the
            // volume over the step. Single precision rounds displacements and a dozen products.
            const double step = 1e-5, close = precision == PRECISION_DOUBLE ? 1e-9 : 1e-5;
            for (int i = 0; i < mesh.node_count; i++) {
                double *const part[3] = {&x[i].x, &x[i].y, &x[i].z};
                const double at[3] = {force[i].x, force[i].y, force[i].z};
                for (int c = 0; c < 3; c++) {
                    const double here = *part[c];
                    *part[c] = here + step;
                    const double more = volume_of(&mesh, x);
                    *part[c] = here - step;
                    const double less = volume_of(&mesh, x);
                    *part[c] = here;
                    expect_near(at[c], pressure * (more - less) / (2.0 * step), close * most);
                }
            }
        }
}

// A sphere of 2562 nodes, inflated slowly enough to stay at rest.
static void inflate(Fixture *fixture, double pressure, bool gas)
{
    TriMesh mesh;
    assert_true(generate_ico_sphere(&mesh, 4, 0.05, &(Status){0}));
    FixtureOptions options = filled(pressure);
    options.material = fixture_material(2e-4);
    options.material.node_damping = 5e-3; // 100 1/s, half of the breathing frequency
    options.cavity.gas = gas;
    options.cavity.ambient = 1e5;
    options.precision = PRECISION_DOUBLE;
    fixture_create(fixture, &mesh, &options);
    fixture_run(fixture, 1500);
    for (int i = 0; i < fixture->mesh.node_count; i++)
        expect_at_most(vec3_length(fixture->v[i]), 1e-4);
}

// The force with which springs hold two halves of a sphere together, along z.
static double held_together(const Fixture *fixture, double height)
{
    double force = 0.0;
    SCOPED(winged_destroy) WingedMesh winged;
    winged_create(&winged, &fixture->mesh);
    for (int e = 0; e < winged.edge_count; e++) {
        const int a = winged.edge[e].node[0], b = winged.edge[e].node[1];
        if ((fixture->x[a].z > height) == (fixture->x[b].z > height))
            continue;
        // Van Gelder: each face adds E2D A / L^2.
        double k = 0.0;
        for (int s = 0; s < 2; s++) {
            const int *n = fixture->mesh.triangle[winged.edge[e].face[s]];
            const Vec3 *p = fixture->mesh.position;
            k += 80.0 * 0.5 *
                 vec3_length(vec3_cross(vec3_sub(p[n[1]], p[n[0]]), vec3_sub(p[n[2]], p[n[0]])));
        }
        const double rest =
            vec3_length(vec3_sub(fixture->mesh.position[a], fixture->mesh.position[b]));
        const Vec3 d = vec3_sub(fixture->x[b], fixture->x[a]);
        const double length = vec3_length(d);
        force += k / (rest * rest) * (length - rest) * fabs(d.z) / length;
    }
    return force;
}

TEST(a_balloon_bears_two_tensions_over_its_radius)
{
    const double radius = 0.05, modulus = 80.0;
    // 1200 Pa is the most that linear springs of this stiffness bear: beyond, the balloon grows
    // without end.
    static const double PRESSURES[] = {150.0, 300.0, 600.0, 1000.0};
    for (int k = 0; k < 4; k++) {
        const double pressure = PRESSURES[k];
        SCOPED(fixture_destroy) Fixture fixture;
        inflate(&fixture, pressure, false);
        double mean = 0.0;
        for (int i = 0; i < fixture.mesh.node_count; i++)
            mean += vec3_length(fixture.x[i]) / fixture.mesh.node_count;
        // Laplace: tension is force over the length of the cut between two halves. The mesh has
        // edges of 4 mm, its cuts run in steps: half a percent.
        const double tension = held_together(&fixture, 1e-4) / (2.0 * M_PI * mean);
        expect_near(pressure, 2.0 * tension / mean, 0.01 * pressure);
        // Thin shell: the springs have the energy 1.5 E2D strain^2 per area at rest, so that
        // p = 3 E2D (stretch - 1) / (R stretch^2); the mesh is a polyhedron of nearly equilateral
        // faces.
        const double stretch = mean / radius;
        print_message("%g Pa: stretch %.5f, 2 T / R %.2f Pa, shell %.2f Pa\n", pressure, stretch,
                      2.0 * tension / mean,
                      3.0 * modulus * (stretch - 1.0) / (radius * stretch * stretch));
        expect_near(pressure, 3.0 * modulus * (stretch - 1.0) / (radius * stretch * stretch),
                    0.02 * pressure);
    }
}

TEST(what_cannot_be_filled_is_refused)
{
    static const struct {
        void (*make)(TriMesh *);
        IntegratorKind integrator;
        int levels;
        bool flip;
        const char *says;
    } CASES[] = {
        {fixture_sheet, INTEGRATOR_LEAPFROG, 0, false, "closed mesh"},
        {fixture_sphere, INTEGRATOR_IMPLICIT, 0, false, "explicit steps"},
        {fixture_sphere, INTEGRATOR_LEAPFROG, 1, false, "continuum"},
        {fixture_sphere, INTEGRATOR_LEAPFROG, 0, true, "counter-clockwise"},
    };
    for (size_t k = 0; k < sizeof CASES / sizeof *CASES; k++) {
        TriMesh mesh;
        CASES[k].make(&mesh);
        for (int f = 0; f < mesh.triangle_count && CASES[k].flip; f++) {
            const int corner = mesh.triangle[f][1];
            mesh.triangle[f][1] = mesh.triangle[f][2];
            mesh.triangle[f][2] = corner;
        }
        FixtureOptions options = filled(100.0);
        options.integrator = CASES[k].integrator;
        options.levels = CASES[k].levels;
        options.adjust = CASES[k].levels > 0 ? ADJUST_CHOI2005 : ADJUST_CONTINUUM;
        SCOPED(fixture_destroy) Fixture fixture;
        Status status = {0};
        assert_false(fixture_try(&fixture, &mesh, &options, &status));
        if (strstr(status.text, CASES[k].says) == NULL)
            fail_msg("%s", status.text);
    }
}
