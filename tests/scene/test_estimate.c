// SPDX-License-Identifier: MIT
// The live estimate of a step's error: near the truth, which many small Runge-Kutta steps tell; and
// without a trace in the motion.
#include "sim/sim.h"
#include "scene/build.h"

#include "test.h"
#include "fixture.h"
#include "random.h"
#include "surface_state.h"
#include "surface/surface.h"

typedef struct One {
    Arena arena;
    StateList state;
    Sim *sim;
    TriMesh mesh;
} One;

// A free sphere of 114 nodes in double precision, stretched and moving, one step a tick.
static void create(One *one, IntegratorKind kind, double step, double damping_time)
{
    const SimOptions sim = {.rate_hz = 1.0 / step, .tool_timeout_s = 1.0, .error_hz = 1.0};
    *one = (One){0};
    fixture_sphere(&one->mesh);
    const int count = one->mesh.node_count;
    FREED Vec3 *position = calloc((size_t)count, sizeof *position);
    FREED Vec3 *velocity = calloc((size_t)count, sizeof *velocity);
    assert_true(position != NULL && velocity != NULL);
    for (int i = 0; i < count; i++) {
        const Vec3 x = one->mesh.position[i];
        position[i] = (Vec3){1.05 * x.x, 0.97 * x.y, x.z};
        velocity[i] = (Vec3){2.0 * x.y, 0.5 * x.z, -x.x};
    }
    const SurfaceOptions options = {
        .body.name = "ball",
        .material = {.youngs_modulus_2d = 80.0, .areal_density = 4.2, .damping_time = damping_time},
        .body.integrator = kind,
        .body.precision = PRECISION_DOUBLE,
        .body.initial_position = position,
        .body.initial_velocity = velocity,
        .body.contact_ratio = 0.5,
        .body.estimate_error = true,
        .body.isa = "auto"};
    Status status = {0};
    Body body = {0};
    one->sim = sim_create(&sim, &one->arena, &one->state);
    expect_ok(surface_create(&body, &one->mesh, &options, &one->arena, &one->state, &status),
              status);
    sim_add_body(one->sim, &body);
    expect_ok(sim_seal(one->sim, 0.0, &status), status);
    assert_int_equal(sim_body(one->sim, 0)->substeps, 1);
}

static void destroy(One *one)
{
    arena_destroy(&one->arena);
    state_destroy(&one->state);
    mesh_destroy(&one->mesh);
}

// How far a body is after `ticks` from where another is.
static double apart(const One *a, int ticks_a, const One *b, int ticks_b)
{
    const int count = a->mesh.node_count;
    FREED Vec3 *x = calloc(2 * (size_t)count, sizeof *x), *v = calloc((size_t)count, sizeof *v);
    double most = 0.0;
    assert_true(x != NULL && v != NULL);
    while (sim_steps(a->sim) < ticks_a)
        sim_step(a->sim);
    while (sim_steps(b->sim) < ticks_b)
        sim_step(b->sim);
    surface_read_state(sim_body(a->sim, 0), x, v);
    surface_read_state(sim_body(b->sim, 0), x + count, v);
    for (int i = 0; i < count; i++)
        most = fmax(most, vec3_length(vec3_sub(x[i], x[count + i])));
    return most;
}

TEST(the_estimate_is_the_error_of_a_step)
{
    static const IntegratorKind KIND[] = {INTEGRATOR_RK4, INTEGRATOR_LEAPFROG,
                                          INTEGRATOR_SYMPLECTIC_EULER};
    enum { FINE = 64 };
    for (int k = 0; k < 3; k++) {
        // A tenth of the largest stable step and less: where errors go by the scheme's order.
        const double step = 2e-4;
        One one, truth;
        create(&one, KIND[k], step, 0.0);
        create(&truth, INTEGRATOR_RK4, step / FINE, 0.0);
        sim_try_step(one.sim, 0);
        const double estimate = sim_take_error(one.sim, 0);
        assert_true(sim_take_error(one.sim, 0) == 0.0); // taken
        const double error = apart(&one, 1, &truth, FINE);
        // Symplectic Euler's first term is h^2 a/2: the next is as h omega = 0.1 of it. The sample
        // has 64 of the 114 nodes, whose worst need not be among them: at least half of it is.
        printf("%s: estimated %.3g, true %.3g\n", integrator_name(KIND[k]), estimate, error);
        assert_true(estimate > 0.5 * error && estimate < 1.2 * error);
        destroy(&one);
        destroy(&truth);
    }
}

// Rms distance of the bodies' nodes.
static double mean_apart(const One *a, const One *b)
{
    const int count = a->mesh.node_count;
    FREED Vec3 *x = calloc(2 * (size_t)count, sizeof *x), *v = calloc((size_t)count, sizeof *v);
    double sum = 0.0;
    assert_true(x != NULL && v != NULL);
    surface_read_state(sim_body(a->sim, 0), x, v);
    surface_read_state(sim_body(b->sim, 0), x + count, v);
    for (int i = 0; i < count; i++)
        sum += vec3_dot(vec3_sub(x[i], x[count + i]), vec3_sub(x[i], x[count + i]));
    return sqrt(sum / count);
}

