// SPDX-License-Identifier: MIT
// The lattice of bodies that adapt against its definition after every step of random divisions,
// merges, cuts and removals; the state at rest; limits, and states that were brought back.
#include "cut_reference.h"
#include "test.h"

#include "base/sets.h"
#include "voxel/cut/cut_parts.h"

// ---------------------------------------------------------------------------------------------
// Random sequences

// Finds leaves within a random distance of a random point, `share` in 100 of them; returns how
// many. leaf: [elements].
static int find_at_random(const CutLattice *cut, uint64_t *seed, int share, int *leaf)
{
    int count = 0;
    double x[3];
    const double reach = random_between(seed, 0.0, 6.0);
    for (int d = 0; d < 3; d++)
        x[d] = random_between(seed, 0.0, cut->lattice_count[d]);
    for (int e = cut->level_first[1]; e < cut->element_count; e++) {
        const double half = 0.5 * (1 << cut->element[e].level);
        double square = 0.0;
        for (int d = 0; d < 3; d++) {
            const double from = fabs(cut->element[e].cell[d] + half - x[d]) - half;
            square += from > 0.0 ? from * from : 0.0;
        }
        if (square <= reach * reach && cut_lattice_is_leaf(cut, e) &&
            random_below(seed, 100) < share)
            leaf[count++] = e;
    }
    return count;
}

static int count_divided(const CutLattice *cut)
{
    int divided = 0;
    for (int e = cut->level_first[1]; e < cut->element_count; e++)
        divided += cut->divided[e];
    return divided;
}

// Divides leaves, and keeps in the list those that are leaves still though nothing is broken in
// them: there was no room. Returns how many.
static int divide_leaves(CutLattice *cut, int *leaf, int count)
{
    int left = 0, before = count_divided(cut);
    const int divided = cut_lattice_divide(cut, leaf, count);
    assert_int_equal(count_divided(cut), before + divided);
    for (int k = 0; k < count; k++)
        if (cut_lattice_is_leaf(cut, leaf[k]))
            leaf[left++] = leaf[k];
    return left;
}

// In a body with room for all that there can be.
static void divide_at_random(CutLattice *cut, uint64_t *seed, int share)
{
    FREED int *leaf = malloc((size_t)cut->element_count * sizeof *leaf);
    assert_int_equal(divide_leaves(cut, leaf, find_at_random(cut, seed, share, leaf)), 0);
}

// Merges some of what can; returns how many.
static int merge_at_random(CutLattice *cut, uint64_t *seed, int share)
{
    int merged = 0;
    for (int e = cut->level_first[1]; e < cut->element_count; e++)
        if (random_below(seed, 100) < share && cut_lattice_can_merge(cut, e)) {
            cut_lattice_merge(cut, e);
            assert_true(cut_lattice_is_leaf(cut, e));
            merged++;
        }
    return merged;
}

// Divides what is in the way of faces, and breaks them if all has room. Follower: NULL, or who
// checks each change.
static void break_faces(CutSample *sample, int (*face)[2], int count, CutFollower *follower)
{
    CutLattice *cut = &sample->cut;
    int left;
    cut_lattice_clear(cut, (const int(*)[2])face, count, INT_MAX, &left);
    if (follower != NULL)
        cut_follower_settle(follower, sample);
    cut_lattice_forget_changes(cut);
    if (left > 0)
        return;
    const int births = cut_lattice_births(cut, (const int(*)[2])face, count);
    if (births > cut_parts_room(cut))
        return;
    cut_lattice_break(cut, (const int(*)[2])face, count);
    assert_int_equal(cut->changes.birth_count, births);
    if (follower != NULL)
        cut_follower_settle(follower, sample);
    cut_lattice_forget_changes(cut);
}

static void break_at_random(CutSample *sample, uint64_t *seed, CutFollower *follower)
{
    CutLattice *cut = &sample->cut;
    FREED int(*face)[2] = malloc(3 * (size_t)cut->level_first[1] * sizeof *face);
    break_faces(sample, face, cut_sample_random(cut, seed, face), follower);
}

// How many there have been of what a test must have met.
typedef struct Met {
    int merged, partly_filled, in_void, carried, freed;
} Met;

