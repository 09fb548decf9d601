// SPDX-License-Identifier: MIT
#include "voxel/cut/cut_carry.h"

#include "base/check.h"
#include "body/rows_show.h"
#include "voxel/cut/cut_masses.h"
#include "voxel/cut/cut_parts.h"
#include "voxel/point_parts.h"

#include <stdlib.h>
#include <string.h>

enum { POINTS = 27, CENTRE = 13, EDGE_POINTS = 2 * CARRY_SHARES + 1 };
enum { AHEAD = 24 }; // vertices to be fetched ahead
static const int STEP[3] = {1, 3, 9};
static const signed char CORNER_AT[NODE_CORNERS] = {0, 2, 6, 8, 18, 20, 24, 26};

// ---------------------------------------------------------------------------------------------
// Where a point is in an element

// Returns the octant of a leaf in which a point is, its low corner, and how far it is from there,
// in parts of the octant's edge.
static int octant_of(const CutLattice *lattice, int leaf, const int point[3], int share[3])
{
    const CutElement *element = &lattice->element[leaf];
    int low = 0;
    for (int d = 0; d < 3; d++) {
        // There are two octants along each axis.
        const int at = (point[d] - element->cell[d]) * (2 * CARRY_SHARES) >> element->level;
        low += STEP[d] * (at / CARRY_SHARES);
        share[d] = at % CARRY_SHARES;
    }
    return low;
}

