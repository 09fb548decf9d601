// SPDX-License-Identifier: MIT
// Private to the cut lattice: definitions that its files share.
#ifndef PLIANT_VOXEL_CUT_CUT_PARTS_H
#define PLIANT_VOXEL_CUT_CUT_PARTS_H

#include "voxel/cut/cut_lattice.h"

// The positions between which one in a divided element is the middle, as offsets x + 3 y + 9 z: the
// middle of an edge between its ends, that of a face between those of its edges, the centre between
// all corners.
typedef struct CutParents {
    int count;
    unsigned char at[8];
} CutParents;

// The rows below `vertex_count` that are free, one bit each; a word of a level is not 0 if the bit
// of it in the next level is set.
enum { FREE_LEVELS = 3, FREE_WORD = 64 };
typedef struct CutFreeRows {
    int count, words[FREE_LEVELS];
    uint64_t *bits[FREE_LEVELS];
} CutFreeRows;

enum { CUT_FAMILY = 8 }; // rows for the children of an element of level 1, void ones included

// Scratch: derived from the state, or empty between calls.
typedef struct CutScratch {
    int points[3];    // lattice points along the axes, those of larger blocks included
    int id_points[3]; // those of the cells, of which ids are made
    int grid_level;   // 1, or 0: there is no larger element
    int *grid;       // leaf of each block of that level, x fastest, with a margin of one; -1: void;
                     // CUT_CELLS: there may be finest cells
    int (*point)[3]; // [vertex] its point
    long head_count;
    int head_bits;     // 0: every point has a place in `head`, else 2^head_bits places by hash
    int *head;         // the vertex of the highest row at a point; -1: none
    int *next;         // [vertex] another vertex at its point, of a lower row
    int *fresh;        // [elements above level 0] to be sorted into `wanted`
    uint64_t *visited; // [point] bits, within a call
    bool *is_lost;     // [vertex] in changes.lost
    signed char node_at[27]; // node by offset x + 3 y + 9 z; -1: the centre
    CutParents parents[27];  // by offset, likewise
    int old[NODE_COUNT];     // vertices of the element that is being divided
    // Of a body that adapts.
    CutFreeRows free;
    int *spare_row[2], spare_count[2]; // of eight cells that are no leaves, and of larger ones
    int left_larger; // leaves above level 0 that are none any more, in this change
    bool *is_ended;  // [vertex] in changes.ended
    uint64_t *noted; // bits of the elements above level 0 that were divided (cut_lattice_note)
} CutScratch;

static inline int cut_parts_block(const CutLattice *lattice, int level, int i, int j, int k)
{
    const int nx = lattice->count[0] >> level, ny = lattice->count[1] >> level;
    const int nz = lattice->count[2] >> level;
    if (i < 0 || j < 0 || k < 0 || i >= nx || j >= ny || k >= nz)
        return -1;
    return cut_lattice_block(lattice, level, i, j, k);
}

// Returns the leaf that an element is or is inside of; for elements that are not divided
// themselves, or are inside one that is not.
static inline int cut_parts_leaf(const CutLattice *lattice, int element)
{
    for (int parent; (parent = cut_lattice_parent(lattice, element)) >= 0; element = parent)
        if (lattice->divided[parent])
            break;
    return element;
}

static inline bool cut_parts_is_cell(const CutLattice *lattice, int element)
{
    return element < lattice->level_first[1];
}

// True if somewhere across a face of an element (-x, +x, -y, +y, -z, +z) solid cells meet, at load.
static inline bool cut_parts_meets(const CutLattice *lattice, int element, int direction)
{
    return cut_parts_is_cell(lattice, element)
               ? cut_lattice_across(lattice, element, direction) >= 0
               : lattice->meets[element - lattice->level_first[1]] >> direction & 1;
}

static inline int *cut_parts_nodes(CutLattice *lattice, int element)
{
    const int row = cut_lattice_row(lattice, element);
    return cut_parts_is_cell(lattice, element) ? lattice->corner[row] : lattice->node[row];
}

static inline int cut_parts_index(const CutScratch *scratch, const int point[3])
{
    return (point[2] * scratch->points[1] + point[1]) * scratch->points[0] + point[0];
}

