// SPDX-License-Identifier: MIT
// Derives everything in a cut lattice from the bits and the ids: at load, and after the state was
// replaced. Step thread.
#include "voxel/cut/cut_parts.h"

#include "base/check.h"

#include <string.h>

// True if nothing that touches a block, which is a leaf or gone, is more than one level larger.
static bool is_balanced(const CutLattice *lattice, int element)
{
    const CutElement *middle = &lattice->element[element];
    for (int n = 0; n < 27; n++) {
        const int at[3] = {(middle->cell[0] >> middle->level) - 1 + n % 3,
                           (middle->cell[1] >> middle->level) - 1 + n / 3 % 3,
                           (middle->cell[2] >> middle->level) - 1 + n / 9};
        for (int up = 2; middle->level + up <= lattice->levels; up++) {
            const int block =
                cut_parts_block(lattice, middle->level + up, at[0] >> up, at[1] >> up, at[2] >> up);
            if (block >= 0 && !lattice->divided[block])
                return false;
        }
    }
    return true;
}

// True if a block can be a leaf: it is of one material and, if some cells of it are void, one of
// those that may merge.
static bool may_be_leaf(const CutLattice *lattice, int element)
{
    const CutElement *of = &lattice->element[element];
    return of->level == 0 || (of->material > 0 && (of->whole || of->mergeable));
}

// True if elements are divided only where they can be, and none borders on a leaf two levels
// larger.
static bool divisions_are_valid(const CutLattice *lattice)
{
    // Only what has children is divided, and only inside of what is divided.
    for (int e = 0; e < lattice->element_count; e++) {
        const bool may = lattice->removable || !cut_parts_is_cell(lattice, e);
        if (lattice->divided[e] > 1 || (lattice->divided[e] && !may))
            return false;
        const int parent = cut_lattice_parent(lattice, e);
        if (lattice->divided[e] && parent >= 0 && !lattice->divided[parent])
            return false;
    }
    for (int e = 0; e < lattice->element_count; e++) {
        const bool gone = cut_parts_is_cell(lattice, e) && cut_lattice_is_gone(lattice, e);
        if (cut_lattice_is_leaf(lattice, e) && !may_be_leaf(lattice, e))
            return false;
        if ((cut_lattice_is_leaf(lattice, e) || gone) && !is_balanced(lattice, e))
            return false;
        // The neighbours of what is gone, across faces, are leaves.
        for (int d = 0; d < 6 && gone; d++) {
            const int across = cut_lattice_across(lattice, e, d);
            if (across >= 0 && !lattice->divided[across] &&
                cut_parts_leaf(lattice, across) != across)
                return false;
        }
    }
    return true;
}

static bool bits_are_valid(const CutLattice *lattice)
{
    for (int cell = 0; cell < lattice->level_first[1]; cell++) {
        if (lattice->broken[cell] > 7)
            return false;
        for (int axis = 0; axis < 3; axis++) {
            const int beyond = cut_lattice_across(lattice, cell, 2 * axis + 1);
            const bool broken = lattice->broken[cell] >> axis & 1;
            // Broken where there is something to break, and around what is gone.
            if (broken ? beyond < 0
                       : beyond >= 0 && (cut_lattice_is_gone(lattice, cell) ||
                                         cut_lattice_is_gone(lattice, beyond)))
                return false;
        }
    }
    return true;
}

// True if the row of a vertex holds what it can.
static bool id_is_valid(const CutLattice *lattice, int vertex)
{
    const int id = lattice->vertex_id[vertex], anchor = lattice->anchor[vertex];
    const bool used = vertex < cut_lattice_used(lattice);
    if (cut_lattice_is_kept(lattice, vertex) && id != lattice->kept_id[vertex])
        return false;
    if (!used || (lattice->adapts && id == -1)) // not used, or free
        return id == -1 && (!lattice->removable || anchor == -1 || !used);
    if (id < 0 || id >= cut_points_most_ids(lattice))
        return false;
    // Only where cells can go may a vertex have lost its part.
    if (!lattice->removable)
        return cut_points_anchor_of(lattice, id) >= 0;
    // Corners in void have the anchor of their id always.
    const int said = cut_points_anchor_of(lattice, id);
    return anchor >= -1 && (said < 8 ? anchor < 8 : anchor == said);
}

