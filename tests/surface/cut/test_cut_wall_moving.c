// SPDX-License-Identifier: MIT
// What moves while a surface body is cut: pieces that come apart, blades through moving tissue, a
// probe that presses on what is cut under it.
#include "wall_bench.h"

#include "effort.h"
#include "test.h"
#include "sim_steps.h"
#include "fixture.h"
#include "random.h"

static Vec3 momentum_of_piece(const DetailBench *bench, int piece, double *mass, Vec3 *center)
{
    const Detail *detail = bench->detail;
    Vec3 sum = {0.0, 0.0, 0.0};
    *center = sum;
    *mass = 0.0;
    for (int i = 0; i < detail->set.node_count; i++) {
        if (detail->set.status[i] != NODE_FREE || detail->set.cut->node_piece[i] != piece)
            continue;
        Vec3 x, v;
        wall_read_row(bench, i, &x, &v);
        sum = vec3_madd(sum, bench->model->mass[i], v);
        *center = vec3_madd(*center, bench->model->mass[i], x);
        *mass += bench->model->mass[i];
    }
    *center = vec3_scale(1.0 / *mass, *center);
    return sum;
}

// Shape springs on frames of their own: nothing holds the pieces together.
TEST(pieces_that_come_apart_move_apart)
{
    for (int kind = 0; kind < 4; kind++) { // explicit ones, implicit ones soft and stiff
        const int precision = kind == 1;
        SurfaceOptions options = wall_options(1, 0);
        if (kind >= 2)
            options.body.integrator = INTEGRATOR_IMPLICIT;
        if (kind == 3)
            options.material.youngs_modulus_2d = 1e6;
        options.shape.frame = SHAPE_BODY;
        options.body.precision = precision == 0 ? PRECISION_DOUBLE : PRECISION_SINGLE;
        TriMesh mesh;
        fixture_sphere(&mesh);
        FREED Vec3 *v = calloc((size_t)mesh.node_count, sizeof *v);
        for (int i = 0; i < mesh.node_count; i++) // one half turns and rises, the other falls
            v[i] = mesh.position[i].z > 0.0
                       ? vec3(-3.0 * mesh.position[i].y, 3.0 * mesh.position[i].x, 0.4)
                       : vec3(0.0, 0.0, -0.4);
        options.body.initial_velocity = v;
        options.body.initial_position = mesh.position;
        SCOPED(bench_destroy) DetailBench bench;
        bench_create(&bench, BENCH_CUTTABLE, &mesh, &options, NULL, NULL);
        CutOptions plane =
            wall_sweep_at(vec3(0.0, 0.0, 0.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), 0.3, 0.3);
        assert_int_equal(wall_cut(&bench, &plane).pieces, 2);
        const int *piece = bench.detail->set.cut->piece;
        int number[2] = {0, -1}; // the lowest face is in one
        for (int f = 0; f < bench.detail->set.face_count; f++)
            number[1] = piece[f] != 0 ? piece[f] : number[1];
        double mass[2];
        Vec3 before[2], start[2], after[2], end[2];
        for (int k = 0; k < 2; k++)
            before[k] = momentum_of_piece(&bench, number[k], &mass[k], &start[k]);
        sim_ticks(bench.sim, 400);
        assert_int_equal(sim_resets(bench.sim), 0);
        for (int k = 0; k < 2; k++) {
            after[k] = momentum_of_piece(&bench, number[k], &mass[k], &end[k]);
            // The frame's rest center and fit are good to rounding of forces of some newtons.
            expect_at_most(vec3_length(vec3_sub(after[k], before[k])),
                           (precision == 0 ? 1e-11 : 1e-4) * vec3_length(before[k]));
        }
        double gap = vec3_length(vec3_sub(end[1], end[0]));
        double was = vec3_length(vec3_sub(start[1], start[0]));
        // 0.4 s at the speeds that the pieces have; a few nodes at the border took the other's.
        Vec3 speed =
            vec3_sub(vec3_scale(1.0 / mass[1], before[1]), vec3_scale(1.0 / mass[0], before[0]));
        // A stiff wall, shrunk by its prestress, is thrown about meanwhile.
        expect_near(gap, was + 0.4 * vec3_length(speed), precision == 0 ? 1e-3 : 2e-3);
        assert_true(gap > was + 0.2);
        WallShape shape;
        wall_expect_sound(&bench, &shape, 0);
    }
}

