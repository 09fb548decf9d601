// SPDX-License-Identifier: MIT
#include "cut_reference.h"

#include "voxel/cut/cut_parts.h"

// ---------------------------------------------------------------------------------------------
// Cells, and the leaves that cover them

bool cut_reference_is_solid(const CutSample *sample, const int at[3])
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

static long cell_index(const CutLattice *cut, const int cell[3])
{
    return ((long)cell[2] * cut->count[1] + cell[1]) * cut->count[0] + cell[0];
}

// Of each position the leaf whose block holds it, solid or not: the largest block that is not
// divided; -1: none.
static int *leaves_of_cells(const CutLattice *cut)
{
    int *leaf = malloc((size_t)cut->count[0] * (size_t)cut->count[1] * (size_t)cut->count[2] *
                       sizeof *leaf);
    int at[3];
    for (at[2] = 0; at[2] < cut->count[2]; at[2]++)
        for (at[1] = 0; at[1] < cut->count[1]; at[1]++)
            for (at[0] = 0; at[0] < cut->count[0]; at[0]++) {
                int level = cut->levels, element;
                while (element = block_at(cut, level, at),
                       level > 0 && (element < 0 || cut->divided[element]))
                    level--;
                leaf[cell_index(cut, at)] = element < 0 || cut->divided[element] ? -1 : element;
            }
    return leaf;
}

static int leaf_at(const CutLattice *cut, const int *of_cell, const int cell[3])
{
    for (int d = 0; d < 3; d++)
        if (cell[d] < 0 || cell[d] >= cut->count[d])
            return -1;
    return of_cell[cell_index(cut, cell)];
}

// Leaves are apart by one level at most where they touch, in void too.
static void check_balance(const CutLattice *cut, const int *of_cell)
{
    int at[3];
    for (at[2] = 0; at[2] < cut->count[2]; at[2]++)
        for (at[1] = 0; at[1] < cut->count[1]; at[1]++)
            for (at[0] = 0; at[0] < cut->count[0]; at[0]++) {
                const int leaf = leaf_at(cut, of_cell, at);
                for (int n = 0; n < 27 && leaf >= 0; n++) {
                    const int other = leaf_at(
                        cut, of_cell,
                        (int[3]){at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1});
                    if (other >= 0)
                        assert_true(abs(cut->element[leaf].level - cut->element[other].level) <= 1);
                }
            }
}

// Every cell that is there is in one leaf, of its material.
static void check_leaves(const CutSample *sample, const int *of_cell)
{
    const CutLattice *cut = &sample->cut;
    FREED int *cells = calloc((size_t)cut->element_count, sizeof *cells);
    int at[3], leaves = 0, at_level[VOXEL_LEVELS_MAX + 1] = {0};
    for (at[2] = 0; at[2] < sample->lattice.count[2]; at[2]++)
        for (at[1] = 0; at[1] < sample->lattice.count[1]; at[1]++)
            for (at[0] = 0; at[0] < sample->lattice.count[0]; at[0]++) {
                const int cell = block_at(cut, 0, at), leaf = leaf_at(cut, of_cell, at);
                const int start = layout_leaf_at(&sample->layout, at[0], at[1], at[2]);
                assert_int_equal(cell >= 0, cut_reference_is_solid(sample, at));
                assert_int_equal(start >= 0, cell >= 0);
                if (cell < 0)
                    continue;
                assert_int_equal(leaf < 0, cut_lattice_is_gone(cut, cell));
                assert_int_equal(cut_lattice_cell(cut, at[0], at[1], at[2]), leaf < 0 ? -1 : cell);
                assert_true(leaf >= 0 || cut->removable);
                if (leaf < 0)
                    continue;
                assert_true(cut->adapts ||
                            cut->element[leaf].level <= sample->layout.leaf[start].level);
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
        assert_true(cut->element[e].whole || cut->adapts);
        leaves++;
        at_level[cut->element[e].level]++;
    }
    assert_int_equal(leaves, cut->leaf_count);
    assert_memory_equal(at_level, cut->leaf_at_level, sizeof at_level);
}

// ---------------------------------------------------------------------------------------------
// Vertices

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
            if (cut_reference_is_solid(sample, in) && cut_reference_is_solid(sample, out))
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
    if (x == 0 && y == 0) {
        const bool broken = cut->broken[a] >> axis & 1;
        assert_int_equal(cut_lattice_is_open(cut, a, axis), broken);
        return !broken;
    }
    return x <= y ? cells_meet(sample, a, 2 * axis + 1) : cells_meet(sample, b, 2 * axis);
}

