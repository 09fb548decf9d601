// SPDX-License-Identifier: MIT
// SET: what it changes while a scene runs, and what it refuses.
#include "test.h"
#include "sim_steps.h"
#include "fixture.h"

TEST(set_changes_what_it_names)
{
    FixtureOptions options = fixture_loadable();
    options.shape.wanted = false;
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    char why[256];
    apply_well(sim_apply_set, fixture.sim, "gravity_x", 2.0);
    apply_well(sim_apply_set, fixture.sim, "gravity_y", -1.0);
    apply_well(sim_apply_set, fixture.sim, "gravity_z", 0.5);
    fixture_run(&fixture, 1);
    expect_near(fixture.v[4].x, 2e-3, 1e-15); // rounding
    expect_near(fixture.v[4].y, -1e-3, 1e-15);
    expect_near(fixture.v[4].z, 0.5e-3, 1e-15);
    apply_well(sim_apply_set, fixture.sim, "body.friction", 0.3);
    expect_near(fixture.body->tuning.friction, 0.3, 0.0);
    apply_well(sim_apply_set, fixture.sim, "friction", 0.4); // of every body
    expect_near(fixture.body->tuning.friction, 0.4, 0.0);
    assert_false(sim_apply_gravity(fixture.sim, (Vec3){0.0, (double)NAN, 0.0}, why, sizeof why));
}

// First kick of one displaced node, which springs alone pull [m/s].
static double first_kick(const char *key, double value)
{
    TriMesh mesh;
    fixture_sphere(&mesh);
    FREED Vec3 *x = malloc((size_t)mesh.node_count * sizeof *x);
    FREED Vec3 *v = calloc((size_t)mesh.node_count, sizeof *v);
    memcpy(x, mesh.position, (size_t)mesh.node_count * sizeof *x);
    x[9].z += 0.002;
    if (strcmp(key, "body.damping_scale") == 0) {
        x[9] = mesh.position[9]; // the dampers alone
        v[9].z = 0.1;
    }
    FixtureOptions options = fixture_loadable();
    options.shape.wanted = false;
    options.rate_hz = 1e5;
    options.initial_position = x;
    options.initial_velocity = v;
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create(&fixture, &mesh, &options);
    apply_well(sim_apply_set, fixture.sim, key, value);
    fixture_run(&fixture, 1);
    double kick = fixture.v[9].z - v[9].z;
    return kick;
}

TEST(scales_multiply_stiffness_and_damping)
{
    double whole = first_kick("body.stiffness_scale", 1.0);
    expect_at_least(fabs(whole), 1e-6);
    expect_near(first_kick("body.stiffness_scale", 0.25), 0.25 * whole, 1e-12 * fabs(whole));
    expect_near(first_kick("body.stiffness_scale", 4.0), 4.0 * whole, 1e-12 * fabs(whole));
    whole = first_kick("body.damping_scale", 1.0);
    expect_at_least(fabs(whole), 1e-6);
    // The kick is the difference of velocities near 0.1 m/s: rounded to 1e-17 m/s.
    expect_near(first_kick("body.damping_scale", 3.0), 3.0 * whole, 1e-15);
    expect_near(first_kick("body.damping_scale", 0.0), 0.0, 1e-15);
}

