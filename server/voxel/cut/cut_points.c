// SPDX-License-Identifier: MIT
// The vertices at a lattice point. Step thread.
#include "voxel/cut/cut_parts.h"

#include "base/check.h"
#include "voxel/point_parts.h"

#include <string.h>

void cut_lattice_point(const CutLattice *lattice, int vertex, int point[3])
{
    memcpy(point, lattice->scratch->point[vertex], 3 * sizeof *point);
}

void cut_lattice_around(const CutLattice *lattice, const int point[3], int leaf[8])
{
    // The block of the lowest cell, that cell, and steps to those beside them.
    const int i = point[0] - 1, j = point[1] - 1, k = point[2] - 1;
    const int by = lattice->scratch->grid_level, *cell = lattice->lut[0];
    const long nx = lattice->count[0], ny = lattice->count[1];
    const long row = (nx >> by) + 2, layer = row * ((ny >> by) + 2);
    const int *low = &lattice->scratch->grid[cut_parts_grid(lattice, i, j, k)];
    const long at = (k * ny + j) * nx + i;
    const long x = by == 0 || i & 1, y = by == 0 || j & 1 ? row : 0,
               z = by == 0 || k & 1 ? layer : 0;
    for (int s = 0; s < 8; s++) {
        const long a = s & 1, b = s >> 1 & 1, c = s >> 2;
        leaf[s] = low[a * x + b * y + c * z];
        if (leaf[s] != CUT_CELLS)
            continue;
        leaf[s] = cell[at + a + (b + c * ny) * nx];
        if (lattice->removable && leaf[s] >= 0 && cut_lattice_is_gone(lattice, leaf[s]))
            leaf[s] = -1;
    }
}

int cut_lattice_node_at(const CutLattice *lattice, int leaf, const int point[3])
{
    const CutElement *element = &lattice->element[leaf];
    int at = 0;
    for (int d = 0, step = 1; d < 3; d++, step *= 3)
        at += step * (2 * (point[d] - element->cell[d]) >> element->level);
    return lattice->scratch->node_at[at];
}

// Returns where the leaf in a slot stores its vertex for the point.
static int *entry_in(CutLattice *lattice, int leaf, int slot, const int point[3])
{
    int *nodes = cut_parts_nodes(lattice, leaf);
    if (cut_parts_is_cell(lattice, leaf))
        return &nodes[7 - slot]; // the opposite corner
    return &nodes[cut_lattice_node_at(lattice, leaf, point)];
}

// The parts at a point, and the slots with a solid cell: bits.
typedef struct CutAround {
    PointParts parts;
    unsigned solid;
} CutAround;

// Returns whether solid cells meet across the common face of two leaves, side by side along an
// axis: the smaller one knows.
static bool meet(const CutLattice *lattice, int low, int high, int axis)
{
    return lattice->element[low].level <= lattice->element[high].level
               ? cut_parts_meets(lattice, low, 2 * axis + 1)
               : cut_parts_meets(lattice, high, 2 * axis);
}

// The same as `parts_at` where a leaf is partly filled.
static CutAround parts_around_void(const CutLattice *lattice, const int point[3], const int leaf[8],
                                   unsigned corners, unsigned broken)
{
    CutAround around = {.solid = 0};
    for (int f = 0; f < 12; f++) {
        const int low = POINT_FACE[f], high = low + (1 << f / 4);
        if (leaf[low] >= 0 && leaf[high] >= 0 && leaf[low] != leaf[high])
            broken |= (unsigned)!meet(lattice, leaf[low], leaf[high], f / 4) << f;
    }
    for (int s = 0; s < 8; s++)
        if (leaf[s] >= 0)
            around.solid |= (unsigned)(lattice->element[leaf[s]].whole ||
                                       cut_parts_cell_in(lattice, point, s) >= 0)
                            << s;
    around.parts = point_parts(leaf, corners, broken);
    return around;
}

