// SPDX-License-Identifier: MIT
// A wall whose numbers go bad in the tick in which a blade goes through it: the cut stays, nodes
// that were there have what they had, and their copies the same.
#include "wall_bench.h"

#include "test.h"
#include "sim_steps.h"

static void put_blade(DetailBench *bench, double x)
{
    const ToolPose pose = {.utime = 1,
                           .position = {x, 0.003, 0.0},
                           .orientation = {1.0, 0.0, 0.0, 0.0},
                           .active = true};
    sim_apply_pose(bench->sim, 0, &pose, true);
}

typedef struct Row {
    bool on;
    Vec3 x, v;
} Row;

static Row *read_all(const DetailBench *bench)
{
    const int count = bench->body->surface.node_count;
    Row *row = calloc((size_t)count, sizeof *row);
    for (int i = 0; i < count; i++) {
        row[i].on = bench->detail->set.status[i] != NODE_OFF;
        if (row[i].on)
            wall_read_row(bench, i, &row[i].x, &row[i].v);
    }
    return row;
}

TEST(a_cut_in_a_bad_tick_stays_and_its_nodes_are_where_they_were)
{
    for (int precision = 0; precision < 2; precision++) {
        const ToolOptions blade = {.id = 1,
                                   .kind = TOOL_BLADE,
                                   .edge = {{0.0, 0.0, -0.4}, {0.0, 0.0, 0.4}},
                                   .max_force = 10.0};
        const LoadOptions huge = {.center = {0.0, 0.0, 0.04},
                                  .radius = 0.03,
                                  .force = {1e30, 0.0, 0.0},
                                  .duration = 1e-3};
        SurfaceOptions options = wall_options(1, 1);
        options.body.precision = (Precision)precision;
        SCOPED(bench_destroy) DetailBench bench;
        wall_create_with(&bench, WALL_SPHERE, &options, 0.3, &blade);
        put_blade(&bench, -0.07);
        sim_ticks(bench.sim, 3);
        assert_int_equal(sim_resets(bench.sim), 0);
        FREED Row *was = read_all(&bench);
        const int count = bench.body->surface.node_count, topology = bench.body->mesh.topology;
        apply_well(sim_apply_load, bench.sim, &huge);
        put_blade(&bench, 0.02);
        sim_step(bench.sim);
        assert_int_equal(sim_resets(bench.sim), 1);
        assert_true(bench.body->mesh.topology > topology);
        FREED Row *is = read_all(&bench);
        int born = 0;
        for (int i = 0; i < count; i++) {
            if (!is[i].on)
                continue;
            int from = i;
            for (int k = 0; k < count && !was[i].on; k++)
                if (was[k].on && memcmp(&was[k].x, &is[i].x, sizeof(Vec3)) == 0)
                    from = k;
            born += !was[i].on;
            assert_true(was[from].on); // itself, or one in whose place it is
            assert_memory_equal(&is[i].x, &was[from].x, sizeof(Vec3));
            assert_memory_equal(&is[i].v, &was[from].v, sizeof(Vec3));
        }
        assert_true(born > 5);
        assert_true(bench.body->ops->check(bench.model));
        bench_expect_sound(&bench);
        sim_ticks(bench.sim, 200);
        assert_int_equal(sim_resets(bench.sim), 1);
    }
}
