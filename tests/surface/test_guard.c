// SPDX-License-Identifier: MIT
// The guard at the end of a tick: what is restored and how much of it, who is blamed, told and
// withdrawn, and that no number leaves unchecked. Bodies are made bad by loads that no scene may
// have, or by making what tools push with a thousand quadrillion times larger.
#include "test.h"
#include "sim_steps.h"
#include "fixture.h"
#include "surface_state.h"

#include "sim/guard/guard.h"

static const ToolOptions probe = {.id = 7,
                                  .kind = TOOL_PROBE,
                                  .capsule_count = 1,
                                  .capsule = {{.radius = 0.01}},
                                  .max_force = 5.0};
static const ToolOptions table = {.id = 9,
                                  .kind = TOOL_STATIC,
                                  .has_plane = true,
                                  .plane = {{0.0, 0.0, -0.048}, {0.0, 0.0, 1.0}},
                                  .max_force = 5.0};
static const LoadOptions huge = {.center = {0.0, 0.0, 0.05},
                                 .radius = 0.02,
                                 .force = {1e30, 0.0, 0.0},
                                 .duration = 10.0,
                                 .sender = 41,
                                 .id = 3};
static const LoadOptions soft = {
    .center = {0.0, 0.0, -0.05}, .radius = 0.02, .force = {0.0, 0.0, 0.01}, .duration = 10.0};

static void apply(Fixture *fixture, const LoadOptions *load)
{
    apply_well(sim_apply_load, fixture->sim, load);
}

static int64_t loads_in_force(const Fixture *fixture)
{
    return *fixture->sim->loads.count;
}

static bool next_event(Fixture *fixture, const char *kind, SimEvent *event)
{
    while (sim_take_event(fixture->sim, event))
        if (strcmp(event->kind, kind) == 0)
            return true;
    return false;
}

static bool is_same(const Vec3 *a, const Vec3 *b, int count)
{
    return memcmp(a, b, (size_t)count * sizeof *a) == 0;
}

// While `spoilt` counts down, what pushes the body pushes it beyond all bounds.
static BodyOps spoiling;
static const BodyOps *honest;
static int spoilt;

static void add_spoilt_forces(void *model, const int *node, int count, const Vec3 *force)
{
    Vec3 much[256];
    assert_in_range(count, 0, 256);
    for (int i = 0; i < count; i++)
        much[i] = vec3_scale(spoilt > 0 ? 1e30 : 1.0, force[i]);
    honest->add_forces(model, node, count, much);
}

static void spoil(Fixture *fixture)
{
    honest = fixture->body->ops;
    spoiling = *honest;
    spoiling.add_forces = add_spoilt_forces;
    fixture->body->ops = &spoiling;
    spoilt = 0;
}

// Without anything that acts.
static bool refuse(void *model)
{
    honest->commit(model);
    return spoilt-- <= 0;
}

static void spoil_motion(Fixture *fixture)
{
    spoil(fixture);
    spoiling.commit = refuse;
    spoilt = 1;
}

// ---------------------------------------------------------------------------------------------
// What is restored

TEST(a_bad_tick_gives_places_and_velocities_back)
{
    for (int precision = 0; precision < 2; precision++)
        for (int kind = 0; kind < INTEGRATOR_COUNT; kind++) {
            FixtureOptions options = fixture_loadable();
            options.integrator = (IntegratorKind)kind;
            options.precision = (Precision)precision;
            SCOPED(fixture_destroy) Fixture fixture;
            fixture_create_sphere(&fixture, &options);
            const int count = fixture.mesh.node_count;
            apply(&fixture, &soft);
            fixture_run(&fixture, 20);
            FREED Vec3 *x = malloc((size_t)count * sizeof *x),
                       *v = malloc((size_t)count * sizeof *v);
            memcpy(x, fixture.x, (size_t)count * sizeof *x);
            memcpy(v, fixture.v, (size_t)count * sizeof *v);
            LoadOptions blow = huge;
            blow.duration = 1e-3;
            apply(&fixture, &blow);
            fixture_run(&fixture, 1);
            assert_int_equal(sim_resets(fixture.sim), 1);
            assert_true(is_same(x, fixture.x, count));
            assert_true(is_same(v, fixture.v, count));
            double fastest = 0.0;
            for (int i = 0; i < count; i++)
                fastest = fmax(fastest, vec3_length(v[i]));
            assert_true(fastest > 1e-4); // it did move
            fixture_run(&fixture, 100);
            assert_int_equal(sim_resets(fixture.sim), 1);
            assert_true(fixture_is_finite(&fixture));
        }
}

