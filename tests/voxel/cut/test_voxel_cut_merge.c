// SPDX-License-Identifier: MIT
// The lattice of bodies that adapt against its definition, worked out anew in the plainest way
// after every step of random divisions, merges, cuts and removals.
#include "cut_sample.h"
#include "test.h"

#include "base/sets.h"

// ---------------------------------------------------------------------------------------------
// What must hold, from the bits and the labels alone

static bool is_solid(const CutSample *sample, const int at[3])
{
    return lattice_label(&sample->lattice, at[0], at[1], at[2]) != 0;
}

static int block_at(const CutLattice *cut, int level, const int cell[3])
{
    int at[3];
    for (int d = 0; d < 3; d++) {
        if (cell[d] < 0 || cell[d] >= cut->count[d])
            return -1;
        at[d] = cell[d] >> level;
    }
    const int nx = cut->count[0] >> level, ny = cut->count[1] >> level;
    return cut->lut[level][(at[2] * ny + at[1]) * nx + at[0]];
}

// The leaf whose block holds a position, solid or not: the largest block that is not divided.
static int leaf_at(const CutLattice *cut, const int cell[3])
{
    for (int level = cut->levels; level >= 0; level--) {
        const int element = block_at(cut, level, cell);
        if (element >= 0 && !cut->divided[element])
            return element;
    }
    return -1;
}

// Each leaf of all that a point has around it.
static void leaves_around(const CutLattice *cut, const int point[3], int leaf[8])
{
    for (int s = 0; s < 8; s++)
        leaf[s] = leaf_at(cut, (int[3]){point[0] - 1 + (s & 1), point[1] - 1 + (s >> 1 & 1),
                                        point[2] - 1 + (s >> 2)});
}

// Whether solid cells on both sides meet in the face of the smaller of two leaves, on its side
// `direction`.
static bool cells_meet(const CutSample *sample, int smaller, int direction)
{
    const CutElement *element = &sample->cut.element[smaller];
    const int axis = direction / 2, edge = 1 << element->level;
    for (int i = 0; i < edge; i++)
        for (int j = 0; j < edge; j++) {
            int in[3], out[3];
            cut_lattice_place(&sample->cut, smaller, in);
            in[axis] += direction & 1 ? edge - 1 : 0;
            in[(axis + 1) % 3] += i;
            in[(axis + 2) % 3] += j;
            memcpy(out, in, sizeof out);
            out[axis] += direction & 1 ? 1 : -1;
            if (is_solid(sample, in) && is_solid(sample, out))
                return true;
        }
    return false;
}

// Whether the leaves in two slots that share a face hold together there.
static bool holds(const CutSample *sample, const int leaf[8], int low, int axis)
{
    const CutLattice *cut = &sample->cut;
    const int a = leaf[low], b = leaf[low + (1 << axis)];
    if (a < 0 || b < 0)
        return false;
    const int x = cut->element[a].level, y = cut->element[b].level;
    if (a == b)
        return true;
    if (x == 0 && y == 0)
        return !(cut->broken[a] >> axis & 1);
    return x <= y ? cells_meet(sample, a, 2 * axis + 1) : cells_meet(sample, b, 2 * axis);
}

