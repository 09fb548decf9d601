// SPDX-License-Identifier: MIT
// The lattice of cut bodies that do not adapt against its definition after every step of random
// cuts, divisions and removals; limits, and states that were brought back.
#include "cut_reference.h"
#include "test.h"
#include "sample_mesh.h"

static void cut_at_random(CutSample *sample, int steps, uint64_t *seed)
{
    CutLattice *cut = &sample->cut;
    FREED int(*face)[2] = malloc(3 * (size_t)cut->level_first[1] * sizeof *face);
    CutFollower follower = cut_follower_create(cut);
    cut_reference_check(sample);
    for (int step = 0; step < steps; step++) {
        cut->split_budget = 1 + random_below(seed, 30);
        if (step + 4 < steps) {
            const int count = cut_sample_random(cut, seed, face);
            if (cut_lattice_has_room(cut, count))
                cut_lattice_break(cut, (const int(*)[2])face, count);
        }
        if (cut->removable || random_below(seed, 3) == 0)
            cut_follower_settle(&follower, sample);
        if (cut->removable) {
            cut_follower_remove_random(&follower, sample, seed);
            cut_reference_check_derived(cut);
        }
        const int divided = cut_lattice_reconstruct(cut);
        // The last may have to divide larger neighbours first: one at each corner a level.
        assert_true(divided < cut->split_budget + 8 * 5);
        cut_follower_settle(&follower, sample);
        if (step % 3 == 0)
            cut_reference_check_derived(cut);
    }
    cut_follower_drop(&follower);
}

TEST(random_cuts_keep_what_follows_from_the_bits)
{
    uint64_t seed = 11;
    for (int round = 0; round < EFFORT(4); round++)
        for (int kind = 0; kind < SAMPLE_KINDS; kind++) {
            SCOPED(cut_sample_drop) CutSample sample;
            cut_sample_create(&sample, sample_lattice((SampleKind)kind, &seed), round % 4, 0, 1);
            cut_at_random(&sample, 12, &seed);
        }
}

TEST(random_cuts_and_removals_keep_what_follows_from_the_bits)
{
    uint64_t seed = 17;
    for (int round = 0; round < EFFORT(2); round++)
        for (int kind = 0; kind < SAMPLE_KINDS; kind++) {
            SCOPED(cut_sample_drop) CutSample sample;
            cut_sample_make(&sample, sample_lattice((SampleKind)kind, &seed), 2 * round, 0, 1,
                            true);
            cut_at_random(&sample, 12, &seed);
        }
}

TEST(cubes_and_balls_with_three_levels_too)
{
    uint64_t seed = 12;
    for (int round = 0; round < EFFORT(4); round++) {
        SCOPED(cut_sample_drop) CutSample sample;
        cut_sample_create(&sample, round % 2 == 0 ? sample_box(32, 32, 32) : sample_ball(32), 3, 0,
                          1);
        cut_at_random(&sample, 12, &seed);
    }
}

// --- limits ---

// Divisions that do not fit leave everything as it was and stay wanted; has_room says so of faces.
TEST(what_does_not_fit_changes_nothing)
{
    uint64_t seed = 13;
    int refused = 0, faces_refused = 0;
    for (int round = 0; round < EFFORT(12); round++) {
        SCOPED(cut_sample_drop) CutSample sample;
        Sample plain;
        Lattice lattice = round % 2 == 0 ? sample_box(16, 16, 16) : sample_ball(20);
        sample_mesh(&plain, lattice, 2);
        const int start = plain.mesh.vertex_count;
        lattice_mesh_destroy(&plain.mesh);
        layout_destroy(&plain.layout);
        cut_sample_create(&sample, lattice, 2, start + random_below(&seed, 500), 1000);
        CutLattice *cut = &sample.cut;
        FREED int(*face)[2] = malloc(3 * (size_t)cut->level_first[1] * sizeof *face);
        for (int step = 0; step < 8; step++) {
            const int count = cut_sample_random(cut, &seed, face);
            if (cut_lattice_has_room(cut, count))
                cut_lattice_break(cut, (const int(*)[2])face, count);
            else
                faces_refused++;
            while (cut_lattice_reconstruct(cut) > 0)
                continue;
            assert_true(cut_lattice_used(cut) <= cut->vertex_capacity);
            cut_reference_check(&sample);
            if (cut->wanted_count > 0) {
                size_t size, again_size;
                FREED unsigned char *before = cut_reference_copy(&sample, &size);
                assert_int_equal(cut_lattice_reconstruct(cut), 0);
                FREED unsigned char *after = cut_reference_copy(&sample, &again_size);
                assert_int_equal(size, again_size);
                assert_memory_equal(before, after, size);
                refused++;
            }
            cut_reference_check_derived(cut);
            cut_lattice_forget_changes(cut);
        }
    }
    assert_true(refused > 0 && faces_refused > 0);
}

