// SPDX-License-Identifier: MIT
// Graspers: what they take hold of, how stiff the grip is, what it gives the body and the tool
// feels, and that letting go leaves nothing behind.
#include "contact_bench.h"
#include "effort.h"
#include "test.h"
#include "sim_steps.h"
#include "random.h"

#include "sim/hold/attachment.h"
#include "sim/sim_data.h"

static ToolOptions jaws(double radius)
{
    ToolOptions tool = bench_ball(radius);
    tool.kind = TOOL_GRASPER;
    tool.grip_stiffness = 0.3;
    tool.grip_damping = 0.5;
    tool.max_force = 100.0;
    return tool;
}

static void hold_at(Bench *bench, Vec3 position, Quat orientation, double grip)
{
    ToolPose pose = {
        .position = position, .orientation = orientation, .active = true, .grip = grip};
    sim_apply_pose(bench->sim, 0, &pose, true);
    sim_step(bench->sim);
}

static int held(const Bench *bench, bool *points)
{
    return attachment_held(bench->sim->attachment[0], points);
}

static const Quat STRAIGHT = {1.0, 0.0, 0.0, 0.0};

// ---------------------------------------------------------------------------------------------
// How stiff

typedef struct Pull {
    int nodes;
    double stretch, force; // of the longest spring [m]; on the hand, inwards [N]
} Pull;

// The pole of a sphere with a held seat, gripped, pulled 20 mm at 50 mm/s and held for a second.
static Pull pull_pole(int subdivisions, double stiffness, double max_force)
{
    BenchOptions options = bench_with_tool(bench_ico_sphere(subdivisions), jaws(0.009));
    options.tool[0].grip_stiffness = stiffness;
    options.tool[0].max_force = max_force;
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, &options);
    int pole = bench_node_towards(&bench.mesh, vec3(0, 0, 1));
    const Vec3 at = bench.mesh.position[pole], out = vec3_unit(at);
    hold_at(&bench, at, STRAIGHT, 1.0);
    bool points;
    Pull pull = {.nodes = held(&bench, &points)};
    assert_false(points);
    for (int i = 1; i <= 1400; i++) {
        hold_at(&bench, vec3_madd(at, fmin(0.02, 5e-5 * i), out), STRAIGHT, 1.0);
        expect_at_most(vec3_length(sim_wrench(bench.sim, 0)->force), max_force * (1.0 + 1e-12));
    }
    bench_read(&bench);
    for (int i = 0; i < bench.mesh.node_count; i++) {
        Vec3 place = vec3_madd(bench.mesh.position[i], 0.02, out);
        if (vec3_length(vec3_sub(bench.mesh.position[i], at)) <= 0.009)
            pull.stretch = fmax(pull.stretch, vec3_length(vec3_sub(bench.x[i], place)));
    }
    pull.force = -vec3_dot(sim_wrench(bench.sim, 0)->force, out);
    assert_true(sim_wrench(bench.sim, 0)->contact);
    return pull;
}

// The figures of the measurement that the stiffness was chosen by, of another program, rounded to
// two digits: half of the last digit is 0.6 to 4 %, and shape springs settle within 1 %.
TEST(grip_stretches_as_measured)
{
    static const struct {
        double stiffness, stretch, force; // [mm], [N]
    } measured[] = {{0.01, 9.1, 0.61}, {0.1, 2.2, 1.33}, {0.3, 0.89, 1.49}, {1.0, 0.30, 1.57}};
    for (size_t k = 0; k < sizeof measured / sizeof *measured; k++) {
        Pull pull = pull_pole(3, measured[k].stiffness, 100.0);
        assert_int_equal(pull.nodes, 7);
        expect_near(1e3 * pull.stretch, measured[k].stretch, 0.05 * measured[k].stretch);
        expect_near(pull.force, measured[k].force, 0.03 * measured[k].force);
    }
}

TEST(hand_that_pulls_beyond_max_force_slips_with_that_force)
{
    Pull pull = pull_pole(3, 0.3, 0.5);
    expect_near(pull.force, 0.5, 0.005);  // its part along the pull
    expect_at_least(pull.stretch, 0.005); // 1.49 N would take it all the way
}

// ---------------------------------------------------------------------------------------------
// What the step bound counts

