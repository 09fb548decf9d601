// SPDX-License-Identifier: MIT
// Single precision against double: the same bodies, the same inputs. Double precision itself is
// checked against a plain solver in test_surface_trajectory.c and test_kernel_variants.c.
#include "base/isa.h"
#include "test.h"
#include "sim_steps.h"
#include "fixture.h"
#include "random.h"

// What one motion is compared by.
typedef struct Difference {
    double position; // largest distance between the two [m]
    double motion;   // largest displacement from rest [m]
    double speed;    // largest difference of velocities [m/s]
    double fastest;  // largest speed [m/s]
} Difference;

static void compare(Fixture *single, Fixture *reference, Difference *out)
{
    fixture_read(single);
    fixture_read(reference);
    *out = (Difference){0};
    for (int i = 0; i < reference->mesh.node_count; i++) {
        Vec3 rest = reference->mesh.position[i];
        out->position = fmax(out->position, vec3_length(vec3_sub(single->x[i], reference->x[i])));
        out->motion = fmax(out->motion, vec3_length(vec3_sub(reference->x[i], rest)));
        out->speed = fmax(out->speed, vec3_length(vec3_sub(single->v[i], reference->v[i])));
        out->fastest = fmax(out->fastest, vec3_length(reference->v[i]));
    }
}

static void create(Fixture *fixture, void (*make)(TriMesh *), Vec3 place, FixtureOptions options,
                   Precision precision)
{
    TriMesh mesh;
    make(&mesh);
    mesh_place(&mesh, 1.0, (Vec3){0.0, 0.0, 0.0}, place);
    options.precision = precision;
    fixture_create(fixture, &mesh, &options);
}

// A random state near rest: nodes moved by up to `amplitude` [m], with velocities to match.
static void random_state(const TriMesh *mesh, double amplitude, Vec3 *x, Vec3 *v)
{
    uint64_t random = 99;
    random_bits(&random);
    for (int i = 0; i < mesh->node_count; i++) {
        double *to[2] = {&x[i].x, &v[i].x};
        const double *rest = &mesh->position[i].x;
        for (int c = 0; c < 3; c++) {
            to[0][c] = rest[c] + amplitude * random_between(&random, -1.0, 1.0);
            to[1][c] = 100.0 * amplitude * random_between(&random, -1.0, 1.0);
        }
    }
}

enum { ALL_VARIANTS = 2 * 3 * 2 * 2 };

// One variant of the kernel as a scene that needs it.
static FixtureOptions variant(int number, IntegratorKind integrator)
{
    FixtureOptions options = {.integrator = integrator, .may_load = true};
    options.material = fixture_material(number & 1 ? 2e-4 : 0.0);
    int shape = number / 2 % 3;
    if (shape > 0)
        options.shape = fixture_shape(shape == 1 ? SHAPE_WORLD : SHAPE_BODY);
    options.prestress = number / 6 % 2 ? 0.05 : 0.0;
    options.gravity = (Vec3){0.5, -0.7, -9.81};
    return options;
}

TEST(every_variant_at_every_level_follows_double)
{
    static void (*const meshes[3])(TriMesh *) = {fixture_organ, fixture_sphere, fixture_sheet};
    for (int number = 0; number < 2 * ALL_VARIANTS; number++) {
        FixtureOptions options =
            variant(number, number < ALL_VARIANTS ? INTEGRATOR_RK4 : INTEGRATOR_LEAPFROG);
        void (*make)(TriMesh *) = meshes[number % 3];
        SCOPED(mesh_destroy) TriMesh mesh;
        make(&mesh);
        FREED Vec3 *x = calloc((size_t)mesh.node_count, sizeof *x);
        FREED Vec3 *v = calloc((size_t)mesh.node_count, sizeof *v);
        random_state(&mesh, 1e-3, x, v);
        options.initial_position = x;
        options.initial_velocity = v;
        SCOPED(fixture_destroy) Fixture reference;
        create(&reference, make, (Vec3){0.0, 0.0, 0.0}, options, PRECISION_DOUBLE);
        bool load = number / 12 % 2 == 1;
        if (load)
            apply_well(sim_apply_load, reference.sim, &fixture_everywhere);
        fixture_run(&reference, 3);

        const char *const *levels = isa_available();
        uint64_t hash = 0;
        for (int k = 0; levels[k] != NULL; k++) {
            SCOPED(fixture_destroy) Fixture single;
            options.isa = levels[k];
            create(&single, make, (Vec3){0.0, 0.0, 0.0}, options, PRECISION_SINGLE);
            if (load)
                apply_well(sim_apply_load, single.sim, &fixture_everywhere);
            fixture_run(&single, 3);
            Difference d;
            compare(&single, &reference, &d);
            // Three ticks of rounding at 6e-8 of the numbers in a row; the largest seen is 4e-7.
            expect_at_most(d.position, (2e-6 * d.motion));
            expect_at_most(d.speed, (2e-6 * d.fastest));
            if (k > 0)
                assert_true(state_hash(&single.state) == hash); // the same bits at every level
            hash = state_hash(&single.state);
        }
    }
}

