// SPDX-License-Identifier: MIT
// The time step of a body whose bounds change with its topology, and what can be set on it.
#include "test.h"
#include "sim_steps.h"
#include "sim/time_step.h"
#include "body/integrator.h"
#include "toy_body.h"

static const double RATE = 100.0; // [Hz]: several substeps at every level

static const ToolOptions ball = {PROBE(0.005, 3.3)};

static ToySceneOptions options_with(double time_step, bool unsafe)
{
    return (ToySceneOptions){.cells = 4,
                             .cell = 0.01,
                             .lockstep = true,
                             .rate_hz = RATE,
                             .time_step = time_step,
                             .unsafe_time_step = unsafe,
                             .may_load = true};
}

// Of symplectic Euler, as integrator.h states it: times 4 where anything is split; the ball adds
// its contact, a = 0.5 of the coarse body's stiffness, 1.65 times since it has no damping
// (contact_create.c).
static double limit_of(bool split, bool touched, double stiffness_scale, double damping_scale)
{
    double times = split ? 4.0 : 1.0;
    double lambda = times * TOY_LAMBDA * fmax(1.0, stiffness_scale);
    double c = times * TOY_DAMPING * fmax(1.0, stiffness_scale * damping_scale);
    lambda += touched ? 1.65 * 0.5 * TOY_LAMBDA : 0.0;
    return 0.9 * (sqrt(c * c + 4.0 * lambda) - c) / lambda;
}

static void expect_step(const ToyScene *scene, double step)
{
    const Body *body = scene->body[0];
    int substeps = (int)ceil(1.0 / (RATE * step));
    assert_int_equal(body->substeps, substeps);
    expect_near(body->h, 1.0 / RATE / substeps, 1e-16); // rounding
}

static void split(ToyScene *scene, bool wanted)
{
    toy_want_all(scene->toy[0], wanted);
    toy_scene_step(scene);
}

TEST(step_follows_the_bounds_of_the_present_level)
{
    for (int touched = 0; touched < 2; touched++) {
        ToySceneOptions options = options_with(0.0, false);
        options.tool = &ball;
        options.tool_count = touched;
        SCOPED(toy_scene_destroy) ToyScene scene;
        toy_scene_create(&scene, &options);
        for (int k = 0; k < 4; k++) {
            bool fine = k % 2 == 1;
            split(&scene, fine);
            // The same formula, rounded differently.
            double limit = limit_of(fine, touched, 1.0, 1.0);
            expect_near(scene.body[0]->time_step_limit, limit, 1e-12 * limit);
            expect_step(&scene, limit);
        }
        // The two levels do differ.
        assert_true(limit_of(true, touched, 1.0, 1.0) < 0.7 * limit_of(false, touched, 1.0, 1.0));
    }
}

// Within the finest level's bound it stays; beyond it is refused at load, when it still can be.
TEST(wanted_step_holds_at_every_level_or_is_refused_at_load)
{
    double fine = limit_of(true, false, 1.0, 1.0);
    ToySceneOptions options = options_with(0.4 * fine, false);
    ToyScene scene;
    toy_scene_create(&scene, &options);
    for (int k = 0; k < 4; k++) {
        expect_step(&scene, 0.4 * fine);
        split(&scene, k % 2 == 0);
    }
    toy_scene_destroy(&scene);

    options = options_with(1.6 * fine, false); // fit for the coarse level
    assert_true(1.6 * fine < limit_of(false, false, 1.0, 1.0));
    Status status = {0};
    assert_false(toy_scene_try(&scene, &options, &status));
    assert_non_null(strstr(status.text, "at the finest level"));
    toy_scene_destroy(&scene);
}

TEST(unsafe_step_stays_as_wanted)
{
    double step = 2.0 * limit_of(false, false, 1.0, 1.0);
    ToySceneOptions options = options_with(step, true);
    SCOPED(toy_scene_destroy) ToyScene scene;
    toy_scene_create(&scene, &options);
    for (int k = 0; k < 3; k++) {
        expect_step(&scene, step);
        split(&scene, k % 2 == 0);
    }
}