// Finds the lowest slot of the part of each slot.
static void find_parts(const CutSample *sample, const int leaf[8], int part[8])
{
    for (int s = 0; s < 8; s++)
        part[s] = leaf[s] < 0 ? -1 : s;
    int together[12][2], pairs = 0;
    for (int s = 0; s < 8; s++)
        for (int axis = 0; axis < 3; axis++)
            if (!(s >> axis & 1) && holds(sample, leaf, s, axis)) {
                together[pairs][0] = s;
                together[pairs++][1] = s + (1 << axis);
            }
    for (int round = 0; round < 8; round++)
        for (int k = 0; k < pairs; k++) {
            int *a = &part[together[k][0]], *b = &part[together[k][1]];
            *a = *b = *a < *b ? *a : *b;
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
        if (part[s] == of && cut_reference_is_solid(sample, (int[3]){point[0] - 1 + (s & 1),
                                                                     point[1] - 1 + (s >> 1 & 1),
                                                                     point[2] - 1 + (s >> 2)}))
            return s;
    return 8 + of;
}

typedef struct Sums {
    int vertices;    // that parts own
    long incidences; // nodes of leaves that have one
} Sums;

// Checks the vertices that the leaves around a point have there; `seen`: [vertex].
static void check_point(const CutSample *sample, const int *of_cell, const int point[3], bool *seen,
                        Sums *sums)
{
    const CutLattice *cut = &sample->cut;
    int leaf[8], around[8], part[8];
    bool inside = true; // of one leaf, or in void
    for (int s = 0; s < 8; s++) {
        leaf[s] = leaf_at(
            cut, of_cell,
            (int[3]){point[0] - 1 + (s & 1), point[1] - 1 + (s >> 1 & 1), point[2] - 1 + (s >> 2)});
        inside &= leaf[s] == leaf[0];
    }
    cut_lattice_around(cut, point, around);
    assert_memory_equal(leaf, around, sizeof leaf);
    if (inside)
        return;
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
        while (anchor < 8 &&
               !cut_reference_is_solid(sample, (int[3]){point[0] - 1 + (lowest & 1),
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

// ---------------------------------------------------------------------------------------------
// Elements that must be divided

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
    if (is_bitten(sample, bitten, element))
        return true;
    if (!sample->cut.adapts)
        return false;
    if (!of->mergeable)
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

void cut_reference_check(const CutSample *sample)
{
    const CutLattice *cut = &sample->cut;
    FREED int *of_cell = leaves_of_cells(cut);
    check_leaves(sample, of_cell);
    check_balance(cut, of_cell);
    check_wanted(sample);
    FREED bool *seen = calloc((size_t)cut->vertex_capacity, sizeof *seen);
    Sums sums = {0};
    // Only partly filled leaves are beyond the lattice.
    const int *count = cut->adapts ? cut->count : cut->lattice_count;
    int p[3];
    for (p[2] = 0; p[2] <= count[2]; p[2]++)
        for (p[1] = 0; p[1] <= count[1]; p[1]++)
            for (p[0] = 0; p[0] <= count[0]; p[0]++)
                check_point(sample, of_cell, p, seen, &sums);
    long present = 0;
    for (int e = 0; e < cut->element_count; e++)
        for (int n = 0; n < (e < cut->level_first[1] ? NODE_CORNERS : NODE_COUNT); n++)
            present += cut_lattice_nodes(cut, e)[n] >= 0;
    assert_true(present == sums.incidences);
    // Lists at points are in one order, however their vertices came.
    for (int v = 0; v < cut_lattice_used(cut); v++)
        assert_true(cut->vertex_id[v] < 0 || cut->scratch->next[v] < v);
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

static void follow_element(const CutLattice *cut, int (*node)[NODE_COUNT], int e)
{
    memset(node[e], -1, sizeof node[e]);
    memcpy(node[e], cut_lattice_nodes(cut, e),
           (e < cut->level_first[1] ? NODE_CORNERS : NODE_COUNT) * sizeof(int));
}

CutFollower cut_follower_create(const CutLattice *cut)
{
    const size_t capacity = (size_t)cut->vertex_capacity;
    CutFollower follower = {malloc((size_t)cut->element_count * sizeof *follower.node),
                            cut_lattice_used(cut), malloc(capacity * sizeof *follower.id),
                            calloc(capacity, sizeof *follower.carried)};
    memcpy(follower.id, cut->vertex_id, capacity * sizeof *follower.id);
    for (int e = 0; e < cut->element_count; e++)
        follow_element(cut, follower.node, e);
    for (int v = 0; v < cut->vertex_capacity; v++)
        follower.carried[v] = cut_lattice_is_carried(cut, v);
    return follower;
}

void cut_follower_drop(CutFollower *follower)
{
    free(follower->node);
    free(follower->id);
    free(follower->carried);
}

// Births: in the middle of vertices that were there or came before, or at the corner of an element.
static void check_births(const CutLattice *cut, CutFollower *follower)
{
    FREED bool *known = calloc((size_t)cut->vertex_capacity, sizeof *known);
    for (int v = 0; v < cut->vertex_capacity; v++)
        known[v] = follower->id[v] >= 0;
    for (int b = 0; b < cut->changes.birth_count; b++) {
        const CutBirth *birth = &cut->changes.birth[b];
        int place[3], sum[3] = {0}, at[3];
        cut_lattice_point(cut, birth->vertex, place);
        // A row is not used again within a change, and in a body that does not adapt never.
        assert_int_equal(known[birth->vertex], birth->carried);
        assert_true(cut->adapts || birth->vertex == follower->used + b);
        assert_true(birth->parent_count == 1 || birth->parent_count == 2 ||
                    birth->parent_count == 4 || birth->parent_count == 8 ||
                    (cut->adapts && birth->parent_count == 0));
        if (birth->parent_count == 0)
            assert_true(is_corner(cut, birth->parent[0], place));
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
    if (!cut->adapts)
        assert_int_equal(cut_lattice_used(cut), follower->used + cut->changes.birth_count);
}

static void check_changes(const CutLattice *cut, CutFollower *follower)
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
    CutFollower now = cut_follower_create(cut);
    for (int v = 0; v < cut->vertex_capacity; v++) {
        if (named[v])
            continue;
        assert_int_equal(now.id[v] >= 0, follower->id[v] >= 0);
        assert_int_equal(now.carried[v], follower->carried[v]);
        if (now.id[v] >= 0 && !cut_lattice_is_in_void(cut, v))
            assert_int_equal(now.id[v], follower->id[v]);
    }
    assert_memory_equal(follower->node, now.node, (size_t)cut->element_count * sizeof *now.node);
    cut_follower_drop(follower);
    *follower = now;
}

void cut_follower_settle(CutFollower *follower, CutSample *sample)
{
    check_changes(&sample->cut, follower);
    cut_reference_check(sample);
    cut_lattice_forget_changes(&sample->cut);
}

void cut_follower_remove_random(CutFollower *follower, CutSample *sample, uint64_t *seed)
{
    CutLattice *cut = &sample->cut;
    int cell[CUT_REMOVE_MOST], kept = cut_sample_random_cells(cut, seed, cell);
    cut_lattice_expose(cut, cell, &kept, cut->split_budget);
    cut_follower_settle(follower, sample);
    cut_lattice_remove(cut, cell, kept);
    for (int k = 0; k < kept; k++)
        assert_true(cut_lattice_is_gone(cut, cell[k]));
    cut_follower_settle(follower, sample);
}

// ---------------------------------------------------------------------------------------------
// Memory

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
        if (part[k] > 0)
            memcpy(to, memory[k], part[k]);
        to += part[k];
    }
    return block;
}

unsigned char *cut_reference_copy(const CutSample *sample, size_t *size)
{
    size_t derived;
    unsigned char *block = derived_block(&sample->cut, &derived);
    const size_t state = state_bytes(&sample->state);
    *size = derived + state;
    block = realloc(block, *size);
    state_copy_out(&sample->state, block + derived);
    return block;
}

void cut_reference_check_derived(CutLattice *cut)
{
    size_t size, again_size;
    FREED unsigned char *block = derived_block(cut, &size);
    assert_true(cut_lattice_derive(cut));
    FREED unsigned char *again = derived_block(cut, &again_size);
    assert_int_equal(size, again_size);
    assert_memory_equal(block, again, size);
}

double cut_reference_damage(CutSample *sample, uint64_t *seed)
{
    CutLattice *cut = &sample->cut;
    for (int k = 0; k < 6 && cut->removable; k++) {
        int cell[CUT_REMOVE_MOST], count = cut_sample_random_cells(cut, seed, cell);
        cut_lattice_expose(cut, cell, &count, 1000);
        cut_lattice_remove(cut, cell, count);
        cut_lattice_forget_changes(cut);
    }
    const size_t bytes = state_bytes(&sample->state);
    FREED unsigned char *good = malloc(bytes), *bad = malloc(bytes);
    state_copy_out(&sample->state, good);
    int refused = 0, rounds = EFFORT(300);
    for (int round = 0; round < rounds; round++) {
        memcpy(bad, good, bytes);
        for (int n = random_below(seed, 3); n >= 0; n--)
            bad[random_bits(seed) % bytes] = (unsigned char)random_below(seed, 256);
        if (round % 5 == 0) { // bits alone
            const size_t at =
                random_bits(seed) % ((size_t)cut->element_count + (size_t)cut->level_first[1]);
            memcpy(bad, good, bytes);
            bad[at] = (unsigned char)random_below(seed, 8);
        }
        state_copy_in(&sample->state, bad);
        if (cut_lattice_derive(cut))
            cut_reference_check(sample);
        else
            refused++;
    }
    state_copy_in(&sample->state, good);
    assert_true(cut_lattice_derive(cut));
    cut_reference_check(sample);
    return (double)refused / rounds;
}
