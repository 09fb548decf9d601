// SPDX-License-Identifier: MIT
// The state of surface bodies that are cut and drilled: room, checkpoints, resets, and what a
// damaged file may hold.
#include "wall_bench.h"

#include "effort.h"
#include "test.h"
#include "sim_steps.h"
#include "fixture.h"
#include "random.h"

TEST(what_does_not_fit_is_refused_and_changes_nothing)
{
    SCOPED(mesh_destroy) TriMesh mesh;
    fixture_sphere(&mesh);
    for (int which = 0; which < 2; which++) {
        SurfaceOptions options = wall_options(2, 0);
        SCOPED(bench_destroy) DetailBench bench;
        // Room for the body itself and a little more; nodes, then faces.
        options.body.node_capacity = which == 0 ? 130 : 0;
        options.body.face_capacity = which == 1 ? 240 : 0;
        wall_create(&bench, WALL_SPHERE, &options, 0.3);
        CutOptions plane =
            wall_sweep_at(vec3(0.0, 0.0, 0.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), 0.3, 0.3);
        uint64_t before = state_hash(&bench.state);
        int topology = bench.body->mesh.topology;
        CutOutcome outcome = wall_cut(&bench, &plane);
        assert_int_equal(outcome.verdict, which == 0 ? CUT_NO_NODES : CUT_NO_FACES);
        assert_true(outcome.needed > outcome.room && outcome.room > 0);
        assert_int_equal(outcome.separated, 0);
        assert_true(state_hash(&bench.state) == before);
        const Region burr = {REGION_CAPSULE, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 0.06};
        const RemovalOutcome went = wall_remove(&bench, REMOVER_DRILL, &burr, (double)INFINITY);
        assert_int_equal(went.verdict, outcome.verdict);
        assert_true(went.needed > went.room && went.room > 0);
        assert_true(state_hash(&bench.state) == before);
        assert_int_equal(bench.body->mesh.topology, topology);
        bench_expect_sound(&bench);
    }
}

// A body at its finest level from the start takes as many copies as it has room for, no more.
TEST(copies_end_with_their_capacity)
{
    uint64_t random = 77;
    SurfaceOptions options = wall_options(0, 0);
    SCOPED(bench_destroy) DetailBench bench;
    wall_create(&bench, WALL_SPHERE, &options, 0.0);
    CutOptions last = {.body = 0};
    WallShape shape;
    for (int i = 0; i < 60; i++) {
        last = wall_random_sweep(&bench, &random, &last);
        wall_cut(&bench, &last);
    }
    // Every corner of every face at most has a node of its own.
    assert_true(*bench.detail->set.cut->copies <= 3 * bench.detail->set.face_count - 114);
    wall_expect_sound(&bench, &shape, 0);
    sim_ticks(bench.sim, 50);
    assert_int_equal(sim_resets(bench.sim), 0);
}

// At a random node, about four faces of level 2 wide.
static void drill_somewhere(DetailBench *bench, uint64_t *random)
{
    const Vec3 at = wall_random_node(bench, random);
    const Region burr = {REGION_CAPSULE, at, at, 0.008};
    assert_true(wall_remove(bench, REMOVER_DRILL, &burr, (double)INFINITY).removed > 0);
    if (bench->detail->set.cut->heat != NULL)
        wall_remove(bench, REMOVER_DIATHERMY, &burr, 100.0);
}

static void prepare_cut_body(DetailBench *bench, uint64_t *random, int levels)
{
    SurfaceOptions options = wall_options(levels, 0);
    options.adaptive = levels > 0;
    options.adapt.check_hz = 100.0;
    options.shape.frame = levels == 2 ? SHAPE_BODY : SHAPE_WORLD;
    options.heats = true;
    wall_create(bench, WALL_SPHERE, &options, 0.3);
    CutOptions last = {.body = 0};
    for (int i = 0; i < 4; i++) {
        last = wall_random_sweep(bench, random, &last);
        wall_cut(bench, &last);
        drill_somewhere(bench, random);
        sim_step(bench->sim);
    }
}

