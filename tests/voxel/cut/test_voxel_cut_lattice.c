// SPDX-License-Identifier: MIT
// The lattice of cut bodies against its definition, worked out anew in the plainest way after every
// step of random cuts and divisions.
#include "cut_sample.h"
#include "test.h"
#include "sample_mesh.h"

// --- what must hold, from the bits alone ---

// Of each cell of the lattice, in its order: the leaf that covers it, -1: void.
static int *leaves_of_cells(const CutSample *sample)
{
    const Lattice *lattice = &sample->lattice;
    const CutLattice *cut = &sample->cut;
    int *leaf = malloc((size_t)cut_sample_cells(sample) * sizeof *leaf), *out = leaf;
    FREED int *covered = calloc((size_t)cut->element_count, sizeof *covered);
    for (int k = 0; k < lattice->count[2]; k++)
        for (int j = 0; j < lattice->count[1]; j++)
            for (int i = 0; i < lattice->count[0]; i++, out++) {
                *out = -1;
                const int start = layout_leaf_at(&sample->layout, i, j, k);
                assert_int_equal(start >= 0, lattice_label(lattice, i, j, k) != 0);
                if (start < 0)
                    continue;
                int level = sample->layout.leaf[start].level, element;
                for (;; level--) {
                    const int nx = cut->count[0] >> level, ny = cut->count[1] >> level;
                    element =
                        cut->lut[level][((k >> level) * ny + (j >> level)) * nx + (i >> level)];
                    assert_true(element >= 0);
                    if (!cut->divided[element])
                        break;
                    assert_true(level > 0 || cut->removable);
                    if (level == 0) // gone
                        break;
                }
                assert_int_equal(cut_lattice_cell(cut, i, j, k) >= 0, !cut->divided[element]);
                if (cut->divided[element])
                    continue;
                assert_int_equal(cut->element[element].level, level);
                assert_int_equal(cut->element[element].material, lattice_label(lattice, i, j, k));
                *out = element;
                covered[element]++;
                assert_int_equal(cut_lattice_leaf_of(cut, cut_lattice_cell(cut, i, j, k)), element);
            }
    int leaves = 0;
    for (int e = 0; e < cut->element_count; e++) {
        const int level = cut->element[e].level;
        assert_int_equal(cut_lattice_is_leaf(cut, e), covered[e] > 0);
        assert_true(covered[e] == 0 || covered[e] == 1 << 3 * level);
        leaves += covered[e] > 0;
    }
    assert_int_equal(leaves, cut->leaf_count);
    return leaf;
}

static int at_cell(const CutSample *sample, const int *of_cell, const int at[3])
{
    const int *n = sample->lattice.count;
    for (int d = 0; d < 3; d++)
        if (at[d] < 0 || at[d] >= n[d])
            return -1;
    return of_cell[(at[2] * n[1] + at[1]) * n[0] + at[0]];
}

static void check_balance(const CutSample *sample, const int *leaf)
{
    const int *n = sample->lattice.count;
    for (int c = 0; c < cut_sample_cells(sample); c++)
        for (int a = 0; a < 27 && leaf[c] >= 0; a++) {
            const int at[3] = {c % n[0] + a % 3 - 1, c / n[0] % n[1] + a / 3 % 3 - 1,
                               c / n[0] / n[1] + a / 9 - 1};
            const int other = at_cell(sample, leaf, at);
            if (other >= 0)
                assert_true(abs(sample->cut.element[leaf[c]].level -
                                sample->cut.element[other].level) <= 1);
        }
}

