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
    const long row = lattice->count[0] + 2, layer = row * (lattice->count[1] + 2);
    const int *low = &lattice->scratch->grid[point[2] * layer + point[1] * row + point[0]];
    for (int s = 0; s < 8; s++)
        leaf[s] = low[(s & 1) + (s >> 1 & 1) * row + (s >> 2) * layer];
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
    if (cut_parts_is_cell(lattice, leaf))
        return &lattice->corner[leaf][7 - slot]; // the opposite corner
    return &lattice
                ->node[leaf - lattice->level_first[1]][cut_lattice_node_at(lattice, leaf, point)];
}

static PointParts parts_at(const CutLattice *lattice, const int point[3], const int leaf[8])
{
    // Bits by slot: solid, leaf of level 0, with the point as a corner; with a broken face by its
    // axis.
    unsigned solid = 0, cells = 0, corners = 0, broken_at[3] = {0, 0, 0}, broken = 0;
    const int all = point[0] | point[1] | point[2];
    for (int s = 0; s < 8; s++) {
        if (leaf[s] < 0)
            continue;
        solid |= 1u << s;
        if (cut_parts_is_cell(lattice, leaf[s])) {
            const unsigned bits = lattice->broken[leaf[s]];
            cells |= 1u << s;
            for (int d = 0; d < 3; d++)
                broken_at[d] |= (bits >> d & 1) << s;
        } else if ((all & ((1 << lattice->element[leaf[s]].level) - 1)) == 0) {
            corners |= 1u << s;
        }
    }
    corners |= cells;
    // Of the slots on the lower side of a face, keep those whose face is open.
    static const unsigned low_side[3] = {0x55, 0x33, 0x0f};
    for (int d = 0; d < 3; d++)
        broken_at[d] &= low_side[d] & cells >> (1 << d);
    if (solid == 0xff && (broken_at[0] | broken_at[1] | broken_at[2]) == 0)
        return (PointParts){.owns = corners != 0};
    for (int f = 0; f < 12; f++)
        broken |= (broken_at[f / 4] >> POINT_FACE[f] & 1) << f;
    return point_parts(leaf, corners, broken);
}

// Returns the vertex at a point whose part's lowest slot is `anchor`; -1: none.
static int find_vertex(const CutLattice *lattice, int index, int anchor)
{
    int v = lattice->scratch->head[index];
    while (v >= 0 && lattice->anchor[v] != anchor)
        v = lattice->scratch->next[v];
    return v;
}

// Returns the cell in a slot around a point at load; -1: void.
static int cell_in(const CutLattice *lattice, const int point[3], int slot)
{
    return cut_lattice_cell_at_load(lattice, point[0] - 1 + (slot & 1),
                                    point[1] - 1 + (slot >> 1 & 1), point[2] - 1 + (slot >> 2));
}

// Returns what the id of a new vertex adds to the index of its point (point_parts_rank): cells that
// are gone count as solid.
static int rank_of(const CutLattice *lattice, const PointParts *parts, int part, const int point[3])
{
    if (!lattice->removable)
        return point_parts_rank(parts, part);
    for (int s = 0; s < part; s++)
        if (cell_in(lattice, point, s) >= 0)
            return part;
    return 0;
}

void cut_points_find_anchors(CutLattice *lattice)
{
    const int *n = lattice->scratch->points, points = n[0] * n[1] * n[2];
    memset(lattice->anchor, -1, (size_t)lattice->vertex_capacity);
    for (int v = 0; v < cut_lattice_used(lattice); v++) {
        const int index = lattice->vertex_id[v] % points;
        const int point[3] = {index % n[0], index / n[0] % n[1], index / (n[0] * n[1])};
        const int rank = lattice->vertex_id[v] / points;
        int lowest = 0;
        while (lowest < 7 && cell_in(lattice, point, lowest) < 0)
            lowest++;
        // An id that no part can have has no anchor.
        const int slot = rank == 0 ? lowest : rank;
        const bool good = cell_in(lattice, point, slot) >= 0 && (rank == 0 || rank > lowest);
        lattice->anchor[v] = (signed char)(good ? slot : -1);
    }
}

void cut_points_add(CutLattice *lattice, int vertex)
{
    CutScratch *scratch = lattice->scratch;
    const int nx = scratch->points[0], ny = scratch->points[1];
    const int index = lattice->vertex_id[vertex] % (nx * ny * scratch->points[2]);
    scratch->point[vertex][0] = index % nx;
    scratch->point[vertex][1] = index / nx % ny;
    scratch->point[vertex][2] = index / (nx * ny);
    scratch->next[vertex] = scratch->head[index];
    scratch->head[index] = vertex;
}