TEST(bad_ticks_with_good_ones_between_lead_to_the_rest_shape_too)
{
    FixtureOptions options = fixture_loadable();
    Vec3 initial[114];
    SCOPED(mesh_destroy) TriMesh mesh;
    fixture_sphere(&mesh);
    assert_int_equal(mesh.node_count, 114);
    for (int i = 0; i < 114; i++)
        initial[i] = vec3_scale(1.05, mesh.position[i]);
    options.initial_position = initial;
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    LoadOptions blow = huge;
    blow.duration = 1e-3;
    for (int k = 0; k < GUARD_BAD_TICKS; k++) {
        assert_int_equal(sim_guard_counts(fixture.sim)->rest_shapes, 0);
        apply(&fixture, &blow);
        fixture_run(&fixture, 2);
        assert_int_equal(sim_resets(fixture.sim), k + 1);
    }
    assert_int_equal(sim_guard_counts(fixture.sim)->rest_shapes, 1);
    BodyMeasure measure;
    sim_measure(fixture.sim, 0, &measure);
    expect_at_most(measure.max_displacement, 1e-15); // a tick's rounding
}

TEST(a_floating_body_that_has_flown_away_comes_back_in_its_rest_shape)
{
    FixtureOptions options = fixture_loadable();
    options.precision = PRECISION_SINGLE;
    options.shape = (SurfaceShape){0};
    Vec3 velocity[114];
    for (int i = 0; i < 114; i++)
        velocity[i] = (Vec3){1e7, 0.0, 0.0};
    options.initial_velocity = velocity;
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    for (int tick = 0; tick < 200; tick++) {
        fixture_run(&fixture, 1);
        // 1e6 times its size, and the way of the ticks that the frame may be behind (FOLLOW_LEAST)
        // and of this one.
        expect_at_most(fabs(fixture.x[0].x), 0.051e6 + 6e4);
    }
    assert_true(sim_guard_counts(fixture.sim)->rest_shapes > 0);
    expect_near(fixture.x[0].x, fixture.mesh.position[0].x, 1e-12); // nothing moves it there
}

// ---------------------------------------------------------------------------------------------
// Loads

// It flies for some ticks before it is out of bounds. What was pushed as long, but has come to rest
// since, has no known cause: here numbers are made bad by hand.
TEST(a_load_that_has_ended_is_the_cause_as_long_as_its_energy_lasts)
{
    FixtureOptions options = fixture_loadable();
    options.shape = (SurfaceShape){0};
    Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    LoadOptions blow = {.radius = 1.0,
                        .force = {1e10 * fixture.body->mass, 0.0, 0.0}, // 1e7 m/s after a tick
                        .duration = 1e-3};
    apply(&fixture, &blow);
    fixture_run(&fixture, 200);
    const GuardCounts *counts = sim_guard_counts(fixture.sim);
    assert_true(sim_resets(fixture.sim) > 0);
    assert_int_equal(counts->restored[GUARD_LOAD], sim_resets(fixture.sim));
    assert_int_equal(counts->loads, 0);
    SimEvent event;
    assert_true(next_event(&fixture, "restored", &event));
    assert_non_null(strstr(event.text, "N that ended 0.0"));
    fixture_destroy(&fixture);

    options = fixture_loadable();
    fixture_create_sphere(&fixture, &options);
    LoadOptions push = soft;
    push.duration = 1e-3;
    apply(&fixture, &push);
    fixture_run(&fixture, 20);
    spoil_motion(&fixture);
    fixture_run(&fixture, 1);
    assert_int_equal(sim_guard_counts(fixture.sim)->restored[GUARD_UNKNOWN], 1);
    fixture_destroy(&fixture);
}

