// SPDX-License-Identifier: MIT
// Bodies on tables (server/sim/README.md, "Planes" and "Friction"): they come to rest, weigh
// what they weigh, stick and slide by Coulomb's law.
#include "test.h"
#include "sim_steps.h"
#include "contact_bench.h"

#include "geometry/generator.h"

static const double G = 9.81; // [m/s2]
static const double PI = 3.14159265358979323846;

// Lowest point of the body below the table z = 0 [m].
static double overlap(Bench *bench)
{
    double low = 0.0;
    bench_read(bench);
    for (int i = 0; i < bench->mesh.node_count; i++)
        low = fmin(low, bench->x[i].z);
    return -low;
}

static double fastest(Bench *bench)
{
    double most = 0.0;
    bench_read(bench);
    for (int i = 0; i < bench->mesh.node_count; i++)
        most = fmax(most, vec3_length(bench->v[i]));
    return most;
}

// A hollow sphere dropped 20 mm on a table. It lands on the edge that points down, where it would
// tip over some seconds later: asked when it has come to rest and before rounding has grown.
TEST(dropped_sphere_comes_to_rest_and_weighs_its_weight)
{
    static const double frequencies[] = {50.0, 100.0}, rest[] = {3.5, 3.0};
    for (int k = 0; k < 2; k++) {
        BenchOptions options = bench_options();
        options.mesh = bench_ico_sphere(3);
        mesh_place(&options.mesh, 1.0, vec3(0, 0, 0), vec3(0, 0, BENCH_RADIUS + 0.02));
        options.fixing = BENCH_FREE;
        options.body_frame = true;
        options.shape_frequency = frequencies[k];
        options.gravity = vec3(0.0, 0.0, -G);
        options.tool[options.tool_count++] = bench_table(vec3(0, 0, 0), vec3(0, 0, 1));
        SCOPED(bench_destroy) Bench bench;
        bench_create(&bench, &options);
        bench_run(&bench, rest[k]);
        expect_at_most(fastest(&bench), 1e-6);
        // 0.22 and 0.16 mm in the prototype (server/sim/README.md, "Planes")
        expect_at_most(overlap(&bench), 0.5e-3);
        const ToolWrench *wrench = sim_wrench(bench.sim, 0);
        double weight = G * bench.body->mass;
        expect_near(wrench->force.z / -weight, 1.0, 1e-3);
        expect_near(wrench->depth, overlap(&bench), 1e-9); // moved 1e-6 m/s within the tick
        expect_near(wrench->normal.z, -1.0, 1e-12);        // out of the body
    }
}

// A flat sheet lies on the table, then gravity leans over as if the table were tilted.
static void lie_down(Bench *bench, double friction, IntegratorKind integrator)
{
    BenchOptions options = bench_options();
    assert_true(generate_sheet(&options.mesh, 7, 7, 0.1, 0.1, &(Status){0}));
    options.fixing = BENCH_FREE;
    options.body_frame = true;
    options.friction = friction;
    options.integrator = integrator;
    options.gravity = vec3(0.0, 0.0, -G);
    options.tool[options.tool_count++] = bench_table(vec3(0, 0, 0), vec3(0, 0, 1));
    bench_create(bench, &options);
    bench_run(bench, 1.0);
}

static void tilt(Bench *bench, double degrees)
{
    double angle = degrees * PI / 180.0;
    apply_well(sim_apply_set, bench->sim, "gravity_x", G * sin(angle));
    apply_well(sim_apply_set, bench->sim, "gravity_z", -G * cos(angle));
}

static double center_x(Bench *bench)
{
    double sum = 0.0;
    bench_read(bench);
    for (int i = 0; i < bench->mesh.node_count; i++)
        sum += bench->body->surface.node_mass[i] * bench->x[i].x;
    return sum / bench->body->mass;
}

static double speed_x(Bench *bench)
{
    return bench_momentum(bench).linear.x / bench->body->mass;
}