void cut_points_list_parents(CutScratch *scratch)
{
    for (int offset = 0; offset < 27; offset++) {
        // How many of its coordinates are in the middle: of an edge, a face or the element.
        const int steps[3] = {offset % 3, offset / 3 % 3, offset / 9};
        const int middles = (steps[0] == 1) + (steps[1] == 1) + (steps[2] == 1);
        CutParents *parents = &scratch->parents[offset];
        for (int n = 0; n < 27; n++) {
            const int at[3] = {n % 3, n / 3 % 3, n / 9};
            // A candidate parent, as a corner of a child.
            int left = 0, child = 0, corner = 0;
            bool beside = true; // where the position is at the end of an edge, so is the parent
            for (int d = 0; d < 3; d++) {
                left += at[d] == 1;
                beside &= steps[d] == 1 || at[d] == steps[d];
                child |= (at[d] == 2) << d;
                corner |= (at[d] > 0) << d;
            }
            if (beside && left == (middles == 2)) {
                parents->child[parents->count] = (unsigned char)child;
                parents->corner[parents->count++] = (unsigned char)corner;
            }
        }
    }
}

static int find_parents(const CutLattice *lattice, int of, const int point[3], int parent[8])
{
    const CutElement *element = &lattice->element[of];
    int offset = 0;
    for (int d = 0, step = 1; d < 3; d++, step *= 3)
        offset += step * (2 * (point[d] - element->cell[d]) >> element->level);
    const CutParents *parents = &lattice->scratch->parents[offset];
    for (int p = 0; p < parents->count; p++)
        parent[p] =
            cut_lattice_nodes(lattice, element->child + parents->child[p])[parents->corner[p]];
    return parents->count;
}

// Adds a copy of `origin`, or, if that is negative, a vertex in the middle of `of`.
static int add_vertex(CutLattice *lattice, int id, int anchor, const int point[3], int origin,
                      int of)
{
    const int v = (int)(*lattice->vertex_count)++;
    ASSERT(v < lattice->vertex_capacity);
    lattice->vertex_id[v] = id;
    lattice->anchor[v] = (signed char)anchor;
    CutBirth *birth = &lattice->changes.birth[lattice->changes.birth_count++];
    *birth = (CutBirth){.vertex = v, .origin = origin, .parent_count = 1, .parent = {origin}};
    if (origin < 0)
        birth->parent_count = find_parents(lattice, of, point, birth->parent);
    cut_points_add(lattice, v);
    return v;
}

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

bool cut_points_visit(CutLattice *lattice, const int point[3], const int leaf[8], int of)
{
    const CutScratch *scratch = lattice->scratch;
    const int index = cut_parts_index(scratch, point);
    const int points = scratch->points[0] * scratch->points[1] * scratch->points[2];
    const PointParts parts = parts_at(lattice, point, leaf);
    if (parts.owns == 0) // then the point need not be a node of any of them
        return true;
    // Find or create the vertex of each part.
    int vertex[8] = {-1, -1, -1, -1, -1, -1, -1, -1}, first_new = -1;
    for (unsigned left = parts.owns; left != 0; left &= left - 1) {
        const int p = __builtin_ctz(left);
        int origin = vertex_before(lattice, &parts, p, leaf, point);
        const int anchor = origin < 0 ? -1 : lattice->anchor[origin];
        vertex[p] = anchor == p ? origin : find_vertex(lattice, index, p);
        // The cell in its lowest slot has gone.
        if (vertex[p] < 0 && anchor >= 0 && leaf[anchor] < 0) {
            vertex[p] = origin;
            lattice->anchor[origin] = (signed char)p;
        }
        if (vertex[p] >= 0)
            continue;
        if (of == CUT_NO_BIRTHS)
            return false;
        if (origin < 0)
            origin = first_new;
        const int id = index + points * rank_of(lattice, &parts, p, point);
        vertex[p] = add_vertex(lattice, id, p, point, origin, of);
        if (first_new < 0)
            first_new = vertex[p];
    }
    // Enter the vertices into the leaves.
    for (int s = 0; s < 8; s++) {
        if (leaf[s] < 0)
            continue;
        int *entry = entry_in(lattice, leaf[s], s, point);
        const int now = vertex[parts.part[s]];
        // A point without a vertex may be at a quarter of a large leaf's edge, where no node is.
        if (now < 0 || *entry == now)
            continue;
        *entry = now;
        cut_parts_list_element(lattice, leaf[s]);
    }
    return true;
}

int cut_points_wanted(const CutLattice *lattice, const int point[3], const int leaf[8])
{
    return __builtin_popcount(parts_at(lattice, point, leaf).owns);
}

int cut_points_present(const CutLattice *lattice, const int point[3])
{
    const CutScratch *scratch = lattice->scratch;
    int count = 0;
    for (int v = scratch->head[cut_parts_index(scratch, point)]; v >= 0; v = scratch->next[v])
        count += lattice->anchor[v] >= 0;
    return count;
}
