// SPDX-License-Identifier: MIT
// Bodies that steer their detail by the error that they estimate of themselves (adapt.error).
#include "test.h"
#include "kept_world.h"
#include "scene_text.h"

#include <stdio.h>

#if defined(PLIANT_WITH_VOXEL) && defined(PLIANT_WITH_HDF5)

AROUND_ALL(scratch_begin, scratch_end)

// The cube of 32 cells of the study, elements of 4 cells, and a ball of 5 cells.
static const char CUBE[] =
    "bodies = ( { name = \"a\"; model = \"voxel\"; levels = { surface = 2; }; %s\n"
    "  voxels = { generator = \"box\"; count = 32; size = 0.003125; };\n"
    "  material = { youngs_modulus = 10000.0; poisson_ratio = 0.3; };\n"
    "  fixed = ( { box = ([-1, -1, -1], [1, 1, -0.0499]); } ); } );\n"
    "tools = ( { id = 1; kind = \"probe\"; capsules = ( { radius = 0.015; } ); } );\n";
// 8 cells along an edge: elements of 2.
static const char SMALL[] =
    "bodies = ( { name = \"a\"; model = \"voxel\"; levels = { inside = 1; surface = 1; }; %s\n"
    "  voxels = { generator = \"box\"; count = 8; size = 0.0125; };\n"
    "  fixed = ( { box = ([-1, -1, -1], [1, 1, -0.0499]); } ); } );\n"
    "tools = ( { id = 1; kind = \"probe\"; capsules = ( { radius = 0.02; } ); } );\n";
// A wall whose faces are too large for its dimple.
static const char WALL[] =
    "bodies = ( { name = \"a\"; levels = 2; %s\n"
    "  mesh = { generator = \"ico_sphere\"; subdivisions = 2; radius = 0.05; };\n"
    "  material = { youngs_modulus_2d = 40.0; areal_density = 1.0; thickness = 0.002;\n"
    "    damping_time = 1e-4; };\n"
    "  shape = { angular_frequency = 50.0; damping_ratio = 0.3; };\n"
    "  fixed = ( { box = ([-1, -1, -1], [1, 1, -0.03]); } ); } );\n"
    "tools = ( { id = 1; kind = \"probe\"; capsules = ( { radius = 0.012; } ); } );\n";
// A sheet of edges of 20 mm.
static const char SHEET[] =
    "bodies = ( { name = \"a\"; %s\n"
    "  mesh = { generator = \"sheet\"; columns = 11; rows = 11; width = 0.2; height = 0.2; };\n"
    "  material = { youngs_modulus_2d = 80.0; areal_density = 4.2; thickness = 0.004;\n"
    "    damping_time = 4e-5; };\n"
    "  shape = { angular_frequency = 50.0; damping_ratio = 1.0; };\n"
    "  fixed = ( { box = ([-1, -1, -1], [-0.0999, 1, 1]); },\n"
    "    { box = ([0.0999, -1, -1], [1, 1, 1]); } ); } );\n"
    "tools = ( { id = 1; kind = \"probe\"; capsules = ( { radius = 0.015; } ); } );\n";
static const double TOP = 0.05; // [m]

static void open_world(World *world, const char *scene, const char *adapt, double error_hz)
{
    char text[1024];
    snprintf(text, sizeof text, scene, adapt);
    const size_t length = strlen(text);
    snprintf(text + length, sizeof text - length, "publish = { error_hz = %g; };\n", error_hz);
    Scene *read = read_kept(text);
    Status status = {0};
    const BuildOptions options = {.isa = "auto", .may_load = true, .publishes = true};
    expect_ok(world_build(world, read, &options, &status), status);
}

