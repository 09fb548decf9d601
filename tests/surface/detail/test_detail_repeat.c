// SPDX-License-Identifier: MIT
// The same bits: of a scene run twice, continued from the middle of a refined state in another
// process's memory, after a reset, looked at or not, and with every instruction set.
#include "base/isa.h"
#include "detail_bench.h"

#include "test.h"
#include "sim_steps.h"
#include "fixture.h"
#include "random.h"
#include "surface/surface.h"

static const ToolOptions BALL = {PROBE(0.006, 3.3)};
static const LoadOptions PRESS = {.center = {0.0, 0.0, -0.05},
                                  .radius = 0.02,
                                  .force = {0.0, 0.05, 0.3},
                                  .start = 0.05,
                                  .duration = 0.35};

enum { KINDS = 5, TICKS = 800, MIDDLE = 290 };

static void create(DetailBench *bench, int kind, const char *isa)
{
    SurfaceOptions options = bench_options(2, 0);
    options.adapt.check_hz = 100.0;
    options.body.precision = kind % 2 == 0 ? PRECISION_SINGLE : PRECISION_DOUBLE;
    options.body.integrator = kind < 2   ? INTEGRATOR_LEAPFROG
                              : kind < 4 ? INTEGRATOR_RK4
                                         : INTEGRATOR_IMPLICIT;
    // The latter free: it floats.
    options.shape.frame = kind < 2 ? SHAPE_WORLD : SHAPE_BODY;
    options.body.isa = isa;
    bench_create_on(bench, BENCH_ADAPTIVE, fixture_sphere, &options, &BALL, &PRESS);
}

// The probe circles on the body and is gone for the last half.
static void run_to(DetailBench *bench, int tick, bool look)
{
    while (sim_steps(bench->sim) < tick) {
        double t = 1e-3 * (double)sim_steps(bench->sim);
        ToolPose pose = {.position = {0.02 * cos(20.0 * t), 0.02 * sin(20.0 * t), 0.053 - 0.02 * t},
                         .orientation = {1.0, 0.0, 0.0, 0.0},
                         .active = t < 0.4};
        sim_apply_pose(bench->sim, 0, &pose, true);
        sim_step(bench->sim);
        if (look)
            bench_expect_sound(bench);
    }
}

TEST(a_scene_run_twice_has_the_same_bits)
{
    for (int kind = 0; kind < KINDS; kind++) {
        DetailBench bench[2];
        for (int k = 0; k < 2; k++) {
            create(&bench[k], kind, NULL);
            run_to(&bench[k], MIDDLE, false);
            run_to(&bench[k], MIDDLE + 60, k == 1); // building all anew changes nothing
            run_to(&bench[k], TICKS, false);
        }
        assert_true(bench[0].detail->adapt.sweep->coarsened > 20);
        assert_true(state_hash(&bench[0].state) == state_hash(&bench[1].state));
        assert_int_equal(bench[0].body->mesh.topology, bench[1].body->mesh.topology);
        bench_destroy(&bench[0]);
        bench_destroy(&bench[1]);
    }
}

TEST(a_refined_state_goes_on_elsewhere_with_the_same_bits)
{
    for (int kind = 0; kind < KINDS; kind++) {
        SCOPED(bench_destroy) DetailBench whole, rest;
        create(&whole, kind, NULL);
        create(&rest, kind, NULL);
        run_to(&rest, 37, false); // whatever it was before
        run_to(&whole, MIDDLE, false);
        assert_true(whole.detail->lists.hanging_count > 5);
        FREED void *block = copy_state(&whole.state);
        resume(&rest.state, rest.sim, block);
        bench_expect_sound(&rest);
        assert_true(state_hash(&rest.state) == state_hash(&whole.state));
        assert_int_equal(rest.body->substeps, whole.body->substeps);
        assert_int_equal(rest.body->mesh.node_count, whole.body->mesh.node_count);
        assert_int_equal(rest.body->mesh.topology, whole.body->mesh.topology);
        run_to(&whole, TICKS, false);
        run_to(&rest, TICKS, false);
        assert_true(state_hash(&rest.state) == state_hash(&whole.state));
    }
}