static void meet(Met *met, const CutLattice *cut)
{
    for (int e = cut->level_first[1]; e < cut->element_count; e++)
        met->partly_filled += cut_lattice_is_leaf(cut, e) && !cut->element[e].whole;
    for (int v = 0; v < cut_lattice_used(cut); v++) {
        met->in_void += cut->vertex_id[v] >= 0 && cut_lattice_is_in_void(cut, v);
        met->carried += cut_lattice_is_carried(cut, v);
        met->freed += cut->vertex_id[v] < 0;
    }
}

static void assert_all_met(const Met *met)
{
    assert_true(met->merged > 0 && met->partly_filled > 0 && met->in_void > 0);
    assert_true(met->carried > 0 && met->freed > 0);
}

static void live_at_random(CutSample *sample, int steps, bool cuts, uint64_t *seed, Met *met)
{
    CutLattice *cut = &sample->cut;
    if (random_below(seed, 2) == 0)
        cut_lattice_coarsen(cut);
    CutFollower follower = cut_follower_create(cut);
    cut_reference_check(sample);
    for (int step = 0; step < steps; step++) {
        cut->split_budget = 1 + random_below(seed, 30);
        if (cuts && random_below(seed, 5) == 0)
            break_at_random(sample, seed, &follower);
        if (cuts && cut->removable && random_below(seed, 4) == 0)
            cut_follower_remove_random(&follower, sample, seed);
        if (random_below(seed, 3) > 0)
            divide_at_random(cut, seed, 1 + random_below(seed, 100));
        cut_follower_settle(&follower, sample);
        met->merged += merge_at_random(cut, seed, 1 + random_below(seed, 100));
        cut_follower_settle(&follower, sample);
        meet(met, cut);
        if (step % 3 == 0)
            cut_reference_check_derived(cut);
    }
    cut_follower_drop(&follower);
}

static void create(CutSample *sample, Lattice lattice, int inside, int surface, bool removable)
{
    // As many vertices as there can be: those of the cells, and of corners in void.
    const int capacity = 8 * (int)lattice_solid(&lattice) + 4096;
    cut_sample_options(sample, lattice, inside, surface);
    sample->removable = removable;
    cut_sample_build(sample, capacity, 1);
}

// Lives of bodies of so many kinds: those that merge, then lattices that are hardly connected, or
// of several materials. Levels inside and at the surface differ by round.
static void live_all(uint64_t seed, int rounds, int kinds, bool cut, bool removable)
{
    Met met = {0};
    for (int round = 0; round < rounds; round++)
        for (int kind = 0; kind < kinds; kind++) {
            const int inside = cut ? round % 4 : round % 3;
            const int surface = !cut ? 1 + round % 3 : removable ? 2 - round % 2 : 2 + round % 2;
            SCOPED(cut_sample_drop) CutSample sample;
            create(&sample,
                   kind < MERGE_KINDS ? cut_sample_body((MergeKind)kind)
                                      : sample_lattice((SampleKind)(kind - MERGE_KINDS), &seed),
                   inside, surface, removable);
            live_at_random(&sample, 6, cut, &seed, &met);
        }
    assert_all_met(&met);
}

TEST(random_divisions_and_merges_keep_what_follows_from_the_bits)
{
    live_all(31, EFFORT(2), MERGE_KINDS, false, false);
}

TEST(random_cuts_and_merges_keep_what_follows_from_the_bits)
{
    live_all(32, EFFORT(1), MERGE_KINDS + SAMPLE_KINDS, true, false);
}

TEST(random_removals_and_merges_keep_what_follows_from_the_bits)
{
    live_all(33, EFFORT(1), MERGE_KINDS + SAMPLE_KINDS, true, true);
}

// ---------------------------------------------------------------------------------------------
// The state at rest

// The leaves and, for each, the ids at its nodes: whatever rows the vertices have.
static int *ids_of_leaves(const CutLattice *cut)
{
    int(*id)[NODE_COUNT] = malloc((size_t)cut->element_count * sizeof *id);
    memset(id, -1, (size_t)cut->element_count * sizeof *id);
    for (int e = 0; e < cut->element_count; e++)
        for (int n = 0; n < (e < cut->level_first[1] ? NODE_CORNERS : NODE_COUNT); n++) {
            const int v = cut_lattice_nodes(cut, e)[n];
            id[e][n] = v < 0 ? -1 : cut->vertex_id[v];
        }
    return (int *)id;
}

