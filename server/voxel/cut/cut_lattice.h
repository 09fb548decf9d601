// SPDX-License-Identifier: MIT
// The elements and vertices of a voxel body while it is cut: private to the voxel module, for
// bodies with `cuttable = true`.
//
// Three sets of bits define everything (README.md, "Three sets of bits"): which elements are
// divided, which faces of the finest cells are broken, and which finest cells are gone. Bits are
// only ever set, but for the first in a body that adapts, whose elements merge again. The elements
// follow from the first, the sharing of vertices from both (lattice_mesh.h: the parts of a lattice
// point), and every local change gives the same result as deriving everything again
// (cut_lattice_derive; tests compare). Elements keep their numbers: all that can ever exist are
// numbered at load, the initial leaves and all their descendants; by level, within a level by
// window (an aligned block of WINDOW_EDGE elements a side), within a window along a Z curve. So the
// eight children of an element are consecutive.
//
// A broken face takes effect, and is open, once the cells on both sides are leaves: around a face
// that still borders on a larger leaf everything stays connected. So no large leaf ever has an open
// face, and outer and cut faces are squares of one size on both sides.
//
// A cell that is gone is void: all its faces are broken, and the cells across them are leaves.
//
// A body that adapts (VoxelOptions.surface_level) has elements for all blocks up to the coarsest
// level that hold a solid cell, its surface included. A leaf of which some cells are void is partly
// filled: its vertices are those of the whole block, corners in void included. Void cells inside of
// it are covered by it (cut_lattice_around). Two leaves hold together at a point only if two solid
// cells meet somewhere across their common face.
//
// Where such a body does not merge, vertices are never removed: they keep their rows, and new ones
// take the next. A vertex's id is
// that of its part when it appeared: the index of its lattice point, x fastest, for the part with
// the lowest slot that was solid at load; + points * (lowest slot of its part) for others. Parts
// only ever become smaller, and the vertex stays with the smaller part that holds the lowest slot.
// When the cell in that slot goes, it stays with the lowest of what that leaves: `anchor` says
// which. Without it, the id does. A vertex whose last element goes has none from then on.
//
// Where elements merge, vertices end that no part owns any more. One that is shown (`kept_id`) is
// carried from then on: it keeps its row and id, and returns when elements there are divided.
// Others are freed: a later vertex takes the lowest free row, but not within the same change. A
// part without solid cells at its point, a corner in void, has anchor 8 + its lowest slot, and an
// id above those of all other parts.
#ifndef PLIANT_VOXEL_CUT_CUT_LATTICE_H
#define PLIANT_VOXEL_CUT_CUT_LATTICE_H

#include "base/memory.h"
#include "voxel/model.h"
#include "voxel/template.h"

enum { WINDOW_EDGE = 4, WINDOW_ELEMENTS = 64 };
enum { CUT_REMOVE_MOST = 64 }; // cells that go in one change
// Farthest from the affine motion of the merged element that vertices of its children may be, in
// cells, for elements to merge while the body moves.
#define CUT_MERGE_RESIDUAL 0.05

// Constant.
typedef struct CutElement {
    short cell[3]; // its lowest cell
    unsigned char level : 3;
    unsigned char whole : 1;     // all its cells are solid
    unsigned char mergeable : 1; // it may be a leaf: in a body that adapts, at any time
    unsigned char material;      // of all its cells; 0: of several
} CutElement;
_Static_assert(sizeof(CutElement) == 8 && VOXEL_LEVELS_MAX < 8, "there are as many as cells");

// Elements [first, end) of one level in one aligned block; empty windows do not exist.
typedef struct CutWindow {
    int first, end;
    unsigned char level;
} CutWindow;

