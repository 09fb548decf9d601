// SPDX-License-Identifier: MIT
// Broken faces, and the divisions of elements that they require. Step thread.
#include "voxel/cut/cut_carry.h"
#include "voxel/cut/cut_parts.h"
#include "voxel/lattice_faces.h"

#include "base/bits.h"
#include "base/check.h"

#include <string.h>

// ---------------------------------------------------------------------------------------------
// Elements that must be divided

// Orders the coarsest first: they must be divided before the elements inside them can be.
static bool goes_before(const CutLattice *lattice, int a, int b)
{
    const int x = lattice->element[a].level, y = lattice->element[b].level;
    return x != y ? x > y : a < b;
}

static void want(CutLattice *lattice, int element)
{
    lattice->wanted[lattice->wanted_count++] = element;
}

// Returns the block of an element's level at step n of 27 around it; -1: void.
static int beside(const CutLattice *lattice, int element, int n)
{
    const CutElement *middle = &lattice->element[element];
    const int level = middle->level;
    return cut_parts_block(lattice, level, (middle->cell[0] >> level) - 1 + n % 3,
                           (middle->cell[1] >> level) - 1 + n / 3 % 3,
                           (middle->cell[2] >> level) - 1 + n / 9);
}

// A leaf that is partly filled holds its corners in void together. Around a broken face that would
// join what the face parts: so there, leaves are finest or whole.
static bool joins_bitten(const CutLattice *lattice, int element)
{
    for (int n = 0; n < 27 && !lattice->element[element].whole; n++) {
        const int around = beside(lattice, element, n);
        if (around >= 0 && (lattice->mark[around] & CUT_BITTEN))
            return true;
    }
    return false;
}

bool cut_split_must(const CutLattice *lattice, int element)
{
    return (lattice->mark[element] & CUT_BITTEN) ||
           (lattice->adapts &&
            (!lattice->element[element].mergeable || joins_bitten(lattice, element)));
}

void cut_split_bite(CutLattice *lattice, int cell)
{
    unsigned char *mark = lattice->mark;
    for (int e = cell; e >= 0 && !(mark[e] & CUT_BITTEN); e = cut_lattice_parent(lattice, e)) {
        mark[e] |= CUT_BITTEN;
        // In a body that adapts what is in the way was divided before.
        if (!lattice->adapts && !cut_parts_is_cell(lattice, e) && cut_lattice_is_leaf(lattice, e))
            want(lattice, e);
    }
}

static void sift(const CutLattice *lattice, int *heap, int count, int at)
{
    const int moved = heap[at];
    for (int child; (child = 2 * at + 1) < count; at = child) {
        if (child + 1 < count && goes_before(lattice, heap[child], heap[child + 1]))
            child++;
        if (!goes_before(lattice, moved, heap[child]))
            break;
        heap[at] = heap[child];
    }
    heap[at] = moved;
}

void cut_split_sort(CutLattice *lattice, int sorted)
{
    int *wanted = lattice->wanted, *fresh = lattice->scratch->fresh;
    int count = lattice->wanted_count - sorted;
    if (count == 0)
        return;
    memcpy(fresh, wanted + sorted, (size_t)count * sizeof *fresh);
    // Heap sort of the new ones: no memory, no bad case.
    for (int at = count / 2 - 1; at >= 0; at--)
        sift(lattice, fresh, count, at);
    for (int last = count - 1; last > 0; last--) {
        int first = fresh[0];
        fresh[0] = fresh[last];
        fresh[last] = first;
        sift(lattice, fresh, last, 0);
    }
    // Merge both from behind.
    for (int to = lattice->wanted_count - 1; count > 0; to--)
        wanted[to] = sorted > 0 && goes_before(lattice, fresh[count - 1], wanted[sorted - 1])
                         ? wanted[--sorted]
                         : fresh[--count];
}

// ---------------------------------------------------------------------------------------------
// Broken faces

bool cut_lattice_has_room(const CutLattice *lattice, int faces)
{
    // A face that opens separates connected parts at each of its corners, at most once.
    return 4L * faces <= cut_parts_room(lattice);
}