TEST(set_beyond_the_bound_or_the_range_is_refused)
{
    static const struct {
        const char *key;
        double value;
        const char *says;
    } cases[] = {
        {"body.stiffness_scale", 1e4, "time step"},
        {"body.damping_scale", 1e5, "time step"},
        {"body.stiffness_scale", -1.0, "outside [0, 1e6]"},
        {"body.stiffness_scale", (double)NAN, "outside"},
        {"body.damping_scale", 2e6, "outside"},
        {"body.friction", -0.1, "outside [0, 10]"},
        {"body.friction", (double)NAN, "outside"},
        {"gravity_x", 2e4, "outside [-1e4, 1e4]"},
        {"gravity_z", (double)INFINITY, "outside"},
        {"gravity_w", 1.0, "unknown key gravity_w"},
        {"", 1.0, "unknown key"},
        {"body", 1.0, "unknown key body"},
        {"body.", 1.0, "unknown key"},
        {"body.mass", 1.0, "unknown key mass"},
        {"bodyx.friction", 1.0, "unknown key bodyx.friction: the scene has no body bodyx"},
        {"adapt_force", 1.0, "the scene has no wall that adapts"},
        {"body.adapt_level", 1.0, "body body does not adapt"},
    };
    FixtureOptions options = fixture_loadable();
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    uint64_t before = state_hash(&fixture.state);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char why[256] = "";
        assert_false(sim_apply_set(fixture.sim, cases[k].key, cases[k].value, why, sizeof why));
        if (strstr(why, cases[k].says) == NULL)
            print_error("%s %g: %s\n", cases[k].key, cases[k].value, why);
        assert_non_null(strstr(why, cases[k].says));
        assert_true(state_hash(&fixture.state) == before);
    }
}

TEST(a_try_changes_no_bit_and_a_setting_is_told_as_it_is)
{
    static const struct {
        const char *key;
        double value;
        const char *says; // of the value, then of the key alone
        const char *is;
    } cases[] = {
        {"body.stiffness_scale", 0.5,
         "body.stiffness_scale = 0.5 instead of 1: ", "body.stiffness_scale = 1, from 0 to "},
        {"body.stiffness_scale", 1e4, "time step", "from 0 to "},
        {"body.damping_scale", 2e6, "outside", "body.damping_scale = 1, from 0 to "},
        {"friction", 0.7, "friction = 0.7 instead of ", ", from 0 to 10"},
        {"gravity_x", 3.0, "gravity_x = 3 instead of 0", "gravity_x = 0, from -1e+04 to 1e+04"},
        {"body.adapt_level", 1.0, "body body does not adapt", "does not adapt"},
        {"body.pressure", 1.0, "body body has no closed cavity", "has no closed cavity"},
        {"nothing", 1.0, "unknown key nothing", "unknown key nothing"},
    };
    FixtureOptions options = fixture_loadable();
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    const Body before = *fixture.body;
    const uint64_t hash = state_hash(&fixture.state);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char why[256] = "", is[256] = "";
        double longer;
        sim_try_set(fixture.sim, cases[k].key, cases[k].value, &longer, why, sizeof why);
        sim_tell_setting(fixture.sim, cases[k].key, is, sizeof is);
        if (strstr(why, cases[k].says) == NULL || strstr(is, cases[k].is) == NULL)
            print_error("%s %g: %s; %s\n", cases[k].key, cases[k].value, why, is);
        assert_non_null(strstr(why, cases[k].says));
        assert_non_null(strstr(is, cases[k].is));
        assert_true(state_hash(&fixture.state) == hash);
        assert_memory_equal(fixture.body, &before, sizeof before);
    }
    char list[256];
    sim_list_settings(fixture.sim, 0, list, sizeof list);
    assert_string_equal(list, "stiffness_scale, damping_scale, friction");
}

TEST(damping_of_an_undamped_body_cannot_be_scaled)
{
    FixtureOptions options = fixture_loadable();
    options.material.damping_time = 0.0;
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    uint64_t before = state_hash(&fixture.state);
    char why[256] = "";
    assert_false(sim_apply_set(fixture.sim, "body.damping_scale", 0.5, why, sizeof why));
    assert_non_null(strstr(why, "no such parameter"));
    assert_true(state_hash(&fixture.state) == before);
}

TEST(unsafe_body_takes_any_scale_in_range)
{
    FixtureOptions options = fixture_loadable();
    options.unsafe_time_step = true;
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    apply_well(sim_apply_set, fixture.sim, "body.stiffness_scale", 1e5);
    apply_well(sim_apply_load, fixture.sim, &fixture_everywhere);
    for (int tick = 0; tick < 200; tick++) {
        fixture_run(&fixture, 1);
        assert_true(fixture_is_finite(&fixture));
    }
    assert_true(sim_resets(fixture.sim) > 0);
}
