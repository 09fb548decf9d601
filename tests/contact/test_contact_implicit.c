// SPDX-License-Identifier: MIT
// Contact of implicit bodies, whose forces from outside are explicit: its stiffness is what the
// step allows, and then it is as stable as that of explicit bodies
// (and as exact in momentum: contact_momentum).
#include "contact_bench.h"
#include "test.h"
#include "sim_steps.h"

static const double THETA[] = {0.5, 0.55, 1.0};
enum { THETAS = 3 };

// A wall of 1e8 N/m: 7000 times too stiff for leapfrog at this rate.
static BenchOptions stiff_options(double theta)
{
    BenchOptions options = bench_with_tool(bench_uv_sphere(), bench_ball(0.01));
    options.youngs_modulus_2d = 1e8;
    options.integrator = INTEGRATOR_IMPLICIT;
    options.theta = theta;
    return options;
}

// With bounds a lambda and b_c a lambda of one capsule, the step is the longest stable one times
// 0.9 (integrator.h).
TEST(stiffness_is_what_the_step_allows)
{
    for (int k = 0; k < THETAS; k++) {
        BenchOptions options = stiff_options(THETA[k]);
        SCOPED(bench_destroy) Bench bench;
        bench_create(&bench, &options);
        const Body *body = bench.body;
        assert_int_equal(body->substeps, 1);
        assert_true(body->contact_share < 1e-3);
        double lambda = 0.5 * body->contact_lambda, damping = 2e-4 * lambda, h = 1e-3 / 0.9;
        double used = (4.0 * THETA[k] - 1.0) * h * h * lambda + 2.0 * h * damping;
        expect_near(used, 4.0, 1e-6); // halves of a power of ten, 60 times
    }
}

TEST(soft_body_keeps_its_contact_stiffness)
{
    double lambda[2];
    for (int k = 0; k < 2; k++) {
        BenchOptions options = bench_with_tool(bench_uv_sphere(), bench_ball(0.01));
        options.integrator = k == 0 ? INTEGRATOR_LEAPFROG : INTEGRATOR_IMPLICIT;
        SCOPED(bench_destroy) Bench bench;
        bench_create(&bench, &options);
        lambda[k] = bench.body->contact_lambda;
        expect_near(bench.body->contact_share, 1.0, 0.0);
    }
    expect_near(lambda[0], lambda[1], 0.0);
}

// A ball is pressed 4 mm into the top and held: the force comes to rest, points up, and the body
// does not move on.
TEST(tool_pressed_on_a_stiff_body_is_answered)
{
    for (int k = 0; k < 2 * THETAS; k++) {
        BenchOptions options = stiff_options(THETA[k / 2]);
        if (k % 2 == 1) { // a body that tools can push away, on its shape springs
            options.fixing = BENCH_FREE;
            options.shape_damping = 1.0;
        }
        SCOPED(bench_destroy) Bench bench;
        bench_create(&bench, &options);
        const double touch = BENCH_RADIUS + 0.01, depth = 0.004;
        bench_travel(&bench, 0, vec3(0.0, 0.0, touch + 0.005), vec3(0.0, 0.0, touch - depth), 0.05);
        Vec3 force[2];
        for (int i = 0; i < 2; i++) {
            bench_run(&bench, 0.3);
            force[i] = sim_wrench(bench.sim, 0)->force;
        }
        bench_read(&bench);
        print_message("theta %.2f: %.4g N up, kinetic %.2g J\n", THETA[k / 2], force[1].z,
                      measure_of(bench.body).kinetic);
        assert_int_equal(bench.body->resets, 0);
        // Held by the wall of the contact alone, kappa a area of some mm: well above nothing and
        // within what the proxy allows.
        expect_at_least(force[1].z, 0.05);
        expect_at_most(force[1].z, 3.3 * (1.0 + 1e-6));
        expect_at_most(vec3_length(vec3_sub(force[1], force[0])), 1e-3 * force[1].z);
        // Of the 1.6e-4 J that 0.13 kg have at the tool's speed.
        expect_at_most(measure_of(bench.body).kinetic, 1e-8);
    }
}

// Graspers and attachments share the step with contacts.
TEST(grasper_takes_its_share_of_the_step)
{
    BenchOptions options = stiff_options(0.55);
    options.tool[0].kind = TOOL_GRASPER;
    options.tool[0].grip_stiffness = 10.0;
    options.tool[0].grip_damping = 0.5;
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, &options);
    const Body *body = bench.body;
    // It pushes or holds: g lambda and 2 zeta sqrt(g lambda) are more.
    double lambda = 10.0 * body->contact_lambda, damping = sqrt(lambda), h = 1e-3 / 0.9;
    expect_near(1.2 * h * h * lambda + 2.0 * h * damping, 4.0, 1e-6);
}

// Jaws closed on the top and drawn up by 2 mm: they are held back, and all comes to rest.
TEST(grasper_that_pulls_a_stiff_body_is_held_back)
{
    for (int k = 0; k < THETAS; k++) {
        BenchOptions options = stiff_options(THETA[k]);
        options.tool[0] = bench_ball(0.02);
        options.tool[0].kind = TOOL_GRASPER;
        options.tool[0].grip_stiffness = 0.3;
        options.tool[0].grip_damping = 0.5;
        SCOPED(bench_destroy) Bench bench;
        bench_create(&bench, &options);
        for (int i = 0; i < 400; i++) {
            const ToolPose pose = {.position = {0.0, 0.0, BENCH_RADIUS + fmin(0.002, 1e-4 * i)},
                                   .orientation = {1.0, 0.0, 0.0, 0.0},
                                   .grip = 1.0,
                                   .active = true};
            sim_apply_pose(bench.sim, 0, &pose, true);
            sim_step(bench.sim);
        }
        bench_read(&bench);
        const Vec3 force = sim_wrench(bench.sim, 0)->force;
        print_message("theta %.2f: %.4g N, kinetic %.2g J\n", THETA[k], force.z,
                      measure_of(bench.body).kinetic);
        assert_int_equal(bench.body->resets, 0);
        expect_at_most(force.z, -0.05);
        expect_at_most(vec3_length(force), 3.3 * (1.0 + 1e-6));
        expect_at_most(measure_of(bench.body).kinetic, 1e-8); // as above
    }
}
