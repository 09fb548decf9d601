// SPDX-License-Identifier: MIT
#include "test.h"
#include "effort.h"
#include "lattice_samples.h"

#include "voxel/layout.h"

// --- counts ---

// A cube of n^3 cells, n a power of two: of n / 2^l blocks along an edge the outermost are not
// merged themselves (l > 0), and those and the next keep from merging further: so (n/2^l - 2)^3 of
// level l are made and (n/2^l - 4)^3 of them merge on.
TEST(cubes_have_the_counts_of_their_layers)
{
    for (int n = 16; n <= 64; n *= 2) {
        SCOPED(lattice_destroy) Lattice lattice = sample_box(n, n, n);
        for (int levels = 1; levels <= 3; levels++) {
            SCOPED(layout_destroy) Layout layout;
            layout_create(&layout, &lattice, levels);
            long leaves = 0;
            for (int level = 0; level <= levels; level++) {
                long made = level == 0 ? n : (n >> level) - 2;
                long merged = level < levels ? (n >> level) - 4 : 0;
                made = made < 0 ? 0 : made;
                merged = merged < 0 ? 0 : merged;
                leaves += made * made * made - merged * merged * merged;
            }
            assert_int_equal(layout.leaf_count, leaves);
        }
    }
}

// Counts of an independent program.
TEST(cubes_and_balls_have_the_known_counts)
{
    static const struct {
        int n, ball, leaves[3];
    } known[] = {
        {16, 0, {2584, 2528, 2528}}, {32, 0, {13560, 12048, 11992}}, {64, 0, {73144, 53936, 52424}},
        {32, 1, {7792, 7568, 7568}}, {64, 1, {41168, 33944, 33720}},
    };
    for (size_t c = 0; c < sizeof known / sizeof known[0]; c++) {
        int n = known[c].n;
        Lattice lattice = known[c].ball ? sample_ball(n) : sample_box(n, n, n);
        for (int levels = 1; levels <= 3; levels++) {
            SCOPED(layout_destroy) Layout layout;
            layout_create(&layout, &lattice, levels);
            assert_int_equal(layout.leaf_count, known[c].leaves[levels - 1]);
        }
        lattice_destroy(&lattice);
    }
}

// --- the rule, cell by cell ---

// Levels of the cells of a lattice by the rule as it is told, with a look at every cell around
// every block; void all around as far as blocks reach.
typedef struct CellLevels {
    const Lattice *lattice;
    signed char *level; // [cell]; -1: void
} CellLevels;

static int cell_level(const CellLevels *cells, int i, int j, int k)
{
    if (lattice_label(cells->lattice, i, j, k) == 0)
        return -1;
    return cells->level[lattice_index(cells->lattice, i, j, k)];
}

static bool block_merges(const CellLevels *cells, int level, const int low[3])
{
    int size = 1 << level, around = size / 2;
    int material = lattice_label(cells->lattice, low[0], low[1], low[2]);
    for (int z = -around; z < size + around; z++)
        for (int y = -around; y < size + around; y++)
            for (int x = -around; x < size + around; x++) {
                int i = low[0] + x, j = low[1] + y, k = low[2] + z;
                bool inside = x >= 0 && y >= 0 && z >= 0 && x < size && y < size && z < size;
                if (cell_level(cells, i, j, k) < level - 1)
                    return false;
                if (inside && lattice_label(cells->lattice, i, j, k) != material)
                    return false;
            }
    return true;
}

static void merge_block(const CellLevels *cells, signed char *to, int level, const int low[3])
{
    int size = 1 << level;
    for (int z = 0; z < size; z++)
        for (int y = 0; y < size; y++)
            for (int x = 0; x < size; x++)
                to[lattice_index(cells->lattice, low[0] + x, low[1] + y, low[2] + z)] =
                    (signed char)level;
}

static CellLevels expected_levels(const Lattice *lattice, int levels)
{
    const int *n = lattice->count;
    size_t total = (size_t)n[0] * (size_t)n[1] * (size_t)n[2];
    CellLevels cells = {.lattice = lattice, .level = calloc(total, 1)};
    FREED signed char *next = calloc(total, 1);
    for (int level = 1; level <= levels; level++) {
        int size = 1 << level;
        for (int k = 0; k < n[2]; k += size)
            for (int j = 0; j < n[1]; j += size)
                for (int i = 0; i < n[0]; i += size) {
                    const int low[3] = {i, j, k};
                    if (block_merges(&cells, level, low))
                        merge_block(&cells, next, level, low);
                }
        memcpy(cells.level, next, total);
    }
    return cells;
}

// --- what must hold of every layout ---

