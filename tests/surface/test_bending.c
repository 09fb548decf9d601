// Bending of a wall: forces and energy of the hinges, and plates against plate theory.
#include "expect.h"
#include "fixture.h"
#include "random.h"
#include "surface/bending.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// A wall that bends and hardly stretches, so that nothing hides the hinges.
static FixtureOptions hinged(double modulus)
{
    FixtureOptions options = {.material = fixture_material(0.0)};
    options.material.youngs_modulus_2d = modulus;
    options.material.bending_stiffness = 1e-4;
    options.integrator = INTEGRATOR_LEAPFROG;
    return options;
}

static double elastic_energy(const Fixture *fixture)
{
    BodyMeasure measure;
    fixture->body->ops->measure(fixture->body->model, &measure);
    return measure.elastic;
}

// An eighth of an edge at most: no face comes near the size at which hinges fade.
static void deform(const TriMesh *mesh, uint64_t seed, Vec3 *x)
{
    for (int i = 0; i < mesh->node_count; i++)
        x[i] = vec3_add(mesh->position[i], vec3_scale(0.0005, random_vec3(&seed)));
}

enum { NODES = 188 };

// Forces by one step that is too short to move anything.
static void forces_in(Precision precision, const Vec3 *x, double modulus, void (*make)(TriMesh *),
                      Vec3 *force)
{
    TriMesh mesh;
    make(&mesh);
    FixtureOptions options = hinged(modulus);
    options.precision = precision;
    options.integrator = INTEGRATOR_SYMPLECTIC_EULER;
    options.rate_hz = 1e9;
    options.initial_position = x;
    Fixture fixture;
    fixture_create(&fixture, &mesh, &options);
    fixture_run(&fixture, 1);
    for (int i = 0; i < fixture.mesh.node_count; i++)
        force[i] =
            vec3_scale(fixture.body->surface.node_mass[i] / sim_tick(fixture.sim), fixture.v[i]);
    fixture_destroy(&fixture);
}

static void forces(const Vec3 *x, double modulus, void (*make)(TriMesh *), Vec3 *force)
{
    forces_in(PRECISION_DOUBLE, x, modulus, make, force);
}

static double energy_of(const Vec3 *x, double modulus, void (*make)(TriMesh *))
{
    TriMesh mesh;
    make(&mesh);
    FixtureOptions options = hinged(modulus);
    options.initial_position = x;
    Fixture fixture;
    fixture_create(&fixture, &mesh, &options);
    double energy = elastic_energy(&fixture);
    fixture_destroy(&fixture);
    return energy;
}

static void force_is_minus_the_gradient_of_the_energy(void **state)
{
    (void)state;
    void (*const make[])(TriMesh *) = {fixture_organ, fixture_sphere, fixture_sheet};
    for (int m = 0; m < 3; m++) {
        TriMesh mesh;
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
                double more = energy_of(x, 1e-6, make[m]);
                *part[c] = here - step;
                double less = energy_of(x, 1e-6, make[m]);
                *part[c] = here;
                // The third derivative adds (step / height)^2 = 1e-11, rounding of the energy
                // about 1e-7.
                expect_near(at[c], -(more - less) / (2.0 * step), 1e-6 * most);
            }
        }
        mesh_destroy(&mesh);
    }
}

static void single_precision_agrees_with_double(void **state)
{
    (void)state;
    TriMesh mesh;
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
    mesh_destroy(&mesh);
}

static void keeps_momentum(IntegratorKind integrator)
{
    TriMesh mesh;
    fixture_sphere(&mesh);
    Vec3 v[NODES];
    uint64_t seed = 5;
    for (int i = 0; i < mesh.node_count; i++)
        v[i] = vec3_add(vec3(0.1, 0.0, 0.05), vec3_scale(0.1, random_vec3(&seed)));
    FixtureOptions options = hinged(80.0);
    options.integrator = integrator;
    options.initial_velocity = v;
    options.material.damping_time = 1e-4; // hinges are damped too
    Fixture fixture;
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
    fixture_destroy(&fixture);
}

static void free_body_keeps_its_momentum(void **state)
{
    (void)state;
    keeps_momentum(INTEGRATOR_LEAPFROG);
    keeps_momentum(INTEGRATOR_IMPLICIT);
}

// Nodes that meet, faces without area, folds of half a turn: nothing but finite numbers.
static void folded_faces_give_finite_forces(void **state)
{
    (void)state;
    TriMesh mesh;
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
        FixtureOptions options = hinged(80.0);
        options.material.damping_time = 2e-4;
        options.shape = fixture_shape(SHAPE_WORLD);
        options.initial_position = x;
        Fixture fixture;
        fixture_create_sphere(&fixture, &options);
        fixture_run(&fixture, 1000);
        double farthest = 0.0;
        for (int i = 0; i < mesh.node_count; i++)
            farthest = fmax(farthest, vec3_length(fixture.x[i]));
        print_message("way %d: within %.3g m after 1 s\n", way, farthest);
        // It started within 0.05 m, with energy to swing, and loses it.
        assert_true(fixture_is_finite(&fixture) && farthest < 0.1);
        fixture_destroy(&fixture);
    }
    mesh_destroy(&mesh);
}