TEST(a_load_that_keeps_making_numbers_bad_is_ended_and_leaves_no_trace)
{
    SCOPED(fixture_destroy) Fixture fixture, calm;
    FixtureOptions options = fixture_loadable();
    fixture_create_sphere(&fixture, &options);
    fixture_create_sphere(&calm, &options);
    apply(&fixture, &huge);
    fixture_run(&fixture, GUARD_MOST_BLAME - 1);
    assert_int_equal(loads_in_force(&fixture), 1);
    fixture_run(&fixture, 1);
    assert_int_equal(loads_in_force(&fixture), 0);
    const GuardCounts *counts = sim_guard_counts(fixture.sim);
    assert_int_equal(counts->loads, 1);
    assert_int_equal(counts->tools, 0);
    assert_int_equal(counts->restored[GUARD_LOAD], GUARD_MOST_BLAME);
    assert_int_equal(sim_resets(fixture.sim), GUARD_MOST_BLAME);
    SimEvent event;
    assert_true(next_event(&fixture, "restored", &event));
    assert_non_null(strstr(event.text, "load 3 of sender 41"));
    assert_int_equal(event.body, 0);
    assert_true(next_event(&fixture, "withdrawn", &event));
    assert_non_null(strstr(event.text, "load 3 of sender 41"));
    assert_false(next_event(&fixture, "restored", &event)); // one word of the three
    // Nothing else acted: the body is where it always was, and what acts later acts as ever.
    fixture_run(&calm, GUARD_MOST_BLAME);
    apply(&fixture, &soft);
    apply(&calm, &soft);
    fixture_run(&fixture, 50);
    fixture_run(&calm, 50);
    assert_int_equal(sim_resets(fixture.sim), GUARD_MOST_BLAME);
    for (int i = 0; i < calm.mesh.node_count; i++) // the rounding of three ticks was stopped
        expect_at_most(vec3_length(vec3_sub(fixture.x[i], calm.x[i])), 1e-15);
}

TEST(a_body_that_a_withdrawn_load_has_torn_away_goes_back_to_its_rest_shape)
{
    FixtureOptions options = fixture_loadable();
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    LoadOptions strong = huge;
    strong.force = (Vec3){1e7, 0.0, 0.0}; // to a balance some 1e5 m away
    apply(&fixture, &strong);
    for (int tick = 0; tick < 500 && loads_in_force(&fixture) > 0; tick++)
        fixture_run(&fixture, 1);
    assert_int_equal(loads_in_force(&fixture), 0);
    assert_int_equal(sim_guard_counts(fixture.sim)->rest_shapes, 1);
    BodyMeasure measure;
    sim_measure(fixture.sim, 0, &measure);
    expect_at_most(measure.max_displacement, 0.0);
}

TEST(the_strongest_load_is_withdrawn_and_the_others_stay)
{
    FixtureOptions options = fixture_loadable();
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    apply(&fixture, &soft);
    apply(&fixture, &huge);
    apply(&fixture, &soft);
    fixture_run(&fixture, GUARD_MOST_BLAME);
    assert_int_equal(loads_in_force(&fixture), 2);
    for (int k = 0; k < 2; k++)
        expect_near(vec3_length(fixture.sim->loads.load[k].force), 0.01, 0.0);
}

TEST(blame_that_is_spread_over_more_than_the_window_withdraws_nothing)
{
    FixtureOptions options = fixture_loadable();
    options.tool_count = 1;
    options.tool = &table;
    options.gravity = (Vec3){0.0, 0.0, -1.0};
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    LoadOptions blow = huge;
    blow.duration = 1e-3;
    for (int k = 0; k < 4; k++) {
        apply(&fixture, &blow);
        fixture_run(&fixture, 600);
        assert_int_equal(sim_resets(fixture.sim), k + 1);
    }
    assert_int_equal(sim_guard_counts(fixture.sim)->loads, 0);
    assert_int_equal(sim_guard_counts(fixture.sim)->rest_shapes, 0);
}

// ---------------------------------------------------------------------------------------------
// Tools

static void put_probe(Fixture *fixture, bool active)
{
    const ToolPose pose = {.utime = 1,
                           .position = {0.0, 0.0, 0.058},
                           .orientation = {1.0, 0.0, 0.0, 0.0},
                           .active = active};
    sim_apply_pose(fixture->sim, 0, &pose, false);
}

static void create_probed(Fixture *fixture)
{
    FixtureOptions options = fixture_loadable();
    options.tool_count = 1;
    options.tool = &probe;
    fixture_create_sphere(fixture, &options);
    spoil(fixture);
}

static void expect_no_wrench(const Fixture *fixture)
{
    const ToolWrench *wrench = sim_wrench(fixture->sim, 0);
    assert_false(wrench->contact);
    expect_near(vec3_length(wrench->force), 0.0, 0.0);
    assert_true(vec3_finite(wrench->position) && vec3_finite(wrench->torque));
}