// Merges what can in any order, until nothing can.
static void merge_all(CutLattice *cut, uint64_t *seed)
{
    for (int idle = 0; idle < 40;) {
        const int merged = merge_at_random(cut, seed, 30);
        cut_lattice_forget_changes(cut);
        idle = merged > 0 ? 0 : idle + 1;
    }
}

// Makes a body fine here and there, and lets it come to rest: all is as before.
static void check_rest(CutLattice *cut, uint64_t *seed)
{
    const size_t elements = (size_t)cut->element_count;
    FREED unsigned char *at_rest = malloc(elements);
    FREED int *ids = ids_of_leaves(cut);
    memcpy(at_rest, cut->divided, elements);
    const int divided = count_divided(cut);
    for (int time = 0; time < 3; time++) {
        for (int call = 0; call < 3 || (call < 50 && count_divided(cut) == divided); call++) {
            divide_at_random(cut, seed, 100);
            cut_lattice_forget_changes(cut);
        }
        assert_int_equal(cut->wanted_count, 0);
        assert_memory_not_equal(at_rest, cut->divided, elements);
        if (time % 2 == 0)
            cut_lattice_coarsen(cut); // level by level
        else
            merge_all(cut, seed);
        FREED int *again = ids_of_leaves(cut);
        assert_memory_equal(at_rest, cut->divided, elements);
        assert_memory_equal(ids, again, elements * NODE_COUNT * sizeof *ids);
    }
}

// A body that was fine somewhere, whatever the order in which it merges again, is as at load, or as
// it was after it was cut.
TEST(the_coarsest_state_is_one)
{
    uint64_t seed = 34;
    for (int round = 0; round < EFFORT(2); round++)
        for (int kind = 0; kind < MERGE_KINDS; kind++) {
            SCOPED(cut_sample_drop) CutSample sample;
            create(&sample, cut_sample_body((MergeKind)kind), round % 3, 1 + round % 3, false);
            CutLattice *cut = &sample.cut;
            cut_lattice_coarsen(cut);
            cut_reference_check(&sample);
            check_rest(cut, &seed);
            // Cut it from this state and from a fine one: the same again.
            FREED int(*face)[2] = malloc(3 * (size_t)cut->level_first[1] * sizeof *face);
            const int count =
                cut_sample_disc(cut, vec3(5.0, 6.0, 1.0), vec3(0.6, 0.7, 0.1), 6.0, face);
            const size_t bytes = state_bytes(&sample.state);
            FREED void *uncut = malloc(bytes);
            state_copy_out(&sample.state, uncut);
            break_faces(&sample, face, count, NULL);
            cut_lattice_coarsen(cut);
            cut_reference_check(&sample);
            FREED int *ids = ids_of_leaves(cut);
            check_rest(cut, &seed);
            state_copy_in(&sample.state, uncut);
            assert_true(cut_lattice_derive(cut));
            divide_at_random(cut, &seed, 100);
            break_faces(&sample, face, count, NULL);
            cut_lattice_coarsen(cut);
            FREED int *again = ids_of_leaves(cut);
            assert_memory_equal(ids, again, (size_t)cut->element_count * NODE_COUNT * sizeof *ids);
            cut_reference_check(&sample);
        }
}

// The least element for each place of a cube: those of the surface, 2:1.
TEST(a_cube_at_rest_has_coarse_elements_throughout)
{
    SCOPED(cut_sample_drop) CutSample sample;
    create(&sample, sample_box(32, 32, 32), 2, 2, false);
    cut_lattice_coarsen(&sample.cut);
    cut_reference_check(&sample);
    assert_int_equal(sample.cut.leaf_count, 512);
    int used = 0;
    for (int v = 0; v < cut_lattice_used(&sample.cut); v++)
        used += sample.cut.vertex_id[v] >= 0 && !cut_lattice_is_carried(&sample.cut, v);
    assert_int_equal(used, 9 * 9 * 9);
}

