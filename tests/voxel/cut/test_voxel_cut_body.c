// SPDX-License-Identifier: MIT
// Cuttable voxel bodies as the pipeline runs them: elements, masses and momentum across cuts and
// divisions, with real dynamics between.
#include "sim/follow.h"
#include "test.h"
#include "sim_steps.h"
#include "cut_world.h"
#include "effort.h"

// --- against a body that cannot be cut ---

// Batches are packed otherwise, so forces add up in another order: equal to rounding, which the
// motion of a tenth of a second in double does not amplify beyond 1e-9 of a cell.
TEST(uncut_body_moves_as_one_that_cannot_be_cut)
{
    for (int law = 0; law < 2; law++) {
        VoxelWorldOptions options = voxel_world_cube(8), plain_options = voxel_world_cube(8);
        options.body.law = plain_options.body.law = (VoxelLaw)law;
        options.body.body.gravity = plain_options.body.body.gravity = vec3(0.0, 0.0, -9.81);
        FixedRegion floor = {
            .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, -0.0499}};
        options.body.body.fixed = plain_options.body.body.fixed = &floor;
        options.body.body.fixed_count = plain_options.body.body.fixed_count = 1;
        SCOPED(cut_world_destroy) CutWorld world;
        SCOPED(voxel_world_destroy) VoxelWorld plain;
        cut_world_create(&world, &options);
        voxel_world_create(&plain, &plain_options);
        expect_near(world.body->lambda, plain.body->lambda, 1e-12 * plain.body->lambda);
        expect_near(world.body->damping, plain.body->damping, 1e-12 * plain.body->damping);
        assert_int_equal(world.body->substeps, plain.body->substeps);
        for (int tick = 0; tick < 100; tick++) {
            sim_step(world.sim);
            sim_step(plain.sim);
        }
        voxel_world_read(&plain);
        assert_int_equal(world.model->vertices.count, plain.count);
        for (int i = 0; i < plain.count; i++) {
            Vec3 x, v;
            rows_read(&world.model->vertices.rows, vertices_row(&world.model->vertices), i, &x, &v);
            assert_int_equal(world.cuts->lattice.vertex_id[i], plain.id[i]);
            expect_near(vec3_length(vec3_sub(x, plain.x[i])), 0.0, 1e-9 * world.lattice.size);
        }
        BodyMeasure a, b;
        a = measure_of(world.body);
        b = measure_of(plain.body);
        expect_near(a.elastic, b.elastic, 1e-9 * b.elastic);
    }
}

// What a hand feels of either is the same matrix; blocks add up in another order.
TEST(uncut_body_tells_the_stiffness_of_one_that_cannot_be_cut)
{
    for (int law = 0; law < 2; law++) {
        VoxelWorldOptions options = voxel_world_cube(16), plain_options = voxel_world_cube(16);
        options.body.law = plain_options.body.law = (VoxelLaw)law;
        SCOPED(cut_world_destroy) CutWorld world;
        SCOPED(voxel_world_destroy) VoxelWorld plain;
        SCOPED(arena_destroy) Arena arena = {0};
        cut_world_create(&world, &options);
        voxel_world_create(&plain, &plain_options);
        Patch *patch[2];
        const Region region = {REGION_CAPSULE, {0.03, 0.01, 0.04}, {0.03, 0.01, 0.04}, 0.016};
        for (int k = 0; k < 2; k++) {
            const Body *body = k == 0 ? world.body : plain.body;
            patch[k] = patch_create(world.cuts->lattice.vertex_capacity, "patch", &arena);
            patch_begin(patch[k], &region, 0.01, false);
            int calls = 0;
            while (!body->ops->gather_patch(body->model, patch[k], 3000))
                calls++;
            assert_true(calls > 2);
            assert_false(patch[k]->full);
        }
        const int count = patch[0]->node_count;
        assert_true(count > 30);
        assert_int_equal(count, patch[1]->node_count);
        assert_memory_equal(patch[0]->node, patch[1]->node, (size_t)count * sizeof(int));
        assert_int_equal(patch[0]->block_count, patch[1]->block_count);
        PatchColumns *x = calloc((size_t)count, sizeof *x), *y[2];
        uint64_t seed = 24;
        for (int i = 0; i < count; i++)
            for (int c = 0; c < 3; c++)
                x[i].of[c] = random_vec3(&seed);
        double largest = 0.0;
        for (int k = 0; k < 2; k++) {
            y[k] = calloc((size_t)count, sizeof *y[k]);
            patch_multiply(patch[k], x, y[k], 0, patch[k]->block_count);
        }
        for (int i = 0; i < count; i++)
            largest = fmax(largest, vec3_length(y[1][i].of[0]));
        assert_true(largest > 0.0);
        for (int i = 0; i < count; i++)
            for (int c = 0; c < 3; c++)
                expect_near(vec3_length(vec3_sub(y[0][i].of[c], y[1][i].of[c])), 0.0,
                            1e-12 * largest);
        free(x);
        free(y[0]);
        free(y[1]);
    }
}

