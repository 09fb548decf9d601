// SPDX-License-Identifier: MIT
// The stiffness that contacts tell (server/sim/README.md, "Stiffness for clients"): positive,
// about what a slow hand feels, and rather too stiff than too soft.
#include "test.h"
#include "contact_bench.h"
#include "effort.h"
#include "stiffness_trial.h"

// A ball pressed 6 mm, held until all is at rest. `place`: from a node (0) to the middle of a face.
static void press_sphere(Bench *bench, int subdivisions, double radius, double place)
{
    BenchOptions options = bench_with_tool(bench_ico_sphere(subdivisions), bench_ball(radius));
    options.contact_ratio = 1.0;
    options.shape_damping = 0.3;
    options.friction = 0.0;
    options.contact_stiffness = true;
    bench_create(bench, &options);
    const TriMesh *mesh = &bench->mesh;
    Vec3 node = mesh->position[bench_node_towards(mesh, vec3(0, 0, 1))];
    Vec3 face = bench_face_center(mesh, bench_face_near(mesh, node));
    Vec3 out = vec3_unit(vec3_add(vec3_scale(1.0 - place, node), vec3_scale(place, face)));
    double start = BENCH_RADIUS + radius;
    bench_travel(bench, 0, vec3_scale(start, out), vec3_scale(start - 0.006, out), 0.05);
    bench_run(bench, 2.0);
}

// Measured here: 0.24 to 0.43 over all, 1.06 to 1.11 along the normal. What is over is mostly
// sideways, where a pressed wall hardly resists: 0 to 11 N/m of it. The contact's
// own springs stiffen with depth: one direction of the first press is told 0.9 % too soft.
TEST(surface_tells_what_a_slow_hand_feels)
{
    for (int k = 0; k < EFFORT(6); k++) {
        SCOPED(bench_destroy) Bench bench;
        press_sphere(&bench, 3, k % 2 == 0 ? 0.005 : 0.010, 0.5 * (k / 2));
        StiffnessVerdict verdict = stiffness_judge(bench.sim, &bench.state);
        if (k < 2)
            expect_at_most(verdict.error, 0.40);
        expect_at_most(verdict.error, 0.45);
        expect_at_most(verdict.normal, 1.2);
        expect_at_least(verdict.normal, 1.0);
        expect_at_least(verdict.short_by, -0.02);
    }
}

// Deep in a wall the patch alone is more than twice as stiff as a slow press: that is remembered
// where the hand holds still. 10 %: the wall settles.
TEST(what_a_slow_press_felt_is_kept_at_rest)
{
    BenchOptions options = bench_with_tool(bench_ico_sphere(3), bench_ball(0.005));
    options.contact_ratio = 1.0;
    options.shape_damping = 0.3;
    options.contact_stiffness = true;
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, &options);
    const Vec3 out = {0.0, 0.0, 1.0};
    const double start = BENCH_RADIUS + 0.005;
    bench_travel(&bench, 0, vec3_scale(start, out), vec3_scale(start - 0.015, out), 0.02);
    const double felt = sym3_along(sim_wrench(bench.sim, 0)->stiffness, out);
    bench_run(&bench, 1.0);
    const double at_rest = sym3_along(sim_wrench(bench.sim, 0)->stiffness, out);
    print_message("%.2f N/m felt, %.2f at rest\n", felt, at_rest);
    expect_at_least(felt, 1.0);
    expect_near(at_rest, felt, 0.1 * felt);
}

TEST(no_contact_has_no_stiffness)
{
    SCOPED(bench_destroy) Bench bench;
    press_sphere(&bench, 2, 0.005, 0.5);
    expect_at_least(sym3_trace(sim_wrench(bench.sim, 0)->stiffness), 1.0);
    bench_touch(&bench, 0, vec3(0.0, 0.0, 0.08));
    bench_run(&bench, 0.01);
    assert_false(sim_wrench(bench.sim, 0)->contact);
    expect_near(sym3_trace(sim_wrench(bench.sim, 0)->stiffness), 0.0, 0.0);
    expect_near(sim_wrench(bench.sim, 0)->damping, 0.0, 0.0);
}

// It is told, and nothing else: the motion has the same bits without it.
TEST(motion_does_not_depend_on_it)
{
    uint64_t hash[2];
    for (int k = 0; k < 2; k++) {
        BenchOptions options = bench_with_tool(bench_ico_sphere(2), bench_capsule(0.03, 0.005));
        options.contact_stiffness = k == 1;
        SCOPED(bench_destroy) Bench bench;
        bench_create(&bench, &options);
        bench_travel(&bench, 0, vec3(0.0, 0.0, 0.056), vec3(0.004, 0.0, 0.045), 0.05);
        bench_run(&bench, 0.2);
        hash[k] = state_hash(&bench.state);
    }
    assert_true(hash[0] == hash[1]);
}

// Springs alone resist: nodes without shape springs and drag have no rates of their own to read.
TEST(a_wall_without_shape_springs_tells_it_too)
{
    BenchOptions options = bench_with_tool(bench_ico_sphere(2), bench_ball(0.005));
    options.contact_stiffness = true;
    options.shape_frequency = 0.0;
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, &options);
    double told = 0.0; // it is pushed away, and touched again
    for (double z = 0.056; z > 0.036; z -= 0.001) {
        bench_travel(&bench, 0, vec3(0.0, 0.0, z), vec3(0.0, 0.0, z - 0.001), 0.0025);
        told = fmax(told, sym3_trace(sim_wrench(bench.sim, 0)->stiffness));
    }
    expect_at_least(told, 1.0);
}