// Looked at 8 times in 0.13 s, about ten swings of the body, damped by some percent or not at all.
TEST(errors_of_steps_add_up_to_that_of_the_motion)
{
    static const IntegratorKind KIND[] = {INTEGRATOR_RK4, INTEGRATOR_LEAPFROG,
                                          INTEGRATOR_SYMPLECTIC_EULER};
    enum { FINE = 16, EVERY = 16, LOOK = 80, TICKS = 640 };
    for (int k = 0; k < 6; k++) {
        const double step = 2e-4, damping_time = k % 2 == 0 ? 0.0 : 2e-4;
        const bool first_order = KIND[k / 2] == INTEGRATOR_SYMPLECTIC_EULER;
        One one, truth;
        SimError error;
        create(&one, KIND[k / 2], step, damping_time);
        create(&truth, INTEGRATOR_RK4, step / FINE, damping_time);
        sim_error(one.sim, 0, &error);
        assert_true(error.steps == -1.0);
        for (int tick = 0; tick < TICKS; tick++) {
            if (tick % EVERY == 0)
                sim_try_step(one.sim, 0);
            sim_step(one.sim);
            for (int i = 0; i < FINE; i++)
                sim_step(truth.sim);
            if (tick % LOOK != LOOK - 1)
                continue;
            // A delay, of a scheme of first order. That of others is in the phase, which grows
            // while the body rings, and a tenth of a micrometre to a few: told too small then.
            sim_error(one.sim, 0, &error);
            const double is = mean_apart(&one, &truth);
            print_message("%s, %g s: estimated %.3g, true %.3g\n", integrator_name(KIND[k / 2]),
                          damping_time, error.steps, is);
            assert_true(error.steps < 2.0 * is);
            assert_true(error.steps > (first_order ? 0.4 : 0.03) * is);
        }
        // Of a body that nobody tries for a second nothing is known.
        for (int tick = 0; tick < 5100; tick++)
            sim_step(one.sim);
        sim_error(one.sim, 0, &error);
        assert_true(error.steps == -1.0);
        destroy(&one);
        destroy(&truth);
    }
}

// Scenes with what a try may touch: warm starts, pieces, forces felt, frames that float, levels.
TEST(tried_steps_leave_no_trace)
{
    static const char *const SCENE[] = {"table",      "press-sphere", "adaptive-organ", "sheet",
                                        "block",      "disc",         "cut-block",      "torn-disc",
                                        "cut-sphere", "grasp-sphere"};
    for (size_t k = 0; k < sizeof SCENE / sizeof *SCENE; k++) {
        char path[512];
        SCOPED(scene_destroy) Scene scene;
        World world[2] = {0};
        Status status = {0};
        snprintf(path, sizeof path, "../config/%s.cfg", SCENE[k]);
        expect_ok(scene_read(path, &scene, &status), status);
        for (int w = 0; w < 2; w++) {
            const BuildOptions options = {.isa = "auto", .may_load = true, .publishes = true};
            scene.sim.estimate_error = w == 1;
            scene.publish.error_hz = w == 1 ? 100.0 : 0.0; // and in space
            expect_ok(world_build(&world[w], &scene, &options, &status), status);
        }
        double most = 0.0;
        for (int tick = 0; tick < 250; tick++) {
            for (int w = 0; w < 2; w++) {
                // A jolt that turns bodies and flattens elements: then warm starts matter.
                char why[200];
                if (tick == 60)
                    sim_apply_gravity(world[w].sim, (Vec3){900.0, 300.0, -2000.0}, why, sizeof why);
                if (tick == 90)
                    sim_apply_gravity(world[w].sim, (Vec3){0.0, 3.0, -9.81}, why, sizeof why);
                sim_step(world[w].sim);
            }
            for (int b = 0; b < sim_body_count(world[1].sim) && tick % 3 == 0; b++) {
                sim_try_step(world[1].sim, b);
                most = fmax(most, sim_take_error(world[1].sim, b));
            }
        }
        assert_true(most > 0.0 && isfinite(most));
        assert_true(state_hash(&world[0].state) == state_hash(&world[1].state));
        for (int w = 0; w < 2; w++)
            world_destroy(&world[w]);
    }
}

TEST(nothing_is_kept_for_a_scene_that_does_not_ask)
{
    SCOPED(scene_destroy) Scene scene;
    SCOPED(world_destroy) World world = {0};
    Status status = {0};
    const BuildOptions options = {.isa = "auto", .may_load = true, .publishes = true};
    expect_ok(scene_read("../config/press-sphere.cfg", &scene, &status) &&
                  world_build(&world, &scene, &options, &status),
              status);
    for (int s = 0; s < sim_stage_count(world.sim); s++)
        assert_true(sim_stage(world.sim, s) != STAGE_ESTIMATE &&
                    sim_stage(world.sim, s) != STAGE_ERROR);
}