// Presses until the tool is withdrawn.
static void press_too_hard(Fixture *fixture)
{
    put_probe(fixture, true);
    fixture_run(fixture, 5);
    assert_true(sim_wrench(fixture->sim, 0)->contact);
    assert_true(sim_wrench(fixture->sim, 0)->force.z > 0.0);
    const int64_t before = sim_resets(fixture->sim);
    spoilt = 1;
    for (int tick = 0; tick < 2 * GUARD_MOST_BLAME; tick++) {
        assert_false(sim_tool_withdrawn(fixture->sim, 0) && tick < GUARD_MOST_BLAME);
        put_probe(fixture, true);
        fixture_run(fixture, 1);
        // In contact as a tool that is led out of the wall, but without force.
        expect_near(vec3_length(sim_wrench(fixture->sim, 0)->force), 0.0, 0.0);
        assert_true(fixture_is_finite(fixture));
    }
    spoilt = 0;
    assert_true(sim_tool_withdrawn(fixture->sim, 0));
    assert_int_equal(sim_guard_counts(fixture->sim)->tools, 1);
    assert_int_equal(sim_resets(fixture->sim), before + GUARD_MOST_BLAME);
}

TEST(a_tool_that_keeps_making_numbers_bad_is_withdrawn_until_let_go)
{
    SCOPED(fixture_destroy) Fixture fixture;
    create_probed(&fixture);
    press_too_hard(&fixture);
    SimEvent event;
    assert_true(next_event(&fixture, "restored", &event));
    assert_non_null(strstr(event.text, "tool 7 in contact at ("));
    assert_true(next_event(&fixture, "withdrawn", &event));
    assert_non_null(strstr(event.text, "tool 7"));
    for (int tick = 0; tick < 500; tick++) { // its sender goes on pushing
        put_probe(&fixture, true);
        fixture_run(&fixture, 1);
        assert_false(sim_tool_motion(fixture.sim, 0)->active);
        expect_no_wrench(&fixture);
    }
    put_probe(&fixture, false);
    assert_false(sim_tool_withdrawn(fixture.sim, 0));
    put_probe(&fixture, true);
    fixture_run(&fixture, 5);
    assert_true(sim_wrench(fixture.sim, 0)->contact);
}

TEST(a_withdrawn_tool_comes_back_after_its_sender_was_silent)
{
    SCOPED(fixture_destroy) Fixture fixture;
    create_probed(&fixture);
    press_too_hard(&fixture);
    fixture_run(&fixture, 190); // tool_timeout_s is 0.2
    put_probe(&fixture, true);
    fixture_run(&fixture, 5);
    assert_false(sim_wrench(fixture.sim, 0)->contact);
    fixture_run(&fixture, 201);
    put_probe(&fixture, true);
    fixture_run(&fixture, 5);
    assert_true(sim_wrench(fixture.sim, 0)->contact);
}

TEST(a_static_tool_stays_and_the_body_goes_to_its_rest_shape)
{
    FixtureOptions options = fixture_loadable();
    options.tool_count = 1;
    options.tool = &table;
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    spoil(&fixture);
    spoilt = 1;
    for (int tick = 0; tick < 3 * GUARD_BAD_TICKS; tick++) {
        fixture_run(&fixture, 1);
        assert_true(fixture_is_finite(&fixture));
        expect_no_wrench(&fixture);
    }
    const GuardCounts *counts = sim_guard_counts(fixture.sim);
    assert_int_equal(counts->tools, 0);
    assert_int_equal(counts->restored[GUARD_TOOL], sim_resets(fixture.sim));
    assert_true(counts->rest_shapes > 0);
    assert_true(sim_tool_motion(fixture.sim, 0)->active);
}

// ---------------------------------------------------------------------------------------------
// Other causes