// A new vertex, with the mean position and velocity of its parents: a copy of its only parent at
// the same point, where its elements had their vertex before; or a vertex in the middle of nodes of
// a divided element, by the template's rule; or, without parents, a corner in void of an element
// that has merged, where that element's affine motion takes it.
typedef struct CutBirth {
    int vertex;
    int parent[8]; // 1, 2, 4 or 8, some more than once; they existed before. 0: the merged element
    unsigned char parent_count;
    bool carried; // it was carried until now: its row and id are not new
} CutBirth;

// Returns the vertex that a new one is a copy of; -1: of none.
static inline int cut_birth_origin(const CutBirth *birth)
{
    return birth->parent_count == 1 ? birth->parent[0] : -1;
}

// A vertex that no element has any more: freed or, if it has a `kept_id`, carried.
typedef struct CutEnd {
    int vertex;
    int element; // that was merged or divided, on whose closed block it was
} CutEnd;

// All changes since cut_lattice_forget_changes, for data derived from the lattice. Each list holds
// an entry once, in the order of its first occurrence. Elements merge and are divided in changes of
// their own.
typedef struct CutChanges {
    int element_count, birth_count, face_count, lost_count, merged_count, ended_count;
    int *element;    // created, removed, or with other vertices
    int *lost;       // vertices of cells that went
    CutBirth *birth; // parents before children
    int (*face)[2];  // {finest cell (element of level 0), axis}: newly broken, or broken and with a
                     // side that has newly become a leaf of level 0
    int *merged;     // elements that are leaves now and were divided before
    CutEnd *ended;   // their points and rows are valid until the changes are forgotten
} CutChanges;

// Bits of an element; all but the first two are scratch.
enum CutMark {
    CUT_LEAF = 128, // it is one
    CUT_BITTEN = 4, // has a broken bit in or on it
    CUT_LISTED = 1, // in changes.element
    CUT_MERGED = 2, // in changes.merged
    CUT_FACE = 8,   // of a finest cell, times 2^axis: its face is in changes.face
    CUT_FACES = 7 * CUT_FACE
};

typedef struct CutLattice {
    // --- constant ---
    int levels;
    int count[3];                          // cells, rounded up to multiples of 2^levels
    int lattice_count[3];                  // as given
    int element_count;                     // that can ever exist
    int level_first[VOXEL_LEVELS_MAX + 2]; // first element of each level
    CutElement *element;                   // [element_count]
    // Of elements of level 1 or more, [element - level_first[1]]
    int *child;              // first one that exists
    unsigned char *children; // bit c: child c exists: it has a solid cell
    unsigned char *meets;    // bit d (-x, +x, -y, +y, -z, +z): across that face solid cells meet
    int *lut[VOXEL_LEVELS_MAX + 1]; // [level][block of 2^level cells, x fastest]: element or -1
    int window_count;
    CutWindow *window; // by level
    int vertex_capacity;
    int split_budget; // divisions per tick
    // Rows for leaves of level 0 and for larger ones, those included that were leaves before the
    // present change.
    int most_cells, most_larger;
    int rest_families; // of eight cells, in the state at rest
    bool removable;    // cells can go
    bool adapts;       // elements merge again; also such as are partly filled
    int kept_end;      // vertices at load: no later one is kept for ever
    int *kept_id; // [kept_end] id of a vertex that keeps its row for ever; -1: ends when it may

    // --- part of the state ---
    unsigned char *divided; // [element_count] of a finest cell: it is gone
    unsigned char *broken;  // [elements of level 0] bit d: its face towards +d
    int *vertex_id;         // [vertex_capacity] -1: does not exist yet
    int64_t *vertex_count;  // see cut_lattice_used
    signed char *anchor;    // [vertex_capacity] lowest slot of its part with a solid cell; 8 + its
                            // lowest slot: it has none; -1: all its elements are gone, or it is
                            // free. State where cells can go, else it follows from the id

    // --- follows from it ---
    // Vertices of leaves, at cut_lattice_row: corners of those of level 0, and nodes of others; -1:
    // absent. Where every element has a row, those of elements that are no leaves are all -1.
    int (*corner)[NODE_CORNERS];
    int (*node)[NODE_COUNT];
    // Rows of larger leaves, and the first of the eight for the children of elements of level 1;
    // -1: none. They are free for others once a change is forgotten. NULL: every element has a row
    int *leaf_row;          // [element - level_first[1]]
    int *family_row;        // [element of level 1 - level_first[1]]; NULL, too: there is no level 1
    unsigned char *mark;    // [element] CutMark
    bool *carried;          // [kept_end] shown, but no element has it now
    struct CutCarry *carry; // is told before elements change; NULL: nobody is. Set by the body
    int leaf_count, leaf_at_level[VOXEL_LEVELS_MAX + 1];
    // Elements that must be divided, because a bit is broken in or on them, by level, the coarsest
    // first, then by number. None in a body that adapts
    int *wanted; // [wanted_count]
    int wanted_count;

    CutChanges changes;
    struct CutScratch *scratch;
} CutLattice;