TEST(a_cut_state_goes_on_elsewhere_with_the_same_bits)
{
    for (int levels = 0; levels < 3; levels++) {
        uint64_t random = 9 + (uint64_t)levels, other = 1234;
        SCOPED(bench_destroy) DetailBench whole, rest;
        prepare_cut_body(&whole, &random, levels);
        prepare_cut_body(&rest, &other, levels); // whatever it was before
        assert_true(*whole.detail->set.cut->copies > 5);
        FREED void *block = copy_state(&whole.state);
        resume(&rest.state, rest.sim, block);
        assert_true(rest.body->ops->check(rest.model));
        assert_true(state_hash(&rest.state) == state_hash(&whole.state));
        WallShape shape;
        wall_expect_sound(&rest, &shape, 0);
        assert_int_equal(rest.body->substeps, whole.body->substeps);
        DetailBench *both[2] = {&whole, &rest};
        uint64_t end[2];
        for (int k = 0; k < 2; k++) {
            CutOptions more = wall_sweep_at(vec3(0.01, 0.0, 0.0), vec3(0.0, 0.6, 0.8),
                                            vec3(0.0, 0.8, -0.6), 0.3, 0.3);
            wall_cut(both[k], &more);
            const Region burr = {REGION_CAPSULE, {0.0, 0.0, 0.04}, {0.0, 0.0, 0.06}, 0.01};
            wall_remove(both[k], REMOVER_DRILL, &burr, 2e-4);
            sim_ticks(both[k]->sim, 100);
            end[k] = state_hash(&both[k]->state);
        }
        assert_true(end[0] == end[1]);
    }
}

TEST(a_reset_makes_it_whole_again)
{
    uint64_t random = 31;
    SurfaceOptions options = wall_options(2, 0);
    SCOPED(bench_destroy) DetailBench bench;
    wall_create(&bench, WALL_SPHERE, &options, 0.0);
    for (int round = 0; round < 2; round++) {
        CutOptions last = {.body = 0};
        for (int i = 0; i < 4; i++) {
            last = wall_random_sweep(&bench, &random, &last);
            wall_cut(&bench, &last);
            drill_somewhere(&bench, &random);
            sim_step(bench.sim);
        }
        assert_true(*bench.detail->set.cut->copies > 5);
        int topology = bench.body->mesh.topology;
        sim_reset(bench.sim);
        assert_int_equal(bench.body->mesh.topology, topology + 1);
        assert_int_equal(*bench.detail->set.cut->copies, 0);
        assert_int_equal(bench.detail->set.cut->gone_count, 0);
        assert_int_equal(bench.body->mesh.node_count, 114);
        bench_expect_sound(&bench);
    }
}

// Numbers of the state changed at random, as by a damaged file: found out, or harmless.
TEST(a_cut_that_no_run_can_have_made_is_refused)
{
    for (int levels = 0; levels < 3; levels++) {
        uint64_t random = 19;
        SCOPED(bench_destroy) DetailBench bench;
        prepare_cut_body(&bench, &random, levels);
        size_t bytes = state_bytes(&bench.state);
        FREED unsigned char *good = malloc(bytes);
        state_copy_out(&bench.state, good);
        int refused = 0, tries = 0;
        for (int i = 0; i < bench.state.count; i++) {
            StateArray *array = &bench.state.array[i];
            const char *part = strchr(array->name, '/');
            if (part == NULL || (strcmp(part, "/broken") != 0 && strcmp(part, "/corners") != 0 &&
                                 strcmp(part, "/copies") != 0 && strcmp(part, "/rest") != 0))
                continue;
            for (int k = 0; k < EFFORT(60); k++) {
                unsigned char *byte = state_memory(array);
                size_t at = (size_t)(random_bits(&random) % array->bytes);
                byte[at] ^= (unsigned char)(1 + random_below(&random, 255));
                sim_restored(bench.sim);
                bool sound = bench.body->ops->check(bench.model);
                refused += !sound;
                tries++;
                sim_ticks(bench.sim, sound ? 2 : 0); // what was let in can be stepped on
                resume(&bench.state, bench.sim, good);
                assert_true(bench.body->ops->check(bench.model));
            }
        }
        print_message("%d of %d refused\n", refused, tries);
        assert_true(tries > 0 && refused > tries / 2);
        WallShape shape;
        wall_expect_sound(&bench, &shape, 0);
    }
}