static CutAround parts_at(const CutLattice *lattice, const int point[3], const int leaf[8])
{
    // Bits by slot: covered by a leaf, leaf of level 0, with the point as a corner; with a broken
    // face by its axis.
    unsigned covered = 0, cells = 0, corners = 0, broken_at[3] = {0, 0, 0}, broken = 0;
    const int all = point[0] | point[1] | point[2];
    bool whole = true;
    for (int s = 0; s < 8; s++) {
        if (leaf[s] < 0)
            continue;
        covered |= 1u << s;
        if (cut_parts_is_cell(lattice, leaf[s])) {
            const unsigned bits = lattice->broken[leaf[s]];
            cells |= 1u << s;
            for (int d = 0; d < 3; d++)
                broken_at[d] |= (bits >> d & 1) << s;
        } else {
            const CutElement *element = &lattice->element[leaf[s]];
            corners |= (unsigned)((all & ((1 << element->level) - 1)) == 0) << s;
            whole &= element->whole;
        }
    }
    corners |= cells;
    // Of the slots on the lower side of a face, keep those whose face is open.
    static const unsigned low_side[3] = {0x55, 0x33, 0x0f};
    for (int d = 0; d < 3; d++)
        broken_at[d] &= low_side[d] & cells >> (1 << d);
    if (covered == 0xff && whole && (broken_at[0] | broken_at[1] | broken_at[2]) == 0)
        return (CutAround){{.owns = corners != 0}, covered};
    for (int f = 0; f < 12; f++)
        broken |= (broken_at[f / 4] >> POINT_FACE[f] & 1) << f;
    if (!whole)
        return parts_around_void(lattice, point, leaf, corners, broken);
    return (CutAround){point_parts(leaf, corners, broken), covered};
}

// Returns the anchor of a part: its lowest slot with a solid cell; 8 + its lowest slot: it has
// none.
static int anchor_of(const CutAround *around, int part)
{
    for (int s = part; s < 8; s++)
        if (around->parts.part[s] == part && (around->solid >> s & 1))
            return s;
    return 8 + part;
}

// Returns the vertex at a point whose part has this anchor; -1: none.
static int find_vertex(const CutLattice *lattice, int index, int anchor)
{
    int v = cut_parts_first(lattice->scratch, index);
    while (v >= 0 && lattice->anchor[v] != anchor)
        v = lattice->scratch->next[v];
    return v;
}

// ---------------------------------------------------------------------------------------------
// Ids

static int product(const int n[3])
{
    return n[0] * n[1] * n[2];
}

static int index_in(const int n[3], const int point[3])
{
    return (point[2] * n[1] + point[1]) * n[0] + point[0];
}

// Parts without a solid cell have the ids above those of the others: their points may be beyond the
// lattice.
int cut_points_most_ids(const CutLattice *lattice)
{
    const CutScratch *scratch = lattice->scratch;
    return 8 * product(scratch->id_points) + (lattice->adapts ? 8 * product(scratch->points) : 0);
}

// Returns the id of a new vertex. Of parts with a solid cell that is the index of the point for the
// part with the lowest one (point_parts_rank): cells that are gone count as solid.
static int id_of(const CutLattice *lattice, const CutAround *around, int part, const int point[3])
{
    const CutScratch *scratch = lattice->scratch;
    const int points = product(scratch->id_points), anchor = anchor_of(around, part);
    if (anchor >= 8)
        return 8 * points + index_in(scratch->points, point) +
               product(scratch->points) * (anchor - 8);
    const int index = index_in(scratch->id_points, point);
    if (!lattice->removable && !lattice->adapts)
        return index + points * point_parts_rank(&around->parts, part);
    for (int s = 0; s < anchor; s++)
        if (cut_parts_cell_in(lattice, point, s) >= 0)
            return index + points * anchor;
    return index;
}

// Finds the point of an id; returns what the id adds to its index: 8 or more for a part without a
// solid cell.
static int point_of_id(const CutLattice *lattice, int id, int point[3])
{
    const CutScratch *scratch = lattice->scratch;
    const int solid = 8 * product(scratch->id_points);
    const int *n = id < solid ? scratch->id_points : scratch->points;
    const int left = id < solid ? id : id - solid, points = product(n), index = left % points;
    point[0] = index % n[0];
    point[1] = index / n[0] % n[1];
    point[2] = index / (n[0] * n[1]);
    return left / points + (id < solid ? 0 : 8);
}

int cut_points_anchor_of(const CutLattice *lattice, int id)
{
    int point[3], lowest = 0;
    const int rank = point_of_id(lattice, id, point);
    if (rank >= 8)
        return rank;
    while (lowest < 7 && cut_parts_cell_in(lattice, point, lowest) < 0)
        lowest++;
    // An id that no part can have has no anchor.
    const int slot = rank == 0 ? lowest : rank;
    const bool good = cut_parts_cell_in(lattice, point, slot) >= 0 && (rank == 0 || rank > lowest);
    return good ? slot : -1;
}