// Returns how many groups of leaves there are that have a vertex in common.
static int count_groups(const CutLattice *cut)
{
    FREED int *of_vertex = malloc((size_t)cut->vertex_capacity * sizeof *of_vertex);
    FREED int *parent = malloc((size_t)cut->element_count * sizeof *parent);
    memset(of_vertex, -1, (size_t)cut->vertex_capacity * sizeof *of_vertex);
    union_find_reset(parent, cut->element_count);
    for (int e = 0; e < cut->element_count; e++)
        for (int n = 0; n < (e < cut->level_first[1] ? NODE_CORNERS : NODE_COUNT); n++) {
            const int v = cut_lattice_nodes(cut, e)[n];
            if (v < 0)
                continue;
            if (of_vertex[v] < 0)
                of_vertex[v] = e;
            union_find_join(parent, e, of_vertex[v]);
        }
    int groups = 0;
    for (int e = 0; e < cut->element_count; e++)
        groups += cut_lattice_is_leaf(cut, e) && union_find_root(parent, e) == e;
    return groups;
}

// Coarse elements share vertices in void, too: never with what does not hang together with them.
TEST(merging_joins_nothing_that_is_apart)
{
    uint64_t seed = 35;
    int apart = 0;
    for (int round = 0; round < EFFORT(2); round++)
        for (int kind = 0; kind <= MERGE_KINDS + SAMPLE_KINDS; kind++) {
            SCOPED(cut_sample_drop) CutSample sample;
            Lattice lattice = kind < MERGE_KINDS ? cut_sample_body((MergeKind)kind)
                              : kind == MERGE_KINDS + SAMPLE_KINDS
                                  ? sample_box(16, 12, 9)
                                  : sample_lattice((SampleKind)(kind - MERGE_KINDS), &seed);
            if (kind == MERGE_KINDS + SAMPLE_KINDS) // two plates, a cell apart, in the same blocks
                memset(lattice.label + lattice_index(&lattice, 0, 0, 5), 0, 16 * 12);
            const int pieces = lattice_pieces(&lattice);
            create(&sample, lattice, round % 3, 1 + round % 3, false);
            cut_lattice_coarsen(&sample.cut);
            assert_int_equal(count_groups(&sample.cut), pieces);
            divide_at_random(&sample.cut, &seed, 100);
            cut_lattice_forget_changes(&sample.cut);
            assert_int_equal(count_groups(&sample.cut), pieces);
            apart += pieces > 1 && sample.cut.leaf_at_level[1] > 0;
        }
    assert_true(apart > 0);
}

// ---------------------------------------------------------------------------------------------
// Limits, and states that were brought back

// Dividing leaves of a list is the same as dividing one after the other. Tries it, and puts the
// state back. Returns how many were divided behind one that had no room.
static int divide_each(CutSample *sample, const int *leaf, int count)
{
    CutLattice *cut = &sample->cut;
    const size_t bytes = state_bytes(&sample->state);
    FREED void *start = malloc(bytes);
    state_copy_out(&sample->state, start);
    int behind = 0, divided = 0;
    bool refused = false;
    for (int k = 0; k < count; k++) {
        const int now = cut_lattice_divide(cut, &leaf[k], 1);
        divided += now;
        behind += refused && cut->divided[leaf[k]] && now > 0;
        refused |= cut_lattice_is_leaf(cut, leaf[k]);
    }
    const uint64_t each = state_hash(&sample->state);
    state_copy_in(&sample->state, start);
    assert_true(cut_lattice_derive(cut));
    assert_int_equal(cut_lattice_divide(cut, leaf, count), divided);
    assert_true(state_hash(&sample->state) == each);
    state_copy_in(&sample->state, start);
    assert_true(cut_lattice_derive(cut));
    return behind;
}