// Whether two of the cells around a point, that share a face, hold together.
static bool holds(const CutSample *sample, const int *leaf, const int point[3], int a, int b)
{
    const CutLattice *cut = &sample->cut;
    if (leaf[a] < 0 || leaf[b] < 0)
        return false;
    if (leaf[a] == leaf[b] || cut->element[leaf[a]].level > 0 || cut->element[leaf[b]].level > 0)
        return true;
    const int low = a < b ? a : b, axis = (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2;
    const int cell = cut_lattice_cell(cut, point[0] - 1 + (low & 1), point[1] - 1 + (low >> 1 & 1),
                                      point[2] - 1 + (low >> 2));
    const bool broken = cut->broken[cell] >> axis & 1;
    assert_int_equal(cut_lattice_is_open(cut, cell, axis), broken);
    return !broken;
}

static bool is_corner(const CutLattice *cut, int leaf, const int point[3])
{
    for (int d = 0; d < 3; d++) {
        const int from = point[d] - cut->element[leaf].cell[d];
        if (from != 0 && from != 1 << cut->element[leaf].level)
            return false;
    }
    return true;
}

static bool is_node(const CutLattice *cut, int leaf, const int point[3])
{
    const int half = 1 << cut->element[leaf].level;
    for (int d = 0; d < 3; d++)
        if (2 * (point[d] - cut->element[leaf].cell[d]) % half != 0)
            return false;
    return true;
}

// Adds what the leaves around a point must have there: vertices, and nodes that have one.
static void check_point(const CutSample *sample, const int *of_cell, const int point[3],
                        int *vertices, long *incidences)
{
    const CutLattice *cut = &sample->cut;
    int leaf[8], around[8], lowest_solid = -1;
    bool joined[8][8];
    for (int s = 0; s < 8; s++) {
        const int at[3] = {point[0] - 1 + (s & 1), point[1] - 1 + (s >> 1 & 1),
                           point[2] - 1 + (s >> 2)};
        leaf[s] = at_cell(sample, of_cell, at);
        if (leaf[s] >= 0 && lowest_solid < 0)
            lowest_solid = s;
    }
    cut_lattice_around(cut, point, around);
    assert_memory_equal(leaf, around, sizeof leaf);
    bool inside = true; // of one leaf
    for (int s = 0; s < 8; s++)
        inside &= leaf[s] == leaf[0];
    if (inside)
        return;
    for (int a = 0; a < 8; a++)
        for (int b = 0; b < 8; b++) {
            const int across = a ^ b;
            joined[a][b] = a == b || (leaf[a] >= 0 && leaf[a] == leaf[b]) ||
                           ((across & (across - 1)) == 0 && holds(sample, leaf, point, a, b));
        }
    for (int m = 0; m < 8; m++)
        for (int a = 0; a < 8; a++)
            for (int b = 0; b < 8; b++)
                joined[a][b] |= joined[a][m] && joined[m][b];
    const int points = (sample->lattice.count[0] + 1) * (sample->lattice.count[1] + 1) *
                       (sample->lattice.count[2] + 1);
    const int index =
        (point[2] * (sample->lattice.count[1] + 1) + point[1]) * (sample->lattice.count[0] + 1) +
        point[0];
    for (int s = 0; s < 8; s++) {
        if (leaf[s] < 0)
            continue;
        bool owned = false, counted = false;
        int lowest = s;
        for (int t = 7; t >= 0; t--)
            if (leaf[t] >= 0 && joined[s][t]) {
                owned |= is_corner(cut, leaf[t], point);
                lowest = t;
            }
        const int v =
            is_node(cut, leaf[s], point)
                ? cut_lattice_nodes(cut, leaf[s])[cut_lattice_node_at(cut, leaf[s], point)]
                : -1;
        for (int t = 0; t < s; t++)
            counted |= leaf[t] == leaf[s];
        *incidences += owned && !counted;
        assert_int_equal(v >= 0, owned);
        if (!owned)
            continue;
        assert_true(v < cut_lattice_used(cut));
        assert_int_equal(cut->anchor[v], lowest);
        assert_int_equal(cut->vertex_id[v] % points, index);
        if (!cut->removable)
            assert_int_equal(cut->vertex_id[v],
                             index + (lowest == lowest_solid ? 0 : points * lowest));
        *vertices += lowest == s;
        int place[3];
        cut_lattice_point(cut, v, place);
        assert_memory_equal(place, point, sizeof place);
    }
}

static void check_wanted(const CutSample *sample)
{
    const CutLattice *cut = &sample->cut;
    FREED bool *bitten = calloc((size_t)cut->element_count, sizeof *bitten);
    for (int cell = 0; cell < cut->level_first[1]; cell++)
        for (int axis = 0; axis < 3; axis++)
            if (cut->broken[cell] >> axis & 1) {
                bitten[cut_lattice_leaf_of(cut, cell)] = true;
                bitten[cut_lattice_leaf_of(cut, cut_lattice_across(cut, cell, 2 * axis + 1))] =
                    true;
            }
    int count = 0;
    for (int level = cut->levels; level > 0; level--)
        for (int e = cut->level_first[level]; e < cut->level_first[level + 1]; e++)
            if (bitten[e]) {
                assert_true(count < cut->wanted_count);
                assert_int_equal(cut->wanted[count++], e);
            }
    assert_int_equal(count, cut->wanted_count);
}

static void check_all(const CutSample *sample)
{
    const CutLattice *cut = &sample->cut;
    int *leaf = leaves_of_cells(sample), vertices = 0;
    check_balance(sample, leaf);
    long incidences = 0, present = 0;
    const int *n = sample->lattice.count;
    for (int z = 0; z <= n[2]; z++)
        for (int y = 0; y <= n[1]; y++)
            for (int x = 0; x <= n[0]; x++)
                check_point(sample, leaf, (int[3]){x, y, z}, &vertices, &incidences);
    for (int v = 0; v < cut_lattice_used(cut); v++)
        vertices += cut->anchor[v] < 0;
    assert_int_equal(vertices, cut_lattice_used(cut));
    for (int e = 0; e < cut->element_count; e++)
        for (int node = 0; node < (e < cut->level_first[1] ? NODE_CORNERS : NODE_COUNT); node++)
            present += cut_lattice_nodes(cut, e)[node] >= 0;
    assert_int_equal(present, incidences);
    check_wanted(sample);
    free(leaf);
}

// --- what the changes say ---

// Everything that a follower keeps: the vertices of elements, as the changes tell of them.
typedef struct Follower {
    int (*node)[NODE_COUNT];
    int vertices;
} Follower;

static void follow_element(const CutLattice *cut, int (*node)[NODE_COUNT], int e)
{
    memset(node[e], -1, sizeof node[e]);
    memcpy(node[e], cut_lattice_nodes(cut, e),
           (e < cut->level_first[1] ? NODE_CORNERS : NODE_COUNT) * sizeof(int));
}

static Follower follower_create(const CutLattice *cut)
{
    Follower follower = {malloc((size_t)cut->element_count * sizeof *follower.node),
                         cut_lattice_used(cut)};
    for (int e = 0; e < cut->element_count; e++)
        follow_element(cut, follower.node, e);
    return follower;
}

static void check_births(const CutLattice *cut, Follower *follower)
{
    const CutChanges *changes = &cut->changes;
    for (int b = 0; b < changes->birth_count; b++) {
        const CutBirth *birth = &changes->birth[b];
        assert_int_equal(birth->vertex, follower->vertices + b); // in order, so parents come first
        const int parents = birth->parent_count, *parent = birth->parent;
        int place[3], sum[3] = {0}, at[3];
        cut_lattice_point(cut, birth->vertex, place);
        assert_true(parents == 1 || parents == 2 || parents == 4 || parents == 8);
        for (int p = 0; p < parents; p++) {
            assert_true(parent[p] >= 0 && parent[p] < birth->vertex);
            cut_lattice_point(cut, parent[p], at);
            for (int d = 0; d < 3; d++)
                sum[d] += at[d];
        }
        for (int d = 0; d < 3; d++)
            assert_int_equal(sum[d], parents * place[d]);
    }
    assert_int_equal(cut_lattice_used(cut), follower->vertices + changes->birth_count);
}

static void check_changes(CutLattice *cut, Follower *follower)
{
    check_births(cut, follower);
    FREED bool *listed = calloc((size_t)cut->element_count, sizeof *listed);
    for (int c = 0; c < cut->changes.element_count; c++) {
        const int e = cut->changes.element[c];
        assert_false(listed[e]);
        listed[e] = true;
        follow_element(cut, follower->node, e);
    }
    Follower expected = follower_create(cut);
    assert_memory_equal(follower->node, expected.node,
                        (size_t)cut->element_count * sizeof *expected.node);
    free(expected.node);
    follower->vertices = cut_lattice_used(cut);
}

// --- the fuzz ---

// Everything that follows from the state, in one block.
static unsigned char *derived_block(const CutLattice *cut, size_t *size)
{
    const size_t cells = (size_t)cut->level_first[1];
    const size_t others = (size_t)cut->element_count - cells;
    const size_t part[] = {cells * sizeof *cut->corner, others * sizeof *cut->node,
                           (size_t)cut->wanted_count * sizeof *cut->wanted,
                           sizeof cut->leaf_at_level};
    const void *memory[] = {cut->corner, cut->node, cut->wanted, cut->leaf_at_level};
    *size = part[0] + part[1] + part[2] + part[3];
    unsigned char *block = malloc(*size), *to = block;
    for (int k = 0; k < 4; k++) {
        memcpy(to, memory[k], part[k]);
        to += part[k];
    }
    return block;
}

static void check_derived(CutLattice *cut)
{
    size_t size, again_size;
    FREED unsigned char *block = derived_block(cut, &size);
    assert_true(cut_lattice_derive(cut));
    FREED unsigned char *again = derived_block(cut, &again_size);
    assert_int_equal(size, again_size);
    assert_memory_equal(block, again, size);
}

// Divides and takes away what the budget allows, as a body does.
static void remove_at_random(CutSample *sample, uint64_t *seed, Follower *follower)
{
    CutLattice *cut = &sample->cut;
    int cell[CUT_REMOVE_MOST], kept = cut_sample_random_cells(cut, seed, cell);
    cut_lattice_expose(cut, cell, &kept, cut->split_budget);
    check_changes(cut, follower);
    check_all(sample);
    cut_lattice_forget_changes(cut);
    cut_lattice_remove(cut, cell, kept);
    for (int k = 0; k < kept; k++)
        assert_true(cut_lattice_is_gone(cut, cell[k]));
    check_changes(cut, follower);
    check_all(sample);
    check_derived(cut);
    cut_lattice_forget_changes(cut);
}

static void cut_at_random(CutSample *sample, int steps, uint64_t *seed)
{
    CutLattice *cut = &sample->cut;
    FREED int(*face)[2] = malloc(3 * (size_t)cut->level_first[1] * sizeof *face);
    Follower follower = follower_create(cut);
    check_all(sample);
    for (int step = 0; step < steps; step++) {
        cut->split_budget = 1 + random_below(seed, 30);
        if (step + 4 < steps) {
            const int count = cut_sample_random(cut, seed, face);
            if (cut_lattice_has_room(cut, count))
                cut_lattice_break(cut, (const int(*)[2])face, count);
        }
        if (cut->removable || random_below(seed, 3) == 0) {
            check_changes(cut, &follower);
            check_all(sample);
            cut_lattice_forget_changes(cut);
        }
        if (cut->removable)
            remove_at_random(sample, seed, &follower);
        const int divided = cut_lattice_reconstruct(cut);
        // The last may have to divide larger neighbours first: one at each corner a level.
        assert_true(divided < cut->split_budget + 8 * 5);
        check_changes(cut, &follower);
        check_all(sample);
        if (step % 3 == 0)
            check_derived(cut);
        cut_lattice_forget_changes(cut);
    }
    free(follower.node);
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

// A copy of everything that a call may change.
static unsigned char *whole_block(const CutSample *sample, size_t *size)
{
    size_t derived;
    unsigned char *block = derived_block(&sample->cut, &derived);
    const size_t state = state_bytes(&sample->state);
    *size = derived + state;
    block = realloc(block, *size);
    state_copy_out(&sample->state, block + derived);
    return block;
}

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
            check_all(&sample);
            if (cut->wanted_count > 0) {
                size_t size, again_size;
                FREED unsigned char *before = whole_block(&sample, &size);
                assert_int_equal(cut_lattice_reconstruct(cut), 0);
                FREED unsigned char *after = whole_block(&sample, &again_size);
                assert_int_equal(size, again_size);
                assert_memory_equal(before, after, size);
                refused++;
            }
            check_derived(cut);
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
        check_all(&sample);
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
        check_all(&sample);
    }
}