// Load time. Elements and vertices as in the layout and the mesh of `making`, in their order, or as
// its rest_id and `divided` say; also needs its capacity, and the options' name and split_budget.
// The arena owns the arrays. False with a status: the capacity is too small.
bool cut_lattice_create(CutLattice *lattice, const VoxelMaking *making, Arena *arena,
                        StateList *state, Status *status);

// Finds the position of an element's lowest cell.
static inline void cut_lattice_place(const CutLattice *lattice, int element, int place[3])
{
    for (int d = 0; d < 3; d++)
        place[d] = lattice->element[element].cell[d];
}
// Returns the window of an element.
int cut_lattice_window(const CutLattice *lattice, int element);

// True if a finest cell was taken away.
static inline bool cut_lattice_is_gone(const CutLattice *lattice, int cell)
{
    return lattice->divided[cell];
}

// Returns the element with this block, which is inside the lattice; -1: none.
static inline int cut_lattice_block(const CutLattice *lattice, int level, int i, int j, int k)
{
    const long nx = lattice->count[0] >> level, ny = lattice->count[1] >> level;
    return lattice->lut[level][(k * ny + j) * nx + i];
}
// Returns the next larger element around one; -1: there is none.
static inline int cut_lattice_parent(const CutLattice *lattice, int element)
{
    const CutElement *of = &lattice->element[element];
    const int level = of->level + 1;
    return level > lattice->levels ? -1
                                   : cut_lattice_block(lattice, level, of->cell[0] >> level,
                                                       of->cell[1] >> level, of->cell[2] >> level);
}
// Returns the first of an element's children that exist, which are one after the other; -1: it is
// of level 0.
static inline int cut_lattice_first_child(const CutLattice *lattice, int element)
{
    const int cells = lattice->level_first[1];
    return element < cells ? -1 : lattice->child[element - cells];
}
// Returns which children of an element exist: bits, none of one of level 0.
static inline unsigned cut_lattice_children(const CutLattice *lattice, int element)
{
    const int cells = lattice->level_first[1];
    return element < cells ? 0 : lattice->children[element - cells];
}

static inline bool cut_lattice_is_leaf(const CutLattice *lattice, int element)
{
    return (lattice->mark[element] & CUT_LEAF) != 0;
}

// Returns child c (bit d: the upper half along axis d) of an element of level 1 or more; -1: void.
static inline int cut_lattice_child(const CutLattice *lattice, int element, int c)
{
    const CutElement *of = &lattice->element[element];
    const int level = of->level - 1;
    const unsigned children = cut_lattice_children(lattice, element);
    if (children == 0xff) // faster
        return cut_lattice_first_child(lattice, element) + c;
    return children >> c & 1 ? cut_lattice_block(lattice, level, (of->cell[0] >> level) + (c & 1),
                                                 (of->cell[1] >> level) + (c >> 1 & 1),
                                                 (of->cell[2] >> level) + (c >> 2))
                             : -1;
}
// Returns which child of its parent an element is.
static inline int cut_lattice_which(const CutLattice *lattice, int element)
{
    const CutElement *of = &lattice->element[element];
    int c = 0;
    for (int d = 0; d < 3; d++)
        c |= (of->cell[d] >> of->level & 1) << d;
    return c;
}

