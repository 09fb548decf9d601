// SPDX-License-Identifier: MIT
// Springs that stiffen by Fung's law: a strip against the closed form, forces against the energy,
// the kernel's exponential, the bound of the time step, what a free body keeps, the same bits.
#include "effort.h"
#include "test.h"
#include "fixture.h"
#include "geometry/generator.h"
#include "random.h"

#include "surface/law.h"
#include "surface/model.h"

#include <stdlib.h>
#include <string.h>

// ---------------------------------------------------------------------------------------------
// A strip

enum { COLUMNS = 13, ROWS = 7, STRIP = COLUMNS * ROWS };
static const double EDGE = 0.01; // [m]

// Equilateral faces; its rows run along x.
static void make_strip(TriMesh *mesh)
{
    int faces = 0;
    mesh_create(mesh, STRIP, 2 * (COLUMNS - 1) * (ROWS - 1));
    for (int r = 0; r < ROWS; r++)
        for (int c = 0; c < COLUMNS; c++)
            mesh->position[r * COLUMNS + c] =
                vec3((c + 0.5 * (r % 2)) * EDGE, r * EDGE * sqrt(0.75), 0.0);
    for (int r = 0; r + 1 < ROWS; r++)
        for (int c = 0; c + 1 < COLUMNS; c++) {
            const int a = r * COLUMNS + c, above = a + COLUMNS, odd = r % 2;
            int *face = mesh->triangle[faces++];
            face[0] = a, face[1] = a + 1, face[2] = odd ? above + 1 : above;
            face = mesh->triangle[faces++];
            face[0] = odd ? a : a + 1, face[1] = above + 1, face[2] = above;
        }
}

// The stress along the strip [N/m], from one kick that is too short to move anything: pulled along
// its rows with free sides, the slanted springs of an equilateral lattice stay as long as they are.
static double stress_of(const FixtureOptions *like, double strain)
{
    const double h = 1e-9;
    TriMesh mesh;
    FixtureOptions options = *like;
    options.integrator = INTEGRATOR_SYMPLECTIC_EULER;
    options.rate_hz = 1.0 / h;
    make_strip(&mesh);
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create(&fixture, &mesh, &options);
    Vec3 x[STRIP], zero[STRIP] = {{0.0, 0.0, 0.0}};
    const double along = 1.0 + strain, half = 0.5 * along, tall = sqrt(1.0 - half * half);
    fixture_read(&fixture);
    for (int i = 0; i < STRIP; i++)
        x[i] = vec3(along * fixture.x[i].x, (i / COLUMNS) * EDGE * tall, 0.0);
    fixture_write(&fixture, x, zero);
    fixture_run(&fixture, 1);
    double pull = 0.0;
    for (int i = 0; i < STRIP; i++)
        if (i % COLUMNS > COLUMNS / 2)
            pull -= fixture_model(&fixture)->mass[i] * fixture.v[i].x / h;
    return pull / ((ROWS - 1) * EDGE * sqrt(0.75));
}

// Stress is E e exp((e / s)^2) up to the strain from which on it is a straight line of slope
// cap E: there the derivative of that law, E (1 + 2 q) exp(q), is cap E.
static double closed_form(double modulus, double s, double cap, double strain)
{
    double low = 0.0, high = 10.0 * s;
    for (int i = 0; i < 200; i++) {
        const double middle = 0.5 * (low + high), q = middle * middle / (s * s);
        *((1.0 + 2.0 * q) * exp(q) < cap ? &low : &high) = middle;
    }
    if (strain <= low)
        return modulus * strain * (strain > 0.0 ? exp(strain * strain / (s * s)) : 1.0);
    return modulus * (low * exp(low * low / (s * s)) + cap * (strain - low));
}

TEST(a_strip_follows_the_closed_form)
{
    static const Stiffening LAWS[] = {{0.15, 10.0}, {0.05, 100.0}, {0.3, 1.5}, {10.0, 2.0}};
    for (int precision = 0; precision < PRECISION_COUNT; precision++) {
        double most = 0.0;
        for (int k = 0; k < 4; k++)
            for (int i = -6; i <= 30; i++) {
                FixtureOptions options = {.material = fixture_material(0.0),
                                          .precision = (Precision)precision};
                options.material.stiffening = LAWS[k];
                if (i == 0)
                    continue;
                const double strain = 0.01 * i,
                             expected = closed_form(80.0, LAWS[k].strain, LAWS[k].cap, strain);
                most = fmax(most, fabs(stress_of(&options, strain) / expected - 1.0));
            }
        print_message("%s: stress off by at most %.2g of the closed form\n",
                      precision == PRECISION_SINGLE ? "single" : "double", most);
        // A kernel in double is within rounding. In single precision strains of 0.01 are known to
        // 1e-5, as displacements of 0.1 m are to 1e-8 m; (e / s)^2 doubles that.
        expect_at_most(most, precision == PRECISION_SINGLE ? 3e-5 : 1e-12);
    }
}

