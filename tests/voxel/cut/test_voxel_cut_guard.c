// SPDX-License-Identifier: MIT
// Cuttable voxel bodies whose numbers go bad in the tick in which a blade goes through them: the
// cut stays, and the vertices that came are where those were that they are copies of.
#include "test.h"
#include "sim_steps.h"
#include "cut_bench.h"
#include "cut_world.h"

static void put_blade(CutWorld *world, double x)
{
    const ToolPose pose = {.utime = 1,
                           .position = {x, 0.003, 0.0},
                           .orientation = {1.0, 0.0, 0.0, 0.0},
                           .active = true};
    sim_apply_pose(world->sim, 0, &pose, true);
}

static bool is_number(Vec3 x)
{
    return vec3_length(x) < 1e3;
}

TEST(a_cut_in_a_bad_tick_stays_and_its_vertices_are_where_they_were)
{
    for (int precision = 0; precision < 2; precision++) {
        SCOPED(cut_world_destroy) CutWorld world;
        VoxelWorldOptions options = voxel_world_cube(6);
        options.body.body.precision = (Precision)precision;
        options.tool[options.tool_count++] =
            (ToolOptions){.id = 1,
                          .kind = TOOL_BLADE,
                          .edge = {{0.0, 0.0, -0.4}, {0.0, 0.0, 0.4}},
                          .max_force = 10.0};
        cut_world_create(&world, &options);
        uint64_t seed = 5;
        cut_world_shake(&world, 0.05, &seed);
        put_blade(&world, -0.2);
        sim_ticks(world.sim, 3);
        assert_int_equal(sim_resets(world.sim), 0);

        const Vertices *vertices = &world.model->vertices;
        const int count = vertices->count;
        FREED Vec3 *was = calloc((size_t)count, sizeof *was),
                   *moved = calloc((size_t)count, sizeof *moved);
        for (int i = 0; i < count; i++)
            rows_read(&vertices->rows, vertices_row(vertices), i, &was[i], &moved[i]);
        const LoadOptions huge = {.center = {0.04, 0.04, 0.04},
                                  .radius = 0.03,
                                  .force = {1e30, 0.0, 0.0},
                                  .duration = 1e-3};
        apply_well(sim_apply_load, world.sim, &huge);
        put_blade(&world, -0.12);
        sim_step(world.sim); // takes the blade along by less than 100 m/s
        put_blade(&world, -0.03);
        assert_int_equal(sim_resets(world.sim), 1);
        // Bad, and not yet cut: all of the state is back.
        for (int i = 0; i < count; i++) {
            Vec3 x, v;
            rows_read(&vertices->rows, vertices_row(vertices), i, &x, &v);
            assert_memory_equal(&x, &was[i], sizeof x);
            assert_memory_equal(&v, &moved[i], sizeof v);
        }
        sim_ticks(world.sim, 3); // the stroke begins anew
        for (int i = 0; i < count; i++)
            rows_read(&vertices->rows, vertices_row(vertices), i, &was[i], &moved[i]);
        apply_well(sim_apply_load, world.sim, &huge);
        put_blade(&world, 0.03);
        const int topology = world.body->mesh.topology;
        sim_step(world.sim);
        assert_int_equal(sim_resets(world.sim), 2);
        assert_true(world.body->mesh.topology > topology); // cut, and bad
        assert_true(vertices->count > count);
        for (int i = 0; i < vertices->count; i++) {
            Vec3 x, v;
            rows_read(&vertices->rows, vertices_row(vertices), i, &x, &v);
            assert_true(is_number(x));
            double nearest = 1.0;
            int from = 0;
            for (int k = 0; k < count; k++) {
                double distance = vec3_length(vec3_sub(x, was[k]));
                from = distance < nearest ? k : from;
                nearest = fmin(nearest, distance);
            }
            // Cells are 17 mm: no other vertex is as near. The same numbers are copied.
            expect_at_most(nearest, 0.0);
            expect_at_most(vec3_length(vec3_sub(v, moved[from])), 0.0);
        }
        assert_true(world.body->ops->check(world.model));
        cut_world_check_masses(&world);
        sim_ticks(world.sim, 200);
        assert_int_equal(sim_resets(world.sim), 2);
    }
}
