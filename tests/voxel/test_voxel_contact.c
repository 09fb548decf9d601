// SPDX-License-Identifier: MIT
// Tools against voxel bodies: pressed from outside they stay outside, whatever they meet; what the
// tool feels is what the body feels; and a tool that finds itself inside is let out.
#include "effort.h"
#include "test.h"
#include "sim_steps.h"
#include "momentum_exchange.h"
#include "voxel_bench.h"
#include "voxel_world.h"

#include "sim/contact/contact_data.h"

static const double HALF = 0.05; // of the cubes' edges, and the ball's radius [m]

static ToolOptions make_tool(double length, double radius)
{
    return (ToolOptions){CAPSULE(length, radius, 50.0)};
}

static const ToolOptions TABLE = {.id = 2,
                                  .kind = TOOL_STATIC,
                                  .has_plane = true,
                                  .plane = {{0.0, 0.0, -0.051}, {0.0, 0.0, 1.0}}};

// Held where z < -0.0499 m.
static VoxelWorldOptions held(VoxelWorldOptions options)
{
    static const FixedRegion below = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, -0.0499}};
    fix_within(&options.body.body, &below);
    return options;
}

static VoxelWorldOptions with_tool(VoxelWorldOptions options, ToolOptions tool)
{
    options.tool[0] = tool;
    options.tool_count = 1;
    return options;
}

static void place(VoxelWorld *world, Vec3 position)
{
    put_tool(world->sim, 0, position);
}

static void step_at(VoxelWorld *world, Vec3 position)
{
    place(world, position);
    sim_step(world->sim);
}

// Moves the tool in a straight line; returns the least force along `out` after the first `skip`
// [m] of the way [N].
static double move_tool(VoxelWorld *world, Vec3 from, Vec3 to, double speed, double skip, Vec3 out)
{
    Vec3 way = vec3_sub(to, from);
    double length = vec3_length(way), least = (double)INFINITY;
    int ticks = (int)ceil(length / (speed * sim_tick(world->sim)));
    for (int i = 1; i <= ticks; i++) {
        step_at(world, vec3_madd(from, (double)i / ticks, way));
        double along = vec3_dot(sim_wrench(world->sim, 0)->force, out);
        if (length * i / ticks > skip)
            least = fmin(least, along);
    }
    return least;
}

static void expect_quiet(const VoxelWorld *world)
{
    assert_int_equal(world->body->resets, 0);
    assert_int_equal(sim_refused_faces(world->sim), 0);
}

// 40 mm at 0.1 m/s into the middle of a face, where four of them meet, into edges and corners. The
// tool is always pushed back, and its middle stays outside.
static void press_everywhere(VoxelWorldOptions (*make)(void), const char *name)
{
    static const Vec3 towards[] = {
        {0.0, 0.0, 1.0}, {0.1, 0.07, 1.0}, {1.0, 0.0, 1.0}, {1.0, 0.1, 0.9}, {1.0, 1.0, 1.0},
    };
    static const double radii[] = {0.002, 0.004, 0.010};
    for (int length = 0; length < 2; length++)
        for (int r = length; r < 3 - length; r++)
            for (int k = 0; k < (int)EFFORT(5); k++) {
                const double radius = radii[r];
                Vec3 t = towards[k], out = vec3_unit(t);
                VoxelWorldOptions options =
                    with_tool(held(make()), make_tool(length == 0 ? 0.0 : 0.03, radius));
                // Faces are pressed along their normal, beside the middle too.
                Vec3 surface = vec3_scale(HALF, t);
                if (k == 1)
                    out = vec3(0.0, 0.0, 1.0);
                SCOPED(voxel_world_destroy) VoxelWorld world;
                voxel_world_create(&world, &options);
                if (name[0] == 'b')
                    surface = vec3_scale(HALF, out);
                Vec3 from = vec3_madd(surface, 2.0 * radius + (length == 0 ? 0.0 : 0.02), out);
                Vec3 to = vec3_madd(surface, radius - 0.04, out);
                double way = vec3_length(vec3_sub(from, to));
                double least = move_tool(&world, from, to, 0.1, way - 0.03, out);
                Vec3 at;
                Quat turn;
                contact_proxy(world.sim->contact[0], &at, &turn);
                const ToolWrench *wrench = sim_wrench(world.sim, 0);
                print_message("%s %g %g %g, %s of %g mm: %.3g N, least %.3g N, overlap %.2g mm\n",
                              name, t.x, t.y, t.z, length == 0 ? "ball" : "capsule", radius * 1e3,
                              vec3_dot(wrench->force, out), least, wrench->depth * 1e3);
                expect_at_least(least, 1e-3);
                assert_true(voxel_world_is_outside(&world, at));
                expect_quiet(&world);
            }
}

