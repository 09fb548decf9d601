// SPDX-License-Identifier: MIT
#include "voxel/cut/cut_carry.h"

#include "base/check.h"
#include "voxel/cut/cut_parts.h"
#include "voxel/point_parts.h"

#include <string.h>

enum { POINTS = 27, CENTRE = 13 };
static const int STEP[3] = {1, 3, 9};
static const signed char CORNER_AT[NODE_CORNERS] = {0, 2, 6, 8, 18, 20, 24, 26};

// ---------------------------------------------------------------------------------------------
// Where a point is in an element

// Returns the place of a point in a leaf around it.
static CarrySite site_in(const CutLattice *lattice, int leaf, const int point[3])
{
    const CutElement *element = &lattice->element[leaf];
    CarrySite site = {0};
    int low = 0;
    for (int d = 0; d < 3; d++) {
        // In shares of an octant, of which there are two along each axis.
        const int at = (point[d] - element->cell[d]) * (2 * CARRY_SHARES) >> element->level;
        low += STEP[d] * (at / CARRY_SHARES);
        site.share[d] = (unsigned char)(at % CARRY_SHARES);
    }
    site.low = (signed char)low;
    return site;
}

// Returns bits of the points of a leaf at which it has a vertex.
static unsigned present_of(const CutScratch *scratch, const int *node)
{
    unsigned present = 0;
    for (int at = 0; at < POINTS; at++)
        present |= (unsigned)(scratch->node_at[at] >= 0 && node[scratch->node_at[at]] >= 0) << at;
    return present;
}

// The middles of an element's edges and of its faces, in the order of nodes, and along which axes
// the points are that they are between.
typedef struct Middle {
    signed char at, a, b; // b: of a face
} Middle;

enum { EDGES = 12, MIDDLES = 18 };
static const Middle MIDDLE[MIDDLES] = {
    {1, 0, 0},  {7, 0, 0},  {19, 0, 0}, {25, 0, 0}, {3, 1, 1},  {5, 1, 1},
    {21, 1, 1}, {23, 1, 1}, {9, 2, 2},  {11, 2, 2}, {15, 2, 2}, {17, 2, 2},
    {12, 1, 2}, {14, 1, 2}, {10, 2, 0}, {16, 2, 0}, {4, 0, 1},  {22, 0, 1},
};

int cut_carry_weights_at(const CutLattice *lattice, int leaf, const int point[3],
                         FitWeight weight[NODE_COUNT])
{
    const CutScratch *scratch = lattice->scratch;
    const int *node = cut_lattice_nodes(lattice, leaf);
    const CarrySite site = site_in(lattice, leaf, point);
    double w[POINTS] = {0.0};
    // Trilinear in the octant.
    for (int c = 0; c < 8; c++) {
        double part = 1.0;
        int at = site.low;
        for (int d = 0; d < 3; d++) {
            const double share = (double)site.share[d] / CARRY_SHARES;
            part *= c >> d & 1 ? share : 1.0 - share;
            at += (c >> d & 1) * STEP[d];
        }
        if (part > 0.0)
            w[at] += part;
    }
    // What is absent is between others: the centre, then faces, then edges.
    for (int c = 0; c < 8; c++)
        w[2 * (c & 1) + 6 * (c >> 1 & 1) + 18 * (c >> 2)] += 0.125 * w[CENTRE];
    w[CENTRE] = 0.0;
    const unsigned present = present_of(scratch, node);
    for (int m = MIDDLES - 1; m >= 0; m--) {
        const Middle *middle = &MIDDLE[m];
        if (w[middle->at] == 0.0 || (present >> middle->at & 1))
            continue;
        const double part = w[middle->at] * (m < EDGES ? 0.5 : 0.25);
        w[middle->at] = 0.0;
        for (int side = -1; side <= 1; side += 2) {
            w[middle->at + side * STEP[middle->a]] += part;
            if (m >= EDGES)
                w[middle->at + side * STEP[middle->b]] += part;
        }
    }
    int count = 0;
    for (int at = 0; at < POINTS; at++)
        if (w[at] != 0.0)
            weight[count++] = (FitWeight){node[scratch->node_at[at]], w[at]};
    return count;
}