TEST(body_sticks_below_the_friction_angle)
{
    SCOPED(bench_destroy) Bench bench;
    lie_down(&bench, 0.5, INTEGRATOR_LEAPFROG); // atan 0.5 = 26.6 degrees
    tilt(&bench, 20.0);
    bench_run(&bench, 1.0); // the bristles take the load
    double start = center_x(&bench);
    bench_run(&bench, 1.0);
    expect_near(center_x(&bench), start, 1e-5);
    // The table carries both parts of the weight.
    Vec3 force = sim_wrench(bench.sim, 0)->force;
    double weight = G * bench.body->mass;
    expect_near(force.x, weight * sin(PI / 9.0), 1e-3 * weight);
    expect_near(force.z, -weight * cos(PI / 9.0), 1e-3 * weight);
}

TEST(body_slides_above_the_friction_angle)
{
    static const IntegratorKind kinds[] = {INTEGRATOR_LEAPFROG, INTEGRATOR_RK4};
    for (int k = 0; k < 2; k++) {
        SCOPED(bench_destroy) Bench bench;
        lie_down(&bench, 0.5, kinds[k]);
        tilt(&bench, 30.0);
        double a = G * (0.5 - 0.5 * cos(PI / 6.0)); // g (sin 30 - 0.5 cos 30)
        bench_run(&bench, 1.0);
        double start = center_x(&bench), speed = speed_x(&bench);
        // It stuck while the bristles stretched: g sin 30 for less than 4 ms of the first second.
        expect_near(speed, a, 0.02);
        bench_run(&bench, 1.0);
        // From then on Coulomb's law to what the normal force still sways, 1e-6 of it.
        expect_near(speed_x(&bench) - speed, a, 1e-5 * a);
        // Positions lag or lead by half a tick at most.
        expect_near(center_x(&bench) - start, speed + 0.5 * a, 1e-3);
    }
}

TEST(body_without_friction_slides_freely)
{
    SCOPED(bench_destroy) Bench bench;
    lie_down(&bench, 0.0, INTEGRATOR_LEAPFROG);
    tilt(&bench, 5.0);
    double start = center_x(&bench);
    bench_run(&bench, 1.0);
    // g sin 5 / 2; leapfrog is exact for a constant force but for rounding, and the wrench has no
    // part along the table.
    expect_near(center_x(&bench) - start, 0.5 * G * sin(PI / 36.0), 1e-9);
    expect_near(sim_wrench(bench.sim, 0)->force.x, 0.0, 0.0);
}

// Both tools push the same nodes: the step bound counts both, and the body is at rest between.
TEST(body_lies_in_a_corner_of_two_tables)
{
    BenchOptions options = bench_options();
    options.mesh = bench_ico_sphere(2);
    mesh_place(&options.mesh, 1.0, vec3(0, 0, 0), vec3(0, 0, 0.075));
    options.fixing = BENCH_FREE;
    options.body_frame = true;
    options.shape_frequency = 100.0;
    options.friction = 0.0;
    options.gravity = vec3(0.0, 0.0, -G);
    options.tool_count = 2;
    options.tool[0] = bench_table(vec3(0, 0, 0), vec3(1, 0, 1));
    options.tool[1] = bench_table(vec3(0, 0, 0), vec3(-1, 0, 1));
    SCOPED(bench_destroy) Bench bench;
    bench_create(&bench, &options);
    // Each plane adds a third of a lambda_b (server/sim/README.md, "Planes").
    double lambda = bench.body->lambda, both = 0.0, more, damping;
    for (int t = 0; t < 2; t++) {
        contact_bounds(bench.body, sim_tool(bench.sim, t), &more, &damping);
        both += more;
    }
    expect_near(both, 0.5 * lambda * 2.0 / 3.0, 1e-12 * lambda);
    bench_run(&bench, 4.0);
    Vec3 left = sim_wrench(bench.sim, 0)->force, right = sim_wrench(bench.sim, 1)->force;
    double weight = G * bench.body->mass;
    // Without friction each normal carries weight / sqrt 2; what still rocks is below 1 %.
    expect_near(vec3_length(left), weight / sqrt(2.0), 0.01 * weight);
    expect_near(vec3_length(right), weight / sqrt(2.0), 0.01 * weight);
    expect_near(left.z + right.z, -weight, 0.01 * weight);
}