static VoxelWorldOptions make_cube(void)
{
    return voxel_world_cube(16);
}

TEST(tools_pressed_into_a_cube_stay_outside)
{
    press_everywhere(make_cube, "cube");
}

TEST(tools_pressed_into_a_ball_stay_outside)
{
    press_everywhere(voxel_world_ball, "ball");
}

// The element forces of the readable solver, at the places where the real body came to rest.
static Vec3 reaction(const VoxelWorld *world, const VoxelWorldOptions *options)
{
    Lattice lattice = world->lattice;
    size_t cells = (size_t)lattice.count[0] * (size_t)lattice.count[1] * (size_t)lattice.count[2];
    lattice.label = zeroed(1, cells);
    memcpy(lattice.label, world->lattice.label, cells);
    VoxelBenchOptions plain = voxel_bench_options(options->body.body.levels);
    SCOPED(voxel_bench_destroy) VoxelBench bench;
    voxel_bench_create(&bench, &lattice, &plain);
    assert_int_equal(bench.vertex_count, world->count);
    for (int i = 0; i < world->count; i++)
        for (int k = 0; k < world->count; k++)
            if (bench.mesh.id[i] == world->id[k])
                bench.position[i] = world->x[k];
    voxel_bench_forces(&bench);
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int i = 0; i < world->count; i++)
        if (bench.rest[i].z < -0.0499)
            sum = vec3_add(sum, bench.force[i]);
    return sum;
}

// At rest the held vertices bear what the tool does: by the forces of another solver.
TEST(held_vertices_bear_what_the_tool_feels)
{
    for (int k = 0; k < 2; k++) {
        VoxelWorldOptions options =
            with_tool(held(voxel_world_cube(8)), make_tool(k == 0 ? 0.0 : 0.02, 0.01));
        options.body.damping = 1.0;
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options);
        const Vec3 press = {0.003, 0.004, HALF + 0.002};
        move_tool(&world, vec3(0.003, 0.004, HALF + 0.011), press, 0.1, 1.0, vec3(0, 0, 1));
        for (int i = 0; i < 12000; i++)
            step_at(&world, press);
        voxel_world_read(&world);
        Vec3 felt = sim_wrench(world.sim, 0)->force, borne = reaction(&world, &options);
        print_message("felt %.9g N, borne %.9g N\n", vec3_length(felt), vec3_length(borne));
        expect_at_least(felt.z, 0.1);
        // What is left of the swing after 12 s.
        expect_near(vec3_length(vec3_add(felt, borne)), 0.0, 1e-6 * felt.z);
    }
}

static Momentum read_momentum(void *world)
{
    Momentum sum;
    voxel_world_read(world);
    voxel_world_momentum(world, &sum.linear, &sum.angular);
    return sum;
}

TEST(body_and_tool_exchange_momentum_exactly)
{
    static const IntegratorKind integrators[] = {INTEGRATOR_SYMPLECTIC_EULER, INTEGRATOR_LEAPFROG};
    for (int k = 0; k < 2; k++) {
        VoxelWorldOptions options = with_tool(voxel_world_cube(8), make_tool(0.06, 0.006));
        options.body.body.integrator = integrators[k];
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options);
        const MomentumExchange sum =
            exchange_momentum(world.sim, 400, 0.02, 8.0, read_momentum, &world);
        print_message("of %.2g N s a tick %.2g is lost, angular %.2g\n", sum.impulse,
                      sum.impulse_lost / sum.impulse, sum.turn_lost / sum.moment);
        expect_at_least(sum.impulse, 1e-6);
        // Rounding of the body's own momentum, 1 kg at 0.1 m/s and more, to 1e-16 of it.
        expect_at_most(sum.impulse_lost, 1e-11 * sum.impulse);
        // The damping's rotation fit, regularised by 1e-9 (Gibson's omega), loses 1e-11.
        expect_at_most(sum.turn_lost, 1e-9 * sum.moment);
    }
}