// ---------------------------------------------------------------------------------------------
// Forces and energy

TEST(forces_are_the_gradient_of_the_energy)
{
    const double h = 1e-9, step = 1e-7; // [s], [m]
    uint64_t random = 3;
    for (int round = 0; round < EFFORT(6); round++) {
        FixtureOptions options = {.material = fixture_material(0.0),
                                  .prestress = 0.05,
                                  .integrator = INTEGRATOR_SYMPLECTIC_EULER,
                                  .rate_hz = 1.0 / h};
        options.material.stiffening = (Stiffening){0.1 + 0.05 * round, 4.0 + 3.0 * round};
        TriMesh mesh;
        fixture_organ(&mesh);
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create(&fixture, &mesh, &options);
        const int count = fixture.mesh.node_count;
        Vec3 x[256], d[256], moved[256], zero[256] = {{0.0, 0.0, 0.0}};
        fixture_read(&fixture);
        for (int i = 0; i < count; i++) {
            x[i] = vec3_madd(vec3(1.3 * fixture.x[i].x, 0.9 * fixture.x[i].y, fixture.x[i].z), 3e-3,
                             random_vec3(&random));
            d[i] = random_vec3(&random);
        }
        double energy[2];
        for (int side = 0; side < 2; side++) {
            for (int i = 0; i < count; i++)
                moved[i] = vec3_madd(x[i], side == 0 ? -step : step, d[i]);
            fixture_write(&fixture, moved, zero);
            energy[side] = fixture_measure(&fixture).elastic;
        }
        fixture_write(&fixture, x, zero);
        fixture_run(&fixture, 1);
        double slope = 0.0, size = 0.0;
        Vec3 sum = {0.0, 0.0, 0.0}, moment = {0.0, 0.0, 0.0};
        for (int i = 0; i < count; i++) {
            const Vec3 f = vec3_scale(fixture_model(&fixture)->mass[i] / h, fixture.v[i]);
            slope -= vec3_dot(f, d[i]);
            size += vec3_length(f);
            sum = vec3_add(sum, f);
            moment = vec3_add(moment, vec3_cross(x[i], f));
        }
        // Of differences 1e-7 m apart the error is 1e-10.
        expect_near((energy[1] - energy[0]) / (2.0 * step), slope, 1e-6 * size);
        expect_at_most(vec3_length(sum), 1e-12 * size);
        expect_at_most(vec3_length(moment), 1e-12 * size);
    }
}

// At the step of the bound, stretched far beyond the knee, without damping: no body blows up; with
// damping and shorter steps energy grows in no tick.
TEST(stretched_bodies_come_back)
{
    static const double CAPS[] = {1.0, 10.0, 100.0};
    uint64_t random = 8;
    for (int trial = 0; trial < EFFORT(12); trial++) {
        const bool damped = trial >= 6;
        FixtureOptions options = {.material = fixture_material(damped ? 5e-4 : 0.0),
                                  .precision = (Precision)(trial & 1),
                                  .shape = fixture_shape(SHAPE_WORLD),
                                  .integrator =
                                      trial % 4 == 3 ? INTEGRATOR_RK4 : INTEGRATOR_LEAPFROG};
        options.material.stiffening = (Stiffening){0.1, CAPS[trial / 2 % 3]};
        options.time_step = damped ? 2e-5 : 0.0;
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create_sphere(&fixture, &options);
        fixture_read(&fixture);
        Vec3 x[128], zero[128] = {{0.0, 0.0, 0.0}};
        for (int i = 0; i < fixture.mesh.node_count; i++)
            x[i] = vec3_madd(vec3(1.6 * fixture.x[i].x, fixture.x[i].y, 0.8 * fixture.x[i].z), 1e-3,
                             random_vec3(&random));
        fixture_write(&fixture, x, zero);
        const double first = fixture_energy(&fixture);
        double before = first, most = 0.0, grows = 0.0;
        for (int tick = 0; tick < 300; tick++) {
            fixture_run(&fixture, 1);
            const double now = fixture_energy(&fixture);
            most = fmax(most, now / first);
            grows = fmax(grows, (now - before) / first);
            before = now;
        }
        // Leapfrog near its bound lets the energy of the fastest modes swing by 5
        // (body/integrator.h); little of it is in those.
        expect_at_most(most, damped ? 1.0 : 1.5);
        if (damped) { // rounding of an energy, in single precision of its positions
            expect_at_most(grows, 1e-6);
            assert_true(before < 0.2 * first);
        }
    }
}