// Returns the corners of a cell's face towards +axis.
static void corner_of_face(const CutLattice *lattice, int cell, int axis, int corner, int point[3])
{
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    cut_lattice_place(lattice, cell, point);
    point[axis]++;
    point[a] += corner & 1;
    point[b] += corner >> 1;
}

int cut_lattice_births(CutLattice *lattice, const int (*face)[2], int count)
{
    uint64_t *visited = lattice->scratch->visited;
    int births = 0, point[3], leaf[8];
    // As if they were broken.
    for (int f = 0; f < count; f++)
        lattice->broken[face[f][0]] |= (unsigned char)(1 << face[f][1]);
    for (int at = 0; at < 4 * count; at++) {
        corner_of_face(lattice, face[at / 4][0], face[at / 4][1], at % 4, point);
        const int index = cut_parts_index(lattice->scratch, point);
        if (bits_has(visited, index))
            continue;
        bits_add(visited, index);
        cut_lattice_around(lattice, point, leaf);
        births += cut_points_missing(lattice, point, leaf);
    }
    for (int at = 0; at < 4 * count; at++) {
        corner_of_face(lattice, face[at / 4][0], face[at / 4][1], at % 4, point);
        bits_remove(visited, cut_parts_index(lattice->scratch, point));
    }
    for (int f = 0; f < count; f++)
        lattice->broken[face[f][0]] &= (unsigned char)~(1 << face[f][1]);
    return births;
}

// Sets the bit alone.
static void break_face(CutLattice *lattice, int cell, int axis)
{
    lattice->broken[cell] |= (unsigned char)(1 << axis);
    cut_split_bite(lattice, cell);
    cut_split_bite(lattice, cut_lattice_across(lattice, cell, 2 * axis + 1));
    cut_parts_list_face(lattice, cell, axis);
}

void cut_lattice_break(CutLattice *lattice, const int (*face)[2], int count)
{
    CutScratch *scratch = lattice->scratch;
    const int sorted = lattice->wanted_count;
    // All bits first: the vertices depend on all of them.
    for (int f = 0; f < count; f++) {
        ASSERT(cut_lattice_beyond(lattice, face[f][0], face[f][1]) >= 0);
        break_face(lattice, face[f][0], face[f][1]);
    }
    cut_split_sort(lattice, sorted);
    // Update the vertices at the corners of open faces, each point once.
    int point[3], leaf[8];
    for (int f = 0; f < count; f++)
        for (int c = 0; c < 4 && cut_lattice_is_open(lattice, face[f][0], face[f][1]); c++) {
            corner_of_face(lattice, face[f][0], face[f][1], c, point);
            const int index = cut_parts_index(scratch, point);
            if (bits_has(scratch->visited, index))
                continue;
            bits_add(scratch->visited, index);
            cut_lattice_around(lattice, point, leaf);
            cut_points_visit(lattice, point, leaf, -1);
        }
    // Clear the marks.
    for (int f = 0; f < count; f++)
        for (int c = 0; c < 4; c++) {
            corner_of_face(lattice, face[f][0], face[f][1], c, point);
            bits_remove(scratch->visited, cut_parts_index(scratch, point));
        }
}

// ---------------------------------------------------------------------------------------------
// Divisions

void cut_split_find_blocks(const CutLattice *lattice, int element, CutBlocks *out)
{
    const CutElement *middle = &lattice->element[element];
    const short *at = middle->cell;
    const int step = 1 << (middle->level - 1);
    // Beyond the lattice, of which the grid has a margin of one cell, is nothing.
    const bool low = at[0] > 0, high = at[0] + 2 * step < lattice->count[0];
    for (int z = 0; z < 4; z++)
        for (int y = 0; y < 4; y++) {
            const int j = at[1] + (y - 1) * step, k = at[2] + (z - 1) * step;
            int *to = out->leaf[z][y];
            if (j < 0 || j >= lattice->count[1] || k < 0 || k >= lattice->count[2]) {
                to[0] = to[1] = to[2] = to[3] = -1;
                continue;
            }
            to[0] = low ? cut_parts_leaf_at(lattice, at[0] - step, j, k) : -1;
            to[1] = cut_parts_leaf_at(lattice, at[0], j, k);
            to[2] = cut_parts_leaf_at(lattice, at[0] + step, j, k);
            to[3] = high ? cut_parts_leaf_at(lattice, at[0] + 2 * step, j, k) : -1;
        }
}

