// SPDX-License-Identifier: MIT
// Solids of a scene that adapt: fine where a tool is and coarse again behind it, within what SET
// allows, and the same from a checkpoint.
#include "test.h"
#include "kept_world.h"
#include "scene_text.h"

#if defined(PLIANT_WITH_VOXEL) && defined(PLIANT_WITH_HDF5)

AROUND_ALL(scratch_begin, scratch_end)

// A cube of 16 cells, 4 elements of 4 cells along each edge, on its bottom; a ball of 2 cells.
#define CUBE                                                                                       \
    "gravity = [0.0, 0.0, -1.0];\n"                                                                \
    "bodies = ( { name = \"a\"; model = \"voxel\"; levels = { surface = 2; };\n"                   \
    "  voxels = { generator = \"box\"; count = 16; size = 0.005; };\n"                             \
    "  fixed = ( { box = ([-1, -1, -1], [1, 1, -0.0399]); } ); } );\n"                             \
    "tools = ( { id = 1; kind = \"probe\"; capsules = ( { radius = 0.01; } ); } );\n"
enum { UNTOUCHED = 4 * 4 * 4 };
static const double TOP = 0.04; // [m]

static void open_scene(World *world, const char *text)
{
    Scene *scene = read_kept(text);
    Status status = {0};
    const BuildOptions options = {.isa = "auto", .may_load = true};
    expect_ok(world_build(world, scene, &options, &status), status);
}

static void open_world(World *world)
{
    open_scene(world, CUBE);
}

static void go(World *world, bool active, Vec3 position, int ticks)
{
    for (int k = 0; k < ticks; k++) {
        const ToolPose pose = {.utime = 1000 * sim_steps(world->sim),
                               .position = position,
                               .orientation = QUAT_NONE,
                               .active = active};
        sim_apply_pose(world->sim, 0, &pose, false);
        sim_step(world->sim);
    }
}

static int elements(const World *world)
{
    return sim_body(world->sim, 0)->element_count;
}

static void set(World *world, const char *key, double value)
{
    char why[256] = "";
    if (!sim_apply_set(world->sim, key, value, why, sizeof why))
        fail_msg("%s", why);
}

static const Vec3 AT = {0.004, -0.006, 0.045}; // a cell deep in the top

TEST(a_solid_is_fine_around_a_tool_and_at_load_again_behind_it)
{
    SCOPED(world_destroy) World world;
    open_world(&world);
    const Body *body = sim_body(world.sim, 0);
    const int topology = body->mesh.topology;
    assert_int_equal(elements(&world), UNTOUCHED);
    assert_int_equal(body->finest_level, 0);
    // Within 50 ms of a pose the tool is there; it waits 1 cell above the surface.
    go(&world, true, vec3(AT.x, AT.y, TOP + 0.015), 100);
    const int near = elements(&world);
    assert_true(near > UNTOUCHED);
    assert_int_equal(body->finest_level, 2);
    go(&world, true, AT, 100);
    assert_true(elements(&world) >= near);
    assert_true(sim_wrench(world.sim, 0)->contact);
    // It has come to rest again after a second, and merges a few elements in each tick.
    go(&world, false, AT, 2000);
    assert_int_equal(elements(&world), UNTOUCHED);
    assert_int_equal(body->finest_level, 0);
    // Nobody saw another mesh.
    assert_int_equal(body->mesh.topology, topology);
    assert_int_equal(sim_resets(world.sim), 0);
}

// A body of this that is held in one way or another, whose weight does not bend it so much that it
// stays divided.
#define HELD(gravity, fixed, more, tool)                                                           \
    "gravity = [0.0, 0.0, " gravity "];\n"                                                         \
    "bodies = ( { name = \"a\"; model = \"voxel\"; levels = { surface = 2; };\n"                   \
    "  voxels = { generator = \"box\"; count = 16; size = 0.005; }; " fixed                        \
    "  material = { youngs_modulus = 1.0e4; poisson_ratio = 0.3; density = 1000.0; drag = 20.0;"   \
    "  }; } );\n" more                                                                             \
    "tools = ( { id = 1; kind = \"probe\"; capsules = ( { radius = 0.01; } ); }" tool " );\n"
#define BOTTOM "  fixed = ( { box = ([-1, -1, -1], [1, 1, -0.0399]); } );"
#define SIDE   "  fixed = ( { box = ([-1, -1, -1], [-0.0399, 1, 1]); } );"
#define TIED                                                                                       \
    "attachments = ( { body = \"a\"; sphere = [-0.04, 0.0, 0.0]; radius = 0.016;"                  \
    "  to = \"world\"; } );\n"
