// SPDX-License-Identifier: MIT
// What a body says of itself against sums over its vertices and the readable element's energy, and
// what SET and loads do to it.
#include "effort.h"
#include "test.h"
#include "sim_steps.h"
#include "random.h"
#include "voxel_reference.h"
#include "voxel_world.h"

#include "voxel/model.h"

// Places and speeds from noise, so large that elements are turned over when `noise` is 1 cell.
static void scatter(VoxelWorld *world, VoxelReference *reference, double noise)
{
    uint64_t random = 21;
    for (int i = 0; i < world->count; i++) {
        Vec3 move = vec3_scale(noise * world->lattice.size, random_vec3(&random));
        reference->position[i] = vec3_add(world->x[i], move);
        reference->velocity[i] = random_vec3(&random);
    }
    voxel_world_write(world, reference->position, reference->velocity);
}

static void expect_measures(VoxelWorldOptions options, VoxelLaw law, double noise)
{
    options.body.law = law;
    SCOPED(voxel_world_destroy) VoxelWorld world;
    SCOPED(voxel_reference_destroy) VoxelReference reference;
    voxel_world_create(&world, &options);
    voxel_reference_create(&reference, &options.body);
    BodyMeasure at_rest = measure_of(world.body);
    expect_near(at_rest.kinetic, 0.0, 0.0);
    expect_near(at_rest.max_displacement, 0.0, 0.0);
    scatter(&world, &reference, noise);
    const BodyMeasure now = measure_of(world.body);
    double kinetic = 0.0, farthest = 0.0;
    for (int i = 0; i < reference.vertex_count; i++) {
        Vec3 u = vec3_sub(reference.position[i], reference.rest[i]), v = reference.velocity[i];
        kinetic += 0.5 * reference.mass[i] * vec3_dot(v, v);
        farthest = fmax(farthest, vec3_length(u));
    }
    const double elastic = voxel_reference_forces(&reference);
    expect_near(now.kinetic / kinetic, 1.0, 1e-12); // order of summation
    expect_near(now.max_displacement / farthest, 1.0, 1e-12);
    expect_near(now.elastic / elastic, 1.0, 1e-9);
    expect_near(at_rest.elastic / elastic, 0.0, 1e-20); // squares of rounding
    // Forces scaled by 3 have three times the energy.
    world.body->unsafe_time_step = true;
    apply_well(sim_apply_set, world.sim, "body.stiffness_scale", 3.0);
    expect_near(measure_of(world.body).elastic / (3.0 * elastic), 1.0, 1e-9);
}

TEST(energies_and_displacement_are_the_sums)
{
    for (int law = 0; law < 2; law++)
        for (int large = 0; large < 2; large++) {
            double noise = large == 0 ? 0.05 : 1.0;
            expect_measures(voxel_world_cube(8), (VoxelLaw)law, noise);
            expect_measures(voxel_world_ball(), (VoxelLaw)law, noise);
            if (law == VOXEL_AFFINE)
                expect_measures(voxel_world_corner(), (VoxelLaw)law, noise);
        }
}

TEST(single_precision_measures_the_same)
{
    double value[2][3];
    for (int precision = 0; precision < 2; precision++) {
        VoxelWorldOptions options = voxel_world_corner();
        options.body.body.precision = (Precision)precision;
        SCOPED(voxel_world_destroy) VoxelWorld world;
        SCOPED(voxel_reference_destroy) VoxelReference reference;
        voxel_world_create(&world, &options);
        voxel_reference_create(&reference, &options.body);
        scatter(&world, &reference, 0.1);
        BodyMeasure now = measure_of(world.body);
        value[precision][0] = now.kinetic;
        value[precision][1] = now.elastic;
        value[precision][2] = now.max_displacement;
    }
    for (int i = 0; i < 3; i++) // rounding of 6e-8 in each displacement, speed and strain
        expect_near(value[1][i] / value[0][i], 1.0, 1e-6);
}