void cut_points_find_anchors(CutLattice *lattice)
{
    memset(lattice->anchor, -1, (size_t)lattice->vertex_capacity);
    for (int v = 0; v < cut_lattice_used(lattice); v++)
        if (lattice->vertex_id[v] >= 0)
            lattice->anchor[v] = (signed char)cut_points_anchor_of(lattice, lattice->vertex_id[v]);
}

// Lists a vertex at its point, which is known: the highest row first, so that the order in which
// vertices end does not depend on when they came.
static void enter_list(CutScratch *scratch, int vertex)
{
    const int index = cut_parts_index(scratch, scratch->point[vertex]);
    int *at = &scratch->head[cut_parts_head(scratch, index)];
    while (*at > vertex)
        at = &scratch->next[*at];
    scratch->next[vertex] = *at;
    *at = vertex;
}

void cut_points_add(CutLattice *lattice, int vertex)
{
    point_of_id(lattice, lattice->vertex_id[vertex], lattice->scratch->point[vertex]);
    enter_list(lattice->scratch, vertex);
}

// Frees a place of a point without vertices: those behind it that had to go round it come nearer.
static void free_head(CutScratch *scratch, unsigned hole)
{
    const unsigned mask = (1u << scratch->head_bits) - 1;
    for (unsigned at = (hole + 1) & mask; mask != 0 && scratch->head[at] >= 0;
         at = (at + 1) & mask) {
        const int index = cut_parts_index(scratch, scratch->point[scratch->head[at]]);
        if (((at - cut_parts_home(scratch, index)) & mask) < ((at - hole) & mask))
            continue;
        scratch->head[hole] = scratch->head[at];
        hole = at;
    }
    scratch->head[hole] = -1;
}

static void leave_list(CutLattice *lattice, int vertex)
{
    CutScratch *scratch = lattice->scratch;
    const unsigned head = cut_parts_head(scratch, cut_parts_index(scratch, scratch->point[vertex]));
    int *at = &scratch->head[head];
    while (*at != vertex)
        at = &scratch->next[*at];
    *at = scratch->next[vertex];
    if (scratch->head[head] < 0)
        free_head(scratch, head);
}

// ---------------------------------------------------------------------------------------------
// Free rows

static void put_row(CutFreeRows *rows, int row)
{
    rows->count++;
    for (int level = 0; level < FREE_LEVELS; level++, row /= FREE_WORD)
        rows->bits[level][row / FREE_WORD] |= (uint64_t)1 << row % FREE_WORD;
}

// Takes the lowest free row; there is one.
static int take_lowest(CutFreeRows *rows)
{
    int word = 0;
    while (rows->bits[FREE_LEVELS - 1][word] == 0)
        word++;
    for (int level = FREE_LEVELS - 1; level > 0; level--)
        word = FREE_WORD * word + __builtin_ctzll(rows->bits[level][word]);
    const int row = FREE_WORD * word + __builtin_ctzll(rows->bits[0][word]);
    rows->count--;
    // A word without bits has none in the next level.
    for (int level = 0, at = row; level < FREE_LEVELS; level++, at /= FREE_WORD) {
        rows->bits[level][at / FREE_WORD] &= ~((uint64_t)1 << at % FREE_WORD);
        if (rows->bits[level][at / FREE_WORD] != 0)
            break;
    }
    return row;
}

void cut_points_find_free(CutLattice *lattice)
{
    CutFreeRows *rows = &lattice->scratch->free;
    rows->count = 0;
    for (int level = 0; level < FREE_LEVELS; level++)
        memset(rows->bits[level], 0, (size_t)rows->words[level] * sizeof *rows->bits[level]);
    for (int v = 0; v < cut_lattice_used(lattice); v++)
        if (lattice->vertex_id[v] < 0)
            put_row(rows, v);
}

void cut_points_free_ended(CutLattice *lattice)
{
    for (int k = 0; k < lattice->changes.ended_count; k++) {
        const int vertex = lattice->changes.ended[k].vertex;
        lattice->scratch->is_ended[vertex] = false;
        if (lattice->vertex_id[vertex] < 0)
            put_row(&lattice->scratch->free, vertex);
    }
}

