// SPDX-License-Identifier: MIT
// Graspers and attachments that hold bodies which adapt, are cut, hang on the world or follow a
// tool.
#include "test.h"
#include "effort.h"
#include "random.h"
#include "sim/hold/attachment_data.h"
#include "tied_bodies.h"

// --- Bodies that change ---

#define ADAPTS                                                                                     \
    "levels = 2; adapt = { force = 0.0005; speed = 0.05; curvature = 0.3; check_hz = 100.0; };"

AROUND_ALL(scratch_begin, scratch_end)

// Two balls that refine and coarsen under a kick, tied to each other: momentum stays exact, and the
// ties follow.
TEST(ties_follow_bodies_that_adapt)
{
    START_RUN(run, DOUBLE "bodies = ( " BALL("one", "[0, 0, 0]", ADAPTS) ",\n" BALL(
                       "two", "[0.102, 0, 0]",
                       ADAPTS) " );\n"
                               "attachments = ( { body = \"two\"; sphere = [0.052, 0, 0]; radius = "
                               "0.02; to_body = \"one\"; } );\n"
                               "loads = ( { body = \"one\"; center = [0, 0, 0.05]; radius = 0.03; "
                               "force = [5, 2, 1]; duration = 0.01; } );");
    Sim *sim = run.world.sim;
    int least = sim_attachment_nodes(sim, 0), most = least, changes[2] = {0, 0};
    sim_ticks(sim, 12);
    Momentum before = run_momentum(&run);
    double size = vec3_length(before.linear);
    for (int i = 0; i < EFFORT(1500); i++) {
        int topology[2];
        for (int b = 0; b < 2; b++)
            topology[b] = sim_body(sim, b)->mesh.topology;
        sim_step(sim);
        int ties = sim_attachment_nodes(sim, 0);
        least = ties < least ? ties : least;
        most = ties > most ? ties : most;
        for (int b = 0; b < 2; b++)
            changes[b] += sim_body(sim, b)->mesh.topology != topology[b];
        assert_true(sim_check(sim));
        assert_int_equal(sim_body(sim, 0)->substeps, sim_body(sim, 1)->substeps);
        Momentum now = run_momentum(&run);
        // Hundreds of changes that each round a thousand momenta.
        expect_at_most(vec3_length(vec3_sub(now.linear, before.linear)), 1e-9 * size);
    }
    assert_true(changes[0] > 5 && changes[1] > 5 && most > least);
    assert_int_equal(sim_resets(sim), 0);
}

static void create_adaptive(Run *run)
{
    run_create(run, DOUBLE
               "bodies = ( " BALL("one", "[0, 0, 0]",
                                  "shape = { angular_frequency = 50.0; damping_ratio = 0.3; };"
                                  "fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.025]); } "
                                  "); " ADAPTS) " );\n"
                                                "tools = ( { id = 3; kind = \"grasper\"; max_force "
                                                "= 100; capsules = ( { radius = 0.02; } ); } );");
}

// Pulls the top of the ball, as at tick `i`; returns how many nodes are held.
static int pull_top(Run *run, int i)
{
    ToolPose pose = {.position = {0, 0, 0.05 + fmin(0.02, 5e-5 * i)},
                     .orientation = {1, 0, 0, 0},
                     .active = true,
                     .grip = 1.0};
    sim_apply_pose(run->world.sim, 0, &pose, true);
    sim_step(run->world.sim);
    assert_true(sim_check(run->world.sim));
    bool points;
    return attachment_held(run->world.sim->attachment[0], &points);
}

// Jaws that pull a ball which refines around them; elsewhere it goes on with the same bits.
TEST(hold_grows_with_the_refinement_that_it_causes)
{
    SCOPED(run_destroy) Run run, other;
    create_adaptive(&run);
    create_adaptive(&other);
    int first = pull_top(&run, 0), most = first;
    for (int i = 1; i < 300; i++) {
        int held = pull_top(&run, i);
        most = held > most ? held : most;
    }
    FREED void *middle = malloc(state_bytes(&run.world.state));
    assert_non_null(middle);
    state_copy_out(&run.world.state, middle);
    state_copy_in(&other.world.state, middle);
    sim_restored(other.world.sim);
    assert_true(sim_check(other.world.sim));
    for (int i = 300; i < 500; i++) {
        int held = pull_top(&run, i);
        assert_int_equal(held, pull_top(&other, i));
        most = held > most ? held : most;
    }
    assert_true(state_hash(&run.world.state) == state_hash(&other.world.state));
    assert_true(most > 2 * first);
    expect_at_most(sim_wrench(run.world.sim, 0)->force.z, -0.1);
    assert_int_equal(sim_resets(run.world.sim), 0);
    assert_int_equal(sim_refused_holds(run.world.sim), 0);
}