// Returns the point at an offset in half edges of an element, and the leaves around it.
static void take_point(const CutLattice *lattice, int element, const CutBlocks *blocks,
                       const int offset[3], int point[3], int leaf[8])
{
    const CutElement *middle = &lattice->element[element];
    for (int d = 0; d < 3; d++)
        point[d] = middle->cell[d] + (offset[d] << middle->level >> 1);
    for (int s = 0; s < 8; s++)
        leaf[s] = blocks->leaf[offset[2] + (s >> 2)][offset[1] + (s >> 1 & 1)][offset[0] + (s & 1)];
}

// Offsets: the nodes of an element, then its centre.
static void offset_of(int node, int offset[3])
{
    for (int d = 0; d < 3; d++)
        offset[d] = node < NODE_COUNT ? NODE_OFFSET[node][d] : 1;
}

enum { MOST_BIRTHS = 8 * CUT_POINTS };

// True if what is divided can still merge, from the smallest on, when an element has children of
// this level: eight cells take the row of a larger leaf then, and one row is needed to free others.
static bool leaves_way_back(const CutLattice *lattice, int level, int children)
{
    if (!lattice->adapts || lattice->family_row == NULL || level == 0)
        return true;
    const int larger = lattice->leaf_count - lattice->leaf_at_level[0] - 1 + children,
              families = lattice->most_cells / CUT_FAMILY - lattice->scratch->spare_count[0];
    return larger + families - lattice->rest_families < lattice->most_larger;
}

static bool fits(CutLattice *lattice, int element)
{
    const int room = cut_parts_spare(lattice);
    const CutElement *parent = &lattice->element[element];
    const int children = __builtin_popcount(cut_lattice_children(lattice, element));
    if (!cut_parts_allow(lattice, parent->level - 1, children) ||
        !leaves_way_back(lattice, parent->level - 1, children))
        return false;
    if (room >= MOST_BIRTHS)
        return true;
    int births = 0, offset[3], point[3], leaf[8];
    CutBlocks blocks;
    cut_split_find_blocks(lattice, element, &blocks);
    for (int c = 0; c < 8; c++) // as if divided already
        blocks.leaf[1 + (c >> 2)][1 + (c >> 1 & 1)][1 + (c & 1)] =
            cut_lattice_child(lattice, element, c);
    for (int n = 0; n < CUT_POINTS; n++) {
        offset_of(n, offset);
        take_point(lattice, element, &blocks, offset, point, leaf);
        births += lattice->adapts ? cut_points_missing(lattice, point, leaf)
                                  : cut_points_wanted(lattice, point, leaf) -
                                        cut_points_present(lattice, point);
    }
    return births <= room;
}

// Gives the children the existing corners: nodes of their parent.
static void hand_down(CutLattice *lattice, int element)
{
    CutScratch *scratch = lattice->scratch;
    int *old = cut_parts_nodes(lattice, element);
    memcpy(scratch->old, old, sizeof scratch->old);
    for (int c = 0; c < 8; c++) {
        // A corner of a child is a node of its parent, or its centre, which is none.
        const int child = cut_lattice_child(lattice, element, c);
        if (child < 0)
            continue;
        cut_parts_take_row(lattice, child);
        int *nodes = cut_parts_nodes(lattice, child);
        for (int k = 0; k < NODE_CORNERS; k++) {
            const int node =
                scratch->node_at[(c & 1) + (k & 1) + 3 * ((c >> 1 & 1) + (k >> 1 & 1)) +
                                 9 * ((c >> 2) + (k >> 2))];
            nodes[k] = node < 0 ? -1 : old[node];
        }
    }
    // The parent is no leaf any more.
    cut_parts_clear_row(lattice, element);
}