// Whether the gripped pole of a free sphere, shaken once, stays bounded with a step of so many
// times the bound of this grip; 0.9 of it is what the bound leaves for safety.
static bool is_stable(double stiffness, double times, double bound_of)
{
    BenchOptions options = bench_with_tool(bench_ico_sphere(2), jaws(0.02));
    options.tool[0].grip_stiffness = bound_of;
    options.rate_hz = 4000.0;
    Bench bench;
    bench_create(&bench, &options);
    double step = times * bench.body->time_step_limit;
    bench_destroy(&bench);
    options.mesh = bench_ico_sphere(2);
    options.tool[0].grip_stiffness = stiffness;
    options.rate_hz = 1.0 / step; // a tick is a step
    options.time_step = step;
    bench_create(&bench, &options);
    assert_int_equal(bench.body->substeps, 1);
    int pole = bench_node_towards(&bench.mesh, vec3(0, 0, 1));
    const Vec3 at = bench.mesh.position[pole];
    hold_at(&bench, at, STRAIGHT, 1.0);
    for (int i = 0; i < 2000; i++)
        hold_at(&bench, vec3_madd(at, i < 10 ? 1e-3 : 0.0, vec3(0.6, 0.0, 0.8)), STRAIGHT, 1.0);
    double energy = energy_of(bench.body);
    bool stable = sim_resets(bench.sim) == 0 && energy < 1.0;
    bench_destroy(&bench);
    return stable;
}

TEST(step_bound_counts_the_grip)
{
    static const double stiffness[] = {0.1, 0.3, 1.0, 10.0};
    for (int k = 0; k < 4; k++)
        assert_true(is_stable(stiffness[k], 1.0 / 0.9, stiffness[k]));
    assert_false(is_stable(100.0, 1.0, 0.3)); // the bound is needed
}

// ---------------------------------------------------------------------------------------------
// Momentum

// A free body is swung by jaws that move and turn: what it gains in a tick is what the tool loses.
// Errors as shares of the largest impulse of a tick.
static void swing(int subdivisions, double radius, bool want_points, double max_force,
                  IntegratorKind integrator, double *linear, double *angular)
{
    BenchOptions options = bench_with_tool(bench_ico_sphere(subdivisions), jaws(radius));
    options.tool[0].max_force = max_force;
    options.fixing = BENCH_FREE;
    options.integrator = integrator;
    options.shape_frequency = 0.0;
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, &options);
    Vec3 at = bench.mesh.position[bench_node_towards(&bench.mesh, vec3(0, 0, 1))];
    if (want_points)
        at = bench_face_center(&bench.mesh, bench_face_near(&bench.mesh, at));
    hold_at(&bench, at, STRAIGHT, 1.0);
    bool points;
    assert_true(held(&bench, &points) > 0);
    assert_int_equal(points, want_points);
    Momentum before = bench_momentum(&bench);
    double tick = sim_tick(bench.sim), most = 0.0, most_angular = 0.0;
    *linear = *angular = 0.0;
    for (int i = 0; i < 400; i++) {
        double t = i * tick;
        Vec3 move = vec3(0.02 * sin(9.0 * t), 0.01 * sin(4.0 * t), 0.01 * sin(5.0 * t));
        hold_at(&bench, vec3_add(at, move),
                quat_from_rotation(vec3(0.4 * sin(11.0 * t), 0.3 * t, 2.0 * t)), 1.0);
        const ToolWrench *wrench = sim_wrench(bench.sim, 0);
        Vec3 impulse = vec3_scale(tick, wrench->force);
        Vec3 moment =
            vec3_scale(tick, vec3_add(wrench->torque, vec3_cross(wrench->position, wrench->force)));
        Momentum now = bench_momentum(&bench);
        most = fmax(most, vec3_length(impulse));
        most_angular = fmax(most_angular, vec3_length(moment));
        Vec3 rest = vec3_add(vec3_sub(now.linear, before.linear), impulse);
        Vec3 turn = vec3_add(vec3_sub(now.angular, before.angular), moment);
        *linear = fmax(*linear, vec3_length(rest));
        *angular = fmax(*angular, vec3_length(turn));
        before = now;
    }
    assert_true(most > 1e-6);
    *linear /= most;
    *angular /= most_angular;
}

// Round-off alone, as with contact.
TEST(body_and_grasper_exchange_momentum_exactly)
{
    double linear, angular;
    swing(2, 0.02, false, 100.0, INTEGRATOR_LEAPFROG, &linear, &angular);
    expect_at_most(linear, 1e-12);
    expect_at_most(angular, 1e-12);
    swing(2, 0.02, false, 0.1, INTEGRATOR_LEAPFROG, &linear, &angular); // slips
    expect_at_most(linear, 1e-12);
    expect_at_most(angular, 1e-12);
    swing(1, 0.004, true, 100.0, INTEGRATOR_LEAPFROG, &linear, &angular); // points of faces
    expect_at_most(linear, 1e-12);
    expect_at_most(angular, 1e-12);
    swing(2, 0.02, false, 100.0, INTEGRATOR_RK4, &linear, &angular);
    expect_at_most(linear, 1e-12);
    expect_at_most(angular, 1e-3); // kept to the order of the scheme
}