// A tool that appears inside a solid, near its surface, is pushed out the nearest way; it never
// feels more than it may. Deep inside nothing holds it: it moves freely until it comes near.
TEST(a_tool_inside_is_let_out)
{
    for (int k = 0; k < 4; k++) {
        ToolOptions tool = make_tool(k % 2 == 0 ? 0.0 : 0.02, 0.006);
        tool.max_force = 3.0;
        VoxelWorldOptions options = with_tool(held(voxel_world_cube(16)), tool);
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options);
        const Vec3 start = {0.01, 0.005, k < 2 ? HALF - 0.004 : 0.0};
        double most = 0.0;
        Vec3 at;
        Quat turn;
        for (int i = 0; i < 100; i++) {
            step_at(&world, start);
            const ToolWrench *wrench = sim_wrench(world.sim, 0);
            most = fmax(most, vec3_length(wrench->force));
            // Where it is let out is told from the first tick on, without force as well.
            contact_proxy(world.sim->contact[0], &at, &turn);
            assert_true(k >= 2 ||
                        (wrench->contact && memcmp(&wrench->position, &at, sizeof at) == 0));
        }
        if (k < 2) {
            assert_true(voxel_world_is_outside(&world, at));
            expect_at_least(sim_wrench(world.sim, 0)->force.z, 0.01);
        } else {
            expect_near(most, 0.0, 0.0);
        }
        // Out through the top: it is free again, and the body comes to rest.
        for (int i = 0; i < 400; i++) {
            step_at(&world, vec3_madd(start, 0.25e-3 * i, vec3(0.0, 0.0, 1.0)));
            most = fmax(most, vec3_length(sim_wrench(world.sim, 0)->force));
        }
        contact_proxy(world.sim->contact[0], &at, &turn);
        expect_near(vec3_length(vec3_sub(at, world.sim->contact[0]->next.position)), 0.0, 0.0);
        expect_near(at.z, start.z + 0.25e-3 * 399, 1e-3);
        assert_false(sim_wrench(world.sim, 0)->contact);
        expect_at_most(most, tool.max_force * (1.0 + 1e-9));
        expect_quiet(&world);
    }
}

// Poses that jump: the proxy walks, meets the surface, and waits there.
TEST(jumps_stay_finite_and_outside)
{
    static const double jumps[] = {0.001, 0.01, 0.05, 0.1, 1.0};
    for (int k = 0; k < 5; k++) {
        ToolOptions tool = make_tool(0.0, 0.005);
        tool.max_force = 3.0;
        VoxelWorldOptions options = with_tool(held(voxel_world_cube(16)), tool);
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options);
        Vec3 above = {0.003, 0.004, HALF + 0.0051}, at;
        Quat turn;
        double most = 0.0;
        for (int i = 0; i < 20; i++)
            step_at(&world, above);
        above.z -= jumps[k];
        for (int i = 0; i < 200; i++) {
            step_at(&world, above);
            most = fmax(most, vec3_length(sim_wrench(world.sim, 0)->force));
        }
        contact_proxy(world.sim->contact[0], &at, &turn);
        print_message("jump of %g mm: %.3g N at most, the proxy %.3g mm from the pose\n",
                      jumps[k] * 1e3, most, 1e3 * vec3_length(vec3_sub(at, above)));
        assert_true(voxel_world_is_outside(&world, at));
        expect_at_most(most, tool.max_force * (1.0 + 1e-9));
        expect_at_least(sim_wrench(world.sim, 0)->force.z, 1e-3);
        expect_quiet(&world);
    }
}

// A plate one cell thick, thinner than the tool: the far side must not pull it through.
TEST(a_plate_of_one_cell_holds_a_thick_tool)
{
    static const FixedRegion rim = {
        .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {-0.0499, 1.0, 1.0}};
    for (int k = 0; k < 4; k++) {
        VoxelWorldOptions options = voxel_world_block(16, 16, 1, 0.00625);
        fix_within(&options.body.body, &rim);
        options = with_tool(options, make_tool(k % 2 == 0 ? 0.0 : 0.03, 0.010));
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options);
        // From above; and at the plate's narrow side.
        Vec3 out = k < 2 ? vec3(0.0, 0.0, 1.0) : vec3(0.0, 1.0, 0.0);
        Vec3 surface = k < 2 ? vec3(0.0, 0.0, 0.003125) : vec3(0.0, HALF, 0.0);
        Vec3 at;
        Quat turn;
        double least = move_tool(&world, vec3_madd(surface, 0.0101, out),
                                 vec3_madd(surface, 0.005, out), 0.1, 0.001, out);
        contact_proxy(world.sim->contact[0], &at, &turn);
        print_message("plate: least %.3g N, overlap %.2g mm\n", least,
                      1e3 * sim_wrench(world.sim, 0)->depth);
        expect_at_least(least, 1e-4);
        assert_true(voxel_world_is_outside(&world, at));
        expect_quiet(&world);
    }
}