// Lists the broken faces of a cell that has become a leaf.
static void list_faces(CutLattice *lattice, int cell)
{
    for (int axis = 0; axis < 3; axis++) {
        if (lattice->broken[cell] >> axis & 1)
            cut_parts_list_face(lattice, cell, axis);
        int at[3];
        cut_lattice_place(lattice, cell, at);
        at[axis]--;
        const int below = cut_lattice_cell_at_load(lattice, at[0], at[1], at[2]);
        if (below >= 0 && (lattice->broken[below] >> axis & 1))
            cut_parts_list_face(lattice, below, axis);
    }
}

void cut_split_visit(CutLattice *lattice, int element)
{
    int offset[3], point[3], leaf[8];
    CutBlocks blocks;
    cut_split_find_blocks(lattice, element, &blocks);
    // Points are all over the tables, which a tick has displaced from the caches: fetch ahead.
    for (int step = 0; step < 2; step++)
        for (int n = 0; n < CUT_POINTS; n++) {
            offset_of(n, offset);
            take_point(lattice, element, &blocks, offset, point, leaf);
            if (step == 0)
                cut_parts_fetch(lattice->scratch, point);
            else
                cut_parts_fetch_vertex(lattice, point);
        }
    for (int n = 0; n < CUT_POINTS; n++) {
        offset_of(n, offset);
        take_point(lattice, element, &blocks, offset, point, leaf);
        cut_points_visit(lattice, point, leaf, element);
    }
}

// Enters the children of an element into the grid, void ones too.
static void enter_children(CutLattice *lattice, int element)
{
    const CutElement *parent = &lattice->element[element];
    const int level = parent->level - 1;
    for (int c = 0; c < 8; c++) {
        const int cell[3] = {parent->cell[0] + ((c & 1) << level),
                             parent->cell[1] + ((c >> 1 & 1) << level),
                             parent->cell[2] + ((c >> 2) << level)};
        cut_parts_enter(lattice, cell, level, cut_lattice_child(lattice, element, c));
    }
}

static void divide(CutLattice *lattice, int element)
{
    const int level = lattice->element[element].level,
              child = cut_lattice_first_child(lattice, element);
    const int children = __builtin_popcount(cut_lattice_children(lattice, element));
    if (lattice->carry != NULL)
        cut_carry_before(lattice->carry, element);
    // The bit and the counts.
    lattice->divided[element] = 1;
    lattice->mark[element] &= (unsigned char)~CUT_LEAF;
    for (int c = child; c < child + children; c++)
        lattice->mark[c] |= CUT_LEAF;
    lattice->leaf_count += children - 1;
    lattice->leaf_at_level[level]--;
    lattice->leaf_at_level[level - 1] += children;
    lattice->scratch->left_larger++;
    // Children start with the nodes that they share with their parent.
    hand_down(lattice, element);
    cut_parts_list_element(lattice, element);
    enter_children(lattice, element);
    // Children with a broken bit inside must be divided in turn.
    for (int c = child; c < child + children; c++) {
        cut_parts_list_element(lattice, c);
        if (level == 1)
            list_faces(lattice, c);
        else if (!lattice->adapts && (lattice->mark[c] & CUT_BITTEN))
            want(lattice, c);
    }
    // Every point of the element may have new vertices now.
    cut_split_visit(lattice, element);
}

// Returns the block of the next level that holds a block, which may be void.
static int larger_block(const CutLattice *lattice, int level, int i, int j, int k)
{
    return i < 0 || j < 0 || k < 0 || level == lattice->levels
               ? -1
               : cut_parts_block(lattice, level + 1, i >> 1, j >> 1, k >> 1);
}

// Divides an element, and first the larger ones around it. Returns how many; if one of them exceeds
// the capacity, the element is not divided.
static int divide_in_order(CutLattice *lattice, int element)
{
    // Larger neighbours first: levels differ by one at most.
    const CutElement *middle = &lattice->element[element];
    const int level = middle->level, i = middle->cell[0] >> level, j = middle->cell[1] >> level;
    const int k = middle->cell[2] >> level;
    int divided = 0;
    for (int n = 0; n < 27; n++) {
        // In void no block of its own level needs to exist there.
        const int larger =
            larger_block(lattice, level, i - 1 + n % 3, j - 1 + n / 3 % 3, k - 1 + n / 9);
        if (larger < 0 || lattice->divided[larger])
            continue;
        divided += divide_in_order(lattice, larger);
        if (!lattice->divided[larger])
            return divided;
    }
    // Room for all its new vertices.
    if (!fits(lattice, element))
        return divided;
    divide(lattice, element);
    return divided + 1;
}

