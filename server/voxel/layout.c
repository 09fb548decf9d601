// SPDX-License-Identifier: MIT
// Merging of blocks of cells into elements. Load time only.
#include "voxel/layout.h"

#include "base/check.h"

#include <stdlib.h>

// Returns the smallest width for a leaf of this level: it needs one of the level below on every
// side, which needs one of its own, down to the cells at the surface: 2^l + 2 (2^(l-1) + ... + 1)
// cells along every axis.
static int span_of_level(int level)
{
    return 3 * (1 << level) - 2;
}

// Lowers the coarsest level when the lattice is too narrow for it, so that it is not rounded up to
// far more than its size.
static void set_sizes(Layout *layout, const Lattice *lattice, int levels)
{
    ASSERT(levels >= 0 && levels <= VOXEL_LEVELS_MAX);
    for (int d = 0; d < 3; d++)
        while (levels > 0 && span_of_level(levels) > lattice->count[d])
            levels--;
    layout->levels = levels;
    for (int d = 0; d < 3; d++) {
        int step = 1 << levels;
        layout->lattice_count[d] = lattice->count[d];
        layout->count[d] = (lattice->count[d] + step - 1) / step * step;
    }
}

static size_t block_index(const Layout *layout, int level, int i, int j, int k)
{
    size_t nx = (size_t)(layout->count[0] >> level), ny = (size_t)(layout->count[1] >> level);
    return ((size_t)k * ny + (size_t)j) * nx + (size_t)i;
}

// During construction the table holds the material of each leaf, and NONE elsewhere.
enum { NONE = -1 };

static void allocate_level(Layout *layout, int level)
{
    size_t total = 1;
    for (int d = 0; d < 3; d++)
        total *= (size_t)(layout->count[d] >> level);
    layout->lut[level] = malloc(total * sizeof *layout->lut[level]);
    ASSERT(layout->lut[level] != NULL);
    for (size_t b = 0; b < total; b++)
        layout->lut[level][b] = NONE;
}

static void place_cells(Layout *layout, const Lattice *lattice)
{
    allocate_level(layout, 0);
    const unsigned char *label = lattice->label;
    for (int k = 0; k < lattice->count[2]; k++)
        for (int j = 0; j < lattice->count[1]; j++) {
            int *row = &layout->lut[0][block_index(layout, 0, 0, j, k)];
            for (int i = 0; i < lattice->count[0]; i++, label++)
                if (*label != 0)
                    row[i] = *label;
        }
}

// Returns the material of the leaf that block (i, j, k) of `level` can become, or NONE: its
// children are leaves of one material, and the blocks of their size all around are leaves too (of
// any material).
static int merged_material(const Layout *layout, int level, int i, int j, int k)
{
    const int *below = layout->lut[level - 1];
    int material = below[block_index(layout, level - 1, 2 * i, 2 * j, 2 * k)];
    if (material == NONE || i == 0 || j == 0 || k == 0 || i + 1 == layout->count[0] >> level ||
        j + 1 == layout->count[1] >> level || k + 1 == layout->count[2] >> level)
        return NONE;
    // The eight children must be of one material, and all around them leaves, too.
    for (int z = -1; z <= 2; z++)
        for (int y = -1; y <= 2; y++) {
            const int *row =
                &below[block_index(layout, level - 1, 2 * i - 1, 2 * j + y, 2 * k + z)];
            bool inside = (y == 0 || y == 1) && (z == 0 || z == 1);
            for (int x = 0; x < 4; x++)
                if (row[x] == NONE || (inside && (x == 1 || x == 2) && row[x] != material))
                    return NONE;
        }
    return material;
}

static void remove_children(Layout *layout, int level, int i, int j, int k)
{
    for (int c = 0; c < 8; c++)
        layout->lut[level - 1][block_index(layout, level - 1, 2 * i + (c & 1), 2 * j + (c >> 1 & 1),
                                           2 * k + (c >> 2))] = NONE;
}

// Decides for all blocks from the level below before any of that level is removed.
static void merge_level(Layout *layout, int level)
{
    allocate_level(layout, level);
    int nx = layout->count[0] >> level, ny = layout->count[1] >> level;
    int nz = layout->count[2] >> level;
    int *slot = layout->lut[level];
    // Decide for all blocks first: a block that is merged counts as a leaf for its neighbours.
    for (int k = 0; k < nz; k++)
        for (int j = 0; j < ny; j++)
            for (int i = 0; i < nx; i++)
                *slot++ = merged_material(layout, level, i, j, k);
    slot = layout->lut[level];
    for (int k = 0; k < nz; k++)
        for (int j = 0; j < ny; j++)
            for (int i = 0; i < nx; i++)
                if (*slot++ != NONE)
                    remove_children(layout, level, i, j, k);
}

// Turns materials into leaves: -1 stays, others are numbered in order.
static void number_level(Layout *layout, int level)
{
    int *slot = layout->lut[level];
    for (int k = 0; k < layout->count[2] >> level; k++)
        for (int j = 0; j < layout->count[1] >> level; j++)
            for (int i = 0; i < layout->count[0] >> level; i++, slot++) {
                if (*slot == NONE)
                    continue;
                layout->leaf[layout->leaf_count] = (Leaf){
                    .cell = {i << level, j << level, k << level},
                    .level = (unsigned char)level,
                    .material = (unsigned char)*slot,
                };
                *slot = layout->leaf_count++;
            }
}

static int count_leaves(const Layout *layout)
{
    int leaves = 0;
    for (int level = 0; level <= layout->levels; level++) {
        size_t total = 1;
        for (int d = 0; d < 3; d++)
            total *= (size_t)(layout->count[d] >> level);
        for (size_t b = 0; b < total; b++)
            leaves += layout->lut[level][b] != NONE;
    }
    return leaves;
}

void layout_create(Layout *layout, const Lattice *lattice, int levels)
{
    *layout = (Layout){0};
    set_sizes(layout, lattice, levels);
    place_cells(layout, lattice);
    for (int level = 1; level <= layout->levels; level++)
        merge_level(layout, level);
    layout->leaf = malloc(((size_t)count_leaves(layout) + 1) * sizeof *layout->leaf);
    ASSERT(layout->leaf != NULL);
    for (int level = 0; level <= layout->levels; level++)
        number_level(layout, level);
}

void layout_destroy(Layout *layout)
{
    free(layout->leaf);
    for (int level = 0; level <= VOXEL_LEVELS_MAX; level++)
        free(layout->lut[level]);
    *layout = (Layout){0};
}

int layout_leaf_at(const Layout *layout, int i, int j, int k)
{
    if (i < 0 || j < 0 || k < 0 || i >= layout->count[0] || j >= layout->count[1] ||
        k >= layout->count[2])
        return -1;
    for (int level = 0; level <= layout->levels; level++) {
        int leaf =
            layout->lut[level][block_index(layout, level, i >> level, j >> level, k >> level)];
        if (leaf >= 0)
            return leaf;
    }
    return -1;
}