// Finds the lowest slot of the part of each slot.
static void find_parts(const CutSample *sample, const int leaf[8], int part[8])
{
    for (int s = 0; s < 8; s++)
        part[s] = leaf[s] < 0 ? -1 : s;
    for (int round = 0; round < 8; round++)
        for (int s = 0; s < 8; s++)
            for (int axis = 0; axis < 3; axis++) {
                const int t = s + (1 << axis);
                if ((s >> axis & 1) || !holds(sample, leaf, s, axis))
                    continue;
                part[s] = part[t] = part[s] < part[t] ? part[s] : part[t];
            }
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

// The vertex of a leaf at a point, by the place of the node; -1: none there.
static int entry_at(const CutLattice *cut, int leaf, const int point[3])
{
    int at[3];
    for (int d = 0; d < 3; d++) {
        const int twice = 2 * (point[d] - cut->element[leaf].cell[d]);
        const int edge = 1 << cut->element[leaf].level;
        if (twice % edge != 0)
            return -1;
        at[d] = twice / edge;
    }
    const int node = node_at_offset(at[0], at[1], at[2]);
    return node < 0 ? -1 : cut_lattice_nodes(cut, leaf)[node];
}

// The slot of the lowest solid cell of a part; 8 + its lowest slot: it has none.
static int anchor_of(const CutSample *sample, const int point[3], const int part[8], int of)
{
    for (int s = 0; s < 8; s++)
        if (part[s] == of &&
            is_solid(sample, (int[3]){point[0] - 1 + (s & 1), point[1] - 1 + (s >> 1 & 1),
                                      point[2] - 1 + (s >> 2)}))
            return s;
    return 8 + of;
}

typedef struct Sums {
    int vertices;    // that parts own
    long incidences; // nodes of leaves that have one
} Sums;

// Checks the vertices that the leaves around a point have there; `seen`: [vertex].
static void check_point(const CutSample *sample, const int point[3], bool *seen, Sums *sums)
{
    const CutLattice *cut = &sample->cut;
    int leaf[8], around[8], part[8];
    leaves_around(cut, point, leaf);
    cut_lattice_around(cut, point, around);
    assert_memory_equal(leaf, around, sizeof leaf);
    find_parts(sample, leaf, part);
    for (int s = 0; s < 8; s++) {
        if (leaf[s] < 0)
            continue;
        bool owned = false, counted = false;
        for (int t = 0; t < 8; t++)
            owned |= leaf[t] >= 0 && part[t] == part[s] && is_corner(cut, leaf[t], point);
        for (int t = 0; t < s; t++)
            counted |= leaf[t] == leaf[s];
        const int v = entry_at(cut, leaf[s], point);
        assert_int_equal(v >= 0, owned);
        if (!owned)
            continue;
        sums->incidences += !counted;
        assert_in_range(v, 0, cut_lattice_used(cut) - 1);
        const int anchor = anchor_of(sample, point, part, part[s]);
        assert_int_equal(cut->anchor[v], anchor);
        assert_int_equal(cut_lattice_is_in_void(cut, v), anchor >= 8);
        assert_false(cut_lattice_is_carried(cut, v));
        if (part[s] == s) {
            assert_false(seen[v]); // one vertex, one part
            seen[v] = true;
            sums->vertices++;
        }
        int place[3];
        cut_lattice_point(cut, v, place);
        assert_memory_equal(place, point, sizeof place);
        // Ids of the uncut mesh: the index of the point, and more for further parts.
        const int *n = sample->lattice.count;
        const int points = (n[0] + 1) * (n[1] + 1) * (n[2] + 1);
        const int index = (point[2] * (n[1] + 1) + point[1]) * (n[0] + 1) + point[0];
        int lowest = 0;
        while (anchor < 8 && !is_solid(sample, (int[3]){point[0] - 1 + (lowest & 1),
                                                        point[1] - 1 + (lowest >> 1 & 1),
                                                        point[2] - 1 + (lowest >> 2)}))
            lowest++;
        if (anchor >= 8)
            assert_true(cut->vertex_id[v] >= 8 * points);
        else if (!cut->removable)
            assert_int_equal(cut->vertex_id[v], index + (anchor == lowest ? 0 : points * anchor));
        else
            assert_int_equal(cut->vertex_id[v] % points, index);
    }
}

// Leaves are apart by one level at most where they touch, in void too.
static void check_balance(const CutLattice *cut)
{
    int at[3];
    for (at[2] = 0; at[2] < cut->count[2]; at[2]++)
        for (at[1] = 0; at[1] < cut->count[1]; at[1]++)
            for (at[0] = 0; at[0] < cut->count[0]; at[0]++) {
                const int leaf = leaf_at(cut, at);
                for (int n = 0; n < 27 && leaf >= 0; n++) {
                    const int other = leaf_at(
                        cut, (int[3]){at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1});
                    if (other >= 0)
                        assert_true(abs(cut->element[leaf].level - cut->element[other].level) <= 1);
                }
            }
}

// Every cell that is there is in one leaf, of its material.
static void check_leaves(const CutSample *sample)
{
    const CutLattice *cut = &sample->cut;
    FREED int *cells = calloc((size_t)cut->element_count, sizeof *cells);
    int at[3], leaves = 0, at_level[VOXEL_LEVELS_MAX + 1] = {0};
    for (at[2] = 0; at[2] < sample->lattice.count[2]; at[2]++)
        for (at[1] = 0; at[1] < sample->lattice.count[1]; at[1]++)
            for (at[0] = 0; at[0] < sample->lattice.count[0]; at[0]++) {
                const int cell = block_at(cut, 0, at), leaf = leaf_at(cut, at);
                assert_int_equal(cell >= 0, is_solid(sample, at));
                if (cell < 0)
                    continue;
                assert_int_equal(leaf < 0, cut_lattice_is_gone(cut, cell));
                if (leaf < 0)
                    continue;
                cells[leaf]++;
                assert_int_equal(cut_lattice_leaf_of(cut, cell), leaf);
                assert_int_equal(cut->element[leaf].material,
                                 lattice_label(&sample->lattice, at[0], at[1], at[2]));
            }
    for (int e = 0; e < cut->element_count; e++) {
        assert_int_equal(cut_lattice_is_leaf(cut, e), cells[e] > 0);
        if (cells[e] == 0)
            continue;
        assert_int_equal(cut->element[e].whole, cells[e] == 1 << 3 * cut->element[e].level);
        leaves++;
        at_level[cut->element[e].level]++;
    }
    assert_int_equal(leaves, cut->leaf_count);
    assert_memory_equal(at_level, cut->leaf_at_level, sizeof at_level);
}

// Whether a face of one of an element's cells is broken.
static bool is_bitten(const CutSample *sample, const bool *bitten, int element)
{
    const CutElement *of = &sample->cut.element[element];
    const int edge = 1 << of->level;
    for (int n = 0; n < edge * edge * edge; n++) {
        const int at[3] = {of->cell[0] + n % edge, of->cell[1] + n / edge % edge,
                           of->cell[2] + n / edge / edge};
        const int cell = block_at(&sample->cut, 0, at);
        if (cell >= 0 && bitten[cell])
            return true;
    }
    return false;
}

// Whether a leaf must be divided.
static bool must_be_divided(const CutSample *sample, const bool *bitten, int element)
{
    const CutElement *of = &sample->cut.element[element];
    const int edge = 1 << of->level;
    if (!of->mergeable || is_bitten(sample, bitten, element))
        return true;
    for (int n = 0; n < 27 && !of->whole; n++) {
        const int around = block_at(&sample->cut, of->level,
                                    (int[3]){of->cell[0] + (n % 3 - 1) * edge,
                                             of->cell[1] + (n / 3 % 3 - 1) * edge,
                                             of->cell[2] + (n / 9 - 1) * edge});
        if (around >= 0 && is_bitten(sample, bitten, around))
            return true;
    }
    return false;
}

static void check_wanted(const CutSample *sample)
{
    const CutLattice *cut = &sample->cut;
    FREED bool *bitten = calloc((size_t)cut->level_first[1], sizeof *bitten);
    for (int cell = 0; cell < cut->level_first[1]; cell++)
        for (int axis = 0; axis < 3; axis++)
            if (cut->broken[cell] >> axis & 1)
                bitten[cell] = bitten[cut_lattice_across(cut, cell, 2 * axis + 1)] = true;
    int count = 0;
    for (int level = cut->levels; level > 0; level--)
        for (int e = cut->level_first[level]; e < cut->level_first[level + 1]; e++)
            if (cut_lattice_is_leaf(cut, e) && must_be_divided(sample, bitten, e)) {
                assert_true(count < cut->wanted_count);
                assert_int_equal(cut->wanted[count++], e);
            }
    assert_int_equal(count, cut->wanted_count);
}

static void check_all(const CutSample *sample)
{
    const CutLattice *cut = &sample->cut;
    check_leaves(sample);
    check_balance(cut);
    check_wanted(sample);
    FREED bool *seen = calloc((size_t)cut->vertex_capacity, sizeof *seen);
    Sums sums = {0};
    int p[3];
    for (p[2] = 0; p[2] <= cut->count[2]; p[2]++)
        for (p[1] = 0; p[1] <= cut->count[1]; p[1]++)
            for (p[0] = 0; p[0] <= cut->count[0]; p[0]++)
                check_point(sample, p, seen, &sums);
    long present = 0;
    for (int e = 0; e < cut->element_count; e++)
        for (int n = 0; n < (e < cut->level_first[1] ? NODE_CORNERS : NODE_COUNT); n++)
            present += cut_lattice_nodes(cut, e)[n] >= 0;
    assert_true(present == sums.incidences);
    // Whatever else is in a row is shown and carried, or without elements, or free.
    for (int v = 0; v < cut->vertex_capacity; v++) {
        const bool carried = cut_lattice_is_carried(cut, v);
        assert_false(seen[v] && carried);
        if (v >= cut_lattice_used(cut) || cut->vertex_id[v] < 0) {
            assert_int_equal(cut->vertex_id[v], -1);
            assert_false(seen[v] || carried || cut_lattice_is_kept(cut, v));
        } else if (!seen[v] && !carried) {
            assert_true(cut->removable && cut->anchor[v] == -1);
        }
        if (carried)
            assert_true(cut_lattice_is_kept(cut, v) && cut->anchor[v] >= 0 && cut->anchor[v] < 8);
    }
}

// ---------------------------------------------------------------------------------------------
// What the changes say

// What a follower knows: the vertices of elements, and which rows hold one.
typedef struct Follower {
    int (*node)[NODE_COUNT];
    int *id; // [capacity] -1: none
    bool *carried;
} Follower;

static void follow_element(const CutLattice *cut, int (*node)[NODE_COUNT], int e)
{
    memset(node[e], -1, sizeof node[e]);
    memcpy(node[e], cut_lattice_nodes(cut, e),
           (e < cut->level_first[1] ? NODE_CORNERS : NODE_COUNT) * sizeof(int));
}

static Follower follower_create(const CutLattice *cut)
{
    const size_t capacity = (size_t)cut->vertex_capacity;
    Follower follower = {malloc((size_t)cut->element_count * sizeof *follower.node),
                         malloc(capacity * sizeof *follower.id),
                         calloc(capacity, sizeof *follower.carried)};
    memcpy(follower.id, cut->vertex_id, capacity * sizeof *follower.id);
    for (int e = 0; e < cut->element_count; e++)
        follow_element(cut, follower.node, e);
    for (int v = 0; v < cut->vertex_capacity; v++)
        follower.carried[v] = cut_lattice_is_carried(cut, v);
    return follower;
}

static void follower_drop(Follower *follower)
{
    free(follower->node);
    free(follower->id);
    free(follower->carried);
}

// Births: in the middle of vertices that were there or came before, or at the corner of an element.
static void check_births(const CutLattice *cut, Follower *follower)
{
    FREED bool *known = calloc((size_t)cut->vertex_capacity, sizeof *known);
    for (int v = 0; v < cut->vertex_capacity; v++)
        known[v] = follower->id[v] >= 0;
    for (int b = 0; b < cut->changes.birth_count; b++) {
        const CutBirth *birth = &cut->changes.birth[b];
        int place[3], sum[3] = {0}, at[3];
        cut_lattice_point(cut, birth->vertex, place);
        // A row is not used again within a change.
        assert_int_equal(known[birth->vertex], birth->carried);
        assert_int_equal(birth->extrapolated >= 0, birth->parent_count == 0);
        if (birth->extrapolated >= 0)
            assert_true(is_corner(cut, birth->extrapolated, place));
        for (int p = 0; p < birth->parent_count; p++) {
            assert_true(known[birth->parent[p]] && birth->parent[p] != birth->vertex);
            cut_lattice_point(cut, birth->parent[p], at);
            for (int d = 0; d < 3; d++)
                sum[d] += at[d];
        }
        for (int d = 0; d < 3 && birth->parent_count > 0; d++)
            assert_int_equal(sum[d], birth->parent_count * place[d]);
        known[birth->vertex] = true;
    }
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
    // Rows come by births and go by ends; what neither names is as it was.
    FREED bool *named = calloc((size_t)cut->vertex_capacity, sizeof *named);
    for (int b = 0; b < cut->changes.birth_count; b++)
        named[cut->changes.birth[b].vertex] = true;
    FREED bool *ended = calloc((size_t)cut->vertex_capacity, sizeof *ended);
    for (int k = 0; k < cut->changes.ended_count; k++) {
        const CutEnd *end = &cut->changes.ended[k];
        int place[3];
        assert_false(ended[end->vertex]);
        named[end->vertex] = ended[end->vertex] = true;
        cut_lattice_point(cut, end->vertex, place);
        for (int d = 0; d < 3; d++)
            assert_in_range(place[d] - cut->element[end->element].cell[d], 0,
                            1 << cut->element[end->element].level);
    }
    Follower now = follower_create(cut);
    for (int v = 0; v < cut->vertex_capacity; v++) {
        if (named[v])
            continue;
        assert_int_equal(now.id[v] >= 0, follower->id[v] >= 0);
        assert_int_equal(now.carried[v], follower->carried[v]);
        if (now.id[v] >= 0 && !cut_lattice_is_in_void(cut, v))
            assert_int_equal(now.id[v], follower->id[v]);
    }
    assert_memory_equal(follower->node, now.node, (size_t)cut->element_count * sizeof *now.node);
    follower_drop(follower);
    *follower = now;
}

// Everything that follows from the state, in one block.
static unsigned char *derived_block(const CutLattice *cut, size_t *size)
{
    const size_t cells = (size_t)cut->level_first[1];
    const size_t others = (size_t)cut->element_count - cells;
    const size_t part[] = {cells * sizeof *cut->corner,
                           others * sizeof *cut->node,
                           (size_t)cut->wanted_count * sizeof *cut->wanted,
                           sizeof cut->leaf_at_level,
                           (size_t)cut->kept_end * sizeof *cut->carried,
                           (size_t)cut->vertex_capacity * sizeof *cut->anchor};
    const void *memory[] = {cut->corner,        cut->node,    cut->wanted,
                            cut->leaf_at_level, cut->carried, cut->anchor};
    enum { PARTS = sizeof part / sizeof *part };
    *size = 0;
    for (int k = 0; k < PARTS; k++)
        *size += part[k];
    unsigned char *block = malloc(*size + 1), *to = block;
    for (int k = 0; k < PARTS; k++) {
        memcpy(to, memory[k], part[k]);
        to += part[k];
    }
    return block;
}

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

static void check_derived(CutLattice *cut)
{
    size_t size, again_size;
    FREED unsigned char *block = derived_block(cut, &size);
    assert_true(cut_lattice_derive(cut));
    FREED unsigned char *again = derived_block(cut, &again_size);
    assert_int_equal(size, again_size);
    assert_memory_equal(block, again, size);
}

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
        if (cut_lattice_is_leaf(cut, leaf[k]) && !cut_lattice_is_bitten(cut, leaf[k]))
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

static void settle(CutSample *sample, Follower *follower)
{
    check_changes(&sample->cut, follower);
    check_all(sample);
    cut_lattice_forget_changes(&sample->cut);
}

static void break_at_random(CutSample *sample, uint64_t *seed, Follower *follower)
{
    CutLattice *cut = &sample->cut;
    FREED int(*face)[2] = malloc(3 * (size_t)cut->level_first[1] * sizeof *face);
    const int count = cut_sample_random(cut, seed, face);
    if (cut_lattice_has_room(cut, count))
        cut_lattice_break(cut, (const int(*)[2])face, count);
    settle(sample, follower);
}

static void remove_at_random(CutSample *sample, uint64_t *seed, Follower *follower)
{
    CutLattice *cut = &sample->cut;
    int cell[CUT_REMOVE_MOST], kept = cut_sample_random_cells(cut, seed, cell);
    cut_lattice_expose(cut, cell, &kept, cut->split_budget);
    settle(sample, follower);
    cut_lattice_remove(cut, cell, kept);
    settle(sample, follower);
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
    Follower follower = follower_create(cut);
    check_all(sample);
    for (int step = 0; step < steps; step++) {
        cut->split_budget = 1 + random_below(seed, 30);
        if (cuts && random_below(seed, 5) == 0)
            break_at_random(sample, seed, &follower);
        if (cuts && cut->removable && random_below(seed, 4) == 0)
            remove_at_random(sample, seed, &follower);
        if (random_below(seed, 3) > 0)
            divide_at_random(cut, seed, 1 + random_below(seed, 100));
        if (random_below(seed, 2) == 0)
            settle(sample, &follower);
        cut_lattice_reconstruct(cut);
        settle(sample, &follower);
        met->merged += merge_at_random(cut, seed, 1 + random_below(seed, 100));
        settle(sample, &follower);
        meet(met, cut);
        if (step % 3 == 0)
            check_derived(cut);
    }
    follower_drop(&follower);
}

// ---------------------------------------------------------------------------------------------
// Bodies

typedef enum MergeKind {
    MERGE_CUBE,
    MERGE_BALL,
    MERGE_SHEET, // one cell thick, at an odd height
    MERGE_TUBE,
    MERGE_LOBES, // two, with a gap of one cell between them
    MERGE_SHELF, // above a block, with void between them that belongs to its elements alone
    MERGE_KINDS,
} MergeKind;

static int label_of(MergeKind kind, int i, int j, int k)
{
    const double y = j + 0.5 - 8.0, z = k + 0.5 - 8.0, r = sqrt(y * y + z * z);
    switch (kind) {
    case MERGE_SHEET:
        return k == 1;
    case MERGE_TUBE:
        return r < 8.0 && r > 6.2;
    case MERGE_LOBES:
        return i != 6 || k < 3;
    case MERGE_SHELF:
        return k < 4 || k == 7;
    default:
        return 1;
    }
}

static Lattice body_of(MergeKind kind)
{
    if (kind == MERGE_BALL)
        return sample_ball(17);
    Lattice lattice = kind == MERGE_CUBE    ? sample_void(16, 16, 16)
                      : kind == MERGE_SHEET ? sample_void(19, 14, 3)
                                            : sample_void(14, 16, 16);
    for (int k = 0; k < lattice.count[2]; k++)
        for (int j = 0; j < lattice.count[1]; j++)
            for (int i = 0; i < lattice.count[0]; i++)
                lattice.label[lattice_index(&lattice, i, j, k)] =
                    (unsigned char)label_of(kind, i, j, k);
    return lattice;
}

static void create(CutSample *sample, Lattice lattice, int inside, int surface, bool removable)
{
    // As many vertices as there can be: those of the cells, and of corners in void.
    const int capacity = 8 * (int)lattice_solid(&lattice) + 4096;
    cut_sample_options(sample, lattice, inside, surface);
    sample->removable = removable;
    cut_sample_build(sample, capacity, 1);
}

TEST(random_divisions_and_merges_keep_what_follows_from_the_bits)
{
    uint64_t seed = 31;
    Met met = {0};
    for (int round = 0; round < EFFORT(2); round++)
        for (int kind = 0; kind < MERGE_KINDS; kind++) {
            SCOPED(cut_sample_drop) CutSample sample;
            create(&sample, body_of((MergeKind)kind), round % 3, 1 + round % 3, false);
            live_at_random(&sample, 6, false, &seed, &met);
        }
    assert_all_met(&met);
}

// Also lattices that are hardly connected, and of several materials.
TEST(random_cuts_and_merges_keep_what_follows_from_the_bits)
{
    uint64_t seed = 32;
    Met met = {0};
    for (int round = 0; round < EFFORT(1); round++)
        for (int kind = 0; kind < MERGE_KINDS + SAMPLE_KINDS; kind++) {
            SCOPED(cut_sample_drop) CutSample sample;
            create(&sample,
                   kind < MERGE_KINDS ? body_of((MergeKind)kind)
                                      : sample_lattice((SampleKind)(kind - MERGE_KINDS), &seed),
                   round % 4, 2 + round % 2, false);
            live_at_random(&sample, 6, true, &seed, &met);
        }
    assert_all_met(&met);
}

TEST(random_removals_and_merges_keep_what_follows_from_the_bits)
{
    uint64_t seed = 33;
    Met met = {0};
    for (int round = 0; round < EFFORT(1); round++)
        for (int kind = 0; kind < MERGE_KINDS + SAMPLE_KINDS; kind++) {
            SCOPED(cut_sample_drop) CutSample sample;
            create(&sample,
                   kind < MERGE_KINDS ? body_of((MergeKind)kind)
                                      : sample_lattice((SampleKind)(kind - MERGE_KINDS), &seed),
                   round % 4, 2 - round % 2, true);
            live_at_random(&sample, 6, true, &seed, &met);
        }
    assert_all_met(&met);
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
            create(&sample, body_of((MergeKind)kind), round % 3, 1 + round % 3, false);
            CutLattice *cut = &sample.cut;
            cut_lattice_coarsen(cut);
            check_all(&sample);
            check_rest(cut, &seed);
            // Cut it from this state and from a fine one: the same again.
            FREED int(*face)[2] = malloc(3 * (size_t)cut->level_first[1] * sizeof *face);
            const int count =
                cut_sample_disc(cut, vec3(5.0, 6.0, 1.0), vec3(0.6, 0.7, 0.1), 6.0, face);
            const size_t bytes = state_bytes(&sample.state);
            FREED void *uncut = malloc(bytes);
            state_copy_out(&sample.state, uncut);
            cut_lattice_break(cut, (const int(*)[2])face, count);
            cut_lattice_coarsen(cut);
            check_all(&sample);
            FREED int *ids = ids_of_leaves(cut);
            check_rest(cut, &seed);
            state_copy_in(&sample.state, uncut);
            assert_true(cut_lattice_derive(cut));
            divide_at_random(cut, &seed, 100);
            cut_lattice_break(cut, (const int(*)[2])face, count);
            cut_lattice_coarsen(cut);
            FREED int *again = ids_of_leaves(cut);
            assert_memory_equal(ids, again, (size_t)cut->element_count * NODE_COUNT * sizeof *ids);
            check_all(&sample);
        }
}