// A second of small motion under a load, somewhere.
static Difference one_second(void (*make)(TriMesh *), Vec3 place, FixtureOptions options)
{
    SCOPED(fixture_destroy) Fixture single, reference;
    create(&single, make, place, options, PRECISION_SINGLE);
    create(&reference, make, place, options, PRECISION_DOUBLE);
    Fixture *both[2] = {&single, &reference};
    for (int k = 0; k < 2; k++) {
        LoadOptions load = {.body = 0,
                            .center = both[k]->mesh.position[0],
                            .radius = 0.02,
                            .force = {0.0, 0.01, -0.02},
                            .duration = 0.3};
        apply_well(sim_apply_load, both[k]->sim, &load);
        fixture_run(both[k], 1000);
    }
    Difference d;
    compare(&single, &reference, &d);
    return d;
}

TEST(small_motion_agrees_to_1e_5_here_and_far_from_the_origin)
{
    static const Vec3 places[3] = {{0.0, 0.0, 0.0}, {5.0, -3.0, 2.0}, {300.0, 500.0, -200.0}};
    static const IntegratorKind kinds[2] = {INTEGRATOR_RK4, INTEGRATOR_LEAPFROG};
    for (int k = 0; k < 6; k++) {
        FixtureOptions options = {.material = fixture_material(2e-4),
                                  .shape = fixture_shape(SHAPE_WORLD),
                                  .integrator = kinds[k % 2],
                                  .may_load = true};
        Vec3 place = places[k / 2];
        // Measured while the motion is at its largest: the load still acts.
        SCOPED(fixture_destroy) Fixture single, reference;
        create(&single, fixture_organ, place, options, PRECISION_SINGLE);
        create(&reference, fixture_organ, place, options, PRECISION_DOUBLE);
        Fixture *both[2] = {&single, &reference};
        for (int b = 0; b < 2; b++) {
            LoadOptions load = {.body = 0,
                                .center = both[b]->mesh.position[0],
                                .radius = 0.05,
                                .force = {0.0, 0.01, -0.02},
                                .duration = 2.0};
            apply_well(sim_apply_load, both[b]->sim, &load);
            fixture_run(both[b], 1000);
        }
        Difference d;
        compare(&single, &reference, &d);
        print_message("at %g m, %s: %.2g of the largest displacement\n", vec3_length(place),
                      integrator_name(options.integrator), d.position / d.motion);
        expect_at_most(d.position, (1e-5 * d.motion)); // what single precision promises
    }
}

TEST(bodies_that_travel_and_turn_agree_to_1e_5)
{
    for (int k = 0; k < 4; k++) {
        FixtureOptions options = {.material = fixture_material(2e-4),
                                  .integrator = k % 2 ? INTEGRATOR_LEAPFROG : INTEGRATOR_RK4,
                                  .may_load = true};
        options.shape = fixture_shape(SHAPE_BODY);
        SCOPED(mesh_destroy) TriMesh mesh;
        fixture_organ(&mesh);
        FREED Vec3 *v = calloc((size_t)mesh.node_count, sizeof *v);
        // 0.5 m/s and a turn in a second: a slow hand; or 2 m/s and 10 rad/s: a fall.
        Vec3 linear = {k < 2 ? 0.5 : 2.0, 0.1, -0.2}, angular = {0.0, 2.0, k < 2 ? 6.0 : 10.0};
        for (int i = 0; i < mesh.node_count; i++)
            v[i] = vec3_add(linear, vec3_cross(angular, mesh.position[i]));
        options.initial_velocity = v;
        Difference d = one_second(fixture_organ, (Vec3){0.0, 0.0, 0.0}, options);
        print_message("travelling %.2f m, %s: %.2g of it\n", d.motion,
                      integrator_name(options.integrator), d.position / d.motion);
        expect_at_most(d.position, (1e-5 * d.motion));
    }
}

TEST(rest_is_exact)
{
    for (int shape = 0; shape < 3; shape++) {
        FixtureOptions options = variant(1 + 2 * shape, INTEGRATOR_LEAPFROG);
        options.gravity = (Vec3){0.0, 0.0, 0.0};
        SCOPED(fixture_destroy) Fixture single;
        create(&single, fixture_organ, (Vec3){3.0, 0.0, 0.0}, options, PRECISION_SINGLE);
        fixture_run(&single, 200);
        fixture_read(&single);
        for (int i = 0; i < single.mesh.node_count; i++) {
            assert_true(vec3_length(single.v[i]) < 1e-9); // the base frame's own rounding
            expect_near(vec3_length(vec3_sub(single.x[i], single.mesh.position[i])), 0.0, 1e-12);
        }
    }
}