// ---------------------------------------------------------------------------------------------
// Rows

typedef float SingleNumbers __attribute__((vector_size(ROW * sizeof(float))));
typedef double DoubleNumbers __attribute__((vector_size(ROW * sizeof(double))));

#define REAL    float
#define NUMBERS SingleNumbers
#define FILL    fill_single
#define PUT     put_single
#define UPDATE  update_single
#include "voxel/cut/cut_carry_rows.h"

#define REAL    double
#define NUMBERS DoubleNumbers
#define FILL    fill_double
#define PUT     put_double
#define UPDATE  update_double
#include "voxel/cut/cut_carry_rows.h"

static bool is_single(const CutCarry *carry)
{
    return carry->vertices->rows.precision == PRECISION_SINGLE;
}

void cut_carry_update_some(const CutCarry *carry, void *row, const int *leaf, int count)
{
    if (is_single(carry))
        for (int k = 0; k < count; k++)
            update_single(carry, leaf[k], row);
    else
        for (int k = 0; k < count; k++)
            update_double(carry, leaf[k], row);
}

void cut_carry_update(CutCarry *carry, void *row)
{
    cut_carry_update_some(carry, row, carry->leaf, carry->leaf_count);
}

int cut_carry_list(CutCarry *carry, const int *vertex, int count, int *leaf)
{
    int found = 0;
    carry->stamp++;
    for (int k = 0; k < count; k++) {
        if (!cut_lattice_is_carried(carry->lattice, vertex[k]))
            continue;
        const int own = carry->leaf_of[vertex[k]], at = own - carry->lattice->level_first[1];
        if (carry->seen[at] != carry->stamp)
            leaf[found++] = own;
        carry->seen[at] = carry->stamp;
    }
    return found;
}

void cut_carry_spread(const CutCarry *carry, void *force, const int *vertex, int count)
{
    const Rows *rows = &carry->vertices->rows;
    FitWeight weight[NODE_COUNT];
    for (int k = 0; k < count; k++) {
        if (!cut_lattice_is_carried(carry->lattice, vertex[k]))
            continue;
        const int carriers = cut_carry_weights(carry, vertex[k], weight);
        for (int c = 0; c < 3; c++) {
            const long from = 4L * vertex[k] + c;
            const double all = rows_get(rows, force, from);
            rows_put(rows, force, from, 0.0);
            for (int w = 0; w < carriers; w++) {
                const long to = 4L * weight[w].vertex + c;
                rows_put(rows, force, to, rows_get(rows, force, to) + weight[w].weight * all);
            }
        }
    }
}

// ---------------------------------------------------------------------------------------------
// Vertices that a merge moves

void cut_carry_want_moves(CutCarry *carry, const char *name, Arena *arena)
{
    const int kept = carry->lattice->kept_end;
    carry->move = ALLOCATE(ARENA_OUTPUT, kept, CarryMove, "vertices that merges move");
    carry->moved = ALLOCATE(ARENA_OUTPUT, kept, int, "moved vertices");
}

void cut_carry_note_move(CutCarry *carry, int vertex)
{
    const Vertices *vertices = carry->vertices;
    if (carry->move == NULL || !cut_lattice_is_kept(carry->lattice, vertex) ||
        carry->moved[vertex] > 0)
        return;
    const Vec3 u = rows_vector(&vertices->rows, vertices_row(vertices), vertex, 0);
    carry->move[carry->move_count++] = (CarryMove){vertex, {u.x, u.y, u.z}};
    carry->moved[vertex] = carry->move_count;
}

void cut_carry_forget_moves(CutCarry *carry)
{
    for (int k = 0; k < carry->move_count; k++)
        carry->moved[carry->move[k].vertex] = 0;
    carry->move_count = 0;
}