// ---------------------------------------------------------------------------------------------
// What stays, and bits

TEST(a_free_body_keeps_its_momentum)
{
    for (int precision = 0; precision < PRECISION_COUNT; precision++) {
        FixtureOptions options = {.material = fixture_material(0.0),
                                  .precision = (Precision)precision,
                                  .integrator = INTEGRATOR_LEAPFROG};
        options.material.stiffening = (Stiffening){0.05, 10.0};
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create_sphere(&fixture, &options);
        uint64_t random = 21;
        Vec3 v[128], linear[2], angular[2];
        fixture_read(&fixture);
        for (int i = 0; i < fixture.mesh.node_count; i++)
            v[i] = vec3_madd(vec3_cross(vec3(2.0, -4.0, 8.0), fixture.x[i]), 0.2,
                             random_vec3(&random));
        fixture_write(&fixture, fixture.x, v);
        for (int side = 0; side < 2; side++) {
            fixture_run(&fixture, side * EFFORT(500));
            linear[side] = angular[side] = vec3(0.0, 0.0, 0.0);
            for (int i = 0; i < fixture.mesh.node_count; i++) {
                const Vec3 p = vec3_scale(fixture_model(&fixture)->mass[i], fixture.v[i]);
                linear[side] = vec3_add(linear[side], p);
                angular[side] = vec3_add(angular[side], vec3_cross(fixture.x[i], p));
            }
        }
        const double scale = vec3_length(angular[0]);
        const bool single = precision == PRECISION_SINGLE;
        // Rounding; in single precision of each kick.
        expect_at_most(vec3_length(vec3_sub(linear[1], linear[0])) * 0.05,
                       (single ? 1e-5 : 1e-11) * scale);
        expect_at_most(vec3_length(vec3_sub(angular[1], angular[0])),
                       (single ? 1e-3 : 1e-10) * scale);
    }
}

TEST(every_instruction_set_gives_the_same_bits)
{
    const char *const *isa = isa_available();
    static const ShapeFrame FRAMES[] = {SHAPE_WORLD, SHAPE_BODY};
    for (int trial = 0; trial < 16; trial++) {
        uint64_t hash = 0;
        for (int k = 0; isa[k] != NULL; k++) {
            FixtureOptions options = {.material = fixture_material(2e-4),
                                      .precision = (Precision)(trial & 1),
                                      .prestress = 0.1,
                                      .isa = isa[k]};
            options.integrator = trial & 2 ? INTEGRATOR_LEAPFROG : INTEGRATOR_RK4;
            options.material.stiffening = (Stiffening){0.05, 10.0};
            if (trial & 2) // both laws
                options.material.branch[options.material.branch_count++] =
                    (MaxwellBranch){0.1, 0.3, false};
            if (trial & 4)
                options.shape = fixture_shape(FRAMES[trial >> 3]);
            SCOPED(fixture_destroy) Fixture fixture;
            fixture_create_sphere(&fixture, &options);
            fixture_run(&fixture, 20);
            const uint64_t end = state_hash(&fixture.state);
            assert_true(hash == 0 || hash == end);
            hash = end;
        }
    }
}

// The bound of the time step is that of springs cap times as stiff, and haptic clients are told the
// tangent; implicit steps are refused by name.
TEST(the_bound_follows_the_cap)
{
    double lambda[2];
    for (int k = 0; k < 2; k++) {
        FixtureOptions options = {.material = fixture_material(0.0),
                                  .integrator = INTEGRATOR_LEAPFROG};
        if (k == 1)
            options.material.stiffening = (Stiffening){0.1, 10.0};
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create_sphere(&fixture, &options);
        lambda[k] = fixture.body->lambda;
        if (k == 1) {
            const double r =
                model_get(fixture_model(&fixture), fixture_model(&fixture)->springs.rest_length, 0);
            expect_near(law_spring(fixture_model(&fixture), 0, 0.05 * r, 0.0).tangent,
                        1.5 * exp(0.25), 1e-12);
            expect_near(law_spring(fixture_model(&fixture), 0, r, 0.0).tangent, 10.0, 1e-12);
            expect_near(law_spring(fixture_model(&fixture), 0, -0.5 * r, 0.0).tangent, 1.0, 1e-12);
        }
    }
    expect_near(lambda[1] / lambda[0], 10.0, 1e-12);
    FixtureOptions options = {.material = fixture_material(0.0), .integrator = INTEGRATOR_IMPLICIT};
    options.material.stiffening = (Stiffening){0.1, 10.0};
    TriMesh mesh;
    Status status = {0};
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_sphere(&mesh);
    assert_false(fixture_try(&fixture, &mesh, &options, &status));
    assert_non_null(strstr(status.text, "stiffening needs an explicit integrator"));
}