// --- momentum ---

static void expect_same_momentum(const WorldMomentum *before, const WorldMomentum *after)
{
    // Relative to the sums of absolute values, which is what rounding goes by.
    expect_near(vec3_length(vec3_sub(after->linear, before->linear)), 0.0,
                1e-12 * before->linear_sum);
    expect_near(vec3_length(vec3_sub(after->angular, before->angular)), 0.0,
                1e-10 * before->angular_sum);
}

// One call of what a tick makes; change_body goes on no further, since `again` is told to be false.
static bool reconstruct(Sim *sim, int body, void *context, TopologyChange *change)
{
    (void)context;
    const bool changed = sim->body[body].ops->reconstruct(&sim->body[body], change);
    change->again = false;
    return changed;
}

static void reconstruct_once(CutWorld *world)
{
    change_body(world->sim, 0, reconstruct, NULL);
}

static void cut_and_check(CutWorld *world, int cuts, uint64_t *seed)
{
    cut_world_shake(world, 0.2, seed);
    for (int k = 0; k < cuts; k++) {
        const CutOptions cut = cut_world_random(world, seed);
        CutOutcome outcome;
        WorldMomentum before = cut_world_momentum(world);
        cut_world_cut(world, &cut, &outcome);
        WorldMomentum after = cut_world_momentum(world);
        expect_same_momentum(&before, &after);
        cut_world_check_masses(world);
        for (int step = 0; step < 6; step++) {
            before = cut_world_momentum(world);
            reconstruct_once(world);
            after = cut_world_momentum(world);
            expect_same_momentum(&before, &after);
            cut_world_check_masses(world);
            sim_step(world->sim);
        }
        assert_int_equal(sim_resets(world->sim), 0);
    }
    while (world->cuts->lattice.wanted_count > 0)
        sim_step(world->sim);
    cut_world_check_masses(world);
    assert_true(world->body->ops->check(world->model));
}

TEST(cuts_and_divisions_keep_momentum_and_mass)
{
    uint64_t seed = 21;
    for (int round = 0; round < EFFORT(6); round++) {
        VoxelWorldOptions options = round % 3 == 0   ? voxel_world_cube(16)
                                    : round % 3 == 1 ? voxel_world_ball()
                                                     : voxel_world_corner();
        options.body.law = round >= 3 ? VOXEL_MIYAZAKI2004 : VOXEL_AFFINE;
        if (options.body.law == VOXEL_MIYAZAKI2004)
            options.body.material_count = 0; // its elements have no Poisson's ratio
        options.body.split_budget = 4;
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        cut_and_check(&world, 4, &seed);
    }
}