TEST(masses_add_up)
{
    for (int law = 0; law < 2; law++) {
        VoxelWorldOptions options = voxel_world_corner();
        options.body.law = (VoxelLaw)law;
        double expected = 0.0;
        for (int c = 0; c < 12 * 6 * 12; c++)
            if (options.lattice.label[c] > 0)
                expected += VOXEL_WORLD_MATERIALS[options.lattice.label[c] - 1].density *
                            pow(options.lattice.size, 3);
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options);
        double sum = 0.0;
        for (int i = 0; i < world.count; i++)
            sum += world.mass[i];
        expect_near(sum / expected, 1.0, 1e-13); // sums of some hundred
        expect_near(world.body->mass / expected, 1.0, 1e-13);
    }
}

// The reference, set alike, goes on as the body does.
TEST(scales_and_gravity_act_from_the_next_tick)
{
    VoxelWorldOptions options = voxel_world_cube(6);
    options.body.body.levels = 1;
    options.body.body.unsafe_time_step = true; // the substeps stay as they are
    options.body.body.time_step = 2.5e-4;
    SCOPED(voxel_world_destroy) VoxelWorld world;
    SCOPED(voxel_reference_destroy) VoxelReference reference;
    voxel_world_create(&world, &options);
    voxel_reference_create(&reference, &options.body);
    scatter(&world, &reference, 0.1);
    char why[128];
    for (int k = 0; k < 4; k++) {
        if (k == 1) {
            assert_true(sim_apply_gravity(world.sim, vec3(1.0, -2.0, -3.0), why, sizeof why));
            reference.gravity = vec3(1.0, -2.0, -3.0);
        } else if (k == 2) {
            apply_well(sim_apply_set, world.sim, "stiffness_scale", 0.25);
            reference.stiffness_scale = 0.25;
        } else if (k == 3) {
            apply_well(sim_apply_set, world.sim, "body.damping_scale", 0.5);
            reference.damping_scale = 0.5;
        }
        double apart = 0.0;
        for (int i = 0; i < 20; i++) {
            sim_step(world.sim);
            voxel_reference_tick(&reference, world.body->substeps, world.body->h);
        }
        voxel_world_read(&world);
        for (int i = 0; i < world.count; i++)
            apart = fmax(apart, vec3_length(vec3_sub(world.x[i], reference.position[i])));
        expect_near(apart, 0.0, 1e-12); // rounding, as in test_voxel_trajectory
    }
}

TEST(a_body_without_damping_has_none_to_scale)
{
    VoxelWorldOptions options = voxel_world_cube(4);
    options.body.damping = 0.0;
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    const BodyOps *ops = world.body->ops;
    assert_false(ops->set(world.body->model, BODY_DAMPING_SCALE, 2.0));
    assert_true(ops->set(world.body->model, BODY_STIFFNESS_SCALE, 0.5));
    for (int p = BODY_ADAPT_FORCE; p <= BODY_ADAPT_LEVEL; p++)
        assert_false(ops->set(world.body->model, (BodyParameter)p, 1.0));
}

// A scale that the body's time step cannot bear is refused, by its default step.
TEST(scales_beyond_the_time_step_are_refused)
{
    VoxelWorldOptions options = voxel_world_cube(6);
    options.rate_hz = 250.0; // several substeps
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    char why[128] = "";
    assert_false(sim_apply_set(world.sim, "stiffness_scale", 100.0, why, sizeof why));
    assert_true(why[0] != '\0');
    apply_well(sim_apply_set, world.sim, "stiffness_scale", 0.01);
}