static int take_row(CutLattice *lattice)
{
    if (lattice->scratch->free.count > 0)
        return take_lowest(&lattice->scratch->free);
    ASSERT(*lattice->vertex_count < lattice->vertex_capacity);
    return (int)(*lattice->vertex_count)++;
}

// ---------------------------------------------------------------------------------------------
// Births

void cut_points_list_parents(CutScratch *scratch)
{
    for (int offset = 0; offset < 27; offset++) {
        // How many of its coordinates are in the middle: of an edge, a face or the element.
        const int steps[3] = {offset % 3, offset / 3 % 3, offset / 9};
        const int middles = (steps[0] == 1) + (steps[1] == 1) + (steps[2] == 1);
        CutParents *parents = &scratch->parents[offset];
        for (int n = 0; n < 27; n++) {
            const int at[3] = {n % 3, n / 3 % 3, n / 9};
            int left = 0;
            bool beside = true; // where the position is at the end of an edge, so is the parent
            for (int d = 0; d < 3; d++) {
                left += at[d] == 1;
                beside &= steps[d] == 1 || at[d] == steps[d];
            }
            if (beside && left == (middles == 2))
                parents->at[parents->count++] = (unsigned char)n;
        }
    }
}

// Returns the vertex at an offset in an element that has been divided: that of the first child
// there, or, where all are void, what the element had; -1: none.
static int vertex_in(const CutLattice *lattice, int element, int offset)
{
    const int at[3] = {offset % 3, offset / 3 % 3, offset / 9};
    const int first = at[0] / 2 + at[1] / 2 * 2 + at[2] / 2 * 4;
    for (int c = first; c < 8; c++) {
        const int k[3] = {at[0] - (c & 1), at[1] - (c >> 1 & 1), at[2] - (c >> 2)};
        const int child = cut_lattice_child(lattice, element, c);
        if (child >= 0 && ((k[0] | k[1] | k[2]) & ~1) == 0)
            return cut_lattice_nodes(lattice, child)[k[0] + 2 * k[1] + 4 * k[2]];
    }
    const int node = lattice->scratch->node_at[offset];
    return node < 0 ? -1 : lattice->scratch->old[node];
}

// Finds the vertices whose mean is the place of a point in an element that has been divided.
static int find_parents(const CutLattice *lattice, int of, const int point[3], int parent[8])
{
    const CutScratch *scratch = lattice->scratch;
    const CutElement *element = &lattice->element[of];
    int offset = 0, count = 0;
    for (int d = 0, step = 1; d < 3; d++, step *= 3)
        offset += step * (2 * (point[d] - element->cell[d]) >> element->level);
    const CutParents *parents = &scratch->parents[offset];
    bool all = true; // exist
    for (int p = 0; p < parents->count; p++) {
        parent[p] = vertex_in(lattice, of, parents->at[p]);
        all &= parent[p] >= 0;
    }
    if (all)
        return parents->count;
    // In the middle of a face a middle of an edge may be in void: its place is between its ends.
    for (int p = 0; p < parents->count; p++) {
        const CutParents *ends = &scratch->parents[parents->at[p]];
        const int middle = vertex_in(lattice, of, parents->at[p]);
        for (int k = 0; k < 2; k++)
            parent[count++] = middle >= 0 ? middle : vertex_in(lattice, of, ends->at[k]);
    }
    return count;
}

// Tells of a vertex: a copy of `origin`, or, if that is negative, one that follows from `of`.
static void list_birth(CutLattice *lattice, int vertex, const int point[3], int origin, int of,
                       bool carried)
{
    CutBirth *birth = &lattice->changes.birth[lattice->changes.birth_count++];
    *birth =
        (CutBirth){.vertex = vertex, .parent = {origin}, .parent_count = 1, .carried = carried};
    if (origin >= 0)
        return;
    ASSERT(of >= 0);
    birth->parent[0] = of;
    birth->parent_count = 0;
    if (lattice->divided[of])
        birth->parent_count = (unsigned char)find_parents(lattice, of, point, birth->parent);
}

