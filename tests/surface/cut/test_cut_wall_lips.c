// SPDX-License-Identifier: MIT
// Lips of bodies: what is touched and pressed where it is shown.
#include "wall_bench.h"

#include "effort.h"
#include "expect.h"
#include "fixture.h"
#include "momentum_exchange.h"
#include "random.h"
#include "test.h"

static const ToolOptions CAPSULE = {.id = 1,
                                    .kind = TOOL_PROBE,
                                    .capsule_count = 1,
                                    .capsule = {{.to = {0.0, 0.0, 0.03}, .radius = 0.006}},
                                    .max_force = 3.3,
                                    .friction = -1.0};

static Momentum read_momentum(void *world)
{
    const DetailBench *bench = world;
    Momentum sum = {0};
    for (int i = 0; i < bench->detail->set.node_count; i++) {
        Vec3 x, v;
        if (bench->detail->set.status[i] != NODE_FREE)
            continue;
        wall_read_row(bench, i, &x, &v);
        momentum_add(&sum, bench->model->mass[i], x, v);
    }
    return sum;
}

// Two cuts that cross at the pole, where the tool strikes.
static void cut_cross(DetailBench *bench)
{
    for (int k = 0; k < 2; k++) {
        const Vec3 forward = k == 0 ? vec3(0.8, 0.6, 0.0) : vec3(-0.6, 0.8, 0.0);
        const CutOptions slit =
            wall_sweep_at(vec3(0.004, 0.003, 0.05), vec3(0.0, 0.0, 1.0), forward, 0.04, 0.06);
        assert_true(wall_cut(bench, &slit).separated > 1);
    }
    assert_true(bench->detail->set.cut->lips.count > 4);
}

// Round-off, except the angular momentum of leapfrog with dashpots in the springs: this loses 5e-7
// of a tick's largest moment on the same body uncut, and up to 9e-7 here.
TEST(a_tool_on_lips_and_their_body_exchange_momentum_exactly)
{
    for (int kind = 0; kind < 4; kind++) {
        SurfaceOptions options = wall_options(kind % 2, 0);
        options.shape.wanted = false;
        options.prestress = 0.0;
        if (kind >= 2)
            options.body.integrator = INTEGRATOR_IMPLICIT;
        SCOPED(bench_destroy) DetailBench bench;
        wall_create_with(&bench, WALL_SPHERE, &options, 0.0, &CAPSULE);
        cut_cross(&bench);
        const MomentumExchange sum =
            exchange_momentum(bench.sim, 600, 0.02, 5.0, read_momentum, &bench);
        assert_int_equal(sim_resets(bench.sim), 0);
        assert_true(sum.impulse > 1e-6);
        expect_at_most(sum.impulse_lost, 1e-11 * sum.impulse);
        expect_at_most(sum.turn_lost, (kind < 2 ? 2e-6 : 1e-11) * sum.moment);
    }
}

// What a tool or a tie reckons with is how a force on a lip moves it: all nodes are free here.
TEST(the_mass_of_a_lip_is_that_with_which_it_yields)
{
    SurfaceOptions options = wall_options(1, 0);
    options.shape.wanted = false;
    SCOPED(bench_destroy) DetailBench bench;
    wall_create_with(&bench, WALL_SPHERE, &options, 0.0, &CAPSULE);
    cut_cross(&bench);
    const DetailLips *lips = &bench.detail->set.cut->lips;
    const double h = 1e-3;
    double least = 1.0;
    for (int i = 0; i < lips->count; i++) {
        const int node = lips->node[i];
        const Vec3 impulse = {0.0, 0.0, 1e-9};
        Vec3 x, before, after;
        bench.body->ops->read_nodes(bench.model, &node, 1, &x, &before);
        bench.body->ops->kick_nodes(bench.model, &node, 1, &impulse, h, 0.0);
        bench.body->ops->read_nodes(bench.model, &node, 1, &x, &after);
        const double mass = bench.body->surface.node_mass[node];
        int carrier[3], hang = 0;
        double share[3];
        detail_lips_carriers(bench.model, node, carrier, share);
        for (int k = 0; k < 3; k++)
            hang += bench.detail->set.status[carrier[k]] == NODE_HANGING;
        // Round-off of speeds of 1e-6 m/s. What hangs shares its masters with other carriers.
        expect_near(mass * (after.z - before.z), impulse.z, (hang > 0 ? 0.3 : 1e-9) * impulse.z);
        least = fmin(least, mass / bench.model->mass[node]);
    }
    print_message("%d lips, at least %.2f of a node's mass\n", lips->count, least);
}

// The time step is that of the mesh as built: springs, masses and rest lengths do not follow lips.
// A free node at a cut has fewer and weaker springs, but less mass, too: hence a little more.
TEST(ten_cuts_raise_the_bound_of_the_step_by_a_fifth_at_most)
{
    uint64_t random = 5;
    double most = 0.0;
    for (int i = 0; i < EFFORT(12); i++) {
        SurfaceOptions options = wall_options(2, 2);
        SCOPED(bench_destroy) DetailBench bench;
        wall_create(&bench, i % 2 == 0 ? WALL_SPHERE : WALL_SHEET, &options, 0.0);
        const double before = bench.body->lambda;
        CutOptions last = {.body = 0};
        for (int k = 0; k < 10; k++) {
            last = wall_random_sweep(&bench, &random, &last);
            wall_cut(&bench, &last);
        }
        assert_true(bench.detail->set.cut->lips.count > 0);
        most = fmax(most, bench.body->lambda / before);
        expect_at_most(bench.body->lambda, 1.2 * before);
    }
    print_message("at most %.3f times\n", most);
}