// Fixed vertices take no part; what comes inside the region, or of one that is fixed, is fixed too,
// and at rest. A region may end inside large elements: what comes there stays where it came.
TEST(copies_and_middles_in_a_fixed_region_are_fixed)
{
    static const double top[2] = {0.001, 0.0135}; // [m] cells 8 and 10: the second is a middle
    uint64_t seed = 22;
    for (int k = 0; k < 2; k++) {
        VoxelWorldOptions options = voxel_world_cube(16);
        FixedRegion region = {
            .kind = FIXED_BOX, .low = {-1.0, -1.0, -1.0}, .high = {1.0, 1.0, top[k]}};
        fix_within(&options.body.body, &region);
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        const int before = world.model->vertices.count;
        cut_and_check(&world, 3, &seed);
        const Vertices *vertices = &world.model->vertices;
        int fixed = 0, away = 0;
        for (int i = 0; i < vertices->count; i++) {
            Vec3 rest = rows_rest(&vertices->rows, i), x, v;
            rows_read(&vertices->rows, vertices_row(vertices), i, &x, &v);
            assert_int_equal(vertices_is_fixed(vertices, i), fixed_contains(&region, rest));
            if (!vertices_is_fixed(vertices, i))
                continue;
            expect_near(vec3_length(v), 0.0, 0.0);
            if (k == 0 || i < before)
                expect_near(vec3_length(vec3_sub(x, rest)), 0.0, 1e-15);
            away += vec3_length(vec3_sub(x, rest)) > 1e-6;
            fixed++;
        }
        assert_true(fixed > 100);
        assert_true(k == 0 || away > 0);
    }
}

// --- separation ---

TEST(whole_sweep_through_a_cube_gives_two_halves)
{
    VoxelWorldOptions options = voxel_world_cube(16);
    SCOPED(cut_world_destroy) CutWorld world;
    cut_world_create(&world, &options);
    const CutOptions cut = cut_world_sweep(vec3(0.001, 0.0, 0.0), vec3(0.0, 0.0, 1.0),
                                           vec3(0.0, 1.0, 0.0), 1.0, -1.0, 1.0);
    CutOutcome outcome;
    assert_true(cut_world_cut(&world, &cut, &outcome));
    assert_int_equal(outcome.separated, 16 * 16);
    assert_int_equal(outcome.pieces, 2);
    int ticks = 0;
    for (; world.cuts->lattice.wanted_count > 0; ticks++)
        sim_step(world.sim);
    // One level a tick, and a budget of 16 divisions: 2 levels, at most 64 + 8 divisions of blocks
    // of the inner 14^3 cells along the cut.
    assert_true(ticks <= 2 + 200 / 16);
    // No element has vertices of both sides: pulled apart, they part.
    const Vertices *vertices = &world.model->vertices;
    const CutLattice *lattice = &world.cuts->lattice;
    FREED signed char *side = calloc((size_t)vertices->count, 1);
    for (int e = 0; e < lattice->element_count; e++) {
        if (!cut_lattice_is_leaf(lattice, e))
            continue;
        const CutElement *element = &lattice->element[e];
        const signed char here = element->cell[0] >= 8 ? 1 : -1;
        const int count = e < lattice->level_first[1] ? NODE_CORNERS : NODE_COUNT;
        for (int n = 0; n < count; n++) {
            const int v = cut_lattice_nodes(lattice, e)[n];
            if (v < 0)
                continue;
            assert_int_not_equal(side[v], -here);
            side[v] = here;
        }
    }
    assert_int_equal(sim_resets(world.sim), 0);
}

// --- determinism ---

static uint64_t run_on(CutWorld *world, const CutOptions *cut, int cuts)
{
    CutOutcome outcome;
    for (int k = 0; k < cuts; k++) {
        cut_world_cut(world, &cut[k], &outcome);
        sim_step(world->sim);
    }
    sim_ticks(world->sim, 20);
    return state_hash(&world->state);
}