// Each solid cell in exactly one leaf of any level, of the level that the rule says; void in none.
static void expect_cover(const Layout *layout, const Lattice *lattice, int levels)
{
    CellLevels cells = expected_levels(lattice, levels);
    for (int k = -1; k <= layout->count[2]; k++)
        for (int j = -1; j <= layout->count[1]; j++)
            for (int i = -1; i <= layout->count[0]; i++) {
                int leaf = layout_leaf_at(layout, i, j, k);
                assert_int_equal(leaf >= 0, lattice_label(lattice, i, j, k) != 0);
                if (leaf < 0)
                    continue;
                const Leaf *l = &layout->leaf[leaf];
                assert_int_equal(l->level, cell_level(&cells, i, j, k));
                assert_int_equal(l->material, lattice_label(lattice, i, j, k));
                assert_int_equal(l->cell[0], i >> l->level << l->level);
                assert_int_equal(l->cell[1], j >> l->level << l->level);
                assert_int_equal(l->cell[2], k >> l->level << l->level);
                int found = 0;
                for (int level = 0; level <= layout->levels; level++) {
                    int nx = layout->count[0] >> level, ny = layout->count[1] >> level;
                    int x = i >> level, y = j >> level, z = k >> level;
                    found += layout->lut[level][(z * ny + y) * nx + x] >= 0;
                }
                assert_int_equal(found, 1);
            }
    free(cells.level);
}

static void expect_balance(const Layout *layout)
{
    for (int k = 0; k < layout->count[2]; k++)
        for (int j = 0; j < layout->count[1]; j++)
            for (int i = 0; i < layout->count[0]; i++) {
                int own = layout_leaf_at(layout, i, j, k);
                for (int o = 0; o < 27 && own >= 0; o++) {
                    int other =
                        layout_leaf_at(layout, i + o % 3 - 1, j + o / 3 % 3 - 1, k + o / 9 - 1);
                    if (other < 0)
                        assert_int_equal(layout->leaf[own].level, 0);
                    else
                        assert_true(abs(layout->leaf[own].level - layout->leaf[other].level) <= 1);
                }
            }
}

static void expect_sorted(const Layout *layout)
{
    for (int e = 1; e < layout->leaf_count; e++) {
        const Leaf *a = &layout->leaf[e - 1], *b = &layout->leaf[e];
        int before = a->level != b->level       ? a->level - b->level
                     : a->cell[2] != b->cell[2] ? a->cell[2] - b->cell[2]
                     : a->cell[1] != b->cell[1] ? a->cell[1] - b->cell[1]
                                                : a->cell[0] - b->cell[0];
        assert_true(before < 0);
    }
}

static void expect_sizes(const Layout *layout, const Lattice *lattice, int levels)
{
    assert_true(layout->levels <= levels);
    for (int d = 0; d < 3; d++) {
        assert_int_equal(layout->lattice_count[d], lattice->count[d]);
        assert_true(layout->count[d] >= lattice->count[d]);
        assert_true(layout->count[d] < lattice->count[d] + (1 << layout->levels));
        assert_int_equal(layout->count[d] % (1 << layout->levels), 0);
    }
    for (int level = 0; level <= VOXEL_LEVELS_MAX; level++)
        assert_int_equal(layout->lut[level] != NULL, level <= layout->levels);
    long cells = 0;
    for (int e = 0; e < layout->leaf_count; e++)
        cells += 1L << 3 * layout->leaf[e].level;
    assert_int_equal(cells, lattice_solid(lattice));
}

TEST(layouts_of_all_sorts_follow_the_rule)
{
    uint64_t seed = 2004;
    for (int round = 0; round < EFFORT(12); round++)
        for (int kind = 0; kind < SAMPLE_KINDS; kind++) {
            SCOPED(lattice_destroy) Lattice lattice = sample_lattice((SampleKind)kind, &seed);
            int levels = random_below(&seed, VOXEL_LEVELS_MAX + 1);
            SCOPED(layout_destroy) Layout layout;
            layout_create(&layout, &lattice, levels);
            expect_sizes(&layout, &lattice, levels);
            expect_cover(&layout, &lattice, levels);
            expect_balance(&layout);
            expect_sorted(&layout);
        }
}

// Level 5 needs 94 cells, and blocks aligned to 32: 128 cells have 2^3 of that size at least.
TEST(large_cube_reaches_the_coarsest_level)
{
    SCOPED(lattice_destroy) Lattice lattice = sample_box(128, 128, 128);
    SCOPED(layout_destroy) Layout layout;
    layout_create(&layout, &lattice, VOXEL_LEVELS_MAX);
    assert_int_equal(layout.levels, VOXEL_LEVELS_MAX);
    assert_int_equal(layout.leaf[layout.leaf_count - 1].level, VOXEL_LEVELS_MAX);
    expect_sizes(&layout, &lattice, VOXEL_LEVELS_MAX);
    expect_sorted(&layout);
}

// What a long thin lattice is rounded up to stays near its size: 31 fold otherwise, squared.
TEST(thin_lattices_are_hardly_rounded_up)
{
    SCOPED(lattice_destroy) Lattice lattice = sample_box(1, 3, 1000);
    SCOPED(layout_destroy) Layout layout;
    layout_create(&layout, &lattice, VOXEL_LEVELS_MAX);
    assert_int_equal(layout.leaf_count, 3000);
    assert_int_equal((long)layout.count[0] * layout.count[1] * layout.count[2], 3000);
}

// Nothing solid is no fault here.
TEST(void_has_no_leaves)
{
    SCOPED(lattice_destroy) Lattice lattice = sample_void(9, 4, 6);
    SCOPED(layout_destroy) Layout layout;
    layout_create(&layout, &lattice, 2);
    assert_int_equal(layout.leaf_count, 0);
    assert_int_equal(layout_leaf_at(&layout, 3, 3, 3), -1);
}