// Whatever bytes a file brings: refused, or a state in which everything holds.
static void damage(bool removable)
{
    uint64_t seed = 14;
    SCOPED(cut_sample_drop) CutSample sample;
    cut_sample_make(&sample, sample_ball(14), 2, 0, 4, removable);
    go_on(&sample, 15, 4);
    for (int k = 0; k < 6 && removable; k++) {
        int cell[CUT_REMOVE_MOST], count = cut_sample_random_cells(&sample.cut, &seed, cell);
        cut_lattice_expose(&sample.cut, cell, &count, 1000);
        cut_lattice_remove(&sample.cut, cell, count);
        cut_lattice_forget_changes(&sample.cut);
    }
    const size_t bytes = state_bytes(&sample.state);
    FREED unsigned char *good = malloc(bytes), *bad = malloc(bytes);
    state_copy_out(&sample.state, good);
    int refused = 0, rounds = EFFORT(300);
    for (int round = 0; round < rounds; round++) {
        memcpy(bad, good, bytes);
        for (int n = random_below(&seed, 3); n >= 0; n--)
            bad[random_bits(&seed) % bytes] = (unsigned char)random_below(&seed, 256);
        if (round % 5 == 0) { // bits alone
            const size_t at = random_bits(&seed) % ((size_t)sample.cut.element_count +
                                                    (size_t)sample.cut.level_first[1]);
            memcpy(bad, good, bytes);
            bad[at] = (unsigned char)random_below(&seed, 8);
        }
        state_copy_in(&sample.state, bad);
        if (cut_lattice_derive(&sample.cut))
            check_all(&sample);
        else
            refused++;
    }
    assert_true(refused > rounds / 2);
    state_copy_in(&sample.state, good);
    assert_true(cut_lattice_derive(&sample.cut));
    check_all(&sample);
}

TEST(damaged_states_are_refused_or_sound)
{
    damage(false);
}

TEST(damaged_states_with_removals_are_refused_or_sound)
{
    damage(true);
}