// Two cubes that an edge joins, where four faces meet: pressed along the edge and into the notch.
TEST(an_edge_of_four_faces_pushes_back)
{
    VoxelWorldOptions options = voxel_world_cube(16);
    Lattice *lattice = &options.lattice;
    for (int k = 0; k < 16; k++)
        for (int j = 0; j < 16; j++)
            for (int i = 0; i < 16; i++)
                if (k >= 8 && (i < 8) == (j < 8)) // a quarter each, above a whole half
                    lattice->label[lattice_index(lattice, i, j, k)] = 0;
    options = with_tool(held(options), make_tool(0.0, 0.005));
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    // Down where the two quarters touch, and into a notch along its diagonal.
    Vec3 up = {0.0, 0.0, 1.0}, aside = vec3_unit(vec3(1.0, 1.0, 0.0)), at;
    Quat turn;
    double down = move_tool(&world, vec3(0.0, 0.0, HALF + 0.0051), vec3(0.0, 0.0, HALF - 0.005),
                            0.1, 0.004, up);
    contact_proxy(world.sim->contact[0], &at, &turn);
    assert_true(voxel_world_is_outside(&world, at));
    for (int i = 0; i < 50; i++) // away and round
        step_at(&world, vec3(0.0, 0.0, 0.1 + 1e-3 * i));
    step_at(&world, vec3(0.05, 0.05, 0.1));
    step_at(&world, vec3(0.05, 0.05, 0.03));
    double in =
        move_tool(&world, vec3(0.02, 0.02, 0.03), vec3(0.0015, 0.0015, 0.03), 0.1, 0.023, aside);
    contact_proxy(world.sim->contact[0], &at, &turn);
    print_message("four faces: %.3g N down, %.3g N into the notch\n", down, in);
    expect_at_least(down, 1e-3);
    expect_at_least(in, 1e-3);
    assert_true(voxel_world_is_outside(&world, at));
    expect_quiet(&world);
}

// A cube falls 1 mm on a table: it comes to rest, borne by its weight.
TEST(a_cube_rests_on_a_table)
{
    VoxelWorldOptions options = with_tool(voxel_world_cube(8), TABLE);
    options.body.body.gravity = vec3(0.0, 0.0, -9.81);
    options.body.damping = 1.0;
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    voxel_world_run(&world, 6.0);
    Vec3 force = sim_wrench(world.sim, 0)->force;
    double weight = 9.81 * world.body->mass;
    print_message("table: %.9g of the weight, overlap %.3g mm\n", -force.z / weight,
                  1e3 * sim_wrench(world.sim, 0)->depth);
    // What is left of the swing after 6 s.
    expect_near(-force.z / weight, 1.0, 1e-3);
    // A plane's penalty a node is a third of what the bound would bear (server/sim/README.md,
    // "Planes"): 981 Pa of weight over about a E / (3 h / 2) = 2.7e5 N/m3.
    expect_at_most(sim_wrench(world.sim, 0)->depth, 0.35 * 0.0125);
}

// Static capsules that lie inside a falling body, sticking out of it at both ends: they cannot
// leave, and hold it.
TEST(a_body_hangs_on_what_it_encloses)
{
    VoxelWorldOptions options = voxel_world_cube(16);
    options.body.body.gravity = vec3(0.0, 0.0, -9.81);
    for (options.tool_count = 0; options.tool_count < 2; options.tool_count++) {
        ToolOptions *tool = &options.tool[options.tool_count];
        const double x = options.tool_count == 0 ? -0.025 : 0.025;
        *tool = make_tool(0.0, 0.008);
        tool->id = 1 + options.tool_count;
        tool->kind = TOOL_STATIC;
        tool->capsule[0].from = vec3(x, -0.2, 0.0);
        tool->capsule[0].to = vec3(x, 0.2, 0.0);
    }
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    voxel_world_run(&world, 1.0); // 4.9 m of fall
    voxel_world_read(&world);
    Vec3 middle = {0.0, 0.0, 0.0};
    for (int i = 0; i < world.count; i++)
        middle = vec3_madd(middle, 1.0 / world.count, world.x[i]);
    expect_at_most(vec3_length(middle), 0.1);
    assert_int_equal(world.body->resets, 0);
}