// Adds a copy of `origin`, or, if that is negative, a vertex that follows from `of`.
static int add_vertex(CutLattice *lattice, int id, int anchor, const int point[3], int origin,
                      int of)
{
    const int v = take_row(lattice);
    lattice->vertex_id[v] = id;
    lattice->anchor[v] = (signed char)anchor;
    memcpy(lattice->scratch->point[v], point, sizeof lattice->scratch->point[v]);
    enter_list(lattice->scratch, v);
    list_birth(lattice, v, point, origin, of, false);
    return v;
}

// ---------------------------------------------------------------------------------------------
// Visits

// Returns the vertex that the leaves of a part had here; -1: none.
static int vertex_before(CutLattice *lattice, const PointParts *parts, int part, const int leaf[8],
                         const int point[3])
{
    for (int s = part; s < 8; s++)
        if (parts->part[s] == part) {
            int v = *entry_in(lattice, leaf[s], s, point);
            if (v >= 0)
                return v;
        }
    return -1;
}

// True if the part of a vertex, a corner in void, is none of those at its point any more, and none
// of them has taken the vertex.
static bool is_left(const CutLattice *lattice, const CutAround *around, int origin,
                    const int vertex[8])
{
    for (int p = 0; p < 8; p++) {
        if (!(around->parts.owns >> p & 1))
            continue;
        if (vertex[p] == origin || anchor_of(around, p) == lattice->anchor[origin])
            return false;
    }
    return true;
}

// Gives a vertex the anchor of the part that its own has become.
static void rename_vertex(CutLattice *lattice, int vertex, int anchor, int id)
{
    lattice->anchor[vertex] = (signed char)anchor;
    if (id != lattice->vertex_id[vertex] && anchor >= 8)
        lattice->vertex_id[vertex] = id;
}

// Returns the vertex of a part, if it exists; -1: it is new. `origin`: what its leaves had.
static int existing_vertex(CutLattice *lattice, const CutAround *around, int part, int origin,
                           const int vertex[8], const int leaf[8], const int point[3])
{
    const int anchor = anchor_of(around, part), was = origin < 0 ? -1 : lattice->anchor[origin];
    if (was == anchor)
        return origin;
    const int found = find_vertex(lattice, cut_parts_index(lattice->scratch, point), anchor);
    if (found >= 0 || was < 0)
        return found;
    // The cell in its lowest slot has gone; or in void the lowest slot of its part is another.
    const bool gone = was < 8 && leaf[was] < 0;
    const bool moved = was >= 8 && anchor >= 8 && is_left(lattice, around, origin, vertex);
    if (!gone && !moved)
        return -1;
    rename_vertex(lattice, origin, anchor, id_of(lattice, around, part, point));
    return origin;
}

// Ends the vertices at a point that no part has.
static void end_vertices(CutLattice *lattice, int index, const int vertex[8], int of)
{
    CutScratch *scratch = lattice->scratch;
    for (int v = cut_parts_first(scratch, index), next; v >= 0; v = next) {
        next = scratch->next[v];
        bool has = lattice->anchor[v] < 0 || cut_lattice_is_carried(lattice, v);
        for (int p = 0; p < 8; p++)
            has |= vertex[p] == v;
        if (has)
            continue;
        if (!scratch->is_ended[v])
            lattice->changes.ended[lattice->changes.ended_count++] = (CutEnd){v, of};
        scratch->is_ended[v] = true;
        if (cut_lattice_is_kept(lattice, v)) {
            lattice->carried[v] = true;
            continue;
        }
        leave_list(lattice, v);
        lattice->vertex_id[v] = -1;
        lattice->anchor[v] = -1;
    }
}

static bool is_node(const CutLattice *lattice, int leaf, const int point[3])
{
    const CutElement *element = &lattice->element[leaf];
    int odd = 0, middles = 0; // quarters of an edge; coordinates in the middle
    for (int d = 0; d < 3; d++) {
        const int twice = 2 * (point[d] - element->cell[d]);
        odd |= twice & ((1 << element->level) - 1);
        middles += twice == 1 << element->level;
    }
    return odd == 0 && middles < 3;
}