#define PLANE                                                                                      \
    ", { id = 2; kind = \"static\"; plane = { point = [0, 0, -0.04]; normal = [0, 0, 1]; }; }"

TEST(held_bodies_have_the_elements_of_before_when_a_tool_has_left)
{
    static const char *const SCENES[] = {
        HELD("0.0", SIDE, "", ""), HELD("0.0", BOTTOM, TIED, ""), HELD("-9.81", BOTTOM, "", ""),
        HELD("-2.0", BOTTOM, TIED, ""), HELD("-9.81", "", "", PLANE)};
    for (size_t s = 0; s < sizeof SCENES / sizeof *SCENES; s++) {
        SCOPED(world_destroy) World world;
        open_scene(&world, SCENES[s]);
        go(&world, false, AT, 800);
        const int before = elements(&world);
        // Beside what is held.
        go(&world, true, vec3(-0.016, 0.0016, TOP + 0.015), 100);
        go(&world, true, vec3(-0.016, 0.0016, TOP + 0.006), 100);
        go(&world, true, vec3(0.0, 0.0016, TOP + 0.006), 100);
        const int touched = elements(&world);
        go(&world, false, AT, 3000);
        print_message("scene %zu: %d elements, touched %d, %d\n", s, before, touched,
                      elements(&world));
        assert_true(touched > before);
        assert_int_equal(elements(&world), before);
        assert_int_equal(sim_resets(world.sim), 0);
    }
}

TEST(set_makes_the_fine_surroundings_of_tools_smaller_and_coarser)
{
    SCOPED(world_destroy) World world;
    open_world(&world);
    const Vec3 at = vec3(AT.x, AT.y, TOP + 0.011); // just above: nothing bends
    go(&world, true, at, 200);
    const int whole = elements(&world);
    set(&world, "adapt_scale", 8.0);
    go(&world, true, at, 400);
    const int less = elements(&world);
    assert_true(less < whole && less > UNTOUCHED);
    set(&world, "adapt_scale", 1.0);
    // What it touches stays fine; farther off it is as coarse as it is told.
    set(&world, "adapt_level", 0.0);
    go(&world, true, at, 400);
    assert_true(elements(&world) < whole && elements(&world) > UNTOUCHED);
    assert_int_equal(sim_body(world.sim, 0)->finest_level, 2);
    const Vec3 off = vec3(AT.x, AT.y, TOP + 0.017); // more than a cell
    set(&world, "adapt_level", 1.0);
    go(&world, false, at, 1000); // what was touched merges
    go(&world, true, off, 400);
    assert_int_equal(sim_body(world.sim, 0)->finest_level, 1);
    set(&world, "adapt_level", 0.0);
    go(&world, false, at, 1000);
    go(&world, true, off, 400);
    assert_int_equal(elements(&world), UNTOUCHED);
    set(&world, "adapt_level", 8.0);
    go(&world, true, at, 400);
    assert_true(elements(&world) >= whole); // and what it left on its way there
    // Thresholds of walls mean nothing to it.
    char why[256] = "";
    assert_false(sim_apply_set(world.sim, "adapt_force", 1.0, why, sizeof why));
}

// The state while elements are divided and merged is all that the next ticks follow from.
TEST(a_checkpoint_continues_while_elements_change)
{
    SCOPED(world_destroy) World world;
    SCOPED(world_destroy) World again;
    open_world(&world);
    open_world(&again);
    go(&world, true, vec3(AT.x, AT.y, TOP + 0.03), 50);
    for (int k = 0; k < 4; k++) {
        go(&world, true, vec3(AT.x - 0.005 * k, AT.y, AT.z), 7);
        world_save(&world, "x.h5");
        assert_string_equal(world_load(&again, "x.h5"), "");
        assert_int_equal(elements(&again), elements(&world));
        assert_int_equal(state_hash(&again.state), state_hash(&world.state));
        go(&world, true, vec3(AT.x - 0.005 * k, AT.y, AT.z), 40);
        go(&again, true, vec3(AT.x - 0.005 * k, AT.y, AT.z), 40);
        assert_int_equal(state_hash(&again.state), state_hash(&world.state));
    }
    assert_true(elements(&world) > UNTOUCHED);
}

TEST(a_body_that_adapts_is_cut_only_if_it_is_cuttable)
{
    SCOPED(world_destroy) World world;
    open_world(&world);
    const Body *body = sim_body(world.sim, 0);
    assert_null(body->ops->cut);
    assert_null(body->ops->remove);
    assert_non_null(body->ops->approach);
}

#endif