// Returns where the place of a point is in `head`, unless one before has taken it.
static inline unsigned cut_parts_home(const CutScratch *scratch, int index)
{
    return scratch->head_bits == 0 ? (unsigned)index
                                   : (unsigned)index * 0x9e3779b1u >> (32 - scratch->head_bits);
}
// Returns the place of a point in `head`, or the free one that it can have.
static inline unsigned cut_parts_head(const CutScratch *scratch, int index)
{
    unsigned at = cut_parts_home(scratch, index);
    const unsigned mask = (1u << scratch->head_bits) - 1;
    while (mask != 0 && scratch->head[at] >= 0 &&
           cut_parts_index(scratch, scratch->point[scratch->head[at]]) != index)
        at = (at + 1) & mask;
    return at;
}
// Returns the vertex of the highest row at a point; -1: there is none.
static inline int cut_parts_first(const CutScratch *scratch, int index)
{
    return scratch->head[cut_parts_head(scratch, index)];
}

// Fetches the place of a point in `head` into the caches.
static inline void cut_parts_fetch(const CutScratch *scratch, const int point[3])
{
    __builtin_prefetch(&scratch->head[cut_parts_home(scratch, cut_parts_index(scratch, point))]);
}

// The same of the vertex there, as a rule.
static inline void cut_parts_fetch_vertex(const CutLattice *lattice, const int point[3])
{
    const CutScratch *scratch = lattice->scratch;
    const int v = scratch->head[cut_parts_home(scratch, cut_parts_index(scratch, point))];
    if (v < 0)
        return;
    __builtin_prefetch(scratch->point[v]);
    __builtin_prefetch(&scratch->next[v]);
    __builtin_prefetch(&lattice->anchor[v]);
}

// Returns the finest cell in a slot around a point at load, also if it is gone; -1: void.
static inline int cut_parts_cell_in(const CutLattice *lattice, const int point[3], int slot)
{
    return cut_lattice_cell_at_load(lattice, point[0] - 1 + (slot & 1),
                                    point[1] - 1 + (slot >> 1 & 1), point[2] - 1 + (slot >> 2));
}

enum { CUT_CELLS = -2 };
// Returns the index of the block of a cell in the grid.
static inline long cut_parts_grid(const CutLattice *lattice, int i, int j, int k)
{
    const int by = lattice->scratch->grid_level, edge = 1 << by;
    const long nx = (lattice->count[0] >> by) + 2, ny = (lattice->count[1] >> by) + 2;
    return (((k + edge) >> by) * ny + ((j + edge) >> by)) * nx + ((i + edge) >> by);
}
// Returns the leaf of a block of the grid at a cell; -1: void.
static inline int cut_parts_leaf_in(const CutLattice *lattice, long block, int i, int j, int k)
{
    int leaf = lattice->scratch->grid[block];
    if (leaf == CUT_CELLS) {
        leaf = cut_lattice_block(lattice, 0, i, j, k);
        leaf = leaf >= 0 && cut_lattice_is_gone(lattice, leaf) ? -1 : leaf;
    }
    return leaf;
}
// Returns the leaf at a cell, which may be one beyond the lattice; -1: void.
static inline int cut_parts_leaf_at(const CutLattice *lattice, int i, int j, int k)
{
    return cut_parts_leaf_in(lattice, cut_parts_grid(lattice, i, j, k), i, j, k);
}
// Writes a leaf (-1: none) into the cells of its block in the grid.
void cut_parts_enter(CutLattice *lattice, const int cell[3], int level, int leaf);
static inline void cut_parts_enter_leaf(CutLattice *lattice, int leaf)
{
    int place[3];
    cut_lattice_place(lattice, leaf, place);
    cut_parts_enter(lattice, place, lattice->element[leaf].level, leaf);
}

// Gives a new leaf a row.
void cut_parts_take_row(CutLattice *lattice, int element);
// Sets the nodes of one that is none any more to -1; its row is free when changes are forgotten.
void cut_parts_clear_row(CutLattice *lattice, int element);

