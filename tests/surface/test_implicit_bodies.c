// SPDX-License-Identifier: MIT
// Implicit bodies as wholes: momentum, extremes of stiffness and mass, what stays fixed, and that
// the same input gives the same bits.
#include "detail_bench.h"
#include "effort.h"
#include "test.h"
#include "sim_steps.h"
#include "fixture.h"
#include "random.h"

#include "geometry/generator.h"
#include "base/isa.h"
#include "surface/implicit.h"

// --- momentum ---

// A sphere that flies, spins at 10 rad/s and is shaken.
static void create_flying(Fixture *fixture, FixtureOptions *options)
{
    TriMesh mesh;
    fixture_sphere(&mesh);
    uint64_t random = 3;
    Vec3 v[114];
    for (int i = 0; i < mesh.node_count; i++) {
        v[i] = vec3_add(vec3(0.3, -0.2, 0.1), vec3_cross(vec3(6.0, 0.0, 8.0), mesh.position[i]));
        v[i] = vec3_madd(v[i], 0.1, random_vec3(&random));
    }
    options->initial_velocity = v;
    fixture_create(fixture, &mesh, options);
}

TEST(free_body_keeps_its_momentum)
{
    static const struct {
        bool frame;
        double stiffness, theta;
        int iterations; // 2: the solver gives up at once
    } cases[] = {
        {true, 0.0, 0.55, 0},  {true, 0.0, 1.0, 0},  {false, 0.0, 0.55, 0}, {true, 1e8, 0.55, 0},
        {false, 1e8, 0.55, 0}, {true, 1e8, 0.55, 2}, {false, 1e4, 1.0, 2},  {true, 1e4, 0.55, 0},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        FixtureOptions options = {
            .material = fixture_material(2e-4),
            .shape = fixture_shape(SHAPE_BODY),
            .integrator = INTEGRATOR_IMPLICIT,
            .implicit = {.theta = cases[k].theta, .iterations = cases[k].iterations},
        };
        options.shape.wanted = cases[k].frame;
        if (cases[k].stiffness > 0.0)
            options.material = (SurfaceMaterial){
                .uniform = true, .spring_stiffness = cases[k].stiffness, .node_mass = 1e-6};
        SCOPED(fixture_destroy) Fixture fixture;
        create_flying(&fixture, &options);
        fixture_read(&fixture);
        const Momentum start = fixture_momentum(&fixture);
        fixture_run(&fixture, EFFORT(1000));
        const Momentum end = fixture_momentum(&fixture);
        const double linear = vec3_length(vec3_sub(end.linear, start.linear)) /
                              vec3_length(start.linear),
                     angular = vec3_length(vec3_sub(end.angular, start.angular)) /
                               vec3_length(start.angular);
        print_message("case %zu: linear %.2g, angular %.2g\n", k, linear, angular);
        assert_int_equal(fixture.body->resets, 0);
        expect_at_most(linear, 1e-10); // what is promised; rounding of 1000 steps is 1e-13
        expect_at_most(angular, 1e-10);
    }
}

// The change of momentum is the impulse of the load, node damping aside.
TEST(load_gives_its_impulse)
{
    const LoadOptions load = {
        .center = {0.0, 0.0, 0.05}, .radius = 0.03, .force = {0.1, 0.0, -0.2}, .duration = 0.05};
    for (int shape = 0; shape < 2; shape++) {
        FixtureOptions options = {
            .material = {.uniform = true, .spring_stiffness = 1e6, .node_mass = 1e-3},
            .shape = fixture_shape(SHAPE_BODY),
            .integrator = INTEGRATOR_IMPLICIT,
            .gravity = {0.0, 0.0, -1.0},
            .load_count = 1,
            .load = &load,
        };
        options.shape.wanted = shape == 1;
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create_sphere(&fixture, &options);
        fixture_run(&fixture, 50);
        const Vec3 p = fixture_momentum(&fixture).linear;
        expect_near(p.x, 0.05 * 0.1, 1e-13); // rounding
        expect_near(p.y, 0.0, 1e-13);
        expect_near(p.z, 0.05 * (-0.2 - 114e-3), 1e-13);
    }
}