// A body that came to be stiffer than was known at load: the bound wins over the scene's step, and
// a tick never takes more than 100000 substeps.
TEST(bound_wins_over_the_wanted_step)
{
    double fine = limit_of(true, false, 1.0, 1.0);
    ToySceneOptions options = options_with(0.9 * fine, false);
    SCOPED(toy_scene_destroy) ToyScene scene;
    toy_scene_create(&scene, &options);
    Body *body = scene.body[0];
    body->lambda = 1e9;
    time_step_follow(scene.sim, body);
    double limit = stability_time_step(INTEGRATOR_SYMPLECTIC_EULER, 1e9, TOY_DAMPING);
    expect_step(&scene, limit);
    expect_near(body->time_step_limit, limit, 0.0);
    body->lambda = 1e30;
    time_step_follow(scene.sim, body);
    assert_int_equal(body->substeps, 100000);
}

// The answer to SET does not depend on the level of the moment: what the finest level does not
// allow is refused at any, and what is granted enters the step at once.
TEST(scales_enter_the_step_at_every_level)
{
    double fine = limit_of(true, false, 1.0, 1.0);
    for (int now = 0; now < 2; now++) {
        ToySceneOptions options = options_with(0.4 * fine, false);
        SCOPED(toy_scene_destroy) ToyScene scene;
        toy_scene_create(&scene, &options);
        split(&scene, now == 1);
        char why[256];
        // 1/0.4 of the step, squared: 6.25; damping takes a little.
        apply_well(sim_apply_set, scene.sim, "stiffness_scale", 4.0);
        assert_false(sim_apply_set(scene.sim, "wall.stiffness_scale", 7.0, why, sizeof why));
        assert_non_null(strstr(why, "time step"));
        expect_near(scene.body[0]->tuning.stiffness_scale, 4.0, 0.0);
        double limit = limit_of(now == 1, false, 4.0, 1.0);
        expect_near(scene.body[0]->time_step_limit, limit, 1e-12 * limit);
        expect_step(&scene, 0.4 * fine);
    }
    // Without a step of the scene's, the finest level has no room for more than its own stiffness.
    ToySceneOptions options = options_with(0.0, false);
    SCOPED(toy_scene_destroy) ToyScene scene;
    toy_scene_create(&scene, &options);
    char why[256];
    assert_false(sim_apply_set(scene.sim, "stiffness_scale", 3.0, why, sizeof why));
}

TEST(bodies_are_asked_after_loads_and_before_contacts)
{
    ToySceneOptions options = options_with(0.0, false);
    options.tool = &ball;
    options.tool_count = 1;
    SCOPED(toy_scene_destroy) ToyScene scene;
    toy_scene_create(&scene, &options);
    const StageId expected[] = {STAGE_INPUTS,        STAGE_TOOLS,   STAGE_LOADS,   STAGE_ADAPT,
                                STAGE_FIND_CONTACTS, STAGE_FORCES,  STAGE_CONTACT, STAGE_WRENCHES,
                                STAGE_CHECK,         STAGE_SNAPSHOT};
    assert_int_equal(sim_stage_count(scene.sim), 10);
    for (int k = 0; k < 10; k++)
        assert_int_equal(sim_stage(scene.sim, k), expected[k]);
    assert_string_equal(stage_name(STAGE_ADAPT), "adapt");
    assert_string_equal(stage_name(STAGE_SNAPSHOT), "snapshot");
}