// Returns the row of an element among those of level 0, or among the others; -1: it has none.
static inline int cut_lattice_row(const CutLattice *lattice, int element)
{
    const int cells = lattice->level_first[1];
    if (element >= cells)
        return lattice->leaf_row != NULL ? lattice->leaf_row[element - cells] : element - cells;
    if (lattice->family_row == NULL)
        return element;
    // Of its parent, and which of the children it is: cut_lattice_parent and _which, but faster.
    const short *at = lattice->element[element].cell;
    const long nx = lattice->count[0] >> 1, ny = lattice->count[1] >> 1;
    const int parent = lattice->lut[1][((at[2] >> 1) * ny + (at[1] >> 1)) * nx + (at[0] >> 1)];
    const int first = lattice->family_row[parent - cells];
    return first < 0 ? -1 : first + ((at[0] & 1) | (at[1] & 1) << 1 | (at[2] & 1) << 2);
}
// Returns the same, rows of larger leaves numbered after those of level 0.
static inline int cut_lattice_place_of_row(const CutLattice *lattice, int element)
{
    if (lattice->leaf_row == NULL)
        return element;
    const int row = cut_lattice_row(lattice, element);
    return row < 0 || element < lattice->level_first[1] ? row : lattice->most_cells + row;
}

// Returns the vertices of an element by node: NODE_CORNERS of them at level 0, else NODE_COUNT.
static inline const int *cut_lattice_nodes(const CutLattice *lattice, int element)
{
    static const int NONE[NODE_COUNT] = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1,
                                         -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
    const int row = cut_lattice_row(lattice, element);
    if (row < 0)
        return NONE;
    return element < lattice->level_first[1] ? lattice->corner[row] : lattice->node[row];
}

// Returns the finest cell at a position, as an element of level 0 (leaf or not); -1: void, gone or
// outside.
int cut_lattice_cell(const CutLattice *lattice, int i, int j, int k);
// Finds those around a point, by slot.
void cut_lattice_cells(const CutLattice *lattice, const int point[3], int cell[8]);
// Returns the same, also if it is gone.
int cut_lattice_cell_at_load(const CutLattice *lattice, int i, int j, int k);
// Returns the leaf that covers a finest cell.
int cut_lattice_leaf_of(const CutLattice *lattice, int cell);
// Returns the cell beyond a cell's face towards +axis; -1: void or gone.
int cut_lattice_beyond(const CutLattice *lattice, int cell, int axis);
// Returns the cell across a face (-x, +x, -y, +y, -z, +z) at load, also if it is gone; -1: void.
int cut_lattice_across(const CutLattice *lattice, int cell, int direction);

// True if the face of a cell towards +axis is open: broken, and both cells are leaves.
static inline bool cut_lattice_is_open(const CutLattice *lattice, int cell, int axis)
{
    if (!(lattice->broken[cell] >> axis & 1) || !cut_lattice_is_leaf(lattice, cell))
        return false;
    const int beyond = cut_lattice_beyond(lattice, cell, axis);
    return beyond >= 0 && cut_lattice_is_leaf(lattice, beyond);
}