TEST(node_damping_slows_a_free_body_by_the_theta_method)
{
    FixtureOptions options = {
        .material = {.uniform = true,
                     .spring_stiffness = 1e8,
                     .node_mass = 1e-6,
                     .node_damping = 1e-4},
        .integrator = INTEGRATOR_IMPLICIT,
    };
    SCOPED(fixture_destroy) Fixture fixture;
    create_flying(&fixture, &options);
    fixture_read(&fixture);
    const Vec3 start = fixture_momentum(&fixture).linear;
    fixture_run(&fixture, 10);
    const Vec3 end = fixture_momentum(&fixture).linear;
    // v' = v - h c v / (1 + theta h c), h c = 1e-3 * 1e-4 / 1e-6.
    const double left = pow(1.0 - 0.1 / (1.0 + 0.55 * 0.1), 10);
    expect_at_most(vec3_length(vec3_sub(end, vec3_scale(left, start))), 1e-12 * vec3_length(start));
}

// --- extremes ---

// Makes one node of the body lighter or heavier.
static void scale_mass(Fixture *fixture, int node, double factor)
{
    SurfaceModel *model = fixture->body->model;
    model->mass[node] *= factor;
    double *inverse = model->nodes.inverse_mass;
    inverse[model->slot[node]] /= factor;
}

static double farthest(const Fixture *fixture)
{
    double most = 0.0;
    for (int i = 0; i < fixture->mesh.node_count; i++)
        most = fmax(most, vec3_length(vec3_sub(fixture->x[i], fixture->mesh.position[i])));
    return most;
}

// Pressed for 0.2 s, then left alone; at 1 kHz and at 100 Hz.
static void expect_return(const char *what, FixtureOptions options, double mass_factor)
{
    static const double rates[] = {1000.0, 100.0};
    for (int r = 0; r < 2; r++) {
        const bool light = options.material.uniform && options.material.node_mass < 1e-5;
        const LoadOptions load = {.center = {0.0, 0.0, 0.05},
                                  .radius = 0.02,
                                  .force = {0.0, 0.0, light ? -0.003 : -1.0},
                                  .duration = 0.2};
        options.integrator = INTEGRATOR_IMPLICIT;
        options.shape = fixture_shape(SHAPE_WORLD);
        options.shape.damping_ratio = 0.3;
        options.rate_hz = rates[r];
        options.load_count = 1;
        options.load = &load;
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create_sphere(&fixture, &options);
        if (mass_factor != 1.0)
            scale_mass(&fixture, 40, mass_factor);
        double most = 0.0;
        for (int tick = 0; tick < (int)(0.8 * rates[r]); tick++) {
            fixture_run(&fixture, 1);
            most = fmax(most, farthest(&fixture));
        }
        print_message("%s, %g Hz: up to %.3g m, then %.3g m, %lld of %lld steps stopped early\n",
                      what, rates[r], most, farthest(&fixture),
                      (long long)((SurfaceModel *)fixture.body->model)->implicit->stopped,
                      (long long)((SurfaceModel *)fixture.body->model)->implicit->steps);
        assert_int_equal(fixture.body->resets, 0);
        assert_true(fixture_is_finite(&fixture));
        // All of the load on the shape springs moves the whole by 3 mm, and a soft wall by a radius
        // or two; within 0.6 s these have swung 5 times and lost e^-9.
        expect_at_least(most, 1e-3);
        expect_at_most(most, 0.15);
        expect_at_most(farthest(&fixture), 0.005 * most + 1e-5);
    }
}

TEST(any_stiffness_is_pressed_and_returns)
{
    for (double k = 1e2; k < 2e8; k *= 1e2) {
        char what[64];
        snprintf(what, sizeof what, "%g N/m", k);
        expect_return(what,
                      (FixtureOptions){.material = {.uniform = true,
                                                    .spring_stiffness = k,
                                                    .spring_damping = 2e-4 * k,
                                                    .node_mass = 1.16e-3}},
                      1.0);
    }
}