// The largest eigenvalue of M^-1 K of the hinges alone lies below the bound, and not far: found by
// power iteration with forces of small displacements.
static void bound_holds_the_largest_eigenvalue(void **state)
{
    (void)state;
    void (*const make[])(TriMesh *) = {fixture_organ, fixture_sphere, fixture_sheet};
    for (int m = 0; m < 3; m++) {
        TriMesh mesh;
        make[m](&mesh);
        FixtureOptions options = hinged(1e-6);
        Fixture fixture;
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
        fixture_destroy(&fixture);
        mesh_destroy(&mesh);
    }
}

// --- plates -------------------------------------------------------------------------------------

static const double SIDE = 0.1; // [m] of an equilateral plate

static int triangle_node(int row, int k)
{
    return row * (row + 1) / 2 + k;
}

// Equilateral faces, `parts` along each side, the centroid at the origin.
static void make_triangle(TriMesh *mesh, int parts, int *border, int *border_count)
{
    const double a = SIDE / parts, tall = a * sqrt(0.75);
    mesh_create(mesh, triangle_node(parts + 1, 0), parts * parts);
    int faces = 0;
    *border_count = 0;
    for (int r = 0; r <= parts; r++)
        for (int k = 0; k <= r; k++) {
            int node = triangle_node(r, k);
            mesh->position[node] =
                vec3((k - 0.5 * r) * a, 2.0 / 3.0 * parts * tall - r * tall, 0.0);
            if (k == 0 || k == r || r == parts)
                border[(*border_count)++] = node;
            if (r == parts)
                continue;
            int *face = mesh->triangle[faces++];
            face[0] = node, face[1] = triangle_node(r + 1, k),
            face[2] = triangle_node(r + 1, k + 1);
            if (k == r)
                continue;
            face = mesh->triangle[faces++];
            face[0] = node, face[1] = triangle_node(r + 1, k + 1),
            face[2] = triangle_node(r, k + 1);
        }
}

// Returns the deflection of the centroid [m] of a plate at rest under a pressure [Pa], or a force
// at its centroid [N].
static double deflection(IntegratorKind integrator, int level, double pressure, double force)
{
    enum { PARTS = 18, MOST = 3 * PARTS };
    int border[MOST], count;
    TriMesh mesh;
    make_triangle(&mesh, PARTS, border, &count);
    FixedRegion fixed = {.kind = FIXED_NODES, .node = border, .node_count = count};
    FixtureOptions options = hinged(80.0);
    options.integrator = integrator;
    options.levels = options.start_level = level;
    options.fixed_count = 1;
    options.fixed = &fixed;
    options.gravity = vec3(0.0, 0.0, pressure / options.material.areal_density);
    // Drag of the lowest mode's critical damping: at rest within half a second.
    double height = SIDE * sqrt(0.75), area = 0.5 * SIDE * height;
    double mass = options.material.areal_density * area / mesh.node_count;
    options.material.node_damping = 2.0 * 25.0 * mass;
    const LoadOptions load = {.body = 0,
                              .center = vec3(0.0, 0.0, 0.0),
                              .radius = 1e-5,
                              .force = vec3(0.0, 0.0, force),
                              .duration = 10.0};
    if (force > 0.0) {
        options.may_load = true;
        options.load_count = 1;
        options.load = &load;
    }
    Fixture fixture;
    fixture_create(&fixture, &mesh, &options);
    fixture_run(&fixture, 800);
    double middle = 0.0, closest = 1.0, speed = 0.0;
    for (int i = 0; i < fixture.mesh.node_count; i++) {
        Vec3 p = fixture.mesh.position[i];
        if (p.x * p.x + p.y * p.y < closest) {
            closest = p.x * p.x + p.y * p.y;
            middle = fixture.x[i].z;
            speed = fabs(fixture.v[i].z);
        }
    }
    expect_at_most(speed * 0.05, 1e-3 * middle); // it is at rest
    fixture_destroy(&fixture);
    return middle;
}