static bool ids_are_valid(const CutLattice *lattice)
{
    if (*lattice->vertex_count < lattice->kept_end ||
        *lattice->vertex_count > lattice->vertex_capacity)
        return false;
    for (int v = 0; v < lattice->vertex_capacity; v++)
        if (!id_is_valid(lattice, v))
            return false;
    return true;
}

void cut_parts_take_row(CutLattice *lattice, int element)
{
    CutScratch *scratch = lattice->scratch;
    const int kind = !cut_parts_is_cell(lattice, element), first = lattice->level_first[1];
    if (kind == 0 ? lattice->family_row == NULL : lattice->leaf_row == NULL)
        return;
    // The first child of an element takes rows for all.
    int *row = kind == 1 ? &lattice->leaf_row[element - first]
                         : &lattice->family_row[cut_lattice_parent(lattice, element) - first];
    if (*row >= 0)
        return;
    ASSERT(scratch->spare_count[kind] > 0); // cut_parts_allow
    *row = scratch->spare_row[kind][--scratch->spare_count[kind]];
}

void cut_parts_clear_row(CutLattice *lattice, int element)
{
    int *nodes = cut_parts_nodes(lattice, element);
    for (int n = 0; n < (cut_parts_is_cell(lattice, element) ? NODE_CORNERS : NODE_COUNT); n++)
        nodes[n] = -1;
}

static void forget_rows(CutLattice *lattice)
{
    CutScratch *scratch = lattice->scratch;
    memset(lattice->corner, -1, (size_t)lattice->most_cells * sizeof *lattice->corner);
    memset(lattice->node, -1, (size_t)lattice->most_larger * sizeof *lattice->node);
    if (lattice->leaf_row == NULL)
        return;
    const int *first = lattice->level_first, larger = lattice->element_count - first[1];
    memset(lattice->leaf_row, -1, (size_t)larger * sizeof *lattice->leaf_row);
    if (lattice->family_row != NULL)
        memset(lattice->family_row, -1,
               (size_t)(first[2] - first[1]) * sizeof *lattice->family_row);
    for (int kind = 0; kind < 2; kind++) {
        const int rows = kind == 0 ? lattice->most_cells / CUT_FAMILY : lattice->most_larger;
        scratch->spare_count[kind] = rows;
        for (int k = 0; k < rows; k++) // the lowest is taken first
            scratch->spare_row[kind][k] = (rows - 1 - k) * (kind == 0 ? CUT_FAMILY : 1);
    }
}

static void find_leaves(CutLattice *lattice)
{
    for (int e = 0; e < lattice->element_count; e++) {
        const int parent = cut_lattice_parent(lattice, e);
        const bool is = !lattice->divided[e] && (parent < 0 || lattice->divided[parent]);
        lattice->mark[e] &= (unsigned char)~CUT_LEAF;
        lattice->mark[e] |= is ? CUT_LEAF : 0;
    }
}

// True if there are no more leaves than there may be.
static bool leaves_are_allowed(const CutLattice *lattice)
{
    int families = 0, larger = 0;
    for (int e = lattice->level_first[1]; e < lattice->element_count; e++) {
        families += e < lattice->level_first[2] && lattice->divided[e];
        larger += cut_lattice_is_leaf(lattice, e);
    }
    return (lattice->family_row == NULL || CUT_FAMILY * families <= lattice->most_cells) &&
           larger <= lattice->most_larger;
}

static void enter_leaves(CutLattice *lattice)
{
    const long margin =
        cut_parts_grid(lattice, lattice->count[0], lattice->count[1], lattice->count[2]) + 1;
    // The grid has a margin of void cells.
    memset(lattice->scratch->grid, -1, (size_t)margin * sizeof *lattice->scratch->grid);
    lattice->leaf_count = 0;
    memset(lattice->leaf_at_level, 0, sizeof lattice->leaf_at_level);
    for (int e = 0; e < lattice->element_count; e++)
        if (cut_lattice_is_leaf(lattice, e)) {
            lattice->leaf_count++;
            lattice->leaf_at_level[lattice->element[e].level]++;
            cut_parts_take_row(lattice, e);
            cut_parts_enter_leaf(lattice, e);
        }
}