// Divisions that do not fit leave everything as it was and keep none behind them waiting; merging
// makes room for them.
TEST(rows_of_vertices_that_ended_are_used_again)
{
    uint64_t seed = 38;
    int refused = 0, behind = 0, found_room = 0;
    for (int round = 0; round < EFFORT(6); round++) {
        SCOPED(cut_sample_drop) CutSample sample;
        Lattice lattice = cut_sample_body(round % 2 == 0 ? MERGE_CUBE : MERGE_BALL);
        // As many rows as the body with its fine surface has, and a few.
        cut_sample_options(&sample, lattice, 2, 2);
        LatticeMesh mesh;
        Status status = {0};
        assert_true(lattice_mesh_create(&mesh, &sample.layout, &status));
        const int capacity = mesh.vertex_count + random_below(&seed, 40);
        lattice_mesh_destroy(&mesh);
        cut_sample_build(&sample, capacity, 1000);
        CutLattice *cut = &sample.cut;
        CutFollower follower = cut_follower_create(cut);
        FREED int *leaf = malloc((size_t)cut->element_count * sizeof *leaf);
        for (int step = 0; step < 12; step++) {
            int count = find_at_random(cut, &seed, 100, leaf);
            behind += divide_each(&sample, leaf, count);
            for (int before = -1; before != count_divided(cut);) { // it may free rows, too
                before = count_divided(cut);
                count = divide_leaves(cut, leaf, count);
                cut_follower_settle(&follower, &sample);
            }
            if (count > 0) {
                refused++;
                size_t size, again_size;
                FREED unsigned char *block = cut_reference_copy(&sample, &size);
                assert_int_equal(cut_lattice_divide(cut, leaf, count), 0);
                FREED unsigned char *again = cut_reference_copy(&sample, &again_size);
                assert_int_equal(size, again_size);
                assert_memory_equal(block, again, size);
            }
            merge_at_random(cut, &seed, 60);
            cut_follower_settle(&follower, &sample);
            int waiting = 0;
            for (int k = 0; k < count; k++) // others are inside leaves now
                waiting += cut_lattice_is_leaf(cut, leaf[k]);
            found_room += waiting - divide_leaves(cut, leaf, count);
            cut_follower_settle(&follower, &sample);
            cut_reference_check_derived(cut);
        }
        cut_follower_drop(&follower);
    }
    print_message("%d times some had no room, %d behind such had, %d found it later\n", refused,
                  behind, found_room);
    assert_true(refused > 0 && behind > 0 && found_room > 0);
}

// Merging whole elements needs no row, and makes room for those that need some.
TEST(a_body_that_has_no_row_left_comes_to_rest_as_well)
{
    int *ids[2], leaves[2];
    for (int full = 0; full < 2; full++) {
        SCOPED(cut_sample_drop) CutSample sample;
        cut_sample_options(&sample, cut_sample_body(MERGE_BALL), 2, 2);
        LatticeMesh mesh;
        Status status = {0};
        assert_true(lattice_mesh_create(&mesh, &sample.layout, &status));
        const int vertices = mesh.vertex_count;
        lattice_mesh_destroy(&mesh);
        cut_sample_build(&sample, full ? vertices : 4 * vertices, 1);
        cut_lattice_coarsen(&sample.cut);
        ids[full] = ids_of_leaves(&sample.cut);
        leaves[full] = sample.cut.leaf_count;
        if (full)
            assert_memory_equal(ids[0], ids[1],
                                (size_t)sample.cut.element_count * NODE_COUNT * sizeof(int));
        cut_reference_check(&sample);
    }
    assert_int_equal(leaves[0], leaves[1]);
    free(ids[0]);
    free(ids[1]);
}

static void go_on(CutSample *sample, uint64_t seed, int steps)
{
    CutLattice *cut = &sample->cut;
    FREED int(*face)[2] = malloc(3 * (size_t)cut->level_first[1] * sizeof *face);
    for (int step = 0; step < steps; step++) {
        if (step % 3 == 2)
            break_faces(sample, face, cut_sample_random(cut, &seed, face), NULL);
        divide_at_random(cut, &seed, 100);
        cut_lattice_forget_changes(cut);
        merge_at_random(cut, &seed, 20);
        cut_lattice_forget_changes(cut);
    }
}