static CarrySite site_in(const CutLattice *lattice, int leaf, const int point[3])
{
    int share[3], step[2] = {0, 0}, axes = 0;
    const int low = octant_of(lattice, leaf, point, share);
    CarrySite site = {.above = 0};
    for (int d = 0; d < 3; d++) {
        site.cell[d] = (unsigned char)(point[d] - lattice->element[leaf].cell[d]);
        if (share[d] == 0)
            continue;
        if (axes < 2) {
            site.shares |= (unsigned char)(axes == 0 ? share[d] : share[d] * CARRY_SHARES);
            step[axes++] = STEP[d];
        } else {
            site.above = (signed char)STEP[d];
            site.third = (unsigned char)share[d];
        }
    }
    for (int k = 0; k < 4; k++)
        site.at[k] = (signed char)(low + (k & 1) * step[0] + (k >> 1) * step[1]);
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
    int shares[3];
    const int low = octant_of(lattice, leaf, point, shares);
    double w[POINTS] = {0.0};
    // Trilinear in the octant.
    for (int c = 0; c < 8; c++) {
        double part = 1.0;
        int at = low;
        for (int d = 0; d < 3; d++) {
            const double share = (double)shares[d] / CARRY_SHARES;
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

// Finds where the lattice points of an element are at rest, by axis and place in it.
static void find_rest(const CutCarry *carry, int leaf, double rest[3][EDGE_POINTS])
{
    const CutElement *element = &carry->lattice->element[leaf];
    for (int d = 0; d < 3; d++)
        for (int k = 0; k <= 1 << element->level; k++)
            rest[d][k] = cut_masses_rest(carry->masses, d, element->cell[d] + k);
}

typedef float SinglePart __attribute__((vector_size(16)));
typedef double DoublePart __attribute__((vector_size(16)));

#define REAL   float
#define PART   SinglePart
#define FILL   fill_single
#define PUT    put_single
#define UPDATE update_single
#define SHOW   show_single
#include "voxel/cut/cut_carry_rows.h"

#define REAL   double
#define PART   DoublePart
#define FILL   fill_double
#define PUT    put_double
#define UPDATE update_double
#define SHOW   show_double
#include "voxel/cut/cut_carry_rows.h"

static bool is_single(const CutCarry *carry)
{
    return carry->vertices->rows.precision == PRECISION_SINGLE;
}

static void find_by(const CutCarry *carry, const void *row, int leaf)
{
    if (is_single(carry))
        update_single(carry, leaf, row);
    else
        update_double(carry, leaf, row);
}

void cut_carry_find(CutCarry *carry, int leaf)
{
    unsigned *known = &carry->known[cut_lattice_row(carry->lattice, leaf)];
    if (*known != carry->now)
        find_by(carry, vertices_row(carry->vertices), leaf);
    *known = carry->now;
}

void cut_carry_snapshot(const CutCarry *carry, const int *to, float *position, float *velocity)
{
    if (is_single(carry))
        show_single(carry, to, position, velocity);
    else
        show_double(carry, to, position, velocity);
}

void cut_carry_update_some(CutCarry *carry, const void *row, const int *leaf, int count)
{
    for (int k = 0; k < count; k++) {
        find_by(carry, row, leaf[k]);
        // Not where they are between ticks.
        carry->known[cut_lattice_row(carry->lattice, leaf[k])] = carry->now - 1;
    }
}

int cut_carry_list(CutCarry *carry, const int *vertex, int count, int *leaf)
{
    int found = 0;
    carry->stamp++;
    for (int k = 0; k < count; k++) {
        if (!cut_lattice_is_carried(carry->lattice, vertex[k]))
            continue;
        const int own = carry->leaf_of[vertex[k]], row = cut_lattice_row(carry->lattice, own);
        if (carry->seen[row] != carry->stamp)
            leaf[found++] = own;
        carry->seen[row] = carry->stamp;
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

// True if it is known where a vertex was before the current change.
static bool is_known(const CutCarry *carry, int vertex)
{
    const int leaf = carry->leaf_of[vertex];
    return leaf >= 0 && carry->known[cut_lattice_row(carry->lattice, leaf)] == carry->now;
}

void cut_carry_note_move(CutCarry *carry, int vertex)
{
    const Vertices *vertices = carry->vertices;
    if (carry->move == NULL || !cut_lattice_is_kept(carry->lattice, vertex) ||
        carry->moved[vertex] > 0)
        return;
    const bool carried = carry->leaf_of[vertex] >= 0;
    if (carried && !is_known(carry, vertex))
        return; // it is beside no merge
    const void *row = carried ? carry->row : vertices_row(vertices);
    const Vec3 u = rows_vector(&vertices->rows, row, vertex, 0);
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
    for (int c = 0; c < 8; c++)
        points |= 1u << (site.at[c & 3] + (c >> 2) * site.above);
    for (int m = EDGES; m < MIDDLES; m++)
        if (points >> MIDDLE[m].at & 1)
            for (int side = -1; side <= 1; side += 2)
                points |= 1u << (MIDDLE[m].at + side * STEP[MIDDLE[m].a]) |
                          1u << (MIDDLE[m].at + side * STEP[MIDDLE[m].b]);
    for (int m = 0; m < MIDDLES; m++)
        need |= (points >> MIDDLE[m].at & 1) << m;
    return need | (points >> CENTRE & 1) << MIDDLES;
}

static void leave_list(CutCarry *carry, int row)
{
    if (row < 0 || carry->place[row] < 0)
        return;
    const int last = carry->leaf[--carry->leaf_count];
    carry->leaf[carry->place[row]] = last;
    carry->place[cut_lattice_row(carry->lattice, last)] = carry->place[row];
    carry->place[row] = -1;
}

// Finds the carried vertices of a leaf again.
static void settle(CutCarry *carry, int leaf)
{
    const CutLattice *lattice = carry->lattice;
    const int at = leaf - lattice->level_first[1], row = cut_lattice_row(lattice, leaf);
    int point[3], count = 0;
    carry->need[row] = 0;
    for (int k = carry->first[at]; k < carry->end[at]; k++) {
        const int v = carry->vertex[k];
        carry->leaf_of[v] = -1;
        carry->site[k].at[0] = -1;
        if (!lattice->carried[v])
            continue;
        cut_lattice_point(lattice, v, point);
        carry->leaf_of[v] = leaf;
        carry->site[k] = site_in(lattice, leaf, point);
        carry->need[row] |= middles_of(carry->site[k]);
        count++;
    }
    leave_list(carry, row);
    if (count == 0)
        return;
    carry->place[row] = carry->leaf_count;
    carry->leaf[carry->leaf_count++] = leaf;
}

// The same once in a change, of leaves that can carry.
static void settle_once(CutCarry *carry, int leaf)
{
    if (cut_parts_is_cell(carry->lattice, leaf))
        return;
    unsigned *seen = &carry->seen[cut_lattice_row(carry->lattice, leaf)];
    if (*seen != carry->stamp)
        settle(carry, leaf);
    *seen = carry->stamp;
}

// The same of the leaf that a kept vertex belongs to.
static void settle_of(CutCarry *carry, int vertex)
{
    const CutLattice *lattice = carry->lattice;
    if (vertex >= lattice->kept_end || carry->rank[vertex] < 0)
        return;
    settle_once(carry, cut_lattice_leaf_of(lattice, carry->cell[carry->rank[vertex]]));
}

void cut_carry_before(CutCarry *carry, int element)
{
    const bool merges = carry->move != NULL && carry->lattice->divided[element];
    CutBlocks around;
    cut_split_find_blocks(carry->lattice, element, &around);
    for (int b = 0; b < 64; b++) {
        const int leaf = around.leaf[b / 16][b / 4 % 4][b % 4];
        const int at = leaf - carry->lattice->level_first[1];
        if (leaf < 0 || at < 0 || carry->place[cut_lattice_row(carry->lattice, leaf)] < 0)
            continue;
        cut_carry_find(carry, leaf);
        for (int i = carry->first[at]; i < carry->end[at] && merges; i++)
            if (carry->leaf_of[carry->vertex[i]] >= 0)
                cut_carry_note_move(carry, carry->vertex[i]);
    }
}

bool cut_carry_give_back(CutCarry *carry, int vertex)
{
    const Vertices *vertices = carry->vertices;
    if (carry->leaf_of[vertex] < 0)
        return true; // it still has its row
    if (!is_known(carry, vertex))
        return false;
    for (long c = (long)vertex * ROW; c < ((long)vertex + 1) * ROW; c++)
        rows_put(&vertices->rows, vertices->row[vertices->current], c,
                 rows_get(&vertices->rows, carry->row, c));
    return true;
}

void cut_carry_follow(CutCarry *carry)
{
    const CutLattice *lattice = carry->lattice;
    const CutChanges *changes = &lattice->changes;
    carry->stamp++;
    // What is no leaf any more carries nothing.
    for (int i = 0; i < changes->element_count; i++) {
        const int element = changes->element[i], at = element - lattice->level_first[1];
        if (at < 0 || cut_lattice_is_leaf(lattice, element))
            continue;
        leave_list(carry, cut_lattice_row(lattice, element));
        for (int k = carry->first[at]; k < carry->end[at]; k++)
            carry->leaf_of[carry->vertex[k]] = -1;
    }
    for (int i = 0; i < changes->element_count; i++)
        if (cut_lattice_is_leaf(lattice, changes->element[i]))
            settle_once(carry, changes->element[i]);
    // Vertices that ended or came back may belong to leaves that have not changed.
    for (int i = 0; i < changes->ended_count; i++)
        settle_of(carry, changes->ended[i].vertex);
    for (int i = 0; i < changes->birth_count; i++)
        settle_of(carry, changes->birth[i].vertex);
    cut_carry_forget(carry);
}

int cut_carry_count(const CutCarry *carry)
{
    int count = 0;
    for (int v = 0; v < carry->lattice->kept_end; v++)
        count += carry->leaf_of[v] >= 0;
    return count;
}

void cut_carry_derive(CutCarry *carry)
{
    const CutLattice *lattice = carry->lattice;
    const int cells = lattice->level_first[1], larger = lattice->element_count - cells;
    memset(carry->place, -1, (size_t)lattice->most_larger * sizeof *carry->place);
    memset(carry->leaf_of, -1, (size_t)lattice->kept_end * sizeof *carry->leaf_of);
    carry->leaf_count = 0;
    for (int at = 0; at < larger; at++)
        if (carry->first[at] < carry->end[at] && cut_lattice_is_leaf(lattice, cells + at))
            settle(carry, cells + at);
    // A file may hold anything.
    for (int v = 0; v < lattice->kept_end; v++)
        if (carry->leaf_of[v] >= 0)
            vertices_clear(carry->vertices, v);
    cut_carry_forget(carry);
}

// ---------------------------------------------------------------------------------------------
// Load time: kept vertices by their cells

// Returns the cell that a kept vertex belongs to.
static int cell_of_kept(const CutLattice *lattice, int vertex)
{
    int point[3];
    cut_lattice_point(lattice, vertex, point);
    return cut_parts_cell_in(lattice, point, lattice->anchor[vertex]);
}

// Returns a cell's place on a curve that passes through each element at one go.
static uint64_t place_on_curve(const short cell[3])
{
    uint64_t place = 0;
    for (int bit = 20; bit >= 0; bit--)
        for (int d = 2; d >= 0; d--)
            place = place << 1 | (uint64_t)(cell[d] >> bit & 1);
    return place;
}

typedef struct CarryEntry {
    uint64_t place;
    int vertex, cell;
} CarryEntry;

static int compare_entries(const void *a, const void *b)
{
    const CarryEntry *x = a, *y = b;
    if (x->place != y->place)
        return x->place < y->place ? -1 : 1;
    return (x->vertex > y->vertex) - (x->vertex < y->vertex);
}

static void sort_vertices(CutCarry *carry)
{
    const CutLattice *lattice = carry->lattice;
    const int cells = lattice->level_first[1];
    CarryEntry *entry = malloc(((size_t)lattice->kept_end + 1) * sizeof *entry);
    int count = 0;
    ASSERT(entry != NULL);
    for (int v = 0; v < lattice->kept_end; v++) {
        carry->rank[v] = -1;
        if (!cut_lattice_is_kept(lattice, v))
            continue;
        const int cell = cell_of_kept(lattice, v);
        entry[count++] = (CarryEntry){place_on_curve(lattice->element[cell].cell), v, cell};
    }
    qsort(entry, (size_t)count, sizeof *entry, compare_entries);
    for (int k = 0; k < count; k++) {
        carry->vertex[k] = entry[k].vertex;
        carry->cell[k] = entry[k].cell;
        carry->rank[entry[k].vertex] = k;
        for (int e = cut_lattice_parent(lattice, entry[k].cell); e >= 0;
             e = cut_lattice_parent(lattice, e)) {
            if (carry->end[e - cells] == 0)
                carry->first[e - cells] = k;
            carry->end[e - cells] = k + 1;
        }
    }
    carry->vertex_count = count;
    free(entry);
}

static void list_weights(CutCarry *carry, const char *name, Arena *arena)
{
    carry->weight = arena_allocate(arena, ARENA_STEP, (size_t)CARRY_SHARES * CARRY_SHARES,
                                   sizeof *carry->weight, "%s/weights of carriers", name);
    for (int k = 0; k < CARRY_SHARES * CARRY_SHARES; k++)
        for (int c = 0; c < 4; c++) {
            const int a = k % CARRY_SHARES, b = k / CARRY_SHARES;
            carry->weight[k][c] =
                (float)((c & 1 ? a : CARRY_SHARES - a) * (c & 2 ? b : CARRY_SHARES - b)) /
                (CARRY_SHARES * CARRY_SHARES);
        }
}

void cut_carry_create(CutCarry *carry, const CutMasses *masses, const char *name, Arena *arena)
{
    const CutLattice *lattice = masses->lattice;
    Vertices *vertices = masses->vertices;
    const int kept = lattice->kept_end, larger = lattice->element_count - lattice->level_first[1];
    *carry = (CutCarry){.masses = masses, .lattice = lattice, .vertices = vertices};
    carry->vertex = ALLOCATE(ARENA_STEP, kept + 2 * AHEAD, int, "kept vertices by cells");
    carry->cell = ALLOCATE(ARENA_TOPOLOGY, kept, int, "cells of kept vertices");
    carry->rank = ALLOCATE(ARENA_TOPOLOGY, kept, int, "places of kept vertices");
    carry->first = ALLOCATE(ARENA_STEP, larger, int, "first kept vertices");
    carry->end = ALLOCATE(ARENA_STEP, larger, int, "last kept vertices");
    carry->leaf_of = ALLOCATE(ARENA_STEP, kept, int, "elements of carried vertices");
    carry->site = ALLOCATE(ARENA_STEP, kept, CarrySite, "sites of carried vertices");
    const int leaves = lattice->most_larger;
    carry->need = ALLOCATE(ARENA_STEP, leaves, unsigned, "middles of carrying elements");
    carry->place = ALLOCATE(ARENA_TOPOLOGY, leaves, int, "places of carrying elements");
    carry->leaf = ALLOCATE(ARENA_STEP, leaves, int, "carrying elements");
    carry->seen = ALLOCATE(ARENA_TOPOLOGY, leaves, unsigned, "elements that were looked at");
    carry->known = ALLOCATE(ARENA_STEP, leaves, unsigned, "elements with known vertices");
    carry->row = arena_allocate(arena, ARENA_STEP, ROW * (size_t)kept,
                                rows_real_size(&vertices->rows), "%s/carried rows", name);
    list_weights(carry, name, arena);
    sort_vertices(carry);
    cut_carry_derive(carry);
}

// ---------------------------------------------------------------------------------------------
// Finest cells

// Returns the slots that hold together with one while nothing is broken; 0: it is void.
static unsigned joined(unsigned solid, int slot)
{
    unsigned found = solid & 1u << slot, last = 0;
    while (found != last) { // across faces along x, y, z
        last = found;
        found |= ((found & 0x55) << 1 | (found & 0xaa) >> 1) & solid;
        found |= ((found & 0x33) << 2 | (found & 0xcc) >> 2) & solid;
        found |= ((found & 0x0f) << 4 | (found & 0xf0) >> 4) & solid;
    }
    return found;
}

unsigned cut_carry_cells(const CutLattice *lattice, const int point[3], int slot, int cell[8])
{
    unsigned broken = 0, cells = 0;
    cut_lattice_cells(lattice, point, cell);
    unsigned solid = 0, any = 0;
    for (int s = 0; s < 8; s++) {
        solid |= (unsigned)(cell[s] >= 0) << s;
        any |= cell[s] >= 0 ? lattice->broken[cell[s]] : 0U;
    }
    if (any == 0) // as a rule
        return joined(solid, slot);
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
        return cut_lattice_nodes(lattice, cell)[corner];
    const CutScratch *scratch = lattice->scratch;
    const short *at = lattice->element[cell].cell;
    const int point[3] = {at[0] + (corner & 1), at[1] + (corner >> 1 & 1), at[2] + (corner >> 2)};
    int around[8];
    const unsigned cells = cut_carry_cells(lattice, point, 7 - corner, around);
    // Its anchor is the lowest of its cells.
    int v = cut_parts_first(scratch, cut_parts_index(scratch, point));
    while (v >= 0 && (cells == 0 || lattice->anchor[v] != __builtin_ctz(cells)))
        v = scratch->next[v];
    return v;
}
