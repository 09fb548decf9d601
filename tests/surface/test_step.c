// SPDX-License-Identifier: MIT
// One tick and what comes between two: resets, bad numbers, settling, stages, and that
// the same inputs give the same bits.
#include "base/isa.h"
#include "test.h"
#include "sim_steps.h"
#include "fixture.h"

static Vec3 difference(const Fixture *fixture, int node)
{
    return vec3_sub(fixture->x[node], fixture->mesh.position[node]);
}

// ---------------------------------------------------------------------------------------------
// Reset, state, repetition

// A probe that presses the top of the sphere.
static const ToolOptions probe = {.id = 1,
                                  .kind = TOOL_PROBE,
                                  .capsule_count = 1,
                                  .capsule = {{.to = {0.0, 0.0, 0.1}, .radius = 0.01}},
                                  .max_force = 3.0};

static void press(Fixture *fixture, double depth)
{
    ToolPose pose = {.position = {0.001, 0.002, 0.06 - depth},
                     .orientation = {1.0, 0.0, 0.0, 0.0},
                     .active = true};
    sim_apply_pose(fixture->sim, 0, &pose, false);
}

// A scene with all that has state: a body frame, a tool in contact, a load; held below.
static void create_busy(Fixture *fixture, IntegratorKind kind)
{
    static const FixedRegion bottom = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, -0.02}};
    FixtureOptions options = fixture_loadable();
    options.integrator = kind;
    options.shape = fixture_shape(SHAPE_BODY);
    options.gravity = vec3(0.0, 0.1, -0.2);
    options.fixed = &bottom;
    options.fixed_count = 1;
    options.tool = &probe;
    options.tool_count = 1;
    fixture_create_sphere(fixture, &options);
}

static void act_busy(Fixture *fixture, int tick)
{
    LoadOptions load = fixture_everywhere;
    load.radius = 0.04;
    load.center = vec3(0.05, 0.0, 0.0);
    load.duration = 0.02;
    if (tick % 50 == 10)
        apply_well(sim_apply_load, fixture->sim, &load);
    if (tick % 10 == 0)
        press(fixture, 1e-3 + 1e-5 * tick);
    sim_step(fixture->sim);
}

TEST(same_inputs_give_the_same_bits)
{
    for (int kind = 0; kind < INTEGRATOR_EXPLICIT; kind++) {
        Fixture fixture[2];
        for (int k = 0; k < 2; k++)
            create_busy(&fixture[k], (IntegratorKind)kind);
        for (int tick = 0; tick < 200; tick++) {
            for (int k = 0; k < 2; k++)
                act_busy(&fixture[k], tick);
            assert_true(state_hash(&fixture[0].state) == state_hash(&fixture[1].state));
        }
        assert_true(sim_wrench(fixture[0].sim, 0)->contact);
        for (int k = 0; k < 2; k++)
            fixture_destroy(&fixture[k]);
    }
}

TEST(instruction_set_level_does_not_change_a_bit)
{
    const char *const *levels = isa_available();
    uint64_t expected = 0;
    for (int k = 0; levels[k] != NULL; k++) {
        FixtureOptions options = fixture_loadable();
        options.shape = fixture_shape(SHAPE_BODY);
        options.isa = levels[k];
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create_sphere(&fixture, &options);
        assert_string_equal(fixture.body->ops->isa(fixture.body->model), levels[k]);
        for (int tick = 0; tick < 200; tick++) {
            if (tick == 10)
                apply_well(sim_apply_load, fixture.sim, &fixture_everywhere);
            sim_step(fixture.sim);
        }
        expected = k == 0 ? state_hash(&fixture.state) : expected;
        assert_true(state_hash(&fixture.state) == expected);
    }
}

TEST(unknown_instruction_set_level_is_refused)
{
    FixtureOptions options = fixture_loadable();
    options.isa = "x86-64-v9";
    fixture_expect_refusal(&options, "x86-64-v9");
}