// ---------------------------------------------------------------------------------------------
// Taking hold and letting go

TEST(jaws_close_at_a_half_and_open_at_less)
{
    BenchOptions options = bench_with_tool(bench_ico_sphere(2), jaws(0.015));
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, &options);
    Vec3 at = bench.mesh.position[bench_node_towards(&bench.mesh, vec3(0, 0, 1))];
    const Vec3 away = vec3(0.0, 0.0, 0.2);
    const Attachment *grip = bench.sim->attachment[0];
    hold_at(&bench, away, STRAIGHT, 0.9); // closed in free air: holds nothing...
    assert_false(attachment_is_holding(grip));
    assert_false(attachment_mutes_contact(grip));
    hold_at(&bench, at, STRAIGHT, 0.9); // ... and picks nothing up
    assert_false(attachment_is_holding(grip));
    hold_at(&bench, away, STRAIGHT, 0.0);
    hold_at(&bench, at, STRAIGHT, 0.49);
    assert_false(attachment_is_holding(grip));
    hold_at(&bench, at, STRAIGHT, GRIP_CLOSES);
    assert_true(attachment_is_holding(grip));
    hold_at(&bench, at, STRAIGHT, GRIP_OPENS); // a trembling finger
    assert_true(attachment_is_holding(grip));
    hold_at(&bench, at, STRAIGHT, 0.39);
    assert_false(attachment_is_holding(grip));
    assert_true(attachment_mutes_contact(grip)); // still inside the jaws
    hold_at(&bench, away, STRAIGHT, 0.39);
    assert_false(attachment_mutes_contact(grip));
}

TEST(inactive_or_silent_grasper_lets_go)
{
    BenchOptions options = bench_with_tool(bench_ico_sphere(2), jaws(0.015));
    options.tool_timeout_s = 0.05;
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, &options);
    sim_set_lockstep(bench.sim, false);
    Vec3 at = bench.mesh.position[bench_node_towards(&bench.mesh, vec3(0, 0, 1))];
    const Attachment *grip = bench.sim->attachment[0];
    hold_at(&bench, at, STRAIGHT, 1.0);
    assert_true(attachment_is_holding(grip));
    bench_withdraw(&bench, 0);
    sim_step(bench.sim);
    assert_false(attachment_is_holding(grip));
    hold_at(&bench, at, STRAIGHT, 1.0);
    assert_true(attachment_is_holding(grip));
    bench_run(&bench, 0.06);
    assert_false(attachment_is_holding(grip));
    assert_false(sim_wrench(bench.sim, 0)->contact);
}

TEST(body_that_was_let_go_returns_to_rest)
{
    BenchOptions options = bench_with_tool(bench_ico_sphere(3), jaws(0.009));
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, &options);
    const Vec3 at = bench.mesh.position[bench_node_towards(&bench.mesh, vec3(0, 0, 1))];
    hold_at(&bench, at, STRAIGHT, 1.0);
    for (int i = 1; i <= 400; i++)
        hold_at(&bench, vec3_madd(at, 5e-5 * i, vec3(0.0, 0.6, 0.8)), STRAIGHT, 1.0);
    double pulled = energy_of(bench.body);
    assert_true(pulled > 1e-3);
    // Opened where it is, amid what it held: no push, no jerk.
    double after = pulled;
    for (int i = 0; i < 100; i++) {
        hold_at(&bench, vec3_madd(at, 0.02, vec3(0.0, 0.6, 0.8)), STRAIGHT, 0.0);
        double energy = energy_of(bench.body);
        expect_at_most(energy, after * (1.0 + 1e-2)); // leapfrog's energy sways with its step
        after = fmin(after, energy);
    }
    bench_withdraw(&bench, 0);
    bench_run(&bench, 3.0);
    bench_read(&bench);
    // exp(-15 / s) in 3 s: 1e-19 of 20 mm; round-off of positions.
    for (int i = 0; i < bench.mesh.node_count; i++)
        expect_at_most(vec3_length(vec3_sub(bench.x[i], bench.mesh.position[i])), 1e-12);
}

TEST(open_jaws_push_like_any_tool)
{
    Vec3 force[2];
    for (int k = 0; k < 2; k++) {
        BenchOptions options = bench_with_tool(bench_ico_sphere(2), jaws(0.005));
        options.tool[0].max_force = 3.3;
        if (k == 1)
            options.tool[0] = bench_ball(0.005);
        // Both in the steps of the grasper, which are the shorter ones or the same.
        options.time_step = 2.5e-4;
        SCOPED(bench_destroy) Bench bench;
        bench_create(&bench, &options);
        for (int i = 0; i < 200; i++)
            force[k] = bench_touch(&bench, 0, vec3(0.0, 0.0, 0.056 - 2e-5 * i));
    }
    assert_true(vec3_length(force[0]) > 1e-3);
    assert_memory_equal(&force[0], &force[1], sizeof force[0]);
}

