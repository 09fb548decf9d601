// SPDX-License-Identifier: MIT
#include "remainder.h"
#include "scoped.h"

#include "base/check.h"

#include <stdlib.h>

// All blocks of one level.
typedef struct Blocks {
    int count[3];
    unsigned char *kept; // [block, x fastest] bit x + 2 y + 4 z: that child belongs to its element
} Blocks;

typedef struct Remainder {
    const Lattice *lattice;
    int dimensions;
    int children;        // per block: 4 or 8
    unsigned char whole; // all children kept
} Remainder;

static size_t block_total(const Blocks *blocks)
{
    return (size_t)blocks->count[0] * (size_t)blocks->count[1] * (size_t)blocks->count[2];
}

static unsigned char *block_at(const Blocks *blocks, const int at[3])
{
    return &blocks->kept[((size_t)at[2] * (size_t)blocks->count[1] + (size_t)at[1]) *
                             (size_t)blocks->count[0] +
                         (size_t)at[0]];
}

// Returns 0 outside.
static unsigned kept_at(const Blocks *blocks, const int at[3])
{
    for (int d = 0; d < 3; d++)
        if (at[d] < 0 || at[d] >= blocks->count[d])
            return 0;
    return *block_at(blocks, at);
}

static void next_block(const Blocks *blocks, int at[3])
{
    for (int d = 0; d < 3 && ++at[d] == blocks->count[d] && d < 2; d++)
        at[d] = 0;
}

static void create_blocks(Blocks *blocks, const Remainder *remainder, int level)
{
    for (int d = 0; d < 3; d++)
        blocks->count[d] =
            d < remainder->dimensions ? ((remainder->lattice->count[d] - 1) >> level) + 1 : 1;
    blocks->kept = zeroed(block_total(blocks), 1);
}

// --- children that stay with their block ---

static bool cell_stays(const Remainder *remainder, const int at[3])
{
    const Lattice *lattice = remainder->lattice;
    int own = lattice_label(lattice, at[0], at[1], at[2]);
    if (remainder->dimensions == 2)
        return own != 0 && lattice_label(lattice, at[0] - 1, at[1], 0) == own &&
               lattice_label(lattice, at[0] + 1, at[1], 0) == own &&
               lattice_label(lattice, at[0], at[1] - 1, 0) == own &&
               lattice_label(lattice, at[0], at[1] + 1, 0) == own;
    for (int z = -1; z <= 1 && own != 0; z++)
        for (int y = -1; y <= 1; y++)
            for (int x = -1; x <= 1; x++)
                if (lattice_label(lattice, at[0] + x, at[1] + y, at[2] + z) != own)
                    return false;
    return own != 0;
}

// True if a block that is not a cell stays with its parent.
static bool block_stays(const Remainder *remainder, const Blocks *blocks, const int at[3])
{
    if (kept_at(blocks, at) != remainder->whole)
        return false;
    for (int d = 0; d < remainder->dimensions; d++)
        for (int side = 0; side < 2; side++) {
            int beside[3] = {at[0], at[1], at[2]};
            beside[d] += side ? 1 : -1;
            // In the adjacent block: the children at the common face.
            for (int c = 0; c < remainder->children; c++)
                if ((c >> d & 1) != side && !(kept_at(blocks, beside) >> c & 1))
                    return false;
        }
    return true;
}

// True if these children are connected through faces.
static bool holds_together(const Remainder *remainder, unsigned kept)
{
    unsigned reached = kept & (~kept + 1u), before;
    do {
        before = reached;
        for (int c = 0; c < remainder->children; c++)
            for (int d = 0; d < remainder->dimensions && (reached >> c & 1); d++)
                reached |= 1u << (c ^ 1 << d) & kept;
    } while (reached != before);
    return reached == kept;
}

static unsigned children_that_stay(const Remainder *remainder, const Blocks *below, int level,
                                   const int at[3])
{
    unsigned kept = 0;
    for (int c = 0; c < remainder->children; c++) {
        int child[3] = {2 * at[0] + (c & 1), 2 * at[1] + (c >> 1 & 1), 2 * at[2] + (c >> 2)};
        bool stays = level == 1
                         ? cell_stays(remainder, child)
                         : kept_at(below, child) != 0 && block_stays(remainder, below, child);
        kept |= (unsigned)stays << c;
    }
    return holds_together(remainder, kept) ? kept : 0;
}

// --- level by level ---

static void remove_kept(const Blocks *below, const int at[3], unsigned kept)
{
    for (int c = 0; kept >> c != 0; c++)
        if (kept >> c & 1) {
            int child[3] = {2 * at[0] + (c & 1), 2 * at[1] + (c >> 1 & 1), 2 * at[2] + (c >> 2)};
            *block_at(below, child) = 0;
        }
}

// Decides for all blocks from the level below before the joined ones stop being elements.
static void join_level(const Remainder *remainder, const Blocks *below, const Blocks *blocks,
                       int level)
{
    size_t total = block_total(blocks);
    int at[3] = {0, 0, 0};
    for (size_t b = 0; b < total; b++, next_block(blocks, at))
        blocks->kept[b] = (unsigned char)children_that_stay(remainder, below, level, at);
    at[0] = at[1] = at[2] = 0;
    for (size_t b = 0; b < total; b++, next_block(blocks, at))
        remove_kept(below, at, blocks->kept[b]);
}

static long count_elements(const Blocks *blocks)
{
    long elements = 0;
    for (size_t b = 0; b < block_total(blocks); b++)
        elements += blocks->kept[b] != 0;
    return elements;
}

void layout_count_remainder(const Lattice *lattice, int dimensions, int levels, long *count)
{
    ASSERT(dimensions == 2 || dimensions == 3);
    ASSERT(levels >= 0);
    Remainder remainder = {.lattice = lattice, .dimensions = dimensions};
    remainder.children = 1 << dimensions;
    remainder.whole = (unsigned char)((1 << remainder.children) - 1);

    Blocks below, blocks;
    create_blocks(&below, &remainder, 0);
    int at[3] = {0, 0, 0};
    for (size_t b = 0; b < block_total(&below); b++, next_block(&below, at))
        below.kept[b] = lattice_label(lattice, at[0], at[1], at[2]) != 0 ? remainder.whole : 0;
    for (int level = 1; level <= levels; level++) {
        create_blocks(&blocks, &remainder, level);
        join_level(&remainder, &below, &blocks, level);
        count[level - 1] = count_elements(&below);
        free(below.kept);
        below = blocks;
    }
    count[levels] = count_elements(&below);
    free(below.kept);
}