TEST(thresholds_are_set_on_one_body_or_all)
{
    static const struct {
        const char *key;
        BodyParameter parameter;
    } keys[] = {{"adapt_force", BODY_ADAPT_FORCE},
                {"adapt_speed", BODY_ADAPT_SPEED},
                {"adapt_curvature", BODY_ADAPT_CURVATURE},
                {"adapt_scale", BODY_ADAPT_SCALE},
                {"adapt_level", BODY_ADAPT_LEVEL}};
    ToySceneOptions options = options_with(0.0, false);
    options.count = 2;
    SCOPED(toy_scene_destroy) ToyScene scene;
    toy_scene_create(&scene, &options);
    char why[256], key[64];
    for (int k = 0; k < 5; k++) {
        apply_well(sim_apply_set, scene.sim, keys[k].key, 3.0);
        snprintf(key, sizeof key, "twin.%s", keys[k].key);
        apply_well(sim_apply_set, scene.sim, key, 5.0);
        expect_near(scene.toy[0]->parameter[keys[k].parameter], 3.0, 0.0);
        expect_near(scene.toy[1]->parameter[keys[k].parameter], 5.0, 0.0);
        assert_false(sim_apply_set(scene.sim, keys[k].key, -1.0, why, sizeof why));
        assert_false(sim_apply_set(scene.sim, keys[k].key, (double)NAN, why, sizeof why));
        assert_false(sim_apply_set(scene.sim, key, 2e9, why, sizeof why));
    }
    assert_false(sim_apply_set(scene.sim, "adapt_level", 1.5, why, sizeof why));
    assert_non_null(strstr(why, "whole number"));
    assert_false(sim_apply_set(scene.sim, "adapt_level", 9.0, why, sizeof why));
    expect_near(scene.toy[1]->parameter[BODY_ADAPT_LEVEL], 5.0, 0.0);
}

// A surface body with levels does not know its finest one: SET was refused wherever it was refined,
// even to a scale below 1.
TEST(a_refined_body_takes_the_scales_that_its_steps_allow)
{
    ToySceneOptions options = options_with(0.0, false);
    SCOPED(toy_scene_destroy) ToyScene scene;
    toy_scene_create(&scene, &options);
    Body *body = scene.body[0];
    body->finest_lambda = body->finest_damping = 0.0;
    body->finest_substeps = body->substeps;
    split(&scene, true);
    assert_true(body->substeps > body->finest_substeps);
    char why[256];
    apply_well(sim_apply_set, scene.sim, "wall.stiffness_scale", 0.5);
    apply_well(sim_apply_set, scene.sim, "stiffness_scale", 1.0);
    assert_false(sim_apply_set(scene.sim, "stiffness_scale", 3.0, why, sizeof why));
}

// What SET does afterwards is the measure of what a try says; rates differ in how much room
// substeps leave.
TEST(a_try_tells_the_substeps_that_set_takes_and_changes_nothing)
{
    int changed = 0;
    for (int rate = 20; rate < 140; rate++) {
        ToySceneOptions options = options_with(0.0, false);
        options.rate_hz = rate;
        SCOPED(toy_scene_destroy) ToyScene scene;
        toy_scene_create(&scene, &options);
        const Body *body = scene.body[0], before = *body;
        char text[256], set[256];
        double longer;
        assert_true(sim_tell_setting(scene.sim, "wall.stiffness_scale", text, sizeof text));
        const double most = strtod(strstr(text, " to ") + strlen(" to "), NULL);
        const uint64_t hash = state_hash(&scene.state);
        assert_true(
            sim_try_set(scene.sim, "wall.stiffness_scale", most, &longer, text, sizeof text));
        assert_true(state_hash(&scene.state) == hash);
        assert_memory_equal(body, &before, sizeof before);
        assert_true(sim_apply_set(scene.sim, "wall.stiffness_scale", most, set, sizeof set));
        assert_int_equal(atoi(strstr(text, ": ") + strlen(": ")), body->substeps);
        if (body->substeps != before.substeps) {
            const char *instead = strstr(strstr(text, ": "), "instead of ");
            assert_int_equal(atoi(instead + strlen("instead of ")), before.substeps);
            assert_true(longer > 1.0); // substeps have a price of their own
            changed++;
        } else {
            assert_non_null(strstr(text, "as now"));
            expect_near(longer, 1.0, 0.0);
        }
        // A refusal is the same sentence.
        assert_false(sim_try_set(scene.sim, "stiffness_scale", 3.0, &longer, text, sizeof text));
        assert_false(sim_apply_set(scene.sim, "stiffness_scale", 3.0, set, sizeof set));
        assert_string_equal(text, set);
    }
    assert_true(changed > 0);
}