// ---------------------------------------------------------------------------------------------
// The state

TEST(hold_is_part_of_the_state)
{
    BenchOptions options = bench_with_tool(bench_ico_sphere(2), jaws(0.02));
    Bench bench;
    bench_create(&bench, &options);
    Vec3 at = bench.mesh.position[bench_node_towards(&bench.mesh, vec3(0, 0, 1))];
    FREED void *middle = malloc(state_bytes(&bench.state));
    uint64_t hash[2];
    for (int run = 0; run < 2; run++) {
        if (run == 0) {
            for (int i = 0; i < 100; i++)
                hold_at(&bench, vec3_madd(at, 1e-4 * i, vec3(0, 0, 1)), STRAIGHT, 1.0);
            state_copy_out(&bench.state, middle);
        } else {
            hold_at(&bench, at, STRAIGHT, 0.0); // something else in between
            resume(&bench.state, bench.sim, middle);
            assert_true(sim_check(bench.sim));
        }
        for (int i = 100; i < 200; i++)
            hold_at(&bench, vec3_madd(at, 1e-4 * i, vec3(0, 0, 1)), STRAIGHT, 1.0);
        hash[run] = state_hash(&bench.state);
    }
    assert_true(hash[0] == hash[1]);
    sim_reset(bench.sim);
    assert_false(attachment_is_holding(bench.sim->attachment[0]));
    // But for the clock, RESET is the start.
    bench.sim->clock->step = 0;
    bench.sim->clock->lockstep = 0;
    uint64_t reset = state_hash(&bench.state);
    bench_destroy(&bench);
    options.mesh = bench_ico_sphere(2);
    bench_create(&bench, &options);
    bench.sim->clock->lockstep = 0;
    assert_true(reset == state_hash(&bench.state));
    bench_destroy(&bench);
}

// Whatever a file may have brought in place of what is held is refused or can be stepped on.
TEST(damaged_holds_are_refused_or_harmless)
{
    BenchOptions options = bench_with_tool(bench_ico_sphere(1), jaws(0.03));
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, &options);
    Vec3 at = bench.mesh.position[bench_node_towards(&bench.mesh, vec3(0, 0, 1))];
    hold_at(&bench, at, STRAIGHT, 1.0);
    size_t bytes = state_bytes(&bench.state);
    FREED unsigned char *good = malloc(bytes);
    state_copy_out(&bench.state, good);
    uint64_t random = 5;
    int refused = 0;
    for (int trial = 0; trial < EFFORT(2000); trial++) {
        state_copy_in(&bench.state, good);
        for (int k = 0; k < bench.state.count; k++) {
            const StateArray *array = &bench.state.array[k];
            if (strstr(array->name, "grasp") == NULL || random_below(&random, 3) != 0)
                continue;
            unsigned char *memory = state_memory(array);
            memory[random_below(&random, (int)array->bytes)] =
                (unsigned char)random_below(&random, 256);
        }
        sim_restored(bench.sim);
        if (!sim_check(bench.sim)) {
            refused++;
            continue;
        }
        hold_at(&bench, at, STRAIGHT, trial % 2 == 0 ? 1.0 : 0.0);
        hold_at(&bench, at, STRAIGHT, trial % 2 == 0 ? 0.0 : 1.0);
    }
    assert_true(refused > 0);
}

// ---------------------------------------------------------------------------------------------
// Friction of tools

// A ball pressed 4 mm deep and drawn 4 mm along; the force that holds it back.
static Vec3 draw_along(double of_body, bool own, double of_tool)
{
    BenchOptions options = bench_with_tool(bench_ico_sphere(2), bench_ball(0.01));
    options.friction = of_body;
    options.tool[0].has_friction = own;
    options.tool[0].friction = of_tool;
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, &options);
    Vec3 force = {0, 0, 0};
    for (int i = 0; i < 400; i++)
        force = bench_touch(
            &bench, 0,
            vec3(i < 200 ? 0.0 : 2e-5 * (i - 200), 0.0, 0.0605 - fmin(2.5e-5 * i, 0.0045)));
    return force;
}

TEST(friction_of_a_tool_replaces_that_of_the_body)
{
    Vec3 same = draw_along(0.3, false, 0.7), own = draw_along(0.7, true, 0.3);
    assert_memory_equal(&same, &own, sizeof same);
    Vec3 smooth = draw_along(0.0, false, 0.0), oiled = draw_along(0.7, true, 0.0);
    assert_memory_equal(&smooth, &oiled, sizeof smooth);
    assert_true(fabs(same.x - smooth.x) > 0.01 * same.z);
}