// Presses the ball into the middle of a place, and then drags it 40 mm to and fro.
static void drag(World *world, Vec3 place, double depth, double speed, int ticks)
{
    for (int k = 0; k < ticks; k++) {
        const double time = sim_time(world->sim), down = fmin(1.0, time / 0.3);
        const double way = fmod(speed * fmax(0.0, time - 0.3) + 0.02, 0.08);
        const double x = way < 0.04 ? way - 0.02 : 0.06 - way;
        const ToolPose pose = {.utime = (int64_t)(1e6 * time),
                               .position = vec3(place.x + x, place.y, place.z - depth * down),
                               .orientation = QUAT_NONE,
                               .active = true};
        sim_apply_pose(world->sim, 0, &pose, false);
        sim_step(world->sim);
    }
}

// Presses the ball into the middle of the top.
static void press(World *world, double radius, double depth, int ticks)
{
    drag(world, vec3(0.0, 0.0, TOP + radius), depth, 0.0, ticks);
}

static double get(World *world, BodyParameter parameter)
{
    const Body *body = sim_body(world->sim, 0);
    double value = -1.0;
    assert_true(body->ops->get(body->model, parameter, &value));
    return value;
}

// Returns the error by which the body is driven.
static double driving(World *world)
{
    SimError error;
    SimToolError tool[1];
    sim_error(world->sim, 0, &error);
    sim_tool_errors(world->sim, tool);
    assert_true(error.space > 0.0 && tool[0].force > 0.0 && tool[0].error >= 0.0);
    return fmax(error.relative, tool[0].error / tool[0].force);
}

// 0.030 with the usual distance around the tool, and 0.022 with all cells: between these the body
// finds the detail that it needs.
TEST(a_pressed_solid_comes_to_the_error_that_its_scene_asks_for)
{
    static const double ERROR[] = {0.028, 0.1};
    int elements[2];
    for (int i = 0; i < 2; i++) {
        SCOPED(world_destroy) World world;
        char adapt[64];
        snprintf(adapt, sizeof adapt, "adapt = { error = %g; };", ERROR[i]);
        open_world(&world, CUBE, adapt, 0.0);
        press(&world, 0.015, 0.01, 1200);
        const double fineness = get(&world, BODY_ADAPT_FINENESS);
        elements[i] = sim_body(world.sim, 0)->element_count;
        print_message("# error %g of %g, %d elements, fineness %g\n", driving(&world), ERROR[i],
                      elements[i], fineness);
        assert_true(i == 0 ? fineness > 1.0 : fineness < 1.0);
        assert_true(driving(&world) < ERROR[i]);
        assert_int_equal(sim_resets(world.sim), 0);
    }
    assert_true(elements[0] > elements[1]);
}

// 0.057 with the usual thresholds, of faces that four times smaller ones around the tool leave at
// 0.047, and 0.012 to 0.03 with thresholds of a hundredth.
TEST(a_pressed_wall_comes_to_the_error_that_its_scene_asks_for)
{
    SCOPED(world_destroy) World world;
    open_world(&world, WALL, "adapt = { error = 0.05; };", 0.0);
    press(&world, 0.012, 0.01, 2500);
    print_message("# error %g of 0.05, %d faces, fineness %g\n", driving(&world),
                  sim_body(world.sim, 0)->element_count, get(&world, BODY_ADAPT_FINENESS));
    assert_true(get(&world, BODY_ADAPT_FINENESS) > 1.0);
    assert_true(driving(&world) < 0.05);
}