// ---------------------------------------------------------------------------------------------
// Lists

// Returns bits of the middles that a site follows from, those included that these follow from.
static unsigned middles_of(CarrySite site)
{
    unsigned points = 0, need = 0;
    for (int c = 0; c < 8; c++) {
        int at = site.low;
        for (int d = 0; d < 3; d++)
            at += (c >> d & 1) && site.share[d] > 0 ? STEP[d] : 0;
        points |= 1u << at;
    }
    for (int m = EDGES; m < MIDDLES; m++)
        if (points >> MIDDLE[m].at & 1)
            for (int side = -1; side <= 1; side += 2)
                points |= 1u << (MIDDLE[m].at + side * STEP[MIDDLE[m].a]) |
                          1u << (MIDDLE[m].at + side * STEP[MIDDLE[m].b]);
    for (int m = 0; m < MIDDLES; m++)
        need |= (points >> MIDDLE[m].at & 1) << m;
    return need | (points >> CENTRE & 1) << MIDDLES;
}

// Lists a carried vertex with the leaf around the cell of its anchor.
static void enter(CutCarry *carry, int vertex)
{
    const CutLattice *lattice = carry->lattice;
    int point[3], leaf[8];
    cut_lattice_point(lattice, vertex, point);
    cut_lattice_around(lattice, point, leaf);
    const int own = leaf[lattice->anchor[vertex]], at = own - lattice->level_first[1];
    ASSERT(at >= 0);
    if (carry->first[at] < 0) {
        carry->need[at] = 0;
        carry->place[at] = carry->leaf_count;
        carry->leaf[carry->leaf_count++] = own;
    }
    carry->leaf_of[vertex] = own;
    carry->site[vertex] = site_in(lattice, own, point);
    carry->need[at] |= middles_of(carry->site[vertex]);
    carry->next[vertex] = carry->first[at];
    carry->first[at] = vertex;
    carry->count++;
}

// Takes all vertices from an element, and enters those that are still carried again.
static void sort_again(CutCarry *carry, int element)
{
    const int at = element - carry->lattice->level_first[1];
    int vertex = at < 0 ? -1 : carry->first[at];
    if (vertex < 0)
        return;
    const int last = carry->leaf[--carry->leaf_count];
    carry->leaf[carry->place[at]] = last;
    carry->place[last - carry->lattice->level_first[1]] = carry->place[at];
    carry->first[at] = -1;
    for (int next; vertex >= 0; vertex = next) {
        next = carry->next[vertex];
        carry->leaf_of[vertex] = -1;
        carry->count--;
        if (cut_lattice_is_carried(carry->lattice, vertex))
            enter(carry, vertex);
    }
}

// Updates the carried vertices of the leaves around some vertices.
static void refresh(CutCarry *carry, const int *vertex, int count)
{
    const CutLattice *lattice = carry->lattice;
    void *row = carry->vertices->row[carry->vertices->current];
    carry->stamp++;
    for (int k = 0; k < count; k++) {
        int point[3], leaf[8];
        if (lattice->vertex_id[vertex[k]] < 0)
            continue;
        cut_lattice_point(lattice, vertex[k], point);
        cut_lattice_around(lattice, point, leaf);
        for (int s = 0; s < 8; s++) {
            const int at = leaf[s] - lattice->level_first[1];
            if (leaf[s] < 0 || at < 0 || carry->first[at] < 0 || carry->seen[at] == carry->stamp)
                continue;
            carry->seen[at] = carry->stamp;
            for (int v = carry->first[at]; v >= 0 && carry->move != NULL; v = carry->next[v])
                cut_carry_note_move(carry, v);
            cut_carry_update_some(carry, row, &leaf[s], 1);
        }
    }
}