static const ToolOptions BLADE = {.id = 1,
                                  .kind = TOOL_BLADE,
                                  .edge = {{-0.2, 0.0, 0.0}, {0.2, 0.0, 0.0}},
                                  .max_force = 5.0,
                                  .friction = -1.0};

// Moves the blade along y from -0.1 m, `way` far in `ticks`, a little askew, and lifts it.
static void stroke(DetailBench *bench, double way, int ticks, double offset, double slant)
{
    double c = cos(0.5 * slant), s = sin(0.5 * slant);
    for (int tick = 0; tick <= ticks + 1; tick++) {
        ToolPose pose = {.position = {0.0, -0.1 + way * tick / ticks, offset},
                         .orientation = {c, 0.0, s, 0.0},
                         .active = tick <= ticks};
        sim_apply_pose(bench->sim, 0, &pose, true);
        sim_step(bench->sim);
    }
}

TEST(a_blade_through_moving_tissue_separates_it)
{
    uint64_t random = 88;
    int cuts = EFFORT(12), most = 0, copies = 0;
    double slowest = 0.0;
    for (int i = 0; i < cuts; i++) {
        SurfaceOptions options = wall_options(1 + i % 3, 0);
        options.adaptive = i % 2 == 0;
        options.adapt.check_hz = 200.0;
        options.body.precision = i % 4 < 2 ? PRECISION_DOUBLE : PRECISION_SINGLE;
        options.shape.frame = i % 5 == 0 ? SHAPE_BODY : SHAPE_WORLD;
        if (i % 4 == 1)
            options.body.integrator = INTEGRATOR_IMPLICIT;
        bool half = i % 3 == 0;
        SCOPED(bench_destroy) DetailBench bench;
        wall_create_with(&bench, WALL_SPHERE, &options, random_between(&random, 0.0, 1.0), &BLADE);
        stroke(&bench, half ? 0.1 : 0.25, random_below(&random, 40) + 10,
               random_between(&random, -0.02, 0.02), random_between(&random, -0.4, 0.4));
        WallShape shape;
        wall_expect_sound(&bench, &shape, 0);
        if (half)
            assert_int_equal(shape.pieces, 1);
        else
            assert_true(shape.pieces >= 2);
        assert_true(shape.borders > 0);
        assert_int_equal(sim_resets(bench.sim), 0);
        double spent =
            1e-3 * (double)sim_stage_ns(bench.sim, STAGE_CUT) / (double)sim_steps(bench.sim);
        slowest = spent > slowest ? spent : slowest;
        most = shape.pieces > most ? shape.pieces : most;
        copies += (int)*bench.detail->set.cut->copies;
    }
    print_message("%d strokes: %d copies, at most %d pieces, at most %.0f us a tick\n", cuts,
                  copies, most, slowest);
}

static const ToolOptions BALL = {PROBE(0.012, 3.3), .friction = -1.0};

// A probe stays outside of a wall whose faces under it are cut, and is pushed by both lips.
TEST(a_probe_presses_on_what_is_cut_under_it)
{
    for (int levels = 0; levels < 3; levels++) {
        SurfaceOptions options = wall_options(levels, 0);
        options.adaptive = levels == 2;
        options.adapt.check_hz = 100.0;
        options.shape.angular_frequency = 200.0;
        options.body.contact_ratio = 1.0;
        SCOPED(bench_destroy) DetailBench bench;
        wall_create_with(&bench, WALL_SPHERE, &options, 0.0, &BALL);
        int felt = 0;
        for (int tick = 0; tick < 400; tick++) {
            // Down onto the north pole, 3 mm into it.
            double depth = fmin(0.003, 0.003 * tick / 100.0);
            put_tool(bench.sim, 0, (Vec3){0.0, 0.0, 0.062 - depth});
            if (tick == 150 || tick == 250) { // two cuts that cross under it
                Vec3 forward = tick == 150 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
                CutOptions slit =
                    wall_sweep_at(vec3(0.0, 0.0, 0.05), vec3(0.0, 0.0, 1.0), forward, 0.03, 0.05);
                assert_true(wall_cut(&bench, &slit).separated > 2);
            }
            sim_step(bench.sim);
            const ToolWrench *wrench = sim_wrench(bench.sim, 0);
            assert_true(vec3_finite(wrench->force));
            felt += tick > 150 && wrench->force.z > 0.0;
        }
        assert_int_equal(sim_resets(bench.sim), 0);
        assert_true(felt > 200); // of 249 ticks; for a moment it may fall free
        WallShape shape;
        wall_expect_sound(&bench, &shape, 0);
    }
}
