// SPDX-License-Identifier: MIT
// Bodies at the edge of what a scene can ask for: all held, a single element, cells that touch in a
// corner, more levels than fit, no damping, loads beyond reason.
#include "effort.h"
#include "test.h"
#include "sim_steps.h"
#include "voxel_reference.h"
#include "voxel_world.h"

#include "voxel/model.h"

static VoxelWorldOptions box(int x, int y, int z, int levels, Precision precision)
{
    VoxelWorldOptions options = voxel_world_block(x, y, z, 0.01);
    options.body.body.levels = levels;
    options.body.body.precision = precision;
    return options;
}

TEST(a_body_held_everywhere_stays)
{
    static const FixedRegion all = {.kind = FIXED_BOX, .low = {-1, -1, -1}, .high = {1, 1, 1}};
    for (int precision = 0; precision < PRECISION_COUNT; precision++) {
        VoxelWorldOptions options = box(6, 6, 6, 1, (Precision)precision);
        fix_within(&options.body.body, &all);
        options.body.body.gravity = vec3(0.0, 0.0, -9.81);
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options);
        voxel_world_run(&world, 0.1);
        voxel_world_read(&world);
        for (int i = 0; i < world.count; i++)
            assert_true(vec3_length(world.v[i]) == 0.0);
        assert_true(measure_of(world.body).max_displacement == 0.0);
        assert_int_equal(world.body->resets, 0);
        LoadOptions load = {.radius = 1.0, .force = {1.0, 0.0, 0.0}, .duration = 1.0};
        char why[128];
        assert_false(sim_apply_load(world.sim, &load, why, sizeof why)); // nobody could move
    }
}

// Stretched evenly by a little, one element with eight equal masses swings with
// omega^2 = 4 (2 mu + 3 lambda) / (rho H^2).
TEST(one_element_rings_at_its_frequency)
{
    for (int nu = 0; nu < 2; nu++) {
        VoxelWorldOptions options = box(1, 1, 1, 3, PRECISION_DOUBLE);
        options.material.poisson_ratio = nu == 0 ? 0.0 : 0.4;
        options.body.damping = 0.0;
        options.body.body.integrator = INTEGRATOR_LEAPFROG;
        const double dt0 = voxel_critical_step(&options.material, 0.01); // 2 / omega
        options.body.body.time_step = 1e-3 * dt0;
        options.rate_hz = 1.0 / options.body.body.time_step;
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options);
        assert_int_equal(world.count, 8);
        assert_int_equal(world.body->element_count, 1);
        Vec3 rest[8];
        for (int i = 0; i < 8; i++) {
            rest[i] = world.x[i];
            world.x[i] = vec3_scale(1.001, rest[i]);
        }
        voxel_world_write(&world, world.x, world.v);
        // Half a period, pi / omega = pi dt0 / 2: as small as it was large.
        voxel_world_run(&world, 0.5 * M_PI * dt0);
        voxel_world_read(&world);
        for (int i = 0; i < 8; i++) {
            Vec3 expected = vec3_scale(0.999, rest[i]);
            // (omega h)^2 / 24 of the phase, and up to half a tick, at the turning point: 1e-6 of
            // the swing of 1e-5 m.
            expect_near(vec3_length(vec3_sub(world.x[i], expected)), 0.0, 1e-10);
        }
    }
}

// Two cells that share a corner's place, and no vertex.
TEST(cells_that_touch_in_a_corner_do_not_know_of_each_other)
{
    for (int precision = 0; precision < PRECISION_COUNT; precision++) {
        VoxelWorldOptions options = box(2, 2, 2, 1, (Precision)precision);
        memset(options.lattice.label, 0, 8);
        options.lattice.label[0] = options.lattice.label[7] = 1;
        // The lower one is held at its low corner.
        const FixedRegion low = {
            .kind = FIXED_SPHERE, .center = {-0.01, -0.01, -0.01}, .radius = 1e-3};
        fix_within(&options.body.body, &low);
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options);
        assert_int_equal(world.count, 16);
        assert_int_equal(world.body->mesh.node_count, 16);
        Vec3 rest[16];
        memcpy(rest, world.x, sizeof rest);
        LoadOptions load = {
            .center = {0.01, 0.01, 0.01}, .radius = 1e-3, .force = {0.0, 0.0, 1e-3}, .duration = 1};
        apply_well(sim_apply_load, world.sim, &load);
        voxel_world_run(&world, 0.1);
        voxel_world_read(&world);
        // The upper one flies: F t^2 / 2 m, m = 1 g.
        double way = 0.0;
        for (int i = 0; i < 16; i++) {
            Vec3 u = vec3_sub(world.x[i], rest[i]);
            int piece = world.body->mesh.piece[i];
            assert_true(piece == 0 || piece == 1);
            if (piece == 0)
                expect_near(vec3_length(u), 0.0, 0.0);
            else
                way += u.z / 8.0;
        }
        // Symplectic Euler's sum, t (t + h) / 2; single: rounding.
        expect_near(way, 0.5 * 0.1 * (0.1 + world.body->h),
                    precision == PRECISION_SINGLE ? 1e-7 : 1e-12);
    }
}

