// One tick and what comes between two: loads, resets, bad numbers, SET, settling, stages, and that
// the same inputs give the same bits.
#include "expect.h"
#include "fixture.h"

#include <stdlib.h>
#include <string.h>

static Vec3 difference(const Fixture *fixture, int node)
{
    return vec3_sub(fixture->x[node], fixture->mesh.position[node]);
}

// A sphere on shape springs that can be loaded.
static FixtureOptions loadable(void)
{
    return (FixtureOptions){.material = fixture_material(2e-4),
                            .shape = fixture_shape(SHAPE_WORLD),
                            .integrator = INTEGRATOR_SYMPLECTIC_EULER,
                            .may_load = true};
}

static void create(Fixture *fixture, const FixtureOptions *options)
{
    TriMesh mesh;
    fixture_sphere(&mesh);
    fixture_create(fixture, &mesh, options);
}

static const LoadOptions everywhere = {
    .body = 0, .radius = 1.0, .force = {0.3, -0.2, 0.1}, .duration = 0.01};

// ---------------------------------------------------------------------------------------------
// Loads

static void load_is_shared_by_nodal_area_and_sums_to_its_force(void **state)
{
    (void)state;
    FixtureOptions options = loadable();
    Fixture fixture;
    create(&fixture, &options);
    LoadOptions load = {
        .center = {0.0, 0.0, 0.05}, .radius = 0.03, .force = {0.1, 0.2, -0.3}, .duration = 0.001};
    char why[128];
    assert_true(sim_apply_load(fixture.sim, &load, why, sizeof why));
    int inside = 0, substeps = fixture.body->substeps;
    double area = 0.0;
    const BodySurface *surface = &fixture.body->surface;
    for (int i = 0; i < surface->node_count; i++)
        if (vec3_length(vec3_sub(fixture.mesh.position[i], load.center)) <= load.radius) {
            area += surface->node_area[i];
            inside++;
        }
    assert_true(inside > 3 && inside < surface->node_count / 2);
    assert_int_equal(substeps, 1);
    fixture_run(&fixture, 1);
    // The first kick from rest: the momentum of a node is its share of the force times the tick.
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int i = 0; i < surface->node_count; i++) {
        Vec3 p = vec3_scale(surface->node_mass[i], fixture.v[i]);
        bool takes = vec3_length(vec3_sub(fixture.mesh.position[i], load.center)) <= load.radius;
        Vec3 share = vec3_scale(takes ? 1e-3 * surface->node_area[i] / area : 0.0, load.force);
        // Rounding of the springs' forces (1 N) over the tick.
        expect_at_most(vec3_length(vec3_sub(p, share)), 1e-16);
        sum = vec3_add(sum, p);
    }
    expect_at_most(vec3_length(vec3_sub(sum, vec3_scale(1e-3, load.force))), 1e-16);
    fixture_destroy(&fixture);
}

// Momentum gained in one tick by a body that nothing else acts on [N s].
static double gain_of_a_tick(Fixture *fixture)
{
    double before = 0.0, after = 0.0;
    const double *mass = fixture->body->surface.node_mass;
    fixture_read(fixture);
    for (int i = 0; i < fixture->mesh.node_count; i++)
        before += mass[i] * fixture->v[i].x;
    fixture_run(fixture, 1);
    for (int i = 0; i < fixture->mesh.node_count; i++)
        after += mass[i] * fixture->v[i].x;
    return after - before;
}

static void load_lasts_its_duration_in_ticks(void **state)
{
    (void)state;
    static const struct {
        double duration;
        int ticks;
    } cases[] = {{0.0, 1}, {0.0004, 1}, {0.001, 1}, {0.0149, 15}, {0.015, 15}, {0.0154, 15}};
    for (int k = 0; k < 6; k++) {
        FixtureOptions options = loadable();
        options.shape.wanted = false;
        Fixture fixture;
        create(&fixture, &options);
        fixture_run(&fixture, 5);
        LoadOptions load = everywhere;
        load.duration = cases[k].duration;
        char why[128];
        assert_true(sim_apply_load(fixture.sim, &load, why, sizeof why));
        for (int tick = 0; tick < 20; tick++) // 1 ms of 0.3 N, or rounding
            expect_near(gain_of_a_tick(&fixture), tick < cases[k].ticks ? 3e-4 : 0.0, 1e-15);
        fixture_destroy(&fixture);
    }
}