TEST(copied_state_continues_with_the_same_bits)
{
    for (int kind = 0; kind < INTEGRATOR_EXPLICIT; kind++) {
        SCOPED(fixture_destroy) Fixture whole, resumed;
        create_busy(&whole, (IntegratorKind)kind);
        create_busy(&resumed, (IntegratorKind)kind);
        for (int tick = 0; tick < 120; tick++) // a load and the contact are at work
            act_busy(&whole, tick);
        for (int tick = 0; tick < 7; tick++) // somewhere else, rows in the other buffer
            act_busy(&resumed, 3 * tick);
        assert_int_equal(state_bytes(&whole.state), state_bytes(&resumed.state));
        FREED void *copy = copy_state(&whole.state);
        state_copy_in(&resumed.state, copy);
        assert_true(state_hash(&whole.state) == state_hash(&resumed.state));
        for (int tick = 120; tick < 240; tick++) {
            act_busy(&whole, tick);
            act_busy(&resumed, tick);
            assert_true(state_hash(&whole.state) == state_hash(&resumed.state));
        }
    }
}

TEST(reset_returns_to_the_bits_of_the_start)
{
    SCOPED(fixture_destroy) Fixture fixture, fresh;
    create_busy(&fixture, INTEGRATOR_LEAPFROG);
    create_busy(&fresh, INTEGRATOR_LEAPFROG);
    for (int tick = 0; tick < 121; tick++)
        act_busy(&fixture, tick);
    apply_well(sim_apply_set, fixture.sim, "gravity_x", 3.0);
    sim_reset(fixture.sim);
    assert_int_equal(sim_steps(fixture.sim), 121); // step and time go on
    expect_near(sim_time(fixture.sim), 0.121, 1e-15);
    assert_false(sim_tool_motion(fixture.sim, 0)->active);
    assert_int_equal(fixture.state.count, fresh.state.count);
    for (int k = 0; k < fixture.state.count; k++) {
        const StateArray *a = &fixture.state.array[k], *b = &fresh.state.array[k];
        if (strcmp(a->name, "sim/clock") != 0)
            assert_memory_equal(state_memory(a), state_memory(b), a->bytes);
    }
    // And moves on as a fresh one does.
    fixture_run(&fixture, 50);
    fixture_run(&fresh, 50);
    assert_memory_equal(fixture.x, fresh.x, (size_t)fresh.mesh.node_count * sizeof *fresh.x);
}

// ---------------------------------------------------------------------------------------------
// Bad numbers

TEST(bad_numbers_restore_the_last_good_state_and_are_counted)
{
    for (int kind = 0; kind < INTEGRATOR_EXPLICIT; kind++) {
        FixtureOptions options = fixture_loadable();
        options.integrator = (IntegratorKind)kind;
        options.rate_hz = 20.0; // far beyond the bound: the motion grows without end
        options.time_step = 0.05;
        options.unsafe_time_step = true;
        SCOPED(fixture_destroy) Fixture fixture;
        fixture_create_sphere(&fixture, &options);
        LoadOptions push = {.center = {0.0, 0.0, 0.05}, .radius = 0.02, .force = {1.0, 0.0, 0.0}};
        apply_well(sim_apply_load, fixture.sim, &push);
        size_t bytes = (size_t)fixture.mesh.node_count * sizeof(Vec3);
        FREED Vec3 *before = malloc(bytes);
        bool restarted = false;
        int64_t resets = 0;
        int bad_tick = -2;
        for (int tick = 0; tick < 300 && !restarted; tick++) {
            fixture_read(&fixture);
            memcpy(before, fixture.x, bytes);
            fixture_run(&fixture, 1);
            assert_true(fixture_is_finite(&fixture));
            if (sim_resets(fixture.sim) == resets)
                continue;
            resets++;
            assert_int_equal(sim_resets(fixture.sim), resets);
            assert_int_equal(fixture.body->resets, resets);
            // The state before the tick, the first time with its velocities; after many bad ticks
            // the rest shape.
            bool again = tick == bad_tick + 1;
            bad_tick = tick;
            if (again)
                for (int i = 0; i < fixture.mesh.node_count; i++)
                    expect_at_most(vec3_length(fixture.v[i]), 0.0);
            restarted = memcmp(fixture.x, fixture.mesh.position, bytes) == 0;
            if (!restarted)
                assert_memory_equal(fixture.x, before, bytes);
        }
        assert_true(resets >= 10);
        assert_true(restarted);
    }
}