TEST(too_few_vertices_are_refused_at_load)
{
    CutSample sample = {.lattice = sample_box(8, 8, 8)};
    Status status = {0};
    layout_create(&sample.layout, &sample.lattice, 1);
    assert_false(cut_sample_try(&sample, 100, 1, &status));
    assert_non_null(strstr(status.text, "vertex_capacity 100"));
    cut_sample_drop(&sample);
}

// The cut surface is of the smallest elements after as many calls as it has levels, and one more
// for each budget of divisions that it needs.
TEST(budget_bounds_the_calls_until_all_is_divided)
{
    static const int budgets[] = {1, 4, 16, 1000000};
    int divisions_of_all = 0;
    for (int b = 0; b < 4; b++) {
        SCOPED(cut_sample_drop) CutSample sample;
        cut_sample_create(&sample, sample_box(32, 32, 32), 2, 0, budgets[b]);
        CutLattice *cut = &sample.cut;
        FREED int(*face)[2] = malloc(3 * (size_t)cut->level_first[1] * sizeof *face);
        int divisions = 0, calls = 0;
        for (int row = 0; row < 16; row++) { // half way through, a row a call
            for (int k = 0; k < 32; k++) {
                face[k][0] = cut_lattice_cell(cut, 15, row, k);
                face[k][1] = 0;
            }
            cut_lattice_break(cut, (const int(*)[2])face, 32);
            divisions += cut_lattice_reconstruct(cut);
        }
        for (; cut->wanted_count > 0; calls++) {
            const int divided = cut_lattice_reconstruct(cut);
            assert_in_range(divided, 1, budgets[b] + 8 * 2);
            divisions += divided;
        }
        assert_true(calls <= cut->levels + divisions / budgets[b]);
        for (int row = 0; row < 16; row++)
            for (int k = 0; k < 32; k++)
                assert_true(cut_lattice_is_open(cut, cut_lattice_cell(cut, 15, row, k), 0));
        if (b == 0)
            divisions_of_all = divisions;
        assert_int_equal(divisions, divisions_of_all); // the same elements in the end
        cut_reference_check(&sample);
    }
}

// --- states that were brought back ---

static void go_on(CutSample *sample, uint64_t seed, int steps)
{
    CutLattice *cut = &sample->cut;
    FREED int(*face)[2] = malloc(3 * (size_t)cut->level_first[1] * sizeof *face);
    for (int step = 0; step < steps; step++) {
        const int count = cut_sample_random(cut, &seed, face);
        cut_lattice_break(cut, (const int(*)[2])face, count);
        cut_lattice_reconstruct(cut);
        cut_lattice_forget_changes(cut);
    }
}

TEST(state_that_was_brought_back_goes_on_alike)
{
    for (int round = 0; round < EFFORT(6); round++) {
        SCOPED(cut_sample_drop) CutSample sample;
        cut_sample_create(&sample, round % 2 == 0 ? sample_box(16, 16, 16) : sample_ball(20), 2, 0,
                          3);
        const size_t bytes = state_bytes(&sample.state);
        FREED void *start = malloc(bytes), *middle = malloc(bytes);
        state_copy_out(&sample.state, start);
        go_on(&sample, 31 + (uint64_t)round, 4);
        state_copy_out(&sample.state, middle);
        go_on(&sample, 41, 4);
        const uint64_t expected = state_hash(&sample.state);
        state_copy_in(&sample.state, middle);
        assert_true(cut_lattice_derive(&sample.cut));
        go_on(&sample, 41, 4);
        assert_true(state_hash(&sample.state) == expected);
        state_copy_in(&sample.state, start);
        assert_true(cut_lattice_derive(&sample.cut));
        go_on(&sample, 31 + (uint64_t)round, 4);
        go_on(&sample, 41, 4);
        assert_true(state_hash(&sample.state) == expected);
        cut_reference_check(&sample);
    }
}

// Whatever bytes a file brings: refused, or a state in which everything holds.
static void damage(bool removable)
{
    uint64_t seed = 14;
    SCOPED(cut_sample_drop) CutSample sample;
    cut_sample_make(&sample, sample_ball(14), 2, 0, 4, removable);
    go_on(&sample, 15, 4);
    expect_at_least(cut_reference_damage(&sample, &seed), 0.5);
}

TEST(damaged_states_are_refused_or_sound)
{
    damage(false);
}

TEST(damaged_states_with_removals_are_refused_or_sound)
{
    damage(true);
}