// Nowhere in a slab of three layers is a cell without void around.
TEST(more_levels_than_fit_change_nothing)
{
    uint64_t hash[2];
    for (int k = 0; k < 2; k++) {
        VoxelWorldOptions options = box(20, 20, 3, k == 0 ? 0 : 5, PRECISION_SINGLE);
        options.body.body.gravity = vec3(0.0, 0.0, -9.81);
        const FixedRegion end = {.kind = FIXED_BOX, .low = {-1, -1, -1}, .high = {-0.09, 1, 1}};
        fix_within(&options.body.body, &end);
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options);
        assert_int_equal(world.body->element_count, 20 * 20 * 3);
        voxel_world_run(&world, 0.2);
        assert_int_equal(world.body->resets, 0);
        hash[k] = state_hash(&world.state);
    }
    assert_true(hash[0] == hash[1]);
}

// A thick slab with five levels allowed hangs from one side as the same without levels, to the few
// per cent that large elements inside cost.
TEST(a_slab_with_many_levels_sags_as_one_without)
{
    double sag[2];
    for (int k = 0; k < 2; k++) {
        VoxelWorldOptions options = box(40, 14, 14, k == 0 ? 0 : 5, PRECISION_SINGLE);
        options.body.body.gravity = vec3(0.0, 0.0, -9.81);
        options.material.youngs_modulus = 1e6;
        options.rate_hz = 200.0;
        const FixedRegion end = {.kind = FIXED_BOX, .low = {-1, -1, -1}, .high = {-0.199, 1, 1}};
        fix_within(&options.body.body, &end);
        SCOPED(voxel_world_destroy) VoxelWorld world;
        voxel_world_create(&world, &options);
        voxel_world_run(&world, 0.025); // on its way down
        sag[k] = measure_of(world.body).max_displacement;
        print_message("%d elements: %.5g m\n", world.body->element_count, sag[k]);
        assert_int_equal(world.body->resets, 0);
    }
    expect_near(sag[1] / sag[0], 1.0, 0.02);
}

// Its motion is bounded by the energy that it began with.
TEST(a_body_without_damping_swings_on)
{
    for (int precision = 0; precision < PRECISION_COUNT; precision++)
        for (int integrator = 1; integrator < 3; integrator++) {
            VoxelWorldOptions options = box(8, 8, 8, 2, (Precision)precision);
            options.body.damping = 0.0;
            options.body.body.integrator = (IntegratorKind)integrator;
            SCOPED(voxel_world_destroy) VoxelWorld world;
            voxel_world_create(&world, &options);
            // The step is the bound's, 0.9 dt0 (but a whole part of the tick).
            for (int i = 0; i < world.count; i++)
                world.x[i].x *= 1.05, world.x[i].z -= 0.3 * world.x[i].x * world.x[i].x;
            voxel_world_write(&world, world.x, world.v);
            const double start = measure_of(world.body).elastic;
            double most = 0.0;
            for (int i = 0; i < EFFORT(3000); i++) {
                sim_step(world.sim);
                if (i % 10 != 0)
                    continue;
                BodyMeasure now = measure_of(world.body);
                most = fmax(most, now.kinetic + now.elastic);
            }
            print_message("energy up to %.3g of the start's\n", most / start);
            // Near the bound the energy at the ends of steps swings by a factor.
            expect_at_most(most / start, 3.0);
            assert_int_equal(world.body->resets, 0);
        }
}

// Whatever a load does, the numbers stay sound. Once one has ended that drew the body out to many
// times its length, it gets its shape back; beyond, it may whirl around its held end for long.
TEST(loads_beyond_reason_are_survived)
{
    static const double forces[] = {1e1, 1e3, 1e5, 1e20, 1e38};
    for (int precision = 0; precision < PRECISION_COUNT; precision++)
        for (size_t k = 0; k < sizeof forces / sizeof *forces; k++) {
            VoxelWorldOptions options = box(8, 8, 8, 2, (Precision)precision);
            const FixedRegion end = {.kind = FIXED_BOX, .low = {-1, -1, -1}, .high = {1, 1, -0.03}};
            fix_within(&options.body.body, &end);
            options.body.damping = 2.0; // its slow swing ends within the test
            SCOPED(voxel_world_destroy) VoxelWorld world;
            SCOPED(voxel_reference_destroy) VoxelReference reference;
            voxel_world_create(&world, &options);
            voxel_reference_create(&reference, &options.body);
            LoadOptions load = {.center = {0.0, 0.0, 0.04},
                                .radius = 0.025,
                                .force = {forces[k], 0.0, forces[k]},
                                .duration = 0.1};
            apply_well(sim_apply_load, world.sim, &load);
            voxel_world_run(&world, 0.1);
            assert_true(world.body->ops->check(world.body->model));
            voxel_world_run(&world, forces[k] <= 1e3 ? 3.0 : 0.3);
            voxel_world_read(&world);
            memcpy(reference.position, world.x, (size_t)world.count * sizeof *world.x);
            print_message("%s, %.0e N: %d resets, then off by %.2g m\n",
                          precision == PRECISION_SINGLE ? "single" : "double", forces[k],
                          (int)world.body->resets, measure_of(world.body).max_displacement);
            assert_true(world.body->ops->check(world.body->model));
            if (forces[k] <= 1e3) {
                assert_int_equal(voxel_reference_inverted(&reference), 0);
                expect_at_most(measure_of(world.body).max_displacement, 1e-3); // of 0.08 m
            }
            sim_reset(world.sim);
            voxel_world_run(&world, 0.1);
            assert_true(measure_of(world.body).max_displacement == 0.0);
        }
}