TEST(momentum_of_a_free_body_stays)
{
    FixtureOptions options = {.material = fixture_material(2e-4),
                              .shape = fixture_shape(SHAPE_BODY),
                              .integrator = INTEGRATOR_LEAPFROG};
    TriMesh mesh;
    fixture_organ(&mesh);
    FREED Vec3 *x = calloc((size_t)mesh.node_count, sizeof *x);
    FREED Vec3 *v = calloc((size_t)mesh.node_count, sizeof *v);
    random_state(&mesh, 1e-3, x, v);
    for (int i = 0; i < mesh.node_count; i++)
        v[i] = vec3_add(v[i], (Vec3){0.3, 0.0, 0.1});
    mesh_destroy(&mesh);
    options.initial_position = x;
    options.initial_velocity = v;
    SCOPED(fixture_destroy) Fixture single;
    create(&single, fixture_organ, (Vec3){0.0, 0.0, 0.0}, options, PRECISION_SINGLE);
    Vec3 momentum[2];
    for (int k = 0; k < 2; k++) {
        fixture_read(&single);
        momentum[k] = (Vec3){0.0, 0.0, 0.0};
        for (int i = 0; i < single.mesh.node_count; i++)
            momentum[k] = vec3_madd(momentum[k], single.body->surface.node_mass[i], single.v[i]);
        fixture_run(&single, 1000);
    }
    // Forces of a spring cancel exactly; each kick rounds each velocity by up to 6e-8 of it.
    expect_near(vec3_length(vec3_sub(momentum[1], momentum[0])) / vec3_length(momentum[0]), 0.0,
                1e-5);
}

TEST(a_copied_state_continues_with_the_same_bits)
{
    FixtureOptions options = variant(5, INTEGRATOR_LEAPFROG); // a floating body
    SCOPED(fixture_destroy) Fixture single;
    create(&single, fixture_sphere, (Vec3){0.0, 0.0, 0.0}, options, PRECISION_SINGLE);
    fixture_run(&single, 37);
    apply_well(sim_apply_load, single.sim, &fixture_everywhere);
    fixture_run(&single, 3);
    FREED void *block = copy_state(&single.state);
    fixture_run(&single, 50);
    uint64_t first = state_hash(&single.state);
    state_copy_in(&single.state, block);
    fixture_run(&single, 50);
    assert_true(state_hash(&single.state) == first);
}

// What the bus and the recording get, of bodies held and floating, turned far from where they
// began.
TEST(snapshots_are_the_rounded_state_and_nothing_more)
{
    const float untouched = -77.0f;
    for (int number = 0; number < 6; number++) { // double, single; three shapes
        FixtureOptions options = variant(2 * (number / 2), INTEGRATOR_LEAPFROG);
        options.gravity = (Vec3){0.0, 0.0, -9.81};
        SCOPED(fixture_destroy) Fixture fixture;
        create(&fixture, fixture_organ, (Vec3){3.0, -2.0, 0.5}, options,
               number % 2 == 0 ? PRECISION_DOUBLE : PRECISION_SINGLE);
        LoadOptions push = fixture_everywhere;
        push.center = (Vec3){3.0, -2.0, 0.6};
        push.radius = 0.1;
        push.duration = 1.0;
        apply_well(sim_apply_load, fixture.sim, &push);
        fixture_run(&fixture, 200);
        fixture_read(&fixture);
        size_t values = 3 * (size_t)fixture.mesh.node_count;
        FREED float *out = calloc(2 * values + 2, sizeof *out);
        float *position = out, *velocity = out + values + 1;
        for (int with = 0; with < 2; with++) {
            position[values] = velocity[values] = untouched;
            fixture.body->ops->snapshot(fixture.body->model, position, with ? velocity : NULL);
            assert_true(position[values] == untouched && velocity[values] == untouched);
            for (int i = 0; i < fixture.mesh.node_count; i++)
                for (int c = 0; c < 3; c++) {
                    // Rounded once, from numbers that differ by double precision's rounding.
                    double x = (&fixture.x[i].x)[c], v = (&fixture.v[i].x)[c];
                    expect_at_most(fabs((double)position[3 * i + c] - x), 6.1e-8 * fabs(x) + 1e-14);
                    if (with)
                        expect_at_most(fabs((double)velocity[3 * i + c] - v),
                                       6.1e-8 * fabs(v) + 1e-14);
                }
        }
    }
}