// All that moves; not the clock, nor the numbers that go on counting.
static uint64_t hash_of_body(const DetailBench *bench)
{
    uint64_t hash = 1;
    for (int i = 0; i < bench->state.count; i++) {
        const StateArray *array = &bench->state.array[i];
        if (strcmp(array->name, "sim/clock") == 0 || strcmp(array->name, "body/sweep") == 0)
            continue;
        const unsigned char *byte = state_memory(array);
        for (size_t b = 0; b < array->bytes; b++)
            hash = (hash ^ byte[b]) * UINT64_C(1099511628211);
    }
    return hash;
}

TEST(a_reset_returns_to_the_start_and_counts_topologies_on)
{
    for (int kind = 0; kind < KINDS; kind++) {
        SCOPED(bench_destroy) DetailBench bench;
        create(&bench, kind, NULL);
        uint64_t start = hash_of_body(&bench);
        int topology = bench.body->mesh.topology;
        for (int round = 0; round < 2; round++) {
            run_to(&bench, MIDDLE * (round + 1), false);
            assert_true(hash_of_body(&bench) != start);
            int before = bench.body->mesh.topology;
            assert_true(before > topology);
            sim_reset(bench.sim);
            assert_true(hash_of_body(&bench) == start);
            assert_int_equal(bench.body->finest_level, 0);
            assert_int_equal(bench.body->mesh.node_count, 114);
            // Another mesh than that before it: whoever has one of the same number must not take
            // it for this one (mesh_t.topology goes up by one with every change).
            topology = bench.body->mesh.topology;
            assert_int_equal(topology, before + 1);
            bench_expect_sound(&bench);
        }
    }
}

static StateArray *find_array(const DetailBench *bench, const char *name)
{
    for (int i = 0; i < bench->state.count; i++)
        if (strcmp(bench->state.array[i].name, name) == 0)
            return &bench->state.array[i];
    fail_msg("no %s in the state", name);
    return NULL;
}

// As a checkpoint that somebody has made up: indices everywhere, and none may be followed.
TEST(a_state_that_no_run_can_have_is_refused)
{
    static const char *const arrays[] = {"body/refined",    "body/calm_since", "body/sweep",
                                         "body/felt_count", "body/felt",       "body/node_slots",
                                         "body/face_slots"};
    uint64_t random = 12;
    for (int kind = 0; kind < 2; kind++) {
        SCOPED(bench_destroy) DetailBench bench;
        create(&bench, kind, NULL);
        run_to(&bench, MIDDLE, false);
        Body *body = bench.body;
        sim_restored(bench.sim);
        assert_true(body->ops->check(body->model));
        FREED void *good = copy_state(&bench.state);
        int refused = 0, tries = 0;
        for (size_t a = 0; a < sizeof arrays / sizeof *arrays; a++)
            for (int i = 0; i < 300; i++, tries++) {
                const StateArray *array = find_array(&bench, arrays[a]);
                unsigned char *byte = state_memory(array);
                if (i < 200) // one byte
                    byte[random_below(&random, (int)array->bytes)] ^=
                        (unsigned char)(1 + random_below(&random, 255));
                else // from somewhere on, in words of which some are small
                    for (size_t b = (size_t)random_below(&random, (int)array->bytes);
                         b < array->bytes; b++)
                        byte[b] = b % 4 == 0 || i % 2 == 0
                                      ? (unsigned char)random_below(&random, 256)
                                      : 0;
                sim_restored(bench.sim);
                bool sound = body->ops->check(body->model);
                refused += !sound;
                sim_ticks(bench.sim, sound ? 2 : 0); // what was let in can be stepped on
                resume(&bench.state, bench.sim, good);
                assert_true(body->ops->check(body->model));
            }
        print_message("%d of %d refused\n", refused, tries);
        assert_true(refused > tries / 2);
        bench_expect_sound(&bench);
    }
}

TEST(every_instruction_set_gives_the_same_bits)
{
    for (int kind = 0; kind < KINDS; kind++) {
        uint64_t hash = 0;
        for (const char *const *isa = isa_available(); *isa != NULL; isa++) {
            SCOPED(bench_destroy) DetailBench bench;
            create(&bench, kind, *isa);
            assert_string_equal(bench.body->ops->isa(bench.model), *isa);
            run_to(&bench, MIDDLE, false);
            if (isa == isa_available())
                hash = state_hash(&bench.state);
            if (state_hash(&bench.state) != hash)
                fail_msg("kind %d: %s differs from %s", kind, *isa, isa_available()[0]);
        }
    }
}