// In the middle of what is left to be divided, the state is copied out; the run that goes on, and
// the one that is brought back from there and from the start, end in the same bits.
TEST(brought_back_state_goes_on_in_the_same_bits)
{
    uint64_t seed = 23;
    for (int single = 0; single < 2; single++) {
        VoxelWorldOptions options = voxel_world_cube(16);
        options.body.split_budget = 3;
        options.body.body.precision = single ? PRECISION_SINGLE : PRECISION_DOUBLE;
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        CutOptions cut[6];
        for (int k = 0; k < 6; k++)
            cut[k] = cut_world_random(&world, &seed);
        cut_world_shake(&world, 0.1, &seed);
        FREED void *begin = malloc(state_bytes(&world.state)),
                   *middle = malloc(state_bytes(&world.state));
        state_copy_out(&world.state, begin);
        CutOutcome outcome;
        for (int k = 0; k < 3; k++) {
            cut_world_cut(&world, &cut[k], &outcome);
            sim_step(world.sim);
        }
        assert_true(world.cuts->lattice.wanted_count > 0);
        state_copy_out(&world.state, middle);
        const uint64_t expected = run_on(&world, cut + 3, 3);
        resume(&world.state, world.sim, middle);
        assert_true(world.body->ops->check(world.model));
        assert_true(run_on(&world, cut + 3, 3) == expected);

        sim_reset(world.sim);
        assert_true(world.body->ops->check(world.model));
        resume(&world.state, world.sim, begin);
        for (int k = 0; k < 3; k++) {
            cut_world_cut(&world, &cut[k], &outcome);
            sim_step(world.sim);
        }
        assert_true(run_on(&world, cut + 3, 3) == expected);
    }
}

// Lanes without an element read the spare row: a damaged checkpoint may have anything there.
TEST(spare_row_must_hold_numbers)
{
    for (int single = 0; single < 2; single++) {
        VoxelWorldOptions options = voxel_world_cube(16);
        options.body.body.precision = single ? PRECISION_SINGLE : PRECISION_DOUBLE;
        SCOPED(cut_world_destroy) CutWorld world;
        cut_world_create(&world, &options);
        const Vertices *vertices = &world.model->vertices;
        void *row = vertices->row[vertices->current];
        const long spare = (long)vertices->capacity * ROW;
        assert_true(world.body->ops->check(world.model));
        for (int c = 0; c < ROW; c += 4) {
            rows_put(&vertices->rows, row, spare + c, (double)NAN);
            assert_false(world.body->ops->check(world.model));
            rows_put(&vertices->rows, row, spare + c, 0.0);
        }
        assert_true(world.body->ops->check(world.model));
    }
}

// More broken faces inside large elements than there is room for when these are divided: no cut
// leads there, but a damaged checkpoint may.
TEST(broken_faces_that_find_no_room_are_refused)
{
    VoxelWorldOptions options = voxel_world_cube(32);
    options.body.body.face_capacity = 40000; // fewer than large elements have faces inside
    SCOPED(cut_world_destroy) CutWorld world;
    cut_world_create(&world, &options);
    CutLattice *lattice = &world.cuts->lattice;
    const int room = (world.cuts->faces.square_capacity - world.cuts->faces.outer_squares) / 2;
    for (int more = 0; more < 2; more++) {
        int broken = 0;
        for (int cell = 0; cell < lattice->level_first[1] && broken < room + more; cell++) {
            const int beyond = cut_lattice_beyond(lattice, cell, 0);
            lattice->broken[cell] = 0;
            if (beyond >= 0 &&
                cut_lattice_leaf_of(lattice, cell) == cut_lattice_leaf_of(lattice, beyond))
                lattice->broken[cell] = 1, broken++;
        }
        assert_int_equal(broken, room + more);
        sim_restored(world.sim);
        assert_int_equal(world.body->ops->check(world.model), more == 0);
    }
}