void cut_carry_follow(CutCarry *carry, const int *vertex, int count)
{
    const CutChanges *changes = &carry->lattice->changes;
    for (int i = 0; i < changes->element_count; i++)
        sort_again(carry, changes->element[i]);
    for (int i = 0; i < changes->ended_count; i++) {
        const int ended = changes->ended[i].vertex;
        if (cut_lattice_is_carried(carry->lattice, ended) && carry->leaf_of[ended] < 0)
            enter(carry, ended);
    }
    if (changes->merged_count > 0) // a division moves nothing
        refresh(carry, vertex, count);
}

void cut_carry_derive(CutCarry *carry)
{
    const CutLattice *lattice = carry->lattice;
    const size_t larger = (size_t)(lattice->element_count - lattice->level_first[1]);
    memset(carry->first, -1, larger * sizeof *carry->first);
    memset(carry->leaf_of, -1, (size_t)lattice->kept_end * sizeof *carry->leaf_of);
    carry->leaf_count = carry->count = 0;
    for (int v = 0; v < lattice->kept_end; v++)
        if (lattice->carried[v])
            enter(carry, v);
}

void cut_carry_create(CutCarry *carry, const CutLattice *lattice, Vertices *vertices,
                      const char *name, Arena *arena)
{
    const int kept = lattice->kept_end, larger = lattice->element_count - lattice->level_first[1];
    *carry = (CutCarry){.lattice = lattice, .vertices = vertices};
    carry->leaf_of = ALLOCATE(ARENA_TOPOLOGY, kept, int, "elements of carried vertices");
    carry->site = ALLOCATE(ARENA_TOPOLOGY, kept, CarrySite, "sites of carried vertices");
    carry->next = ALLOCATE(ARENA_TOPOLOGY, kept, int, "next carried vertices");
    carry->first = ALLOCATE(ARENA_TOPOLOGY, larger, int, "first carried vertices");
    carry->need = ALLOCATE(ARENA_TOPOLOGY, larger, unsigned, "middles of carrying elements");
    carry->place = ALLOCATE(ARENA_TOPOLOGY, larger, int, "places of carrying elements");
    carry->leaf = ALLOCATE(ARENA_TOPOLOGY, larger, int, "carrying elements");
    carry->seen = ALLOCATE(ARENA_TOPOLOGY, larger, int, "updated elements");
    cut_carry_derive(carry);
}

// ---------------------------------------------------------------------------------------------
// Finest cells

unsigned cut_carry_cells(const CutLattice *lattice, const int point[3], int slot)
{
    int cell[8];
    unsigned broken = 0, cells = 0;
    for (int s = 0; s < 8; s++)
        cell[s] = cut_lattice_cell(lattice, point[0] - 1 + (s & 1), point[1] - 1 + (s >> 1 & 1),
                                   point[2] - 1 + (s >> 2));
    for (int f = 0; f < 12; f++) {
        const int low = cell[POINT_FACE[f]];
        broken |= (unsigned)(low >= 0 && cut_lattice_is_open(lattice, low, f / 4)) << f;
    }
    const PointParts parts = point_parts(cell, 0xff, broken);
    for (int s = 0; s < 8; s++)
        cells |= (unsigned)(parts.part[s] >= 0 && parts.part[s] == parts.part[slot]) << s;
    return cells;
}

int cut_carry_corner(const CutLattice *lattice, int cell, int corner)
{
    if (cut_lattice_is_leaf(lattice, cell))
        return lattice->corner[cell][corner];
    const CutScratch *scratch = lattice->scratch;
    const int *at = lattice->element[cell].cell;
    const int point[3] = {at[0] + (corner & 1), at[1] + (corner >> 1 & 1), at[2] + (corner >> 2)};
    const unsigned cells = cut_carry_cells(lattice, point, 7 - corner);
    // Its anchor is the lowest of its cells.
    int v = scratch->head[cut_parts_index(scratch, point)];
    while (v >= 0 && (cells == 0 || lattice->anchor[v] != __builtin_ctz(cells)))
        v = scratch->next[v];
    return v;
}