// Keeps what was not divided, and sorts what was appended to the first `before` into their order.
static void keep_wanted(CutLattice *lattice, int before)
{
    int kept = 0, sorted = 0;
    const bool appended = lattice->wanted_count > before;
    for (int w = 0; w < lattice->wanted_count; w++) {
        if (w == before)
            sorted = kept;
        if (!lattice->divided[lattice->wanted[w]])
            lattice->wanted[kept++] = lattice->wanted[w];
    }
    lattice->wanted_count = kept;
    if (appended)
        cut_split_sort(lattice, sorted);
}

int cut_lattice_reconstruct(CutLattice *lattice)
{
    // Children that must be divided in turn are appended; the next call processes them.
    enum { REFUSED_MOST = 64 }; // one takes about a microsecond
    // As many as the budget allows, in the list's order.
    const int before = lattice->wanted_count;
    int divided = 0, refused = 0;
    for (int w = 0; w < before && divided < lattice->split_budget && refused < REFUSED_MOST; w++) {
        const int element = lattice->wanted[w];
        if (lattice->divided[element])
            continue;
        divided += divide_in_order(lattice, element);
        refused += !lattice->divided[element];
    }
    keep_wanted(lattice, before);
    return divided;
}

int cut_lattice_divide(CutLattice *lattice, const int *element, int count)
{
    const int before = lattice->wanted_count;
    int divided = 0;
    for (int k = 0; k < count; k++)
        if (cut_lattice_is_leaf(lattice, element[k]))
            divided += divide_in_order(lattice, element[k]);
    keep_wanted(lattice, before);
    return divided;
}

int cut_split_divide_others(CutLattice *lattice)
{
    int divided = 0;
    for (int level = lattice->levels; level > 0; level--)
        for (int e = lattice->level_first[level]; e < lattice->level_first[level + 1]; e++)
            if (cut_lattice_is_leaf(lattice, e) && !lattice->element[e].mergeable)
                divided += divide_in_order(lattice, e);
    return divided;
}

// ---------------------------------------------------------------------------------------------
// Cells that go

bool cut_lattice_has_room_to_remove(const CutLattice *lattice, int cells)
{
    // What a cell leaves of a part at each of its corners are three parts at most.
    return 16L * cells <= cut_parts_room(lattice);
}

// Divides what is in the way of a cell's faces, from the largest elements to the finest: the leaves
// that cover the cell and, in a body that adapts, partly filled ones around them (joins_bitten).
// True if nothing is in the way now.
static bool clear_cell(CutLattice *lattice, int cell, int budget, int *divided)
{
    int above[VOXEL_LEVELS_MAX], count = 0;
    for (int e = cut_lattice_parent(lattice, cell); e >= 0; e = cut_lattice_parent(lattice, e))
        above[count++] = e;
    while (count-- > 0)
        for (int n = 0; n < 27; n++) {
            const bool own = n == 13;
            const int around = own               ? above[count]
                               : lattice->adapts ? beside(lattice, above[count], n)
                                                 : -1;
            if (around < 0 || !cut_lattice_is_leaf(lattice, around) ||
                (!own && lattice->element[around].whole))
                continue;
            if (*divided < budget)
                *divided += divide_in_order(lattice, around);
            if (!lattice->divided[around])
                return false;
        }
    return true;
}