// Timoshenko and Woinowsky-Krieger, Theory of Plates and Shells, section 71: an equilateral plate
// of height a, simply supported, bends by q a^4 / (972 D) at its centroid under a pressure, and by
// 0.00575 P a^2 / D under a force there. Its borders are straight: nothing depends on the Poisson
// ratio.
static void plates_follow_plate_theory(void **state)
{
    (void)state;
    const double a = SIDE * sqrt(0.75), D = 1e-4;
    // One level, finer, and implicit.
    for (int k = 0; k < 3; k++) {
        const int level = k == 1;
        const IntegratorKind integrator = k == 2 ? INTEGRATOR_IMPLICIT : INTEGRATOR_LEAPFROG;
        // Deflections of a micrometre: no stretching.
        double pressed =
            deflection(integrator, level, 4e-3, 0.0) / (4e-3 * a * a * a * a / (972.0 * D));
        double pushed = deflection(integrator, level, 0.0, 4e-6) / (0.00575 * 4e-6 * a * a / D);
        print_message("level %d%s: pressure %.4f, force %.4f of theory\n", level,
                      k == 2 ? ", implicit" : "", pressed, pushed);
        expect_near(pressed, 1.0, 0.02);
        expect_near(pushed, 1.0, 0.05);
    }
}

// --- a cylinder ---------------------------------------------------------------------------------

static const double RADIUS = 0.05; // [m]

enum { AROUND = 16, ROWS = 13 };

// An open cylinder of nearly equilateral faces, its ends free.
static void make_cylinder(TriMesh *mesh)
{
    const double pi = 3.14159265358979323846;
    const double tall = 2.0 * pi * RADIUS / AROUND * sqrt(0.75);
    mesh_create(mesh, AROUND * ROWS, 2 * AROUND * (ROWS - 1));
    int faces = 0;
    for (int r = 0; r < ROWS; r++)
        for (int k = 0; k < AROUND; k++) {
            const double angle = 2.0 * pi * (k + 0.5 * (r % 2)) / AROUND;
            mesh->position[r * AROUND + k] =
                vec3(RADIUS * cos(angle), RADIUS * sin(angle), (r - 0.5 * (ROWS - 1)) * tall);
            if (r + 1 == ROWS)
                continue;
            // The next node of this row, and the two above the edge.
            const int a = r * AROUND + k, b = r * AROUND + (k + 1) % AROUND;
            const int left = (r + 1) * AROUND + (k + (r % 2 ? 0 : AROUND - 1)) % AROUND,
                      above = (r + 1) * AROUND + (k + (r % 2 ? 1 : 0)) % AROUND;
            int *face = mesh->triangle[faces++];
            face[0] = a, face[1] = b, face[2] = above;
            face = mesh->triangle[faces++];
            face[0] = a, face[1] = above, face[2] = left;
        }
}

// A long cylinder pinched by a pressure p cos(2 phi) bends without stretching into an oval of
// amplitude w = p R^4 / (9 D) (Timoshenko and Gere, Theory of Elastic Stability, section 7.1, with
// D in place of E I: a ring at n = 2 has the factor (n^2 - 1)^2).
static void a_pinched_cylinder_becomes_an_oval(void **state)
{
    (void)state;
    const double D = 1e-4, pressure = 0.002, want = pressure * pow(RADIUS, 4.0) / (9.0 * D);
    for (int level = 0; level < 3; level++) {
        TriMesh mesh;
        make_cylinder(&mesh);
        FixtureOptions options = hinged(80.0);
        options.material.bending_stiffness = D;
        options.material.areal_density = 0.1;
        options.precision = PRECISION_DOUBLE;
        options.levels = options.start_level = level;
        options.may_load = true;
        // Critical damping of the oval's mode, sqrt(7.2 D / (rho R^4)) = 34 rad/s.
        const double edge = 2.0 * 3.14159265358979323846 * RADIUS / AROUND;
        const double node_mass = 0.1 * edge * edge * sqrt(0.75); // of level 0, as the damping is
        options.material.node_damping = 2.0 * 34.0 * node_mass;
        Fixture fixture;
        fixture_create(&fixture, &mesh, &options);
        const BodyOps *ops = fixture.body->ops;
        for (int i = 0; i < fixture.mesh.node_count; i++) {
            const Vec3 at = fixture.mesh.position[i];
            const Vec3 out = vec3_unit(vec3(at.x, at.y, 0.0));
            const double force = pressure * (out.x * out.x - out.y * out.y) *
                                 fixture.body->surface.node_mass[i] / 0.1;
            ops->add_load(fixture.body->model, i, vec3_scale(force, out));
        }
        fixture_run(&fixture, 500);
        // The oval's part of the radial displacements, weighted by mass.
        double sum = 0.0, weight = 0.0, speed = 0.0;
        for (int i = 0; i < fixture.mesh.node_count; i++) {
            const Vec3 at = fixture.mesh.position[i];
            const Vec3 out = vec3_unit(vec3(at.x, at.y, 0.0));
            const double share = out.x * out.x - out.y * out.y;
            const double mass = fixture.body->surface.node_mass[i];
            sum += mass * share * vec3_dot(out, vec3_sub(fixture.x[i], at));
            weight += mass * share * share;
            speed += mass * share * vec3_dot(out, fixture.v[i]);
        }
        print_message("level %d: oval %.4f of theory\n", level, sum / weight / want);
        expect_at_most(fabs(speed / weight) / 34.0, 2e-3 * want); // it is at rest
        // The free ends, where a strip bends more easily, count for 1 or 2 %.
        expect_near(sum / weight, want, 0.05 * want);
        fixture_destroy(&fixture);
    }
}