TEST(light_nodes_on_stiff_springs_are_pressed_and_return)
{
    expect_return(
        "1e8 N/m, 1e-6 kg",
        (FixtureOptions){.material = {.uniform = true, .spring_stiffness = 1e8, .node_mass = 1e-6}},
        1.0);
}

TEST(a_node_may_be_a_million_times_lighter)
{
    expect_return("a light node", (FixtureOptions){.material = fixture_material(2e-4)}, 1e-6);
}

TEST(a_heavy_node_moves_slowly_and_nothing_breaks)
{
    FixtureOptions options = {.material = fixture_material(2e-4),
                              .shape = fixture_shape(SHAPE_WORLD),
                              .integrator = INTEGRATOR_IMPLICIT,
                              .gravity = {0.0, 0.0, -9.81}};
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    scale_mass(&fixture, 40, 1e6);
    fixture_run(&fixture, 100);
    // A thousand kilograms hang on the wall: they fall, in 0.1 s by 0.049 m; the shape springs,
    // scaled with the mass, hold back (1 - cos wt) / w^2 of it.
    const double w = 50.0, fall = 9.81 / (w * w) * (1.0 - exp(-0.1 * w * 0.1) * cos(w * 0.1));
    expect_near(fixture.x[40].z - fixture.mesh.position[40].z, -fall, 0.1 * fall);
    assert_int_equal(fixture.body->resets, 0);
}

// Flattened, inverted, thrown about in a cube of 10 R, all in one point: a soft wall, a stiff one,
// and one that nothing damps but the method.
TEST(comes_to_rest_from_any_start)
{
    for (int n = 0; n < EFFORT(12); n++) {
        const int k = 5 * n % 12, start = k % 4, wall = k / 4; // all of them, few that are alike
        TriMesh mesh;
        fixture_sphere(&mesh);
        uint64_t random = 9;
        Vec3 x[114];
        for (int i = 0; i < mesh.node_count; i++) {
            const Vec3 p = mesh.position[i];
            x[i] = start == 0   ? vec3(p.x, p.y, 0.0)
                   : start == 1 ? vec3(-p.x, p.y, p.z)
                   : start == 2 ? vec3_scale(0.5, random_vec3(&random))
                                : vec3(0.01, 0.0, 0.0);
        }
        FixtureOptions options = {.material = fixture_material(2e-4),
                                  .shape = fixture_shape(SHAPE_WORLD),
                                  .integrator = INTEGRATOR_IMPLICIT,
                                  .initial_position = x};
        options.shape.damping_ratio = 0.3;
        if (wall == 1)
            options.material = (SurfaceMaterial){.uniform = true,
                                                 .spring_stiffness = 1e6,
                                                 .spring_damping = 1e2,
                                                 .node_mass = 1.16e-3};
        if (wall == 2)
            options.material =
                (SurfaceMaterial){.uniform = true, .spring_stiffness = 1e8, .node_mass = 1e-6};
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create(&fixture, &mesh, &options);
        fixture_run(&fixture, 1500);
        BodyMeasure measure = measure_of(fixture.body);
        print_message("wall %d, start %d: %.2g m from rest, %.2g J\n", wall, start,
                      farthest(&fixture), measure.kinetic);
        assert_int_equal(fixture.body->resets, 0);
        // The soft wall comes back by its shape springs, e^-22. A stiff one may stay folded, within
        // its size; what still moves then is slow.
        if (wall == 0)
            expect_at_most(farthest(&fixture), 1e-6);
        expect_at_most(farthest(&fixture), 0.2);
        expect_at_most(measure.kinetic, wall == 1 ? 1e-4 : 1e-6);
    }
}

// --- what stays, and what is the same ---