// Returns the rows in use, of which some may be free (id -1) in a body that adapts.
static inline int cut_lattice_used(const CutLattice *lattice)
{
    return (int)*lattice->vertex_count;
}
// True if a vertex keeps its row for ever, and is shown.
static inline bool cut_lattice_is_kept(const CutLattice *lattice, int vertex)
{
    return vertex < lattice->kept_end && lattice->kept_id[vertex] >= 0;
}
// True if a kept vertex is no node of any element now.
static inline bool cut_lattice_is_carried(const CutLattice *lattice, int vertex)
{
    return vertex < lattice->kept_end && lattice->carried[vertex];
}
// True if a vertex is a corner in void: no solid cell of its part is at its point.
static inline bool cut_lattice_is_in_void(const CutLattice *lattice, int vertex)
{
    return lattice->anchor[vertex] >= 8;
}
// Returns the rest position of a vertex, in cells.
void cut_lattice_point(const CutLattice *lattice, int vertex, int point[3]);
// Returns the leaves around a lattice point by slot, x + 2 y + 4 z; -1: void.
void cut_lattice_around(const CutLattice *lattice, const int point[3], int leaf[8]);
// Returns the node of a leaf at a lattice point that is a vertex of one of the leaves around.
int cut_lattice_node_at(const CutLattice *lattice, int leaf, const int point[3]);

// True if this many new broken faces are certain to fit.
bool cut_lattice_has_room(const CutLattice *lattice, int faces);
// Returns how many vertices come when unbroken faces between leaves break.
int cut_lattice_births(CutLattice *lattice, const int (*face)[2], int count);
// Breaks faces {cell, axis} that are not broken yet, first all bits, then the vertices. Those
// inside coarse leaves are dormant until these leaves, which now must be divided, are. In a body
// that adapts there are none: cut_lattice_clear comes before.
void cut_lattice_break(CutLattice *lattice, const int (*face)[2], int count);
// Divides the leaves in the way of faces that are to break: those that cover their cells and, in a
// body that adapts, partly filled ones around; about as many as the budget allows. `left`: faces
// that something is still in the way of. Returns how many were divided.
int cut_lattice_clear(CutLattice *lattice, const int (*face)[2], int count, int budget, int *left);
// True if the vertices of this many cells that go are certain to fit.
bool cut_lattice_has_room_to_remove(const CutLattice *lattice, int cells);
// Divides the leaves in the way of cells that are to go: those that cover them, and those across
// their faces; about as many as the budget allows. Leaves in the list the cells that nothing is in
// the way of now. Returns how many were divided.
int cut_lattice_expose(CutLattice *lattice, int *cell, int *count, int budget);
// Takes away exposed cells, at most CUT_REMOVE_MOST: breaks all their faces, first all bits, then
// the vertices.
void cut_lattice_remove(CutLattice *lattice, const int *cell, int count);
// Divides elements that must be, each at most once per call and at most split_budget (a division
// may first have to divide coarser neighbours, and so exceed it by a few); elements that share a
// corner never differ by more than one level. Returns how many were divided. What exceeds the
// capacity stays in the list; if there is much of it only the first is tried.
int cut_lattice_reconstruct(CutLattice *lattice);
void cut_lattice_forget_changes(CutLattice *lattice);

// --- bodies that adapt ---
// Divides leaves of level 1 or more, each with what must be divided before it, whatever the budget.
// Returns how many were divided. Left are those that exceed the capacity.
int cut_lattice_divide(CutLattice *lattice, const int *element, int count);
// Notes what is divided, in a body that adapts; for cut_lattice_undivide.
void cut_lattice_note(CutLattice *lattice);
// Merges what has been divided since and can merge. Returns how many: again, until there are none.
int cut_lattice_undivide(CutLattice *lattice);
// True if a divided element may become a leaf: its children are leaves, no block of their size
// around it is divided, it is mergeable, and nothing is broken in or near it. False if a child was
// merged in this change.
bool cut_lattice_can_merge(const CutLattice *lattice, int element);
// Merges the children of an element that can merge.
void cut_lattice_merge(CutLattice *lattice, int element);
// Divides what must be, and merges all that can until nothing can: the state at rest, a function of
// the broken bits alone. Forgets the changes; vertices end or come without a place. Load time,
// before anything is derived from the lattice, and tests.
void cut_lattice_coarsen(CutLattice *lattice);

// cut_lattice_derive.c. Derives everything that follows from the state. False: an impossible state
// (from a checkpoint).
bool cut_lattice_derive(CutLattice *lattice);

#endif