// Enters the vertices of the parts into the leaves.
static void enter_vertices(CutLattice *lattice, const PointParts *parts, const int vertex[8],
                           const int leaf[8], const int point[3])
{
    for (int s = 0; s < 8; s++) {
        if (leaf[s] < 0)
            continue;
        const int now = vertex[parts->part[s]];
        // A point without a vertex may be at a quarter of a large leaf's edge, where no node is.
        // Only where elements merge may a leaf lose its vertex.
        if (now < 0 && (!lattice->adapts || !is_node(lattice, leaf[s], point)))
            continue;
        int *entry = entry_in(lattice, leaf[s], s, point);
        if (*entry == now)
            continue;
        *entry = now;
        cut_parts_list_element(lattice, leaf[s]);
    }
}

bool cut_points_visit(CutLattice *lattice, const int point[3], const int leaf[8], int of)
{
    const CutScratch *scratch = lattice->scratch;
    const int index = cut_parts_index(scratch, point);
    const CutAround around = parts_at(lattice, point, leaf);
    if (around.parts.owns == 0 && !lattice->adapts) // then it need not be a node of any of them
        return true;
    // Find or create the vertex of each part.
    int vertex[8] = {-1, -1, -1, -1, -1, -1, -1, -1}, first_new = -1;
    for (unsigned left = around.parts.owns; left != 0; left &= left - 1) {
        const int p = __builtin_ctz(left);
        int origin = vertex_before(lattice, &around.parts, p, leaf, point);
        vertex[p] = existing_vertex(lattice, &around, p, origin, vertex, leaf, point);
        if (vertex[p] >= 0) {
            if (cut_lattice_is_carried(lattice, vertex[p])) {
                lattice->carried[vertex[p]] = false;
                if (of != CUT_NO_BIRTHS)
                    list_birth(lattice, vertex[p], point, -1, of, true);
            }
            continue;
        }
        if (of == CUT_NO_BIRTHS)
            return false;
        if (origin < 0)
            origin = first_new;
        vertex[p] = add_vertex(lattice, id_of(lattice, &around, p, point), anchor_of(&around, p),
                               point, origin, of);
        if (first_new < 0)
            first_new = vertex[p];
    }
    enter_vertices(lattice, &around.parts, vertex, leaf, point);
    if (lattice->adapts && of >= 0)
        end_vertices(lattice, index, vertex, of);
    return true;
}

int cut_points_wanted(const CutLattice *lattice, const int point[3], const int leaf[8])
{
    return __builtin_popcount(parts_at(lattice, point, leaf).parts.owns);
}

int cut_points_present(const CutLattice *lattice, const int point[3])
{
    const CutScratch *scratch = lattice->scratch;
    int count = 0;
    for (int v = cut_parts_first(scratch, cut_parts_index(scratch, point)); v >= 0;
         v = scratch->next[v])
        count += lattice->anchor[v] >= 0;
    return count;
}

int cut_points_missing(const CutLattice *lattice, const int point[3], const int leaf[8])
{
    const CutAround around = parts_at(lattice, point, leaf);
    const int index = cut_parts_index(lattice->scratch, point);
    int count = 0;
    for (unsigned left = around.parts.owns; left != 0; left &= left - 1)
        count += find_vertex(lattice, index, anchor_of(&around, __builtin_ctz(left))) < 0;
    return count;
}

int cut_points_corner(const CutLattice *lattice, int element, const int point[3])
{
    const CutElement *of = &lattice->element[element];
    int leaf[8], slot = -1;
    cut_lattice_around(lattice, point, leaf);
    // The element in place of what is inside of it: as a corner of it, one slot.
    for (int s = 0; s < 8; s++) {
        bool in = true;
        for (int d = 0; d < 3; d++) {
            const int at = point[d] - 1 + (s >> d & 1) - of->cell[d];
            in &= at >= 0 && at >> of->level == 0;
        }
        if (in)
            leaf[slot = s] = element;
    }
    const CutAround around = parts_at(lattice, point, leaf);
    const int part = around.parts.part[slot];
    const int found =
        find_vertex(lattice, cut_parts_index(lattice->scratch, point), anchor_of(&around, part));
    if (found >= 0)
        return found;
    // One in void may have another anchor until then.
    for (int s = 0; s < 8; s++)
        if (s != slot && leaf[s] >= 0 && around.parts.part[s] == part) {
            const int node = cut_lattice_node_at(lattice, leaf[s], point);
            if (node >= 0 && cut_lattice_nodes(lattice, leaf[s])[node] >= 0)
                return cut_lattice_nodes(lattice, leaf[s])[node];
        }
    return -1;
}
