// SPDX-License-Identifier: MIT
// Turns the cells of a plane lattice into elements of several sizes. Load time only.
#include "plane/mesh.h"

#include "base/check.h"

#include <stdlib.h>
#include <string.h>

enum { VOID = -1 };

// During construction: the level of the element that covers each cell.
typedef struct Levels {
    const PlaneLayout *layout;
    signed char *level;    // [cell] or VOID
    unsigned char *label;  // [cell]
    signed char *promoted; // [cell] levels after the pass
} Levels;

static size_t cell_count(const PlaneLayout *layout)
{
    return (size_t)layout->count[0] * (size_t)layout->count[1];
}

static bool is_outside(const PlaneLayout *layout, int i, int j)
{
    return i < 0 || j < 0 || i >= layout->count[0] || j >= layout->count[1];
}

static size_t cell_at(const PlaneLayout *layout, int i, int j)
{
    return (size_t)j * (size_t)layout->count[0] + (size_t)i;
}

// Returns the level of the element over a cell; VOID outside.
static int level_at(const Levels *levels, int i, int j)
{
    return is_outside(levels->layout, i, j) ? VOID : levels->level[cell_at(levels->layout, i, j)];
}

static int label_at(const Levels *levels, int i, int j)
{
    return is_outside(levels->layout, i, j) ? 0 : levels->label[cell_at(levels->layout, i, j)];
}

// True if the square of `size` cells at (i, j) is entirely of `level`, and nothing along its edges
// is finer.
static bool stays(const Levels *levels, int level, int size, int i, int j)
{
    for (int y = 0; y < size; y++)
        for (int x = 0; x < size; x++)
            if (level_at(levels, i + x, j + y) != level)
                return false;
    for (int k = 0; k < size; k++)
        if (level_at(levels, i + k, j - 1) < level || level_at(levels, i + k, j + size) < level ||
            level_at(levels, i - 1, j + k) < level || level_at(levels, i + size, j + k) < level)
            return false;
    return true;
}

// A cell is carved where the label changes.
static bool cell_stays(const Levels *levels, int i, int j)
{
    int own = label_at(levels, i, j);
    return own != 0 && label_at(levels, i - 1, j) == own && label_at(levels, i + 1, j) == own &&
           label_at(levels, i, j - 1) == own && label_at(levels, i, j + 1) == own;
}

static void promote(const Levels *levels, int level, int size, int i, int j)
{
    for (int y = 0; y < size; y++)
        for (int x = 0; x < size; x++)
            levels->promoted[cell_at(levels->layout, i + x, j + y)] = (signed char)level;
}

// Joins every quarter that is not carved with the enclosing square of `level`.
static void join_level(Levels *levels, int level)
{
    const PlaneLayout *layout = levels->layout;
    const int size = 1 << level, half = size / 2;
    memcpy(levels->promoted, levels->level, cell_count(layout));
    for (int j = 0; j < layout->count[1]; j += size)
        for (int i = 0; i < layout->count[0]; i += size) {
            // Which quarters of the square can belong to one element.
            unsigned joined = 0;
            // These become part of the larger element.
            for (int q = 0; q < 4; q++) {
                int x = i + (q & 1) * half, y = j + (q >> 1) * half;
                bool joins =
                    level == 1 ? cell_stays(levels, x, y) : stays(levels, level - 1, half, x, y);
                joined |= joins ? 1u << q : 0u;
            }
            if (joined == 6 || joined == 9) // they meet in a corner
                continue;
            for (int q = 0; q < 4; q++)
                if (joined >> q & 1)
                    promote(levels, level, half, i + (q & 1) * half, j + (q >> 1) * half);
        }
    memcpy(levels->level, levels->promoted, cell_count(layout));
}

// Lists the elements of a level, in order; with a NULL `element` only counts them.
static void list_level(PlaneLayout *layout, const Levels *levels, int level)
{
    const int size = 1 << level, half = level == 0 ? 1 : size / 2;
    int *slot = layout->lut[level];
    for (int j = 0; j < layout->count[1]; j += size)
        for (int i = 0; i < layout->count[0]; i += size, slot++) {
            PlaneElement element = {.cell = {i, j}, .level = (unsigned char)level};
            for (int q = 0; q < 4; q++) {
                int x = level == 0 ? i : i + (q & 1) * half;
                int y = level == 0 ? j : j + (q >> 1) * half;
                // The quarters that are of this level are its own.
                if (level_at(levels, x, y) != level)
                    continue;
                element.quarters |= (unsigned char)(1u << q);
                element.material = (unsigned char)label_at(levels, x, y);
            }
            // The first pass counts, the second fills.
            *slot = element.quarters != 0 ? layout->element_count++ : -1;
            if (*slot >= 0 && layout->element != NULL)
                layout->element[*slot] = element;
        }
}

static void list_elements(PlaneLayout *layout, const Levels *levels)
{
    for (int pass = 0; pass < 2; pass++) {
        layout->element_count = 0;
        for (int level = 0; level <= layout->levels; level++)
            list_level(layout, levels, level);
        if (pass == 1)
            break;
        layout->element = calloc((size_t)layout->element_count + 1, sizeof *layout->element);
        ASSERT(layout->element != NULL);
    }
}

void plane_layout_create(PlaneLayout *layout, const Lattice *lattice, int levels)
{
    ASSERT(levels >= 0 && levels <= PLANE_LEVELS_MAX);
    *layout = (PlaneLayout){.levels = levels};
    for (int d = 0; d < 2; d++) {
        int step = 1 << levels;
        layout->lattice_count[d] = lattice->count[d];
        layout->count[d] = (lattice->count[d] + step - 1) / step * step;
    }
    // Look-up tables of all levels.
    for (int level = 0; level <= levels; level++) {
        layout->lut[level] = malloc((cell_count(layout) >> 2 * level) * sizeof *layout->lut[level]);
        ASSERT(layout->lut[level] != NULL);
    }
    Levels work = {.layout = layout};
    work.level = malloc(cell_count(layout));
    work.label = calloc(cell_count(layout), 1);
    work.promoted = malloc(cell_count(layout));
    ASSERT(work.level != NULL && work.label != NULL && work.promoted != NULL);
    // All cells start as elements of level 0.
    memset(work.level, VOID, cell_count(layout));
    for (int j = 0; j < lattice->count[1]; j++)
        for (int i = 0; i < lattice->count[0]; i++) {
            int label = lattice_label(lattice, i, j, 0);
            work.label[cell_at(layout, i, j)] = (unsigned char)label;
            work.level[cell_at(layout, i, j)] = label != 0 ? 0 : VOID;
        }
    // Larger elements grow level by level.
    for (int level = 1; level <= levels; level++)
        join_level(&work, level);
    list_elements(layout, &work);
    free(work.level);
    free(work.label);
    free(work.promoted);
}

void plane_layout_destroy(PlaneLayout *layout)
{
    free(layout->element);
    for (int level = 0; level <= PLANE_LEVELS_MAX; level++)
        free(layout->lut[level]);
    *layout = (PlaneLayout){0};
}

int plane_layout_at(const PlaneLayout *layout, int i, int j)
{
    if (is_outside(layout, i, j))
        return -1;
    for (int level = 0; level <= layout->levels; level++) {
        size_t columns = (size_t)(layout->count[0] >> level);
        int e = layout->lut[level][(size_t)(j >> level) * columns + (size_t)(i >> level)];
        int q = level == 0 ? 0 : (i >> (level - 1) & 1) + 2 * (j >> (level - 1) & 1);
        if (e >= 0 && layout->element[e].quarters >> q & 1)
            return e;
    }
    return -1;
}