static void find_wanted(CutLattice *lattice)
{
    for (int e = 0; e < lattice->element_count; e++)
        lattice->mark[e] &= (unsigned char)~CUT_BITTEN;
    lattice->wanted_count = 0;
    for (int cell = 0; cell < lattice->level_first[1]; cell++)
        for (int axis = 0; axis < 3; axis++)
            if (lattice->broken[cell] >> axis & 1) {
                cut_split_bite(lattice, cell);
                cut_split_bite(lattice, cut_lattice_across(lattice, cell, 2 * axis + 1));
            }
    cut_split_sort(lattice, 0);
}

// Assumes that all kept vertices are carried; visits of points tell which are not.
static void assume_carried(CutLattice *lattice)
{
    for (int v = 0; v < lattice->kept_end; v++)
        lattice->carried[v] = lattice->kept_id[v] >= 0 && lattice->anchor[v] >= 0;
}

// True if a kept vertex can be as it is: carried if a larger leaf is around the cell that it
// belongs to, and of other cells or of none only once that has gone.
static bool kept_is_valid(const CutLattice *lattice, int vertex)
{
    const int slot = cut_points_anchor_of(lattice, lattice->vertex_id[vertex]);
    int point[3];
    cut_lattice_point(lattice, vertex, point);
    const int cell =
        cut_lattice_cell_at_load(lattice, point[0] - 1 + (slot & 1), point[1] - 1 + (slot >> 1 & 1),
                                 point[2] - 1 + (slot >> 2));
    const bool moved = lattice->anchor[vertex] != slot;
    return cut_lattice_is_carried(lattice, vertex)
               ? !moved && !cut_parts_is_cell(lattice, cut_parts_leaf(lattice, cell))
               : !moved || cut_lattice_is_gone(lattice, cell);
}

// Returns how many vertices have elements; -1: a kept one is not as it can be.
static int count_present(const CutLattice *lattice)
{
    int present = 0;
    for (int v = 0; v < cut_lattice_used(lattice); v++) {
        if (cut_lattice_is_kept(lattice, v) && !kept_is_valid(lattice, v))
            return -1;
        present += lattice->anchor[v] >= 0 && !cut_lattice_is_carried(lattice, v);
    }
    return present;
}

static bool find_vertices(CutLattice *lattice)
{
    CutScratch *scratch = lattice->scratch;
    // List the vertices by their points.
    memset(scratch->head, -1, (size_t)scratch->head_count * sizeof *scratch->head);
    if (!lattice->removable)
        cut_points_find_anchors(lattice);
    for (int v = 0; v < cut_lattice_used(lattice); v++)
        if (lattice->vertex_id[v] >= 0)
            cut_points_add(lattice, v);
    assume_carried(lattice);
    // Visit all points at which leaves meet; no vertex may be missing.
    int expected = 0, leaf[8];
    for (int z = 0; z < scratch->points[2]; z++)
        for (int y = 0; y < scratch->points[1]; y++)
            for (int x = 0; x < scratch->points[0]; x++) {
                const int point[3] = {x, y, z};
                cut_lattice_around(lattice, point, leaf);
                bool one = true; // a point inside a leaf is not on its border
                for (int s = 1; s < 8; s++)
                    one &= leaf[s] == leaf[0];
                if (one)
                    continue;
                expected += cut_points_wanted(lattice, point, leaf);
                if (!cut_points_visit(lattice, point, leaf, CUT_NO_BIRTHS))
                    return false;
            }
    // Each expected vertex was found: equal counts mean all of them, and none twice.
    return expected == count_present(lattice);
}

bool cut_parts_derive(CutLattice *lattice)
{
    cut_lattice_forget_changes(lattice);
    // Forget what was derived before.
    forget_rows(lattice);
    lattice->wanted_count = 0;
    find_leaves(lattice);
    // Bits first; then vertices, which must be those of the ids.
    if (!divisions_are_valid(lattice) || !bits_are_valid(lattice) || !ids_are_valid(lattice) ||
        !leaves_are_allowed(lattice))
        return false;
    enter_leaves(lattice);
    if (lattice->adapts)
        cut_points_find_free(lattice);
    find_wanted(lattice);
    const bool sound = find_vertices(lattice);
    cut_lattice_forget_changes(lattice);
    return sound;
}

bool cut_lattice_derive(CutLattice *lattice)
{
    bool sound = cut_parts_derive(lattice);
    // In a body that adapts nothing waits to be divided.
    for (int e = lattice->level_first[1]; e < lattice->element_count && lattice->adapts; e++)
        sound = sound && !(cut_lattice_is_leaf(lattice, e) && cut_split_must(lattice, e));
    return sound;
}