TEST(what_was_set_is_the_cause_for_a_while_then_the_unsafe_step)
{
    FixtureOptions options = fixture_loadable();
    options.time_step = 1e-3;
    options.unsafe_time_step = true;
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    LoadOptions push = soft;
    push.duration = 1e-3;
    apply(&fixture, &push);
    fixture_run(&fixture, 20);
    assert_int_equal(sim_resets(fixture.sim), 0);
    char why[128];
    apply_well(sim_apply_set, fixture.sim, "stiffness_scale", 1e6);
    const GuardCounts *counts = sim_guard_counts(fixture.sim);
    fixture_run(&fixture, 1000);
    assert_true(counts->restored[GUARD_SET] > 0);
    assert_int_equal(counts->restored[GUARD_SET], sim_resets(fixture.sim));
    SimEvent event;
    assert_true(next_event(&fixture, "restored", &event));
    assert_non_null(strstr(event.text, "stiffness_scale SET"));
    const int64_t before = sim_resets(fixture.sim);
    for (int k = 0; k < 20; k++) { // what is in its rest shape would stay there
        fixture.sim->guard->freeze[0] = (GuardFreeze){0}; // RESET would undo the SET, too
        sim_apply_load(fixture.sim, &push, why, sizeof why);
        fixture_run(&fixture, 100);
    }
    assert_true(counts->restored[GUARD_TIME_STEP] > 0);
    assert_int_equal(counts->restored[GUARD_SET], before);
    bool told = false;
    while (next_event(&fixture, "restored", &event))
        told |= strstr(event.text, "beyond its bound") != NULL;
    assert_true(told);
}

// With nothing else that acts. What a wall bears is no cause.
TEST(a_pressure_that_bursts_its_wall_is_the_cause)
{
    FixtureOptions options = fixture_loadable();
    options.shape = (SurfaceShape){0};
    for (int bursts = 0; bursts < 2; bursts++) {
        SCOPED(fixture_destroy) Fixture fixture;
        SimEvent event;
        options.cavity = (SurfaceCavity){.wanted = true, .pressure = bursts ? 1e6 : 1.0};
        fixture_create_sphere(&fixture, &options);
        if (!bursts)
            spoil_motion(&fixture);
        fixture_run(&fixture, 50);
        const int64_t *restored = sim_guard_counts(fixture.sim)->restored;
        assert_true(restored[bursts ? GUARD_PRESSURE : GUARD_UNKNOWN] > 0);
        assert_int_equal(restored[bursts ? GUARD_UNKNOWN : GUARD_PRESSURE], 0);
        assert_true(next_event(&fixture, "restored", &event));
        assert_int_equal(strstr(event.text, "1e+06 Pa inside") != NULL, bursts);
    }
}

TEST(what_was_set_is_named_whichever_key_it_is)
{
    FixtureOptions options = fixture_loadable();
    options.integrator = INTEGRATOR_LEAPFROG;
    options.cavity = (SurfaceCavity){.wanted = true, .gas = true, .ambient = 1e5};
    static const struct {
        const char *key, *cause;
        double value;
    } SETS[] = {
        {"gravity_y", "gravity_y SET", 1.0}, {"body.damping_scale", "damping_scale SET", 1.0},
        {"friction", "friction SET", 0.3},   {"body.pressure", "pressure SET", 1.0},
        {"volume", "volume SET", 5e-4},      {"body.adapt_force", NULL, 1.0}};
    for (size_t i = 0; i < sizeof SETS / sizeof *SETS; i++) {
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create_sphere(&fixture, &options);
        spoil_motion(&fixture);
        char why[128];
        if (sim_apply_set(fixture.sim, SETS[i].key, SETS[i].value, why, sizeof why) !=
            (SETS[i].cause != NULL))
            fail_msg("%s: %s", SETS[i].key, why);
        spoilt = 1;
        fixture_run(&fixture, 2);
        SimEvent event;
        assert_true(next_event(&fixture, "restored", &event));
        if (SETS[i].cause != NULL && strstr(event.text, SETS[i].cause) == NULL)
            fail_msg("'%s' is not in: %s", SETS[i].cause, event.text);
    }
}

TEST(a_body_is_told_of_once_a_window_however_often_it_is_restored)
{
    FixtureOptions options = fixture_loadable();
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    LoadOptions blow = huge;
    blow.duration = 1e-3;
    int told = 0, blows = 0;
    for (int tick = 0; tick < 2500; tick++) {
        SimEvent event;
        if (tick % 30 == 0) { // too rarely to be frozen
            apply(&fixture, &blow);
            blows++;
        }
        fixture_run(&fixture, 1);
        while (next_event(&fixture, "restored", &event))
            told++;
        if (tick == 1020)
            assert_non_null(strstr(event.text, "34 times since the last report"));
    }
    assert_int_equal(sim_resets(fixture.sim), blows);
    assert_int_equal(told, 3);
}