// A body that is tied to another, held by the world and by jaws, cut to pieces through all of
// these.
static void cut_through_what_is_held(const char *body, double height)
{
    char text[4096];
    snprintf(
        text, sizeof text,
        DOUBLE "bodies = ( %s,\n" BALL(
            "two", "[0, 0, %g]",
            "") " );\n"
                "tools = ( { id = 3; kind = \"grasper\"; max_force = 100; "
                "capsules = ( { radius = 0.03; } ); } );\n"
                "attachments = ( { body = \"one\"; sphere = [0, 0, %g]; radius = 0.025; "
                "to_body = \"two\"; },\n"
                "{ body = \"one\"; sphere = [0, 0, %g]; radius = 0.03; to = \"world\"; },\n"
                "{ body = \"two\"; sphere = [0, 0, %g]; radius = 0.01; to_body = \"one\"; } );",
        body, height + 0.051, height, -height, height + 0.001);
    START_RUN(run, text);
    Sim *sim = run.world.sim;
    ToolPose pose = {
        .position = {height, 0, 0}, .orientation = {1, 0, 0, 0}, .active = true, .grip = 1.0};
    const int before[2] = {sim_attachment_nodes(sim, 0), sim_attachment_nodes(sim, 1)};
    uint64_t random = 17;
    int severed = 0;
    GraspEvent event = {0};
    for (int i = 0; i < 60; i++) {
        pose.position.x = height + 1e-4 * i;
        sim_apply_pose(sim, 0, &pose, true);
        if (i % 5 == 1) {
            Vec3 normal = vec3_unit(random_vec3(&random)),
                 aside = vec3_unit(vec3_cross(normal, random_vec3(&random)));
            Vec3 along = vec3_cross(normal, aside);
            double reach = 0.2;
            CutOptions cut = {.body = 0};
            for (int k = 0; k < 2; k++) {
                double s = k == 0 ? -reach : reach;
                cut.before.end[k] = vec3_add(vec3_scale(s, aside), vec3_scale(-reach, along));
                cut.after.end[k] = vec3_add(vec3_scale(s, aside), vec3_scale(reach, along));
            }
            CutOutcome sum;
            char why[256];
            severed += sim_apply_cut(sim, &cut, &sum, why, sizeof why);
        }
        sim_step(sim);
        assert_true(sim_check(sim));
        while (sim_next_grasp(sim, &event))
            ;
    }
    assert_true(severed > 3);
    assert_true(event.nodes > 0);
    assert_true(sim_attachment_nodes(sim, 0) > before[0]); // copies are held as their originals
    assert_true(sim_attachment_nodes(sim, 1) > before[1]);
    assert_int_equal(sim_resets(sim), 0);
}

TEST(what_is_held_stays_held_when_it_is_cut)
{
    cut_through_what_is_held(BALL("one", "[0, 0, 0]", "cuttable = true; levels = 1;"), 0.05);
    cut_through_what_is_held(
        "{ name = \"one\"; model = \"voxel\"; cuttable = true; levels = 1;\n"
        "  voxels = { generator = \"box\"; count = [8, 8, 8]; size = 0.0125; };\n"
        "  integrator = \"leapfrog\"; }",
        0.05);
}

// --- Held by the world and by tools ---

// Every node of a ball hangs on a spring of its own: k_i = g lambda m_i, so that all sink by
// 9.81 / (g lambda), without strain.
TEST(body_that_hangs_on_the_world_sinks_by_its_weight)
{
    START_RUN(run, DOUBLE "gravity = [0, 0, -9.81];\nbodies = ( " BALL(
                       "one", "[0, 0, 0]",
                       "") " );\n"
                           "attachments = ( { body = \"one\"; sphere = [0, 0, 0]; radius = 1; "
                           "to = \"world\"; stiffness = 0.02; damping_ratio = 0.7; } );");
    const Body *body = sim_body(run.world.sim, 0);
    assert_int_equal(sim_attachment_nodes(run.world.sim, 0), 162);
    sim_ticks(run.world.sim, 3000);
    double sink = 9.81 / (0.02 * body->contact_lambda);
    Momentum rest = run_momentum(&run);
    expect_at_most(vec3_length(rest.linear), 1e-12);
    expect_near(middle_of(&run, 0).z, -sink, 1e-9 * sink);
}

