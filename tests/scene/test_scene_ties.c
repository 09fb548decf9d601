// SPDX-License-Identifier: MIT
// Attachments that tie bodies to each other, surface and voxel: momentum, steps, checkpoints.
#include "test.h"
#include "effort.h"
#include "tied_bodies.h"

#include "io/checkpoint.h"

// A kick on the first body; from then on nothing acts from outside.
static void kicked_pair_keeps_its_momentum(const char *bodies, const char *region, double angular)
{
    char text[4096];
    snprintf(text, sizeof text,
             DOUBLE "bodies = ( %s );\n"
                    "attachments = ( { body = \"two\"; %s to_body = \"one\"; } );\n"
                    "loads = ( { body = \"one\"; center = [0, 0, 0.05]; radius = 0.03;\n"
                    "  force = [0.5, 2.0, 1.0]; duration = 0.01; } );",
             bodies, region);
    START_RUN(run, text);
    Sim *sim = run.world.sim;
    assert_true(sim_attachment_nodes(sim, 0) >= 3);
    assert_int_equal(sim_body(sim, 0)->substeps, sim_body(sim, 1)->substeps);
    Vec3 start[2] = {middle_of(&run, 0), middle_of(&run, 1)};
    sim_ticks(sim, 12);
    const Momentum before = run_momentum(&run);
    double size = vec3_length(before.linear);
    expect_near(size, 0.01 * sqrt(0.25 + 4.0 + 1.0), 1e-9);
    double turn = 0.05 * size; // an arm of the ball's size
    for (int i = 0; i < EFFORT(1500); i++) {
        sim_step(sim);
        Momentum now = run_momentum(&run);
        expect_at_most(vec3_length(vec3_sub(now.linear, before.linear)), 1e-12 * size);
        expect_at_most(vec3_length(vec3_sub(now.angular, before.angular)), angular * turn);
    }
    // The other one was taken along, and they are still together.
    Vec3 moved = vec3_sub(middle_of(&run, 1), start[1]);
    assert_true(vec3_length(moved) > 0.005);
    double apart = vec3_length(vec3_sub(middle_of(&run, 1), middle_of(&run, 0)));
    expect_near(apart, vec3_length(vec3_sub(start[1], start[0])), 0.03);
}

AROUND_ALL(scratch_begin, scratch_end)

TEST(bodies_tied_to_each_other_exchange_momentum_exactly)
{
    // Surfaces: forces along springs, round-off alone.
    kicked_pair_keeps_its_momentum(
        BALL("one", "[0, 0, 0]", "") ",\n" BALL("two", "[0.102, 0, 0]", ""),
        "sphere = [0.052, 0, 0]; radius = 0.02;", 1e-10);
    // Voxels: elements turn with their fitted rotation, whose moments cancel to first order only.
    kicked_pair_keeps_its_momentum(BALL("one", "[0, 0, 0]", "") ",\n" BAR("two", ""),
                                   "box = ([0.0, -1.0, -1.0], [0.0601, 1.0, 1.0]);", 1e-3);
}

// In the middle of everything the state is all that counts.
TEST(joined_bodies_repeat_bit_for_bit)
{
    START_RUN(run, "bodies = ( " BALL("one", "[0, 0, 0]", "") ",\n" BAR(
                       "two", "") " );\n"
                                  "attachments = ( { body = \"two\"; box = ([0, -1, -1], "
                                  "[0.0601, 1, 1]); to_body = \"one\"; } );\n"
                                  "loads = ( { body = \"one\"; center = [0, 0, 0.05]; radius = "
                                  "0.03; force = [0, 1, 1]; duration = 0.05; } );");
    FREED void *middle = malloc(state_bytes(&run.world.state));
    assert_non_null(middle);
    uint64_t hash[2];
    sim_ticks(run.world.sim, 40);
    state_copy_out(&run.world.state, middle);
    for (int pass = 0; pass < 2; pass++) {
        sim_ticks(run.world.sim, 60);
        hash[pass] = state_hash(&run.world.state);
        state_copy_in(&run.world.state, middle);
        sim_restored(run.world.sim);
        assert_true(sim_check(run.world.sim));
    }
    assert_true(hash[0] == hash[1]);
}

static double *state_numbers(Run *run, const char *name)
{
    for (int i = 0; i < run->world.state.count; i++)
        if (strcmp(run->world.state.array[i].name, name) == 0)
            return state_memory(&run->world.state.array[i]);
    fail_msg("no array %s", name);
    return NULL;
}

// From such numbers every tick would come out beyond bounds, for ever.
TEST(holds_and_ties_beyond_all_bounds_are_refused)
{
    START_RUN(
        run,
        "bodies = ( " BALL("one", "[0, 0, 0]", "") ",\n" BAR(
            "two",
            "") " );\n"
                "attachments = ( { body = \"two\"; box = ([0, -1, -1], [0.0601, 1, 1]); "
                "to_body = \"one\"; },\n"
                "{ body = \"two\"; box = ([0.1399, -1, -1], [0.2, 1, 1]); to = \"world\"; } );");
    sim_step(run.world.sim);
    assert_true(sim_check(run.world.sim));
    double *weight = state_numbers(&run, "two/attachment0/ties") + 2; // after node and face
    double saved[2] = {weight[0], weight[1]};
    weight[0] = 1e300, weight[1] = -1e300; // with a third of 1 they sum up to 1
    weight[2] += saved[0] + saved[1];
    assert_false(sim_check(run.world.sim));
    weight[2] -= saved[0] + saved[1];
    weight[0] = saved[0], weight[1] = saved[1];
    assert_true(sim_check(run.world.sim));
    double *place = state_numbers(&run, "two/attachment1/places");
    place[0] = 1e300;
    assert_false(sim_check(run.world.sim));
}