// Loads of one tick each, of which none can be withdrawn: without end it would be restored in each.
static void blow_often(Fixture *fixture, int ticks)
{
    LoadOptions blow = huge;
    blow.duration = 1e-3;
    for (int tick = 0; tick < ticks; tick++) {
        apply(fixture, &blow);
        fixture_run(fixture, 1);
    }
}

TEST(a_body_that_is_restored_again_and_again_is_frozen_until_reset)
{
    FixtureOptions options = fixture_loadable();
    SCOPED(fixture_destroy) Fixture fixture, other;
    fixture_create_sphere(&fixture, &options);
    fixture_create_sphere(&other, &options);
    const int count = fixture.mesh.node_count;
    blow_often(&fixture, 500);
    FREED Vec3 *rest = malloc((size_t)count * sizeof *rest);
    memcpy(rest, fixture.x, (size_t)count * sizeof *rest);
    // The tenth in a row and the four that follow lead to the rest shape.
    assert_int_equal(sim_resets(fixture.sim), GUARD_BAD_TICKS + GUARD_MOST_SHAPES - 1);
    expect_near(rest[0].x, fixture.mesh.position[0].x, 1e-12); // of 0.05: rounding
    SimEvent event;
    assert_true(next_event(&fixture, "frozen", &event));
    expect_in(event.text, "until RESET");
    expect_in(event.text, "load 3 of sender 41");
    expect_in(event.text, "lower the load");
    assert_false(next_event(&fixture, "frozen", &event));
    assert_int_equal(sim_guard_counts(fixture.sim)->frozen, 1);
    // A run that goes on from here keeps it so.
    FREED void *image = copy_state(&fixture.state);
    resume(&other.state, other.sim, image);
    assert_true(sim_check(other.sim));
    Fixture *both[2] = {&fixture, &other};
    for (int k = 0; k < 2; k++) {
        apply(both[k], &soft);
        fixture_run(both[k], 50);
        assert_true(is_same(rest, both[k]->x, count));
    }
    assert_int_equal(state_hash(&fixture.state), state_hash(&other.state));
    // RESET lets it go: it gives way to the load again.
    sim_reset(fixture.sim);
    apply(&fixture, &soft);
    fixture_run(&fixture, 50);
    assert_false(is_same(rest, fixture.x, count));
    assert_int_equal(sim_resets(fixture.sim), GUARD_BAD_TICKS + GUARD_MOST_SHAPES - 1);
    // A tick that cannot be.
    other.sim->guard->freeze[0].since = other.sim->clock->step + 2;
    assert_false(sim_check(other.sim));
}

// ---------------------------------------------------------------------------------------------
// Other bodies

TEST(another_body_does_not_notice)
{
    Vec3 *place[2] = {NULL, NULL};
    for (int run = 0; run < 2; run++) {
        SCOPED(arena_destroy) Arena arena = {0};
        SCOPED(state_destroy) StateList list = {0};
        SCOPED(mesh_destroy) TriMesh mesh;
        fixture_sphere(&mesh);
        const SimOptions sim_options = {.rate_hz = 1000.0, .may_load = true};
        Sim *sim = sim_create(&sim_options, &arena, &list);
        for (int k = 0; k < 2; k++) {
            const SurfaceOptions options = {.body.name = k == 0 ? "hit" : "calm",
                                            .material = fixture_material(2e-4),
                                            .shape = fixture_shape(SHAPE_WORLD),
                                            .body.gravity = {0.0, 0.0, -1.0},
                                            .body.contact_ratio = 1.0};
            Body body;
            assert_true(surface_create(&body, &mesh, &options, &arena, &list, &(Status){0}));
            sim_add_body(sim, &body);
        }
        assert_true(sim_seal(sim, 0.0, &(Status){0}));
        if (run == 1)
            apply_well(sim_apply_load, sim, &huge); // body 0
        sim_ticks(sim, 50);
        assert_int_equal(sim_resets(sim), run == 1 ? GUARD_MOST_BLAME : 0);
        assert_int_equal(sim_body(sim, 1)->resets, 0);
        place[run] = calloc(2 * (size_t)mesh.node_count, sizeof(Vec3));
        surface_read_state(sim_body(sim, 1), place[run], place[run] + mesh.node_count);
        if (run == 1)
            assert_true(is_same(place[0], place[1], 2 * mesh.node_count));
    }
    free(place[0]);
    free(place[1]);
}

// ---------------------------------------------------------------------------------------------
// What leaves