// Faces change every few ticks then. Rounds that each change began again took up to 1100 ticks.
TEST(a_dragged_wall_is_steered_by_the_error_that_it_has)
{
    SCOPED(world_destroy) World world;
    SimError error;
    double sum = 0.0;
    int64_t oldest = 0;
    open_world(&world, SHEET, "levels = 2; adapt = { error = 0.03; };", 0.0);
    for (int k = 0; k < 400; k++) {
        drag(&world, vec3(0.0, 0.003, 0.0151), 0.008, 0.1, 10);
        sim_error(world.sim, 0, &error);
        if (k < 300)
            continue;
        sum += error.relative / 100.0;
        oldest = error.age > oldest ? error.age : oldest;
    }
    print_message("# error %g of 0.03, at most %d ticks old; %d faces, fineness %g\n", sum,
                  (int)oldest, sim_body(world.sim, 0)->element_count,
                  get(&world, BODY_ADAPT_FINENESS));
    // One round is under way, another has begun after it.
    assert_in_range(oldest, 1, 300);
    assert_true(get(&world, BODY_ADAPT_FINENESS) > 10.0);
    // 0.05 of what it has moved is what a wall of level 3 changes; a third of that is promised.
    // With hanging nodes where they were at another time it was 0.003.
    assert_true(sum > 0.016 && sum < 0.1);
}

// Of one place that is a node's, and of one between nodes.
TEST(the_force_on_a_tool_errs_by_what_a_finer_wall_changes)
{
    static const Vec3 PLACE[] = {{0.0, 0.0, 0.015}, {0.007, 0.004, 0.015}};
    for (int k = 0; k < 2; k++) {
        double force[2], error = 0.0;
        for (int finer = 0; finer < 2; finer++) {
            SCOPED(world_destroy) World world;
            SimToolError tool[1];
            open_world(&world, SHEET, finer ? "levels = 1; start_level = 1;" : "", 50.0);
            drag(&world, PLACE[k], 0.008, 0.0, 800);
            sim_tool_errors(world.sim, tool);
            force[finer] = tool[0].force;
            error = finer ? error : tool[0].error;
        }
        const double truth = fabs(force[1] - force[0]);
        print_message("# force %.4f N, estimated error %.4f N, in truth %.4f N\n", force[0], error,
                      truth);
        // Estimates of walls are 1.25 times what one level more changes (surface/error.c); a tenth
        // for rounds that have not converged. With nodes that tools hold it was 0.7 to 1.6 times.
        expect_near(error / truth, 1.25, 0.125);
    }
}

// Let go, a body swings through its rest shape, where it has hardly moved: its relative error is
// still one of the swing.
TEST(an_error_does_not_jump_when_a_body_swings)
{
    static const char SWINGS[] =
        "bodies = ( { name = \"a\"; model = \"voxel\"; levels = { inside = 2; surface = 2; }; %s\n"
        "  voxels = { generator = \"box\"; count = 16; size = 0.00625; };\n"
        "  fixed = ( { box = ([-1, -1, -1], [1, 1, -0.0499]); } ); } );\n"
        "tools = ( { id = 1; kind = \"probe\"; capsules = ( { radius = 0.012; } ); } );\n";
    SCOPED(world_destroy) World world;
    open_world(&world, SWINGS, "", 100.0);
    press(&world, 0.012, 0.008, 500);
    SimError error;
    sim_error(world.sim, 0, &error);
    const double pressed = error.relative;
    const ToolPose away = {.utime = (int64_t)(1e6 * sim_time(world.sim)), .orientation = QUAT_NONE};
    sim_apply_pose(world.sim, 0, &away, false);
    double most = 0.0;
    for (int k = 0; k < 500; k++) {
        sim_step(world.sim);
        sim_error(world.sim, 0, &error);
        most = fmax(most, error.relative);
    }
    print_message("pressed %.1f %%, afterwards at most %.1f %%, at last %.1f %%\n", 100.0 * pressed,
                  100.0 * most, 100.0 * error.relative);
    assert_true(error.relative >= 0.0);
    // A third more, as elements become larger; over what it has moved at that time 2.5 times.
    expect_at_most(most, 1.5 * pressed);
}

// What the cells themselves leave out is said once.
TEST(a_target_out_of_reach_is_reported_once)
{
    SCOPED(world_destroy) World world;
    open_world(&world, SMALL, "adapt = { error = 0.001; };", 0.0);
    int count = 0;
    for (int k = 0; k < 40; k++) {
        SimEvent event;
        press(&world, 0.02, 0.01, 50);
        while (sim_take_event(world.sim, &event)) {
            assert_string_equal(event.kind, "error");
            print_message("# %s\n", event.text);
            assert_int_equal(event.body, 0);
            count++;
        }
    }
    assert_int_equal(count, 1);
}