TEST(other_bodies_go_on_when_one_is_restored)
{
    // Two bodies in one sim: one beyond its bound, one within.
    SCOPED(arena_destroy) Arena arena = {0};
    SCOPED(state_destroy) StateList list = {0};
    SCOPED(mesh_destroy) TriMesh mesh;
    fixture_sphere(&mesh);
    SimOptions sim_options = {.rate_hz = 20.0};
    Sim *sim = sim_create(&sim_options, &arena, &list);
    for (int k = 0; k < 2; k++) {
        SurfaceOptions options = {.body.name = k == 0 ? "wild" : "calm",
                                  .material = fixture_material(2e-4),
                                  .shape = fixture_shape(SHAPE_WORLD),
                                  .body.integrator = INTEGRATOR_LEAPFROG,
                                  .body.time_step = k == 0 ? 0.05 : 0.0,
                                  .body.unsafe_time_step = k == 0,
                                  .body.gravity = {0.0, 0.0, -1.0},
                                  .body.contact_ratio = 1.0};
        Body body;
        assert_true(surface_create(&body, &mesh, &options, &arena, &list, &(Status){0}));
        sim_add_body(sim, &body);
    }
    LoadOptions push = {
        .center = {0.0, 0.0, 0.05}, .radius = 0.02, .force = {1.0, 0.0, 0.0}, .duration = 1.0};
    sim_add_load(sim, &push); // body 0
    assert_true(sim_seal(sim, 0.0, &(Status){0}));
    sim_ticks(sim, 200);
    assert_true(sim_body(sim, 0)->resets > 0);
    assert_int_equal(sim_body(sim, 1)->resets, 0);
    BodyMeasure measure;
    const Body *calm = sim_body(sim, 1);
    measure = measure_of(calm);
    // Hangs g / w^2 below rest, all nodes alike; its swing has faded to exp(-0.1 * 50 * 10).
    expect_near(measure.max_displacement, 1.0 / 2500.0, 1e-12);
}

// ---------------------------------------------------------------------------------------------
// Settling

TEST(settled_body_hangs_still_at_time_zero)
{
    FixtureOptions options = fixture_loadable();
    options.gravity = vec3(0.0, 0.0, -9.81);
    options.settle_s = 8.0;
    options.load = &fixture_everywhere; // must wait for the first tick
    options.load_count = 1;
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    assert_int_equal(sim_steps(fixture.sim), 0);
    expect_near(sim_time(fixture.sim), 0.0, 0.0);
    assert_int_equal(sim_stage_ns(fixture.sim, STAGE_FORCES), 0);
    fixture_read(&fixture);
    for (int i = 0; i < fixture.mesh.node_count; i++) {
        // Every node hangs g / w^2 below: no spring is stretched. Swings fade as exp(-5 t).
        expect_near(difference(&fixture, i).z, -9.81 / 2500.0, 1e-12);
        expect_at_most(vec3_length(fixture.v[i]), 1e-12);
    }
    fixture_run(&fixture, 1);
    expect_at_least(fixture.v[0].x, 1e-4); // now the load acts
    sim_reset(fixture.sim);
    fixture_read(&fixture);
    expect_near(difference(&fixture, 3).z, -9.81 / 2500.0, 1e-12);
}

TEST(settling_that_blows_up_is_refused)
{
    FixtureOptions options = fixture_loadable();
    options.gravity = vec3(0.0, 0.0, -9.81);
    options.prestress = 0.2;
    options.rate_hz = 20.0;
    options.time_step = 0.05;
    options.unsafe_time_step = true;
    options.settle_s = 20.0;
    fixture_expect_refusal(&options, "settle_s");
}

// ---------------------------------------------------------------------------------------------
// Tools' time, stages

TEST(silent_tool_is_withdrawn_after_its_time)
{
    SCOPED(fixture_destroy) Fixture fixture;
    create_busy(&fixture, INTEGRATOR_LEAPFROG); // tool_timeout_s 0.2
    press(&fixture, 0.006);
    fixture_run(&fixture, 201);
    assert_true(sim_tool_motion(fixture.sim, 0)->active);
    assert_true(sim_wrench(fixture.sim, 0)->contact);
    fixture_run(&fixture, 1);
    assert_false(sim_tool_motion(fixture.sim, 0)->active);
    assert_false(sim_wrench(fixture.sim, 0)->contact);
    expect_near(vec3_length(sim_wrench(fixture.sim, 0)->force), 0.0, 0.0);
}