TEST(a_wrench_that_nobody_should_feel_is_withheld)
{
    SCOPED(fixture_destroy) Fixture fixture;
    create_probed(&fixture);
    put_probe(&fixture, true);
    fixture_run(&fixture, 5);
    Sim *sim = fixture.sim;
    const ToolWrench good = sim->wrench[0];
    assert_true(good.contact);
    guard_wrenches(sim);
    assert_memory_equal(&good, &sim->wrench[0], sizeof good);
    assert_int_equal(sim_guard_counts(sim)->wrenches, 0);
    const double bad[] = {(double)NAN, HUGE_VAL, -HUGE_VAL, 1e200};
    const size_t at[] = {offsetof(ToolWrench, position.x),   offsetof(ToolWrench, force.y),
                         offsetof(ToolWrench, torque.z),     offsetof(ToolWrench, point.x),
                         offsetof(ToolWrench, normal.y),     offsetof(ToolWrench, depth),
                         offsetof(ToolWrench, stiffness.xy), offsetof(ToolWrench, damping)};
    int64_t count = 0;
    for (size_t i = 0; i < sizeof at / sizeof *at; i++)
        for (int k = 0; k < 4; k++) {
            sim->wrench[0] = good;
            memcpy((char *)&sim->wrench[0] + at[i], &bad[k], sizeof bad[k]);
            guard_wrenches(sim);
            expect_no_wrench(&fixture);
            assert_int_equal(sim_guard_counts(sim)->wrenches, ++count);
        }
}

static void measure_badly(const void *model, BodyMeasure *measure)
{
    (void)model;
    *measure = (BodyMeasure){.kinetic = HUGE_VAL, .elastic = (double)NAN, .max_displacement = 2.0};
}

TEST(figures_that_are_no_numbers_are_withheld)
{
    SCOPED(fixture_destroy) Fixture fixture;
    create_probed(&fixture);
    spoiling.measure = measure_badly;
    BodyMeasure measure;
    sim_measure(fixture.sim, 0, &measure);
    expect_near(measure.kinetic, 0.0, 0.0);
    expect_near(measure.elastic, 0.0, 0.0);
    expect_near(measure.max_displacement, 2.0, 0.0);
    assert_int_equal(sim_guard_counts(fixture.sim)->figures, 2);
}

// ---------------------------------------------------------------------------------------------
// The state

TEST(what_the_guard_remembers_is_part_of_the_state)
{
    SCOPED(fixture_destroy) Fixture fixture, other;
    create_probed(&fixture);
    create_probed(&other);
    LoadOptions blow = huge;
    blow.duration = 1e-3;
    apply(&fixture, &blow);
    fixture_run(&fixture, 1);
    press_too_hard(&fixture);
    FREED void *image = copy_state(&fixture.state);
    resume(&other.state, other.sim, image);
    assert_true(sim_check(other.sim));
    assert_true(sim_tool_withdrawn(other.sim, 0));
    for (int tick = 0; tick < 300; tick++) {
        Fixture *both[2] = {&fixture, &other};
        for (int k = 0; k < 2; k++) {
            put_probe(both[k], tick != 150); // let go of once
            if (tick == 100)
                apply(both[k], &huge);
            fixture_run(both[k], 1);
        }
    }
    assert_int_equal(state_hash(&fixture.state), state_hash(&other.state));
    assert_true(sim_wrench(other.sim, 0)->contact);
    // A state that cannot be is found out.
    other.sim->guard->tool[0].withdrawn = 1; // while it moves
    assert_false(sim_check(other.sim));
    other.sim->guard->tool[0].withdrawn = 0;
    assert_true(sim_check(other.sim));
    other.sim->guard->body[0].set_key = 1000;
    assert_false(sim_check(other.sim));
}

TEST(a_reset_forgives)
{
    SCOPED(fixture_destroy) Fixture fixture, fresh;
    create_probed(&fixture);
    create_probed(&fresh);
    press_too_hard(&fixture);
    sim_reset(fixture.sim);
    assert_false(sim_tool_withdrawn(fixture.sim, 0));
    fixture.sim->clock->step = 0; // all else is as at the start
    assert_int_equal(state_hash(&fixture.state), state_hash(&fresh.state));
    assert_int_equal(sim_guard_counts(fixture.sim)->tools, 1); // but not what has been
    put_probe(&fixture, true);
    fixture_run(&fixture, 5);
    assert_true(sim_wrench(fixture.sim, 0)->contact);
}