TEST(fixed_nodes_stay_and_the_rest_comes_to_equilibrium)
{
    const FixedRegion fixed = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, -0.025}};
    FixtureOptions options = {
        .material = fixture_material(2e-4),
        .shape = {.wanted = true, .angular_frequency = 50.0, .damping_ratio = 0.5},
        .integrator = INTEGRATOR_IMPLICIT,
        .gravity = {0.0, 0.0, -9.81},
        .fixed = &fixed,
        .fixed_count = 1};
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    fixture_run(&fixture, 1500);
    SCOPED(reference_destroy) Reference reference;
    fixture_reference(&fixture, &options, &reference);
    FREED double(*a)[3] = calloc(114, sizeof *a);
    for (int i = 0; i < 114; i++) {
        const double x[3] = {fixture.x[i].x, fixture.x[i].y, fixture.x[i].z};
        memcpy(reference.x[i], x, sizeof x);
        memset(reference.v[i], 0, sizeof reference.v[i]);
        if (reference.fixed[i]) {
            expect_near(vec3_length(vec3_sub(fixture.x[i], fixture.mesh.position[i])), 0.0, 0.0);
            expect_near(vec3_length(fixture.v[i]), 0.0, 0.0);
        }
    }
    reference_accelerations(&reference, (const double(*)[3])reference.x,
                            (const double(*)[3])reference.v, a);
    // Of gravity nothing is left: what swung has lost e^-37.
    for (int i = 0; i < 114; i++)
        for (int c = 0; c < 3; c++)
            expect_near(a[i][c], 0.0, 1e-6);
}

static FixtureOptions busy_options(int kind)
{
    static const LoadOptions load = {
        .center = {0.0, 0.0, 0.05}, .radius = 0.03, .force = {0.1, 0.0, -0.3}, .duration = 0.03};
    FixtureOptions options = {.material = fixture_material(2e-3),
                              .shape = fixture_shape(kind == 1 ? SHAPE_BODY : SHAPE_WORLD),
                              .integrator = INTEGRATOR_IMPLICIT,
                              .prestress = 0.05,
                              .load_count = 1,
                              .load = &load};
    options.shape.wanted = kind != 2;
    return options;
}

TEST(state_goes_on_elsewhere_with_the_same_bits)
{
    for (int kind = 0; kind < 3; kind++) {
        FixtureOptions options = busy_options(kind);
        SCOPED(fixture_destroy) Fixture whole, rest;
        fixture_create_sphere(&whole, &options);
        fixture_create_sphere(&rest, &options);
        fixture_run(&rest, 37); // whatever it was before
        fixture_run(&whole, 20);
        FREED void *block = copy_state(&whole.state);
        resume(&rest.state, rest.sim, block);
        fixture_run(&whole, 40);
        fixture_run(&rest, 40);
        assert_true(state_hash(&rest.state) == state_hash(&whole.state));
    }
}

TEST(every_instruction_set_level_gives_the_same_bits)
{
    for (int kind = 0; kind < 3; kind++) {
        uint64_t first = 0;
        for (const char *const *isa = isa_available(); *isa != NULL; isa++) {
            FixtureOptions options = busy_options(kind);
            options.isa = *isa;
            SCOPED(fixture_destroy) Fixture fixture;
            fixture_create_sphere(&fixture, &options);
            fixture_run(&fixture, 60);
            if (first == 0)
                first = state_hash(&fixture.state);
            assert_true(state_hash(&fixture.state) == first);
        }
    }
}

// With substeps the tick only says when others look.
TEST(substeps_are_steps)
{
    for (int kind = 0; kind < 3; kind++) {
        FixtureOptions options = busy_options(kind);
        options.load_count = 0;
        options.gravity = vec3(0.3, 0.0, -1.0);
        options.time_step = 0.25e-3;
        SCOPED(fixture_destroy) Fixture slow, fast;
        fixture_create_sphere(&slow, &options);
        assert_int_equal(slow.body->substeps, 4);
        options.rate_hz = 4000.0;
        fixture_create_sphere(&fast, &options);
        assert_int_equal(fast.body->substeps, 1);
        fixture_run(&slow, 10);
        fixture_run(&fast, 40);
        for (int i = 0; i < slow.mesh.node_count; i++) {
            assert_memory_equal(&slow.x[i], &fast.x[i], sizeof slow.x[i]);
            assert_memory_equal(&slow.v[i], &fast.v[i], sizeof slow.v[i]);
        }
    }
}