// Once there, it stays: a step changes the error by less than the width of the band.
TEST(detail_does_not_swing_while_a_tool_is_held)
{
    SCOPED(world_destroy) World world;
    open_world(&world, SMALL, "adapt = { error = 0.1; };", 0.0);
    press(&world, 0.02, 0.01, 2000);
    const double fineness = get(&world, BODY_ADAPT_FINENESS);
    const int elements = sim_body(world.sim, 0)->element_count;
    for (int k = 0; k < 20; k++) {
        press(&world, 0.02, 0.01, 50);
        expect_near(get(&world, BODY_ADAPT_FINENESS), fineness, 0.0);
        assert_int_equal(sim_body(world.sim, 0)->element_count, elements);
    }
}

// Neither what is published nor a checkpoint in the middle of a round changes what follows.
static void compare(const char *scene, const char *adapt, double radius, double speed)
{
    const Vec3 top = vec3(0.0, 0.0, TOP + radius);
    SCOPED(world_destroy) World world;
    SCOPED(world_destroy) World told;
    SCOPED(world_destroy) World again;
    open_world(&world, scene, adapt, 0.0);
    open_world(&told, scene, adapt, 100.0);
    open_world(&again, scene, adapt, 0.0);
    for (int k = 0; k < 6; k++) {
        drag(&world, top, 0.01, speed, 53); // rounds begin each 50 ticks at most, and take several
        drag(&told, top, 0.01, speed, 53);
        assert_int_equal(state_hash(&told.state), state_hash(&world.state));
        world_save(&world, "x.h5");
        assert_string_equal(world_load(&again, "x.h5"), "");
        assert_int_equal(state_hash(&again.state), state_hash(&world.state));
        drag(&world, top, 0.01, speed, 130);
        drag(&told, top, 0.01, speed, 130);
        drag(&again, top, 0.01, speed, 130);
        assert_int_equal(state_hash(&again.state), state_hash(&world.state));
    }
    assert_true(get(&world, BODY_ADAPT_FINENESS) != 1.0);
}

TEST(driven_bodies_move_the_same_with_errors_told_and_from_a_checkpoint)
{
    compare(SMALL, "adapt = { error = 0.05; };", 0.02, 0.0);
    compare(WALL, "adapt = { error = 0.02; };", 0.012, 0.0);
    compare(WALL, "adapt = { error = 0.02; };", 0.012, 0.1); // faces change within rounds
}

TEST(set_changes_the_error_that_is_asked_for_of_driven_bodies_alone)
{
    SCOPED(world_destroy) World world;
    SCOPED(world_destroy) World other;
    open_world(&world, SMALL, "adapt = { error = 0.05; };", 0.0);
    open_world(&other, SMALL, "", 0.0);
    char why[256] = "";
    assert_true(sim_apply_set(world.sim, "a.adapt_error", 0.01, why, sizeof why));
    expect_near(get(&world, BODY_ADAPT_ERROR), 0.01, 0.0);
    assert_false(sim_apply_set(world.sim, "adapt_error", 0.0, why, sizeof why));
    assert_string_equal(why, "adapt_error 0 outside [0.0001, 1]");
    assert_false(sim_apply_set(other.sim, "a.adapt_error", 0.01, why, sizeof why));
    assert_string_equal(why, "body a is not steered by its error (adapt.error)");
    // A RESET returns to the scene's.
    press(&world, 0.02, 0.01, 400);
    sim_reset(world.sim);
    expect_near(get(&world, BODY_ADAPT_ERROR), 0.05, 0.0);
    expect_near(get(&world, BODY_ADAPT_FINENESS), 1.0, 0.0);
}

#endif