TEST(tool_in_lockstep_never_gets_stale)
{
    SCOPED(fixture_destroy) Fixture fixture;
    create_busy(&fixture, INTEGRATOR_LEAPFROG);
    sim_set_lockstep(fixture.sim, true);
    press(&fixture, 0.002);
    fixture_run(&fixture, 500);
    assert_true(sim_tool_motion(fixture.sim, 0)->active);
    assert_true(sim_wrench(fixture.sim, 0)->contact);
}

TEST(static_tool_stays)
{
    const ToolOptions table = {.id = 4,
                               .kind = TOOL_STATIC,
                               .has_plane = true,
                               .plane = {{0.0, 0.0, -0.05}, {0.0, 0.0, 1.0}}};
    FixtureOptions options = fixture_loadable();
    options.shape = fixture_shape(SHAPE_BODY);
    options.gravity = vec3(0.0, 0.0, -1.0);
    options.tool = &table;
    options.tool_count = 1;
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, &options);
    fixture_run(&fixture, 1000);
    assert_true(sim_tool_motion(fixture.sim, 0)->active);
    assert_true(sim_wrench(fixture.sim, 0)->contact);
    sim_reset(fixture.sim);
    assert_true(sim_tool_motion(fixture.sim, 0)->active);
}

static void expect_stages(const FixtureOptions *options, const StageId *expected, int count)
{
    SCOPED(fixture_destroy) Fixture fixture;
    fixture_create_sphere(&fixture, options);
    assert_int_equal(sim_stage_count(fixture.sim), count);
    for (int k = 0; k < count; k++)
        assert_int_equal(sim_stage(fixture.sim, k), expected[k]);
}

TEST(stages_are_only_those_that_the_scene_has)
{
    FixtureOptions options = fixture_loadable();
    options.may_load = false;
    expect_stages(&options, (StageId[]){STAGE_FORCES, STAGE_CHECK}, 2);
    options.load = &fixture_everywhere;
    options.load_count = 1;
    expect_stages(&options, (StageId[]){STAGE_LOADS, STAGE_FORCES, STAGE_CHECK}, 3);
    options.load_count = 0;
    options.tool = &probe;
    options.tool_count = 1;
    expect_stages(&options,
                  (StageId[]){STAGE_TOOLS, STAGE_FIND_CONTACTS, STAGE_FORCES, STAGE_CONTACT,
                              STAGE_WRENCHES, STAGE_CHECK},
                  6);
    const ToolOptions table = {.id = 4,
                               .kind = TOOL_STATIC,
                               .has_plane = true,
                               .plane = {{0.0, 0.0, -0.1}, {0.0, 0.0, 1.0}}};
    options.tool = &table;
    expect_stages(
        &options,
        (StageId[]){STAGE_FIND_CONTACTS, STAGE_FORCES, STAGE_CONTACT, STAGE_WRENCHES, STAGE_CHECK},
        5);
    options.tool_count = 0;
    options.may_load = true;
    expect_stages(&options,
                  (StageId[]){STAGE_INPUTS, STAGE_LOADS, STAGE_FORCES, STAGE_CHECK, STAGE_SNAPSHOT},
                  5);
    for (int s = 0; s < STAGE_COUNT; s++)
        assert_true(strlen(stage_name((StageId)s)) > 0);
}

TEST(bodies_and_tools_are_those_of_the_scene)
{
    SCOPED(fixture_destroy) Fixture fixture;
    create_busy(&fixture, INTEGRATOR_RK4);
    assert_int_equal(sim_body_count(fixture.sim), 1);
    assert_ptr_equal(sim_body(fixture.sim, 0), fixture.body);
    assert_string_equal(fixture.body->name, "body");
    assert_int_equal(sim_tool_count(fixture.sim), 1);
    assert_int_equal(sim_tool(fixture.sim, 0)->id, 1);
    expect_near(sim_tick(fixture.sim), 1e-3, 0.0);
}