TEST(tool_holds_its_region_while_it_is_active)
{
    START_RUN(run,
              "bodies = ( " BALL(
                  "one", "[0, 0, 0]",
                  "") " );\n"
                      "tools = ( { id = 7; kind = \"probe\"; capsules = ( { from = [0, 0, 1]; "
                      "radius = 0.001; } ); } );\n"
                      "attachments = ( { body = \"one\"; sphere = [0, 0, 0.05]; radius = 0.02; "
                      "tool = 7; } );");
    Sim *sim = run.world.sim;
    const Attachment *hold = sim->attachment[0];
    sim_step(sim);
    assert_false(attachment_is_holding(hold));
    ToolPose pose = {.position = {1, 2, 3}, .orientation = {1, 0, 0, 0}, .active = true};
    for (int i = 0; i < 300; i++) {
        pose.position.x = 1.0 + 1e-4 * i;
        sim_apply_pose(sim, 0, &pose, true);
        sim_step(sim);
        assert_true(attachment_is_holding(hold));
        assert_true(i == 0 || sim_wrench(sim, 0)->contact);
    }
    // Thirty millimetres at 0.1 m/s, and the free ball was drawn along.
    expect_near(middle_of(&run, 0).x, 0.015, 0.01);
    pose.active = false;
    sim_apply_pose(sim, 0, &pose, true);
    sim_step(sim);
    assert_false(attachment_is_holding(hold));
    assert_false(sim_wrench(sim, 0)->contact);
}

// --- Graspers on voxel bodies ---

TEST(grasper_pulls_a_voxel_body_and_feels_it)
{
    START_RUN(run, DOUBLE "bodies = ( " BAR(
                       "bar", "") " );\n"
                                  "tools = ( { id = 3; kind = \"grasper\"; max_force = 100; "
                                  "capsules = ( { radius = 0.012; } ); } );");
    Sim *sim = run.world.sim;
    Momentum before = run_momentum(&run);
    ToolPose pose = {
        .position = {0.06, 0, 0}, .orientation = {1, 0, 0, 0}, .active = true, .grip = 1.0};
    double most = 0.0;
    for (int i = 0; i < 400; i++) {
        pose.position.x = 0.06 - 1e-4 * i;
        pose.orientation = quat_from_rotation(vec3(0.002 * i, 0.0, 0.0));
        sim_apply_pose(sim, 0, &pose, true);
        sim_step(sim);
        const ToolWrench *wrench = sim_wrench(sim, 0);
        Momentum now = run_momentum(&run);
        Vec3 rest = vec3_madd(vec3_sub(now.linear, before.linear), 1e-3, wrench->force);
        most = fmax(most, vec3_length(wrench->force));
        expect_at_most(vec3_length(rest), 1e-14); // of about 1e-3 N s
        before = now;
    }
    GraspEvent event;
    assert_true(sim_next_grasp(sim, &event));
    assert_int_equal(event.nodes, 4); // the corners of the end, 7 mm off; the next are 12.2
    assert_false(sim_next_grasp(sim, &event));
    assert_true(most > 1e-3);
    expect_near(middle_of(&run, 0).x, 0.1 - 0.04, 0.01); // taken along
    pose.grip = 0.0;
    sim_apply_pose(sim, 0, &pose, true);
    for (int i = 0; i < 101; i++) // at most ten are told a second
        sim_step(sim);
    assert_true(sim_next_grasp(sim, &event));
    assert_int_equal(event.nodes, 0);
}

// Jaws that pull the end of a held bar, below max_force: what they hold follows them within a
// millimetre.
TEST(jaws_keep_what_they_hold_of_a_solid_within_a_millimetre)
{
    START_RUN(
        run,
        DOUBLE "bodies = ( " BAR(
            "bar",
            "fixed = ( { box = ([0.13, -1, -1], [1, 1, 1]); } );") " );\n"
                                                                   "tools = ( { id = 3; kind = "
                                                                   "\"grasper\"; max_force = 5; "
                                                                   "capsules = ( { radius = 0.012; "
                                                                   "} ); } );");
    Sim *sim = run.world.sim;
    const Body *body = sim_body(sim, 0);
    const Attachment *grip = sim->attachment[0];
    ToolPose pose = {
        .position = {0.06, 0, 0}, .orientation = {1, 0, 0, 0}, .active = true, .grip = 1.0};
    Vec3 first[4], now[4];
    for (int i = 0; i < 1500; i++) {
        pose.position.x = 0.06 - fmin(3e-5 * i, 0.02);
        sim_apply_pose(sim, 0, &pose, true);
        sim_step(sim);
        body->ops->read_nodes(body->model, grip->node, 4, i == 0 ? first : now, NULL);
    }
    const double pull = vec3_length(sim_wrench(sim, 0)->force);
    double lag = 0.0;
    for (int i = 0; i < 4; i++)
        lag = fmax(lag, vec3_length(vec3_sub(vec3_sub(now[i], first[i]), vec3(-0.02, 0, 0))));
    print_message("%.3f N, %.4f mm behind\n", pull, 1e3 * lag);
    assert_true(pull > 0.05 && pull < 5.0);
    expect_at_most(lag, 1e-3);
}