// Returns how many vertices can still come.
static inline int cut_parts_room(const CutLattice *lattice)
{
    return lattice->vertex_capacity - cut_lattice_used(lattice) + lattice->scratch->free.count;
}

// The same for divisions and cuts, which leave what a partly filled element takes that merges.
static inline int cut_parts_spare(const CutLattice *lattice)
{
    return cut_parts_room(lattice) - (lattice->adapts ? NODE_CORNERS : 0);
}

// True if this many leaves may come, larger ones or children of one element.
static inline bool cut_parts_allow(const CutLattice *lattice, int level, int count)
{
    const int larger = lattice->leaf_count - lattice->leaf_at_level[0];
    if (level == 0)
        return lattice->family_row == NULL || lattice->scratch->spare_count[0] > 0;
    return count <= lattice->most_larger - larger - lattice->scratch->left_larger;
}

void cut_parts_list_element(CutLattice *lattice, int element);
void cut_parts_list_face(CutLattice *lattice, int cell, int axis);

// cut_points.c. Gives the leaves around a point the vertices of their parts there. New parts get
// copies of the vertex that their leaves had, or, without one, a vertex in the middle of `of`,
// which was divided, or extrapolated from it, if it was merged; then vertices that no part has any
// more end. With of = CUT_NO_BIRTHS there must be no new part: false if there is.
enum { CUT_NO_BIRTHS = -2 };
bool cut_points_visit(CutLattice *lattice, const int point[3], const int leaf[8], int of);
// Load time.
void cut_points_list_parents(CutScratch *scratch);
// Returns how many ids there can be.
int cut_points_most_ids(const CutLattice *lattice);
// Returns the anchor that an id says, as it was before any cell went; -1: no part has that id.
int cut_points_anchor_of(const CutLattice *lattice, int id);
// Sets the anchors of all vertices to those.
void cut_points_find_anchors(CutLattice *lattice);
// Frees the rows of vertices that have ended.
void cut_points_free_ended(CutLattice *lattice);
// Finds the free rows from the ids.
void cut_points_find_free(CutLattice *lattice);
// Return how many vertices the point should have, and how many with elements it has.
int cut_points_wanted(const CutLattice *lattice, const int point[3], const int leaf[8]);
int cut_points_present(const CutLattice *lattice, const int point[3]);
// Returns how many vertices have to come there, at most: of a body that adapts.
int cut_points_missing(const CutLattice *lattice, const int point[3], const int leaf[8]);
// Returns the vertex that an element which is no leaf would have at its corner if it were one; -1:
// a new one.
int cut_points_corner(const CutLattice *lattice, int element, const int point[3]);
// Lists a vertex at the point of its id.
void cut_points_add(CutLattice *lattice, int vertex);

// Lists a vertex of a cell that goes.
void cut_parts_list_lost(CutLattice *lattice, int vertex);

// cut_split.c. Call it when the element's bits have changed: it may have to be divided.
void cut_split_bite(CutLattice *lattice, int cell);
// True if a leaf must be divided: something is broken in or near it, or it may be no leaf at all.
bool cut_split_must(const CutLattice *lattice, int element);
// Load time: divides the leaves that may be none, whatever is broken. Returns how many.
int cut_split_divide_others(CutLattice *lattice);
// Sorts the elements added to `wanted` behind the first `sorted` into its order.
void cut_split_sort(CutLattice *lattice, int sorted);

// The leaves in and around an element that is being divided or merged, as blocks of its children's
// level, with its own in the middle. None is smaller.
typedef struct CutBlocks {
    int leaf[4][4][4]; // [z][y][x]
} CutBlocks;
enum { CUT_POINTS = NODE_COUNT + 1 }; // nodes of an element, and its centre
void cut_split_find_blocks(const CutLattice *lattice, int element, CutBlocks *out);
// Gives the leaves around all these points of an element their vertices.
void cut_split_visit(CutLattice *lattice, int element);

// cut_lattice_derive.c. The same as cut_lattice_derive, but elements may be left that must be
// divided.
bool cut_parts_derive(CutLattice *lattice);

// cut_merge.c. Load time: decides which elements may be leaves of a body that adapts.
void cut_merge_allow(CutLattice *lattice, const VoxelMaking *making);

#endif