#ifdef PLIANT_WITH_HDF5
// Through a file too.
TEST(holds_and_ties_are_in_checkpoints)
{
    const char *text = "bodies = ( " BALL("one", "[0, 0, 0]", "") ",\n" BAR(
        "two",
        "") " );\n"
            "tools = ( { id = 3; kind = \"grasper\"; capsules = ( { radius = 0.02; } ); } );\n"
            "attachments = ( { body = \"two\"; box = ([0, -1, -1], [0.0601, 1, 1]); to_body = "
            "\"one\"; },\n"
            "{ body = \"two\"; box = ([0.1399, -1, -1], [0.2, 1, 1]); to = \"world\"; } );";
    SCOPED(run_destroy) Run run, other;
    run_create(&run, text);
    run_create(&other, text);
    ToolPose pose = {
        .position = {0, 0, 0.05}, .orientation = {1, 0, 0, 0}, .active = true, .grip = 1.0};
    for (int i = 0; i < 100; i++) {
        pose.position.z = 0.05 + 1e-4 * i;
        sim_apply_pose(run.world.sim, 0, &pose, true);
        sim_step(run.world.sim);
    }
    char path[SCRATCH_PATH];
    Status status = {0};
    WorldImage image;
    world_image_reserve(&image, &run.world.arena, &run.world);
    world_image_take(&image, &run.world);
    assert_true(
        checkpoint_write(scratch_path(&scratch_space, "a.h5", path), &image, &run.world, &status));
    assert_true(checkpoint_read(path, &other.world, &status));
    assert_true(attachment_is_holding(other.world.sim->attachment[0]) ||
                attachment_is_holding(other.world.sim->attachment[1]));
    for (int i = 0; i < 100; i++) {
        sim_apply_pose(run.world.sim, 0, &pose, true);
        sim_apply_pose(other.world.sim, 0, &pose, true);
        sim_step(run.world.sim);
        sim_step(other.world.sim);
    }
    assert_true(state_hash(&run.world.state) == state_hash(&other.world.state));
}
#endif

// Two free balls tied by many springs, shaken once, with a step of 1 / 0.9 of the bound, the 0.9
// being for safety: whether they stay bounded. `bound_of`: the stiffness that the bound counts.
static bool ties_are_stable(double stiffness, double bound_of)
{
    static const char format[] =
        "rate_hz = %.17g;\n" DOUBLE "bodies = ( " BALL("one", "[0, 0, 0]", "%s") ",\n" BALL(
            "two", "[0.102, 0, 0]", "%s") " );\n"
                                          "attachments = ( { body = \"two\"; sphere = "
                                          "[0.052, 0, 0]; radius = 0.04; to_body = "
                                          "\"one\"; stiffness = %g; } );\n"
                                          "loads = ( { body = \"one\"; center = [0.05, "
                                          "0, 0]; radius = 0.02; force = [0.5, 0.2, 0.1]; "
                                          "duration = 0.002; } );";
    char step[128] = "";
    SCOPED(run_destroy) Run run;
    run_format(&run, format, 1000.0, step, step, bound_of);
    double limit = sim_body(run.world.sim, 0)->time_step_limit;
    limit = fmin(limit, sim_body(run.world.sim, 1)->time_step_limit) / 0.9;
    run_destroy(&run);
    snprintf(step, sizeof step, "time_step = %.17g; unsafe_time_step = true;", limit);
    run_format(&run, format, 1.0 / limit, step, step, stiffness);
    assert_int_equal(sim_body(run.world.sim, 0)->substeps, 1);
    sim_ticks(run.world.sim, EFFORT(3000));
    BodyMeasure measure;
    const Body *body = sim_body(run.world.sim, 0);
    body->ops->measure(body->model, &measure);
    bool stable = sim_resets(run.world.sim) == 0 && measure.kinetic < 1.0;
    return stable;
}

TEST(step_bound_counts_ties)
{
    static const double stiffness[] = {0.1, 1.0, 10.0};
    for (int k = 0; k < 3; k++)
        assert_true(ties_are_stable(stiffness[k], stiffness[k]));
    assert_false(ties_are_stable(100.0, 0.3)); // the bound is needed
}

// The softer of two bodies with many substeps sets the pace of both.
TEST(joined_bodies_take_the_same_steps)
{
    START_RUN(run, "bodies = ( " BALL("one", "[0, 0, 0]", "time_step = 0.0001; ") ",\n" BALL(
                       "two", "[0.102, 0, 0]", "") ",\n" BALL("three", "[0, 0, 1]",
                                                              "") " );\n"
                                                                  "attachments = ( { body = "
                                                                  "\"two\"; sphere = [0.052, 0, "
                                                                  "0]; radius = 0.02; to_body = "
                                                                  "\"one\"; } );");
    assert_int_equal(sim_body(run.world.sim, 0)->substeps, 10);
    assert_int_equal(sim_body(run.world.sim, 1)->substeps, 10);
    assert_true(sim_body(run.world.sim, 2)->substeps < 10);
}