// Presses a sphere with 1 N until it is at rest, at a level. Displacements of the nodes of level 0.
static int press(double thickness, int level, Vec3 *u)
{
    enum { LOADS = 40 };
    TriMesh mesh;
    fixture_sphere(&mesh);
    const int coarse = mesh.node_count;
    FixtureOptions options = {.material = fixture_material(2e-4),
                              .shape = fixture_shape(SHAPE_WORLD),
                              .integrator = INTEGRATOR_LEAPFROG,
                              .may_load = true,
                              .load_count = LOADS};
    options.material.thickness = thickness;
    options.shape.damping_ratio = 1.0;
    options.levels = options.start_level = level;
    // Many radii: a pressure without a jump at its border, the same at every level.
    LoadOptions load[LOADS];
    for (int k = 0; k < LOADS; k++)
        load[k] = (LoadOptions){.center = vec3(0.0, 0.05, 0.0),
                                .radius = 0.03 * (0.5 + 0.5 * k / (LOADS - 1.0)),
                                .force = vec3(0.0, -1.0 / LOADS, 0.0),
                                .duration = 10.0};
    options.load = load;
    Fixture fixture;
    fixture_create(&fixture, &mesh, &options);
    fixture_run(&fixture, 350);
    for (int i = 0; i < coarse; i++)
        u[i] = vec3_sub(fixture.x[i], fixture.mesh.position[i]);
    fixture_destroy(&fixture);
    return coarse;
}

// With hinges each level is at least twice as close to the next; without them the wall folds
// elsewhere at each level.
static void levels_converge_only_with_bending(void **state)
{
    (void)state;
    for (int k = 0; k < 2; k++) {
        Vec3 u[3][NODES];
        double part[3] = {0.0};
        for (int level = 0; level < 3; level++) {
            const int count = press(k == 0 ? 4e-3 : 0.0, level, u[level]);
            double difference = 0.0, sum = 0.0;
            for (int i = 0; level > 0 && i < count; i++) {
                Vec3 d = vec3_sub(u[level][i], u[level - 1][i]);
                difference += vec3_dot(d, d);
                sum += vec3_dot(u[level][i], u[level][i]);
            }
            part[level] = level > 0 ? sqrt(difference / sum) : 0.0;
        }
        print_message("%s bending: level 1 differs from 0 by %.2f %%, 2 from 1 by %.2f %%\n",
                      k == 0 ? "with" : "without", 100.0 * part[1], 100.0 * part[2]);
        if (k == 0)
            expect_at_most(part[2], 0.5 * part[1]);
        else
            expect_at_least(part[2], 0.5 * part[1]);
    }
}

static void refuses_free_hanging_nodes(void **state)
{
    (void)state;
    FixtureOptions options = hinged(80.0);
    options.levels = 1;
    options.adjust = ADJUST_CHOI2005;
    TriMesh mesh;
    fixture_sphere(&mesh);
    Fixture fixture;
    Status status = {0};
    assert_false(fixture_try(&fixture, &mesh, &options, &status));
    assert_non_null(strstr(status.text, "bending"));
    fixture_destroy(&fixture);
}

static void thickness_gives_the_stiffness_of_a_plate(void **state)
{
    (void)state;
    SurfaceMaterial material = {.youngs_modulus_2d = 80.0, .thickness = 4e-3};
    // 20 kPa (4 mm)^3 / (12 (1 - 1/9)).
    expect_near(bending_stiffness(&material), 20e3 * 64e-9 / (12.0 * 8.0 / 9.0), 1e-18);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(force_is_minus_the_gradient_of_the_energy),
        cmocka_unit_test(single_precision_agrees_with_double),
        cmocka_unit_test(free_body_keeps_its_momentum),
        cmocka_unit_test(folded_faces_give_finite_forces),
        cmocka_unit_test(bound_holds_the_largest_eigenvalue),
        cmocka_unit_test(plates_follow_plate_theory),
        cmocka_unit_test(a_pinched_cylinder_becomes_an_oval),
        cmocka_unit_test(levels_converge_only_with_bending),
        cmocka_unit_test(refuses_free_hanging_nodes),
        cmocka_unit_test(thickness_gives_the_stiffness_of_a_plate),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