// The order of free rows follows from the state.
TEST(adapting_state_that_was_brought_back_goes_on_alike)
{
    for (int round = 0; round < EFFORT(4); round++) {
        SCOPED(cut_sample_drop) CutSample sample;
        create(&sample, cut_sample_body(round % 2 == 0 ? MERGE_BALL : MERGE_LOBES), 2, 2, false);
        cut_lattice_coarsen(&sample.cut);
        const size_t bytes = state_bytes(&sample.state);
        FREED void *middle = malloc(bytes);
        go_on(&sample, 31 + (uint64_t)round, 6);
        state_copy_out(&sample.state, middle);
        go_on(&sample, 41, 5);
        const uint64_t expected = state_hash(&sample.state);
        state_copy_in(&sample.state, middle);
        assert_true(cut_lattice_derive(&sample.cut));
        go_on(&sample, 41, 5);
        assert_true(state_hash(&sample.state) == expected);
        cut_reference_check(&sample);
    }
}

// Whatever bytes a file brings: refused, or a state in which everything holds.
static void damage(bool removable)
{
    uint64_t seed = 38;
    SCOPED(cut_sample_drop) CutSample sample;
    create(&sample, sample_ball(13), 2, 2, removable);
    cut_lattice_coarsen(&sample.cut);
    go_on(&sample, 39, 4);
    expect_at_least(cut_reference_damage(&sample, &seed), 1.0 / 3.0);
}

TEST(damaged_adapting_states_are_refused_or_sound)
{
    damage(false);
}

TEST(damaged_adapting_states_with_removals_are_refused_or_sound)
{
    damage(true);
}

// True if the state is refused as it is now; then it is as it was before.
static bool is_refused(CutSample *sample, const void *good)
{
    const bool refused = !cut_lattice_derive(&sample->cut);
    state_copy_in(&sample->state, good);
    assert_true(cut_lattice_derive(&sample->cut));
    return refused;
}

// States in which everything else fits, as a file may bring them.
TEST(adapting_states_that_no_body_has_are_refused)
{
    SCOPED(cut_sample_drop) CutSample sample;
    create(&sample, sample_ball(13), 2, 2, false);
    CutLattice *cut = &sample.cut;
    cut_lattice_coarsen(cut);
    FREED void *good = malloc(state_bytes(&sample.state));
    // A partly filled element that has no numbers of its own.
    int merged = cut->level_first[1];
    while (!cut_lattice_is_leaf(cut, merged) || cut->element[merged].whole)
        merged++;
    state_copy_out(&sample.state, good);
    cut->element[merged].mergeable = false;
    const bool refused = !cut_lattice_derive(cut);
    cut->element[merged].mergeable = true;
    assert_true(refused);
    assert_true(cut_lattice_derive(cut));
    // A vertex that no part can have.
    int id = 0;
    while (cut_points_anchor_of(cut, id) >= 0)
        id++;
    cut->vertex_id[(*cut->vertex_count)++] = id;
    assert_true(is_refused(&sample, good));
    // A kept vertex in whose place another is: nothing carries it among finest cells.
    int kept = 0;
    while (kept < cut->kept_end && !cut_lattice_is_carried(cut, kept))
        kept++;
    assert_true(kept < cut->kept_end);
    int point[3], leaf[8];
    cut_lattice_point(cut, kept, point);
    cut_lattice_around(cut, point, leaf);
    for (int s = 0; s < 8; s++) // around it all becomes finest
        for (int round = 0; round < 4 && leaf[s] >= cut->level_first[1]; round++) {
            cut_lattice_divide(cut, &leaf[s], 1);
            cut_lattice_forget_changes(cut);
            cut_lattice_around(cut, point, leaf);
        }
    assert_false(cut_lattice_is_carried(cut, kept));
    state_copy_out(&sample.state, good);
    cut->vertex_id[(*cut->vertex_count)++] = cut->kept_id[kept];
    assert_true(is_refused(&sample, good));
}

TEST(a_carried_vertex_that_says_its_cells_have_gone_is_refused)
{
    SCOPED(cut_sample_drop) CutSample sample;
    create(&sample, sample_ball(13), 2, 2, true);
    CutLattice *cut = &sample.cut;
    cut_lattice_coarsen(cut);
    FREED void *good = malloc(state_bytes(&sample.state));
    state_copy_out(&sample.state, good);
    int carried = 0;
    for (int v = 0; v < cut->kept_end; v++) {
        if (!cut_lattice_is_carried(cut, v))
            continue;
        carried++;
        cut->anchor[v] = -1;
        assert_true(is_refused(&sample, good));
    }
    assert_true(carried > 0);
}