// Returns the largest change of force in a tick, as a share of max_force, while jaws of a radius
// pull the top of a block by 30 mm in a second, and its nodes slip out.
static double steepest_slip(const char *levels, double youngs_modulus, double radius,
                            double max_force)
{
    char text[1024];
    snprintf(text, sizeof text,
             "bodies = ( { name = \"block\"; model = \"voxel\"; voxels = { generator = \"box\";\n"
             "  count = [12, 12, 12]; size = 0.004; }; %s\n"
             "  material = { youngs_modulus = %g; density = 1000.0; };\n"
             "  fixed = ( { box = ([-1.0, -1.0, -1.0], [1.0, 1.0, -0.023]); } ); } );\n"
             "tools = ( { id = 1; kind = \"grasper\"; max_force = %g;\n"
             "  capsules = ( { radius = %g; } ); } );",
             levels, youngs_modulus, max_force, radius);
    START_RUN(run, text);
    Sim *sim = run.world.sim;
    const Attachment *grip = sim->attachment[0];
    ToolPose pose = {.orientation = {1, 0, 0, 0}, .active = true, .grip = 1.0};
    Vec3 last = vec3(0, 0, 0);
    double steepest = 0.0, most = 0.0;
    bool points;
    int first = 0, left = 0;
    for (int i = 0; i < 1200 && grip->hold->ease == 0.0; i++) { // until the last has slipped
        pose.position = vec3(0.0005, 0.0003, 0.024 + fmin(3e-5 * i, 0.03));
        sim_apply_pose(sim, 0, &pose, true);
        sim_step(sim);
        const int held = attachment_held(grip, &points);
        first = i == 0 ? held : first;
        left = held;
        const Vec3 force = sim_wrench(sim, 0)->force;
        most = fmax(most, vec3_length(force));
        // Jaws that close draw what they hold into place within a few ticks.
        if (i > 50)
            steepest = fmax(steepest, vec3_length(vec3_sub(force, last)));
        last = force;
        assert_true(sim_check(sim));
    }
    expect_near(most, max_force, 1e-6 * max_force); // beyond it they slip
    assert_true(left < first);
    print_message("%d to %d %s: %.2g of %g N in a tick\n", first, left, points ? "points" : "nodes",
                  steepest / max_force, max_force);
    return steepest / max_force;
}

// What leaves is pulled with 2.5 % of max_force less in each tick, and takes some of its
// neighbours' load along: a twentieth is what a hand is promised.
TEST(force_is_steady_while_tissue_slips_out_of_jaws)
{
    expect_at_most(steepest_slip("levels = 2;", 1e4, 0.005, 2.0), 0.05);
    expect_at_most(steepest_slip("levels = 1;", 5e3, 0.006, 1.0), 0.05);
    // Points of faces, which share their corners, also jerk by 7 % while all of them are held.
    expect_at_most(steepest_slip("levels = 1;", 5e3, 0.0019, 0.2), 0.08);
}

// A trembling grip makes ten events a second at most, and the last one is the truth.
TEST(grasps_are_told_ten_times_a_second_at_most)
{
    START_RUN(run,
              "bodies = ( " BAR(
                  "bar",
                  "") " );\n"
                      "tools = ( { id = 3; kind = \"grasper\"; capsules = ( { radius = 0.012; } ); "
                      "} );");
    Sim *sim = run.world.sim;
    ToolPose pose = {.position = {0.06, 0, 0}, .orientation = {1, 0, 0, 0}, .active = true};
    GraspEvent event = {0};
    int told = 0;
    for (int i = 0; i < 1100; i++) { // the last release is eased over 20 ms and told later
        pose.grip = i < 900 && i % 2 == 0 ? 1.0 : 0.0;
        sim_apply_pose(sim, 0, &pose, true);
        sim_step(sim);
        while (sim_next_grasp(sim, &event))
            told++;
    }
    assert_in_range(told, 10, 12);
    assert_int_equal(event.nodes, 0);
}

// --- What a scene without them pays, and what is wrong with others ---

TEST(scene_without_graspers_has_nothing_of_them)
{
    START_RUN(run,
              "bodies = ( " BALL(
                  "one", "[0, 0, 0]",
                  "") " );\n"
                      "tools = ( { id = 3; kind = \"probe\"; capsules = ( { radius = 0.01; } ); } "
                      ");");
    for (int i = 0; i < sim_stage_count(run.world.sim); i++)
        assert_int_not_equal(sim_stage(run.world.sim, i), STAGE_GRASP);
    for (int i = 0; i < run.world.arena.count; i++) {
        assert_null(strstr(run.world.arena.block[i].name, "grasp"));
        assert_null(strstr(run.world.arena.block[i].name, "attachment"));
    }
}