// Without elastic forces (a moment after rest) a load shows as momentum: the total is F t, and each
// vertex has its share of the area.
TEST(a_load_is_shared_by_area)
{
    VoxelWorldOptions options = voxel_world_cube(8);
    options.rate_hz = 1e6;
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    const VoxelModel *model = world.body->model;
    LoadOptions load = {
        .center = {0.01, 0.02, 0.05}, .radius = 0.033, .force = {0.3, -0.2, 0.5}, .duration = 2e-6};
    apply_well(sim_apply_load, world.sim, &load);
    sim_step(world.sim);
    voxel_world_read(&world);
    double area = 0.0;
    int inside = 0;
    for (int i = 0; i < model->surface_count; i++)
        if (vec3_length(vec3_sub(world.x[i], load.center)) <= load.radius) {
            area += world.body->surface.node_area[i];
            inside++;
        }
    assert_true(inside > 10);
    // A face of 0.1 m has 8 x 8 squares; those around the vertices inside are a part of it.
    expect_at_most(area, 0.1 * 0.1);
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int i = 0; i < world.count; i++) {
        Vec3 p = vec3_scale(world.mass[i], world.v[i]), expected = {0.0, 0.0, 0.0};
        bool in =
            i < model->surface_count &&
            vec3_length(vec3_sub(rows_rest(&model->vertices.rows, i), load.center)) <= load.radius;
        if (in)
            expected = vec3_scale(1e-6 * world.body->surface.node_area[i] / area, load.force);
        sum = vec3_add(sum, p);
        expect_near(vec3_length(vec3_sub(p, expected)) / 1e-6, 0.0, 1e-14); // [N], of 0.6
    }
    expect_near(vec3_length(vec3_sub(vec3_scale(1e6, sum), load.force)), 0.0, 1e-13);
    // Two ticks long, then it ends.
    sim_ticks(world.sim, 5);
    voxel_world_read(&world);
    sum = vec3(0.0, 0.0, 0.0);
    for (int i = 0; i < world.count; i++)
        sum = vec3_madd(sum, world.mass[i], world.v[i]);
    expect_near(vec3_length(vec3_sub(vec3_scale(0.5e6, sum), load.force)), 0.0, 1e-12);
}

TEST(areas_of_the_outer_vertices_add_up)
{
    VoxelWorldOptions options = voxel_world_cube(8);
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    double sum = 0.0;
    for (int i = 0; i < world.body->surface.node_count; i++)
        sum += world.body->surface.node_area[i];
    expect_near(sum, 6.0 * 0.1 * 0.1, 1e-15);
}

TEST(held_vertices_are_known_and_stay)
{
    // A lattice point by its id, a ball, and a box.
    const int point = 8 + 9 * (8 + 9 * 8); // the far corner
    const FixedRegion regions[3] = {
        {.kind = FIXED_NODES, .node = &point, .node_count = 1},
        {.kind = FIXED_SPHERE, .center = {0.0, 0.0, 0.0}, .radius = 0.02},
        {.kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, -0.0499}},
    };
    VoxelWorldOptions options = voxel_world_cube(8);
    options.body.body.fixed = regions;
    options.body.body.fixed_count = 3;
    options.body.body.gravity = vec3(5.0, 0.0, -9.81);
    SCOPED(voxel_world_destroy) VoxelWorld world;
    voxel_world_create(&world, &options);
    Vec3 start[9 * 9 * 9];
    int fixed = 0;
    for (int i = 0; i < world.count; i++)
        start[i] = world.x[i];
    voxel_world_run(&world, 0.2);
    voxel_world_read(&world);
    for (int i = 0; i < world.count; i++) {
        Vec3 x = start[i];
        bool held = x.z < -0.0499 || vec3_length(x) <= 0.02 || world.id[i] == point;
        assert_int_equal(world.body->ops->is_fixed(world.body->model, i), held);
        double moved = vec3_length(vec3_sub(world.x[i], x));
        if (held)
            assert_true(moved == 0.0 && vec3_length(world.v[i]) == 0.0);
        else
            assert_true(moved > 0.0);
        fixed += held;
    }
    assert_in_range(fixed, 9 * 9 + 1 + 1, 9 * 9 + 1 + 40);
}