// What SET scales is scaled in forces and matrix alike.
TEST(scaled_springs_are_springs_of_that_stiffness)
{
    FixtureOptions options = busy_options(0);
    options.material = (SurfaceMaterial){
        .uniform = true, .spring_stiffness = 1e5, .spring_damping = 20.0, .node_mass = 1e-3};
    SCOPED(fixture_destroy) Fixture scaled, plain;
    fixture_create_sphere(&scaled, &options);
    const BodyOps *ops = scaled.body->ops;
    assert_true(ops->set(scaled.body->model, BODY_STIFFNESS_SCALE, 4.0));
    assert_true(ops->set(scaled.body->model, BODY_DAMPING_SCALE, 0.5));
    options.material.spring_stiffness *= 4.0;
    options.material.spring_damping *= 2.0;
    fixture_create_sphere(&plain, &options);
    fixture_run(&scaled, 50);
    fixture_run(&plain, 50);
    for (int i = 0; i < plain.mesh.node_count; i++) // powers of two: not even rounding differs
        assert_memory_equal(&scaled.x[i], &plain.x[i], sizeof plain.x[i]);
}

// --- the choice ---

TEST(automatic_body_is_implicit_where_leapfrog_takes_too_many_substeps)
{
    int explicit_most = 0, limit = 0;
    bool was_implicit = false;
    for (double k = 1e2; k < 2e8; k *= 10.0) {
        FixtureOptions options = {
            .material = {.uniform = true, .spring_stiffness = k, .node_mass = 1e-3}};
        options.automatic = true;
        options.shape = fixture_shape(SHAPE_WORLD);
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create_sphere(&fixture, &options);
        const bool implicit = fixture.body->integrator == INTEGRATOR_IMPLICIT;
        if (!implicit) {
            assert_int_equal(fixture.body->integrator, INTEGRATOR_LEAPFROG);
            assert_false(was_implicit);
            explicit_most = fixture.body->substeps;
        } else {
            assert_int_equal(fixture.body->substeps, 1);
        }
        was_implicit = implicit;
        limit = fixture.body->auto_substeps;
    }
    assert_true(was_implicit);
    assert_true(explicit_most <= limit && explicit_most > limit / 4);
}

// `leapfrog_substeps` of the stiff wall in tests/bench/results.tsv, measured on another day, with
// other programs running: within a third and a half of the estimate there.
TEST(automatic_choice_crosses_where_the_bench_does)
{
    static const struct {
        int nodes;
        double measured;
    } bench[] = {{114, 25.7}, {642, 59.3}, {2562, 114.4}};
    for (int i = 0; i < 3; i++) {
        const int springs = 3 * bench[i].nodes - 6; // of a closed mesh without holes
        const double found = surface_auto_substeps(springs, bench[i].nodes, 0);
        print_message("%d nodes: %g substeps, measured %g\n", bench[i].nodes, found,
                      bench[i].measured);
        expect_at_most(found, 1.4 * bench[i].measured);
        expect_at_least(found, bench[i].measured / 1.4);
    }
    // A solver that stops earlier is cheaper.
    assert_true(surface_auto_substeps(30000, 10000, 5) < surface_auto_substeps(30000, 10000, 50));
}

TEST(refusal_of_too_many_substeps_names_the_bound_and_the_way_out)
{
    FixtureOptions options = {
        .material = {.uniform = true, .spring_stiffness = 1e8, .node_mass = 1e-12},
        .integrator = INTEGRATOR_LEAPFROG};
    fixture_expect_refusal(&options, "stability bound of leapfrog is ");
    fixture_expect_refusal(&options, "integrator = \"implicit\" or \"auto\"");
}