static void scene_loads_start_at_their_time_and_add_up(void **state)
{
    (void)state;
    FixtureOptions options = loadable();
    options.shape.wanted = false;
    options.may_load = false;
    LoadOptions load[2] = {everywhere, everywhere};
    load[0].start = 0.008; // given out of order
    load[0].duration = 0.002;
    load[1].start = 0.005;
    load[1].duration = 0.004;
    options.load = load;
    options.load_count = 2;
    Fixture fixture;
    create(&fixture, &options);
    static const int expected[12] = {0, 0, 0, 0, 0, 1, 1, 1, 2, 1, 0, 0};
    for (int tick = 0; tick < 12; tick++)
        expect_near(gain_of_a_tick(&fixture), 3e-4 * expected[tick], 1e-15); // rounding
    fixture_destroy(&fixture);
}

static void load_on_nothing_is_refused(void **state)
{
    (void)state;
    FixtureOptions options = loadable();
    Fixture fixture;
    create(&fixture, &options);
    uint64_t before = state_hash(&fixture.state);
    LoadOptions load = everywhere;
    load.center = vec3(1.0, 2.0, 3.0);
    load.radius = 0.5;
    char why[128] = "";
    assert_false(sim_apply_load(fixture.sim, &load, why, sizeof why));
    assert_non_null(strstr(why, "no node within 0.5 m of (1, 2, 3)"));
    assert_true(state_hash(&fixture.state) == before);
    fixture_destroy(&fixture);
}

static void load_on_held_nodes_alone_is_refused(void **state)
{
    (void)state;
    const FixedRegion top = {.kind = FIXED_BOX, .low = {-1.0, -1.0, 0.02}, .high = {1.0, 1.0, 1.0}};
    FixtureOptions options = loadable();
    options.fixed_count = 1;
    options.fixed = &top;
    Fixture fixture;
    create(&fixture, &options);
    LoadOptions load = everywhere;
    load.center = vec3(0.0, 0.0, 0.05);
    load.radius = 0.02;
    char why[128] = "";
    assert_false(sim_apply_load(fixture.sim, &load, why, sizeof why));
    assert_non_null(strstr(why, "free"));
    fixture_destroy(&fixture);
}

static void full_set_of_loads_refuses_and_takes_again_when_one_ended(void **state)
{
    (void)state;
    FixtureOptions options = loadable();
    Fixture fixture;
    create(&fixture, &options);
    LoadOptions load = everywhere;
    load.center = fixture.mesh.position[5];
    load.radius = 1e-3; // one node
    char why[128] = "";
    for (int k = 0; k < SIM_LOADS; k++)
        assert_true(sim_apply_load(fixture.sim, &load, why, sizeof why));
    assert_false(sim_apply_load(fixture.sim, &load, why, sizeof why));
    assert_non_null(strstr(why, "64 loads"));
    fixture_run(&fixture, 11);
    load.radius = 0.2;
    assert_true(sim_apply_load(fixture.sim, &load, why, sizeof why));
    assert_true(sim_apply_load(fixture.sim, &load, why, sizeof why));
    // Room for two loads of all nodes, not for three.
    assert_false(sim_apply_load(fixture.sim, &load, why, sizeof why));
    assert_non_null(strstr(why, "too many nodes"));
    fixture_destroy(&fixture);
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
    FixtureOptions options = loadable();
    options.integrator = kind;
    options.shape = fixture_shape(SHAPE_BODY);
    options.gravity = vec3(0.0, 0.1, -0.2);
    options.fixed = &bottom;
    options.fixed_count = 1;
    options.tool = &probe;
    options.tool_count = 1;
    create(fixture, &options);
}

static void act_busy(Fixture *fixture, int tick)
{
    char why[128];
    LoadOptions load = everywhere;
    load.radius = 0.04;
    load.center = vec3(0.05, 0.0, 0.0);
    load.duration = 0.02;
    if (tick % 50 == 10)
        assert_true(sim_apply_load(fixture->sim, &load, why, sizeof why));
    if (tick % 10 == 0)
        press(fixture, 1e-3 + 1e-5 * tick);
    sim_step(fixture->sim);
}