// The least element for each place of a cube: those of the surface, 2:1.
TEST(a_cube_at_rest_has_coarse_elements_throughout)
{
    SCOPED(cut_sample_drop) CutSample sample;
    create(&sample, sample_box(32, 32, 32), 2, 2, false);
    cut_lattice_coarsen(&sample.cut);
    check_all(&sample);
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
            Lattice lattice = kind < MERGE_KINDS ? body_of((MergeKind)kind)
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
// What may be a leaf

static bool cells_hang_together(const CutSample *sample, const CutElement *of)
{
    const int edge = 1 << of->level, cells = edge * edge * edge;
    FREED int *queue = malloc((size_t)cells * sizeof *queue);
    FREED bool *seen = calloc((size_t)cells, sizeof *seen);
    int solid = 0, first = -1, end = 0;
    for (int n = cells - 1; n >= 0; n--)
        if (is_solid(sample, (int[3]){of->cell[0] + n % edge, of->cell[1] + n / edge % edge,
                                      of->cell[2] + n / edge / edge})) {
            solid++;
            first = n;
        }
    queue[end++] = first;
    seen[first] = true;
    for (int begin = 0; begin < end; begin++)
        for (int d = 0; d < 6; d++) {
            int at[3] = {queue[begin] % edge, queue[begin] / edge % edge,
                         queue[begin] / edge / edge};
            at[d / 2] += d & 1 ? 1 : -1;
            if (at[d / 2] < 0 || at[d / 2] >= edge)
                continue;
            const int n = (at[2] * edge + at[1]) * edge + at[0];
            for (int k = 0; k < 3; k++)
                at[k] += of->cell[k];
            if (seen[n] || !is_solid(sample, at))
                continue;
            seen[n] = true;
            queue[end++] = n;
        }
    return end == solid;
}

// How many parts the cells around a point are in, none of them gone or merged.
static int parts_of_cells(const CutSample *sample, const int point[3], int *solid)
{
    int part[8], parts = 0;
    *solid = 0;
    for (int s = 0; s < 8; s++) {
        const bool is =
            is_solid(sample, (int[3]){point[0] - 1 + (s & 1), point[1] - 1 + (s >> 1 & 1),
                                      point[2] - 1 + (s >> 2)});
        part[s] = is ? s : -1;
        *solid += is;
    }
    for (int round = 0; round < 8; round++)
        for (int s = 0; s < 8; s++)
            for (int axis = 0; axis < 3; axis++) {
                const int t = s ^ 1 << axis;
                if (part[s] >= 0 && part[t] >= 0)
                    part[s] = part[t] = part[s] < part[t] ? part[s] : part[t];
            }
    for (int s = 0; s < 8; s++)
        parts += part[s] == s;
    return parts;
}

// Whether a point of a closed block is where its motion keeps it: all corners that move it are
// held.
static bool is_kept_by_corners(const CutElement *of, const int point[3], const FixedRegion *held)
{
    const int edge = 1 << of->level;
    for (int c = 0; c < 8; c++) {
        bool moves = true; // it: the weight is not 0
        int corner[3];
        for (int d = 0; d < 3; d++) {
            corner[d] = of->cell[d] + (c >> d & 1) * edge;
            moves &= abs(point[d] - corner[d]) < edge;
        }
        if (moves && !fixed_contains(held, vec3(corner[0], corner[1], corner[2])))
            return false;
    }
    return true;
}

// By the definition, for one element alone; the children are another's.
static bool may_be_leaf(const CutSample *sample, const CutElement *of, const FixedRegion *held,
                        const FineRegion *fine)
{
    const int edge = 1 << of->level;
    int material = 0, solid;
    bool inner = true;
    for (int n = 0; n < edge * edge * edge; n++) {
        const int at[3] = {of->cell[0] + n % edge, of->cell[1] + n / edge % edge,
                           of->cell[2] + n / edge / edge};
        const int label = lattice_label(&sample->lattice, at[0], at[1], at[2]);
        if (label != 0 && material != 0 && label != material)
            return false;
        material = label != 0 ? label : material;
    }
    double square = 0.0;
    for (int d = 0; d < 3; d++) { // the point of the block that is nearest to the ball
        const double at = d == 0 ? fine->centre.x : d == 1 ? fine->centre.y : fine->centre.z;
        const double near = fmax(of->cell[d], fmin(of->cell[d] + edge, at));
        square += (near - at) * (near - at);
    }
    if (square <= fine->radius * fine->radius)
        return false;
    for (int z = 0; z <= edge; z++)
        for (int y = 0; y <= edge; y++)
            for (int x = 0; x <= edge; x++) {
                const int p[3] = {of->cell[0] + x, of->cell[1] + y, of->cell[2] + z};
                if (parts_of_cells(sample, p, &solid) > 1)
                    return false;
                inner &= solid == 8;
                if (fixed_contains(held, vec3(p[0], p[1], p[2])) != is_kept_by_corners(of, p, held))
                    return false;
            }
    return cells_hang_together(sample, of) &&
           of->level <= (inner ? sample->levels : sample->surface_level);
}

TEST(elements_may_be_leaves_where_they_say_what_their_cells_do)
{
    uint64_t seed = 36;
    int may = 0, may_not = 0;
    for (int round = 0; round < EFFORT(3); round++)
        for (int kind = 0; kind < MERGE_KINDS + SAMPLE_KINDS; kind++) {
            SCOPED(cut_sample_drop) CutSample sample;
            Lattice lattice = kind < MERGE_KINDS
                                  ? body_of((MergeKind)kind)
                                  : sample_lattice((SampleKind)(kind - MERGE_KINDS), &seed);
            lattice.origin = vec3(0.0, 0.0, 0.0); // points are their own places
            FixedRegion held = {.kind = round % 2 == 0 ? FIXED_SPHERE : FIXED_BOX,
                                .low = vec3(-1.0, -1.0, -1.0),
                                .high = vec3(20.0, 8.0, 40.0),
                                .center = vec3(3.0, 4.0, 1.0),
                                .radius = random_between(&seed, 0.0, 8.0)};
            FineRegion fine = {.centre = vec3(10.0, 9.0, 2.0),
                               .radius = random_between(&seed, 0.0, 4.0)};
            cut_sample_options(&sample, lattice, round % 3, 1 + round % 3);
            sample.fixed = &held;
            sample.fine = &fine;
            cut_sample_build(&sample, 8 * (int)lattice_solid(&lattice) + 4096, 1);
            const CutLattice *cut = &sample.cut;
            for (int e = cut->level_first[1]; e < cut->element_count; e++) {
                const CutElement *of = &cut->element[e];
                bool expected = may_be_leaf(&sample, of, &held, &fine);
                for (int c = 0; c < 8 && of->level > 1; c++) {
                    const int child = cut_lattice_child(cut, e, c);
                    expected &= child < 0 || cut->element[child].mergeable;
                }
                assert_int_equal(of->mergeable, expected);
                may += expected;
                may_not += !expected;
            }
            cut_lattice_coarsen(&sample.cut);
            check_all(&sample);
        }
    assert_true(may > 1000 && may_not > 1000);
}

// ---------------------------------------------------------------------------------------------
// Limits, and states that were brought back

// Divisions that do not fit leave everything as it was; merging makes room for them.
TEST(rows_of_vertices_that_ended_are_used_again)
{
    uint64_t seed = 37;
    int refused = 0, found_room = 0;
    for (int round = 0; round < EFFORT(6); round++) {
        SCOPED(cut_sample_drop) CutSample sample;
        Lattice lattice = body_of(round % 2 == 0 ? MERGE_CUBE : MERGE_BALL);
        // As many rows as the body with its fine surface has, and a few.
        cut_sample_options(&sample, lattice, 2, 2);
        LatticeMesh mesh;
        Status status = {0};
        assert_true(lattice_mesh_create(&mesh, &sample.layout, &status));
        const int capacity = mesh.vertex_count + random_below(&seed, 40);
        lattice_mesh_destroy(&mesh);
        cut_sample_build(&sample, capacity, 1000);
        CutLattice *cut = &sample.cut;
        Follower follower = follower_create(cut);
        FREED int *leaf = malloc((size_t)cut->element_count * sizeof *leaf);
        for (int step = 0; step < 12; step++) {
            int count = find_at_random(cut, &seed, 100, leaf);
            for (int before = -1; before != count_divided(cut);) { // it may free rows, too
                before = count_divided(cut);
                count = divide_leaves(cut, leaf, count);
                settle(&sample, &follower);
            }
            if (count > 0) {
                refused++;
                size_t size, again_size;
                FREED unsigned char *block = whole_block(&sample, &size);
                assert_int_equal(cut_lattice_divide(cut, leaf, count), 0);
                FREED unsigned char *again = whole_block(&sample, &again_size);
                assert_int_equal(size, again_size);
                assert_memory_equal(block, again, size);
            }
            merge_at_random(cut, &seed, 60);
            settle(&sample, &follower);
            int waiting = 0;
            for (int k = 0; k < count; k++) // others are inside leaves now
                waiting += cut_lattice_is_leaf(cut, leaf[k]);
            found_room += waiting - divide_leaves(cut, leaf, count);
            settle(&sample, &follower);
            check_derived(cut);
        }
        follower_drop(&follower);
    }
    print_message("%d times some had no room, %d of these found it later\n", refused, found_room);
    assert_true(refused > 0 && found_room > 0);
}

// Merging whole elements needs no row, and makes room for those that need some.
TEST(a_body_that_has_no_row_left_comes_to_rest_as_well)
{
    int *ids[2], leaves[2];
    for (int full = 0; full < 2; full++) {
        SCOPED(cut_sample_drop) CutSample sample;
        cut_sample_options(&sample, body_of(MERGE_BALL), 2, 2);
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
        check_all(&sample);
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
            cut_lattice_break(cut, (const int(*)[2])face, cut_sample_random(cut, &seed, face));
        divide_at_random(cut, &seed, 100);
        cut_lattice_forget_changes(cut);
        cut_lattice_reconstruct(cut);
        cut_lattice_forget_changes(cut);
        merge_at_random(cut, &seed, 20);
        cut_lattice_forget_changes(cut);
    }
}

// What waits to be divided follows from the state, and so does the order of free rows.
TEST(adapting_state_that_was_brought_back_goes_on_alike)
{
    for (int round = 0; round < EFFORT(4); round++) {
        SCOPED(cut_sample_drop) CutSample sample;
        create(&sample, body_of(round % 2 == 0 ? MERGE_BALL : MERGE_LOBES), 2, 2, false);
        sample.cut.split_budget = 1;
        cut_lattice_coarsen(&sample.cut);
        const size_t bytes = state_bytes(&sample.state);
        FREED void *middle = malloc(bytes);
        go_on(&sample, 31 + (uint64_t)round, 6);
        assert_true(sample.cut.wanted_count > 0);
        state_copy_out(&sample.state, middle);
        go_on(&sample, 41, 5);
        const uint64_t expected = state_hash(&sample.state);
        state_copy_in(&sample.state, middle);
        assert_true(cut_lattice_derive(&sample.cut));
        go_on(&sample, 41, 5);
        assert_true(state_hash(&sample.state) == expected);
        check_all(&sample);
    }
}

// Whatever bytes a file brings: refused, or a state in which everything holds.
static void damage(bool removable)
{
    uint64_t seed = 38;
    SCOPED(cut_sample_drop) CutSample sample;
    create(&sample, sample_ball(13), 2, 2, removable);
    sample.cut.split_budget = 4;
    cut_lattice_coarsen(&sample.cut);
    go_on(&sample, 39, 4);
    for (int k = 0; k < 3 && removable; k++) {
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
    assert_true(refused > rounds / 3);
    state_copy_in(&sample.state, good);
    assert_true(cut_lattice_derive(&sample.cut));
    check_all(&sample);
}

TEST(damaged_adapting_states_are_refused_or_sound)
{
    damage(false);
}

TEST(damaged_adapting_states_with_removals_are_refused_or_sound)
{
    damage(true);
}