int cut_lattice_clear(CutLattice *lattice, const int (*face)[2], int count, int budget, int *left)
{
    int divided = 0, last[2] = {-1, -1};
    bool good[2] = {true, true};
    *left = 0;
    for (int f = 0; f < count; f++) {
        const int side[2] = {face[f][0],
                             cut_lattice_across(lattice, face[f][0], 2 * face[f][1] + 1)};
        for (int k = 0; k < 2; k++) {
            // What is in the way of a cell is in the way of the others of its parent.
            const int parent = cut_lattice_parent(lattice, side[k]);
            if (parent != last[k])
                good[k] = parent < 0 || clear_cell(lattice, side[k], budget, &divided);
            last[k] = parent;
        }
        *left += !good[0] || !good[1];
    }
    return divided;
}

int cut_lattice_expose(CutLattice *lattice, int *cell, int *count, int budget)
{
    const int wanted = lattice->wanted_count;
    int divided = 0, kept = 0;
    for (int k = 0; k < *count; k++) {
        bool good = clear_cell(lattice, cell[k], budget, &divided);
        for (int d = 0; d < SQUARE_DIRECTIONS && good; d++) {
            const int across = cut_lattice_across(lattice, cell[k], d);
            good = across < 0 || cut_lattice_is_gone(lattice, across) ||
                   clear_cell(lattice, across, budget, &divided);
        }
        if (good)
            cell[kept++] = cell[k];
    }
    *count = kept;
    keep_wanted(lattice, wanted);
    return divided;
}

static void corner_of_cell(const CutLattice *lattice, int cell, int corner, int point[3])
{
    for (int d = 0; d < 3; d++)
        point[d] = lattice->element[cell].cell[d] + (corner >> d & 1);
}

// Updates the vertices around a point, of which those without an element are left alone.
static void leave_point(CutLattice *lattice, const int point[3])
{
    CutScratch *scratch = lattice->scratch;
    const int index = cut_parts_index(scratch, point);
    if (bits_has(scratch->visited, index))
        return;
    bits_add(scratch->visited, index);
    int leaf[8];
    cut_lattice_around(lattice, point, leaf);
    cut_points_visit(lattice, point, leaf, -1);
    for (int v = cut_parts_first(scratch, index); v >= 0; v = scratch->next[v])
        if (lattice->anchor[v] >= 0 && lattice->anchor[v] < 8 && leaf[lattice->anchor[v]] < 0)
            lattice->anchor[v] = -1;
}

void cut_lattice_remove(CutLattice *lattice, const int *cell, int count)
{
    CutScratch *scratch = lattice->scratch;
    const int sorted = lattice->wanted_count;
    int point[3];
    // All bits first, and the cells out of the grid.
    for (int k = 0; k < count; k++) {
        ASSERT(cut_lattice_is_leaf(lattice, cell[k]));
        for (int d = 0; d < SQUARE_DIRECTIONS; d++) {
            const int across = cut_lattice_across(lattice, cell[k], d);
            const int low = d & 1 ? cell[k] : across;
            if (across >= 0 && !(lattice->broken[low] >> d / 2 & 1))
                break_face(lattice, low, d / 2);
        }
    }
    cut_split_sort(lattice, sorted); // leaves around that are partly filled
    for (int k = 0; k < count; k++) {
        const short *at = lattice->element[cell[k]].cell;
        lattice->divided[cell[k]] = 1;
        lattice->mark[cell[k]] &= (unsigned char)~CUT_LEAF;
        lattice->leaf_count--;
        lattice->leaf_at_level[0]--;
        cut_parts_enter(lattice, (const int[3]){at[0], at[1], at[2]}, 0, -1);
        cut_parts_list_element(lattice, cell[k]);
        for (int c = 0; c < NODE_CORNERS; c++)
            cut_parts_list_lost(lattice, cut_lattice_nodes(lattice, cell[k])[c]);
        cut_parts_clear_row(lattice, cell[k]);
    }
    // Then the vertices at their corners, each point once.
    for (int k = 0; k < count; k++)
        for (int c = 0; c < NODE_CORNERS; c++) {
            corner_of_cell(lattice, cell[k], c, point);
            leave_point(lattice, point);
        }
    for (int k = 0; k < count; k++)
        for (int c = 0; c < NODE_CORNERS; c++) {
            corner_of_cell(lattice, cell[k], c, point);
            bits_remove(scratch->visited, cut_parts_index(scratch, point));
        }
}