static void same_inputs_give_the_same_bits(void **state)
{
    (void)state;
    for (int kind = 0; kind < INTEGRATOR_COUNT; kind++) {
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

static void instruction_set_level_does_not_change_a_bit(void **state)
{
    (void)state;
    const char *const *levels = surface_isa_levels();
    uint64_t expected = 0;
    for (int k = 0; levels[k] != NULL; k++) {
        FixtureOptions options = loadable();
        options.shape = fixture_shape(SHAPE_BODY);
        options.isa = levels[k];
        Fixture fixture;
        create(&fixture, &options);
        assert_string_equal(fixture.body->ops->isa(fixture.body->model), levels[k]);
        for (int tick = 0; tick < 200; tick++) {
            char why[128];
            if (tick == 10)
                assert_true(sim_apply_load(fixture.sim, &everywhere, why, sizeof why));
            sim_step(fixture.sim);
        }
        expected = k == 0 ? state_hash(&fixture.state) : expected;
        assert_true(state_hash(&fixture.state) == expected);
        fixture_destroy(&fixture);
    }
}

static void unknown_instruction_set_level_is_refused(void **state)
{
    (void)state;
    FixtureOptions options = loadable();
    options.isa = "x86-64-v9";
    TriMesh mesh;
    fixture_sphere(&mesh);
    Fixture fixture;
    Status status = {0};
    assert_false(fixture_try(&fixture, &mesh, &options, &status));
    assert_non_null(strstr(status.text, "x86-64-v9"));
    fixture_destroy(&fixture);
}

static void copied_state_continues_with_the_same_bits(void **state)
{
    (void)state;
    for (int kind = 0; kind < INTEGRATOR_COUNT; kind++) {
        Fixture whole, resumed;
        create_busy(&whole, (IntegratorKind)kind);
        create_busy(&resumed, (IntegratorKind)kind);
        for (int tick = 0; tick < 120; tick++) // a load and the contact are at work
            act_busy(&whole, tick);
        for (int tick = 0; tick < 7; tick++) // somewhere else, rows in the other buffer
            act_busy(&resumed, 3 * tick);
        assert_int_equal(state_bytes(&whole.state), state_bytes(&resumed.state));
        void *copy = malloc(state_bytes(&whole.state));
        state_copy_out(&whole.state, copy);
        state_copy_in(&resumed.state, copy);
        free(copy);
        assert_true(state_hash(&whole.state) == state_hash(&resumed.state));
        for (int tick = 120; tick < 240; tick++) {
            act_busy(&whole, tick);
            act_busy(&resumed, tick);
            assert_true(state_hash(&whole.state) == state_hash(&resumed.state));
        }
        fixture_destroy(&whole);
        fixture_destroy(&resumed);
    }
}

static void reset_returns_to_the_bits_of_the_start(void **state)
{
    (void)state;
    Fixture fixture, fresh;
    create_busy(&fixture, INTEGRATOR_LEAPFROG);
    create_busy(&fresh, INTEGRATOR_LEAPFROG);
    char why[128];
    for (int tick = 0; tick < 121; tick++)
        act_busy(&fixture, tick);
    assert_true(sim_apply_set(fixture.sim, "gravity_x", 3.0, why, sizeof why));
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
    fixture_destroy(&fixture);
    fixture_destroy(&fresh);
}

// ---------------------------------------------------------------------------------------------
// Bad numbers

static bool all_finite(const Fixture *fixture)
{
    for (int i = 0; i < fixture->mesh.node_count; i++)
        if (!vec3_finite(fixture->x[i]) || !vec3_finite(fixture->v[i]))
            return false;
    return true;
}

static void bad_numbers_restore_the_last_good_state_and_are_counted(void **state)
{
    (void)state;
    for (int kind = 0; kind < INTEGRATOR_COUNT; kind++) {
        FixtureOptions options = loadable();
        options.integrator = (IntegratorKind)kind;
        options.rate_hz = 20.0; // far beyond the bound: the motion grows without end
        options.time_step = 0.05;
        options.unsafe_time_step = true;
        Fixture fixture;
        create(&fixture, &options);
        char why[128];
        LoadOptions push = {.center = {0.0, 0.0, 0.05}, .radius = 0.02, .force = {1.0, 0.0, 0.0}};
        assert_true(sim_apply_load(fixture.sim, &push, why, sizeof why));
        size_t bytes = (size_t)fixture.mesh.node_count * sizeof(Vec3);
        Vec3 *before = malloc(bytes);
        bool restarted = false;
        int64_t resets = 0;
        for (int tick = 0; tick < 300 && !restarted; tick++) {
            fixture_read(&fixture);
            memcpy(before, fixture.x, bytes);
            fixture_run(&fixture, 1);
            assert_true(all_finite(&fixture));
            if (sim_resets(fixture.sim) == resets)
                continue;
            resets++;
            assert_int_equal(sim_resets(fixture.sim), resets);
            assert_int_equal(fixture.body->resets, resets);
            for (int i = 0; i < fixture.mesh.node_count; i++)
                expect_at_most(vec3_length(fixture.v[i]), 0.0);
            // The state before the tick; after many bad ticks in a row, the rest shape.
            restarted = memcmp(fixture.x, fixture.mesh.position, bytes) == 0;
            if (!restarted)
                assert_memory_equal(fixture.x, before, bytes);
        }
        assert_true(resets >= 10);
        assert_true(restarted);
        free(before);
        fixture_destroy(&fixture);
    }
}

static void other_bodies_go_on_when_one_is_restored(void **state)
{
    (void)state;
    // Two bodies in one sim: one beyond its bound, one within.
    Arena arena = {0};
    StateList list = {0};
    Status status = {0};
    TriMesh mesh;
    fixture_sphere(&mesh);
    SimOptions sim_options = {.rate_hz = 20.0};
    Sim *sim = sim_create(&sim_options, &arena, &list);
    for (int k = 0; k < 2; k++) {
        SurfaceOptions options = {.name = k == 0 ? "wild" : "calm",
                                  .material = fixture_material(2e-4),
                                  .shape = fixture_shape(SHAPE_WORLD),
                                  .integrator = INTEGRATOR_LEAPFROG,
                                  .time_step = k == 0 ? 0.05 : 0.0,
                                  .unsafe_time_step = k == 0,
                                  .gravity = {0.0, 0.0, -1.0},
                                  .contact_ratio = 1.0};
        Body body;
        assert_true(surface_create(&body, &mesh, &options, &arena, &list, &status));
        sim_add_body(sim, &body);
    }
    LoadOptions push = {
        .center = {0.0, 0.0, 0.05}, .radius = 0.02, .force = {1.0, 0.0, 0.0}, .duration = 1.0};
    sim_add_load(sim, &push); // body 0
    assert_true(sim_seal(sim, 0.0, &status));
    for (int tick = 0; tick < 200; tick++)
        sim_step(sim);
    assert_true(sim_body(sim, 0)->resets > 0);
    assert_int_equal(sim_body(sim, 1)->resets, 0);
    BodyMeasure measure;
    const Body *calm = sim_body(sim, 1);
    calm->ops->measure(calm->model, &measure);
    // Hangs g / w^2 below rest, all nodes alike; its swing has faded to exp(-0.1 * 50 * 10).
    expect_near(measure.max_displacement, 1.0 / 2500.0, 1e-12);
    state_destroy(&list);
    arena_destroy(&arena);
    mesh_destroy(&mesh);
}

// ---------------------------------------------------------------------------------------------
// Settling

static void settled_body_hangs_still_at_time_zero(void **state)
{
    (void)state;
    FixtureOptions options = loadable();
    options.gravity = vec3(0.0, 0.0, -9.81);
    options.settle_s = 8.0;
    options.load = &everywhere; // must wait for the first tick
    options.load_count = 1;
    Fixture fixture;
    create(&fixture, &options);
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
    fixture_destroy(&fixture);
}

static void settling_that_blows_up_is_refused(void **state)
{
    (void)state;
    FixtureOptions options = loadable();
    options.gravity = vec3(0.0, 0.0, -9.81);
    options.prestress = 0.2;
    options.rate_hz = 20.0;
    options.time_step = 0.05;
    options.unsafe_time_step = true;
    options.settle_s = 20.0;
    TriMesh mesh;
    fixture_sphere(&mesh);
    Fixture fixture;
    Status status = {0};
    assert_false(fixture_try(&fixture, &mesh, &options, &status));
    assert_int_equal(status.code, STATUS_INVALID);
    assert_non_null(strstr(status.text, "settle_s"));
    fixture_destroy(&fixture);
}

// ---------------------------------------------------------------------------------------------
// SET

static void set_changes_what_it_names(void **state)
{
    (void)state;
    FixtureOptions options = loadable();
    options.shape.wanted = false;
    Fixture fixture;
    create(&fixture, &options);
    char why[256];
    assert_true(sim_apply_set(fixture.sim, "gravity_x", 2.0, why, sizeof why));
    assert_true(sim_apply_set(fixture.sim, "gravity_y", -1.0, why, sizeof why));
    assert_true(sim_apply_set(fixture.sim, "gravity_z", 0.5, why, sizeof why));
    fixture_run(&fixture, 1);
    expect_near(fixture.v[4].x, 2e-3, 1e-15); // rounding
    expect_near(fixture.v[4].y, -1e-3, 1e-15);
    expect_near(fixture.v[4].z, 0.5e-3, 1e-15);
    assert_true(sim_apply_set(fixture.sim, "body.friction", 0.3, why, sizeof why));
    expect_near(fixture.body->tuning.friction, 0.3, 0.0);
    fixture_destroy(&fixture);
}

// First kick of one displaced node, which springs alone pull [m/s].
static double first_kick(const char *key, double value)
{
    TriMesh mesh;
    fixture_sphere(&mesh);
    Vec3 *x = malloc((size_t)mesh.node_count * sizeof *x);
    Vec3 *v = calloc((size_t)mesh.node_count, sizeof *v);
    memcpy(x, mesh.position, (size_t)mesh.node_count * sizeof *x);
    x[9].z += 0.002;
    if (strcmp(key, "body.damping_scale") == 0) {
        x[9] = mesh.position[9]; // the dampers alone
        v[9].z = 0.1;
    }
    FixtureOptions options = loadable();
    options.shape.wanted = false;
    options.rate_hz = 1e5;
    options.initial_position = x;
    options.initial_velocity = v;
    Fixture fixture;
    fixture_create(&fixture, &mesh, &options);
    char why[256];
    assert_true(sim_apply_set(fixture.sim, key, value, why, sizeof why));
    fixture_run(&fixture, 1);
    double kick = fixture.v[9].z - v[9].z;
    fixture_destroy(&fixture);
    free(x);
    free(v);
    return kick;
}

static void scales_multiply_stiffness_and_damping(void **state)
{
    (void)state;
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

static void set_beyond_the_bound_or_the_range_is_refused(void **state)
{
    (void)state;
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
        {"bodyx.friction", 1.0, "unknown key"},
    };
    FixtureOptions options = loadable();
    Fixture fixture;
    create(&fixture, &options);
    uint64_t before = state_hash(&fixture.state);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char why[256] = "";
        assert_false(sim_apply_set(fixture.sim, cases[k].key, cases[k].value, why, sizeof why));
        if (strstr(why, cases[k].says) == NULL)
            print_error("%s %g: %s\n", cases[k].key, cases[k].value, why);
        assert_non_null(strstr(why, cases[k].says));
        assert_true(state_hash(&fixture.state) == before);
    }
    fixture_destroy(&fixture);
}

static void damping_of_an_undamped_body_cannot_be_scaled(void **state)
{
    (void)state;
    FixtureOptions options = loadable();
    options.material.damping_time = 0.0;
    Fixture fixture;
    create(&fixture, &options);
    uint64_t before = state_hash(&fixture.state);
    char why[256] = "";
    assert_false(sim_apply_set(fixture.sim, "body.damping_scale", 0.5, why, sizeof why));
    assert_non_null(strstr(why, "no such parameter"));
    assert_true(state_hash(&fixture.state) == before);
    fixture_destroy(&fixture);
}

static void unsafe_body_takes_any_scale_in_range(void **state)
{
    (void)state;
    FixtureOptions options = loadable();
    options.unsafe_time_step = true;
    Fixture fixture;
    create(&fixture, &options);
    char why[256];
    assert_true(sim_apply_set(fixture.sim, "body.stiffness_scale", 1e5, why, sizeof why));
    assert_true(sim_apply_load(fixture.sim, &everywhere, why, sizeof why));
    for (int tick = 0; tick < 200; tick++) {
        fixture_run(&fixture, 1);
        assert_true(all_finite(&fixture));
    }
    assert_true(sim_resets(fixture.sim) > 0);
    fixture_destroy(&fixture);
}

// ---------------------------------------------------------------------------------------------
// Tools' time, stages

static void silent_tool_is_withdrawn_after_its_time(void **state)
{
    (void)state;
    Fixture fixture;
    create_busy(&fixture, INTEGRATOR_LEAPFROG); // tool_timeout_s 0.2
    press(&fixture, 0.006);
    fixture_run(&fixture, 201);
    assert_true(sim_tool_motion(fixture.sim, 0)->active);
    assert_true(sim_wrench(fixture.sim, 0)->contact);
    fixture_run(&fixture, 1);
    assert_false(sim_tool_motion(fixture.sim, 0)->active);
    assert_false(sim_wrench(fixture.sim, 0)->contact);
    expect_near(vec3_length(sim_wrench(fixture.sim, 0)->force), 0.0, 0.0);
    fixture_destroy(&fixture);
}

static void tool_in_lockstep_never_gets_stale(void **state)
{
    (void)state;
    Fixture fixture;
    create_busy(&fixture, INTEGRATOR_LEAPFROG);
    sim_set_lockstep(fixture.sim, true);
    press(&fixture, 0.002);
    fixture_run(&fixture, 500);
    assert_true(sim_tool_motion(fixture.sim, 0)->active);
    assert_true(sim_wrench(fixture.sim, 0)->contact);
    fixture_destroy(&fixture);
}

static void static_tool_stays(void **state)
{
    (void)state;
    const ToolOptions table = {.id = 4,
                               .kind = TOOL_STATIC,
                               .has_plane = true,
                               .plane = {{0.0, 0.0, -0.05}, {0.0, 0.0, 1.0}}};
    FixtureOptions options = loadable();
    options.shape = fixture_shape(SHAPE_BODY);
    options.gravity = vec3(0.0, 0.0, -1.0);
    options.tool = &table;
    options.tool_count = 1;
    Fixture fixture;
    create(&fixture, &options);
    fixture_run(&fixture, 1000);
    assert_true(sim_tool_motion(fixture.sim, 0)->active);
    assert_true(sim_wrench(fixture.sim, 0)->contact);
    sim_reset(fixture.sim);
    assert_true(sim_tool_motion(fixture.sim, 0)->active);
    fixture_destroy(&fixture);
}

static void expect_stages(const FixtureOptions *options, const StageId *expected, int count)
{
    Fixture fixture;
    create(&fixture, options);
    assert_int_equal(sim_stage_count(fixture.sim), count);
    for (int k = 0; k < count; k++)
        assert_int_equal(sim_stage(fixture.sim, k), expected[k]);
    fixture_destroy(&fixture);
}

static void stages_are_only_those_that_the_scene_has(void **state)
{
    (void)state;
    FixtureOptions options = loadable();
    options.may_load = false;
    expect_stages(&options, (StageId[]){STAGE_FORCES, STAGE_CHECK}, 2);
    options.load = &everywhere;
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

static void bodies_are_found_by_name(void **state)
{
    (void)state;
    Fixture fixture;
    create_busy(&fixture, INTEGRATOR_RK4);
    assert_int_equal(sim_body_count(fixture.sim), 1);
    assert_ptr_equal(sim_find_body(fixture.sim, "body"), fixture.body);
    assert_null(sim_find_body(fixture.sim, "bod"));
    assert_null(sim_find_body(fixture.sim, "body2"));
    assert_int_equal(sim_tool_count(fixture.sim), 1);
    assert_int_equal(sim_tool(fixture.sim, 0)->id, 1);
    expect_near(sim_tick(fixture.sim), 1e-3, 0.0);
    fixture_destroy(&fixture);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(load_is_shared_by_nodal_area_and_sums_to_its_force),
        cmocka_unit_test(load_lasts_its_duration_in_ticks),
        cmocka_unit_test(scene_loads_start_at_their_time_and_add_up),
        cmocka_unit_test(load_on_nothing_is_refused),
        cmocka_unit_test(load_on_held_nodes_alone_is_refused),
        cmocka_unit_test(full_set_of_loads_refuses_and_takes_again_when_one_ended),
        cmocka_unit_test(same_inputs_give_the_same_bits),
        cmocka_unit_test(instruction_set_level_does_not_change_a_bit),
        cmocka_unit_test(unknown_instruction_set_level_is_refused),
        cmocka_unit_test(copied_state_continues_with_the_same_bits),
        cmocka_unit_test(reset_returns_to_the_bits_of_the_start),
        cmocka_unit_test(bad_numbers_restore_the_last_good_state_and_are_counted),
        cmocka_unit_test(other_bodies_go_on_when_one_is_restored),
        cmocka_unit_test(settled_body_hangs_still_at_time_zero),
        cmocka_unit_test(settling_that_blows_up_is_refused),
        cmocka_unit_test(set_changes_what_it_names),
        cmocka_unit_test(scales_multiply_stiffness_and_damping),
        cmocka_unit_test(set_beyond_the_bound_or_the_range_is_refused),
        cmocka_unit_test(damping_of_an_undamped_body_cannot_be_scaled),
        cmocka_unit_test(unsafe_body_takes_any_scale_in_range),
        cmocka_unit_test(silent_tool_is_withdrawn_after_its_time),
        cmocka_unit_test(tool_in_lockstep_never_gets_stale),
        cmocka_unit_test(static_tool_stays),
        cmocka_unit_test(stages_are_only_those_that_the_scene_has),
        cmocka_unit_test(bodies_are_found_by_name),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
