// SPDX-License-Identifier: MIT
#include "voxel_coarse.h"

#include "base/check.h"
#include "scoped.h"

#include <stdlib.h>
#include <string.h>

// What is being built.
typedef struct Coarse {
    const Lattice *lattice;
    int count[3]; // cells, in whole blocks of the coarsest level
    int *level;   // [cell] of the element that covers it; -1: void
    int *leaf;    // [cell] element, in void too where its block reaches there; -1: none
    Layout *layout;
    LatticeMesh *mesh;
} Coarse;

static bool is_solid(const Lattice *lattice, int i, int j, int k)
{
    const int *n = lattice->count;
    return i >= 0 && j >= 0 && k >= 0 && i < n[0] && j < n[1] && k < n[2] &&
           lattice->label[((long)k * n[1] + j) * n[0] + i] > 0;
}

static bool is_inside(const Coarse *c, const int cell[3])
{
    for (int d = 0; d < 3; d++)
        if (cell[d] < 0 || cell[d] >= c->count[d])
            return false;
    return true;
}

static long cell_at(const Coarse *c, const int cell[3])
{
    return ((long)cell[2] * c->count[1] + cell[1]) * c->count[0] + cell[0];
}

// The n-th cell of a block of `edge` cells a side.
static void cell_of_block(const int low[3], int edge, int n, int cell[3])
{
    cell[0] = low[0] + n % edge;
    cell[1] = low[1] + n / edge % edge;
    cell[2] = low[2] + n / edge / edge;
}

void voxel_coarse_solid(const Lattice *lattice, const Leaf *leaf, uint64_t *solid)
{
    const int edge = 1 << leaf->level;
    memset(solid, 0, (size_t)template_solid_words(leaf->level) * sizeof *solid);
    for (int n = 0; n < edge * edge * edge; n++) {
        int cell[3];
        cell_of_block(leaf->cell, edge, n, cell);
        solid[n / 64] |= (uint64_t)is_solid(lattice, cell[0], cell[1], cell[2]) << n % 64;
    }
}

// --- elements ---

static bool hangs_together(const Coarse *c, const int low[3], int edge)
{
    const int all = edge * edge * edge;
    FREED bool *solid = zeroed((size_t)all, sizeof *solid);
    FREED int *queue = zeroed((size_t)all, sizeof *queue);
    int count = 0, reached = 0, end = 0;
    for (int n = 0; n < all; n++) {
        int cell[3];
        cell_of_block(low, edge, n, cell);
        solid[n] = is_solid(c->lattice, cell[0], cell[1], cell[2]);
        count += solid[n];
        if (solid[n] && end == 0)
            queue[end++] = n;
    }
    if (count == 0)
        return false;
    solid[queue[0]] = false;
    for (; reached < end; reached++)
        for (int d = 0, step = 1; d < 3; d++, step *= edge)
            for (int up = -1; up <= 1; up += 2) {
                const int at = queue[reached] / step % edge + up, n = queue[reached] + up * step;
                if (at < 0 || at >= edge || !solid[n])
                    continue;
                solid[n] = false;
                queue[end++] = n;
            }
    return reached == count;
}

// True if all solid cells of a block are of elements of this level at least.
static bool is_coarse(const Coarse *c, const int low[3], int edge, int level)
{
    for (int n = 0; n < edge * edge * edge; n++) {
        int cell[3];
        cell_of_block(low, edge, n, cell);
        if (is_inside(c, cell) && c->level[cell_at(c, cell)] >= 0 &&
            c->level[cell_at(c, cell)] < level)
            return false;
    }
    return true;
}

static void merge_level(Coarse *c, int level, bool (*may)(const int cell[3], int level))
{
    const int edge = 1 << level, all = edge * edge * edge,
              cells = c->count[0] * c->count[1] * c->count[2];
    FREED int *merged = zeroed((size_t)cells, sizeof *merged);
    memcpy(merged, c->level, (size_t)cells * sizeof *merged);
    int low[3];
    for (low[2] = 0; low[2] < c->count[2]; low[2] += edge)
        for (low[1] = 0; low[1] < c->count[1]; low[1] += edge)
            for (low[0] = 0; low[0] < c->count[0]; low[0] += edge) {
                // Of the children's size, all around.
                const int around[3] = {low[0] - edge / 2, low[1] - edge / 2, low[2] - edge / 2};
                if ((may != NULL && !may(low, level)) || !hangs_together(c, low, edge) ||
                    !is_coarse(c, around, 2 * edge, level - 1))
                    continue;
                for (int n = 0; n < all; n++) {
                    int cell[3];
                    cell_of_block(low, edge, n, cell);
                    if (c->level[cell_at(c, cell)] >= 0)
                        merged[cell_at(c, cell)] = level;
                }
            }
    memcpy(c->level, merged, (size_t)cells * sizeof *merged);
}

static void list_leaves(Coarse *c)
{
    Layout *layout = c->layout;
    int at[3];
    for (at[2] = 0; at[2] < c->count[2]; at[2]++)
        for (at[1] = 0; at[1] < c->count[1]; at[1]++)
            for (at[0] = 0; at[0] < c->count[0]; at[0]++) {
                const int level = c->level[cell_at(c, at)], edge = level < 0 ? 0 : 1 << level;
                if (level < 0 || c->leaf[cell_at(c, at)] >= 0)
                    continue;
                Leaf *leaf = &layout->leaf[layout->leaf_count];
                *leaf = (Leaf){.level = (unsigned char)level, .material = 1};
                for (int d = 0; d < 3; d++)
                    leaf->cell[d] = at[d] / edge * edge;
                for (int n = 0; n < edge * edge * edge; n++) {
                    int cell[3];
                    cell_of_block(leaf->cell, edge, n, cell);
                    c->leaf[cell_at(c, cell)] = layout->leaf_count;
                }
                layout->leaf_count++;
            }
}

// --- vertices ---

// True if two solid cells meet across the face of the smaller of two elements, of which `cell`,
// below the face, is in the lower one.
static bool meets(const Coarse *c, int lower, int upper, int axis, const int cell[3])
{
    const Leaf *a = &c->layout->leaf[lower], *b = &c->layout->leaf[upper];
    const Leaf *small = a->level <= b->level ? a : b;
    const int edge = 1 << small->level, u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int n = 0; n < edge * edge; n++) {
        int at[3], beyond[3];
        at[axis] = cell[axis];
        at[u] = small->cell[u] + n % edge;
        at[v] = small->cell[v] + n / edge;
        memcpy(beyond, at, sizeof beyond);
        beyond[axis]++;
        if (is_solid(c->lattice, at[0], at[1], at[2]) &&
            is_solid(c->lattice, beyond[0], beyond[1], beyond[2]))
            return true;
    }
    return false;
}

// Returns the node of an element at a point; -1: none, -2: not even half an edge.
static int node_of(const Leaf *leaf, const int point[3])
{
    int o[3];
    for (int d = 0; d < 3; d++) {
        const int twice = 2 * (point[d] - leaf->cell[d]);
        if (twice % (1 << leaf->level) != 0)
            return -1;
        o[d] = twice >> leaf->level;
    }
    return node_at_offset(o[0], o[1], o[2]);
}

static void add_vertex(Coarse *c, const int point[3], const int leaf[8], const int part[8], int of)
{
    bool has = false;
    int node[8];
    for (int s = 0; s < 8; s++) {
        node[s] = part[s] == of ? node_of(&c->layout->leaf[leaf[s]], point) : -1;
        has = has || (node[s] >= 0 && node[s] < NODE_CORNERS);
    }
    if (!has)
        return;
    LatticeMesh *mesh = c->mesh;
    memcpy(mesh->point[mesh->vertex_count], point, sizeof *mesh->point);
    for (int s = 0; s < 8; s++)
        if (node[s] >= 0)
            mesh->vertex[leaf[s]][node[s]] = mesh->vertex_count;
    mesh->vertex_count++;
}

// The parts of the elements around a point that hold together there, by their lowest slot.
static void visit_point(Coarse *c, const int point[3])
{
    int leaf[8], part[8];
    for (int s = 0; s < 8; s++) {
        const int cell[3] = {point[0] - 1 + (s & 1), point[1] - 1 + (s >> 1 & 1),
                             point[2] - 1 + (s >> 2)};
        leaf[s] = is_inside(c, cell) ? c->leaf[cell_at(c, cell)] : -1;
        part[s] = leaf[s] >= 0 ? s : -1;
    }
    for (int round = 0; round < 8; round++)
        for (int s = 0; s < 8; s++)
            for (int t = 0; t < 8; t++) {
                const int d = (s ^ t) == 1 ? 0 : (s ^ t) == 2 ? 1 : (s ^ t) == 4 ? 2 : -1;
                if (leaf[s] < 0 || leaf[t] < 0 || part[s] <= part[t])
                    continue;
                bool joined = leaf[s] == leaf[t];
                if (!joined && d >= 0) {
                    const int low = s < t ? s : t;
                    const int cell[3] = {point[0] - 1 + (low & 1), point[1] - 1 + (low >> 1 & 1),
                                         point[2] - 1 + (low >> 2)};
                    joined = meets(c, leaf[low], leaf[s ^ t ^ low], d, cell);
                }
                if (joined)
                    part[s] = part[t];
            }
    for (int s = 0; s < 8; s++)
        if (part[s] == s)
            add_vertex(c, point, leaf, part, s);
}

void voxel_coarse_create(const Lattice *lattice, int level,
                         bool (*may)(const int cell[3], int level), Layout *layout,
                         LatticeMesh *mesh)
{
    Coarse c = {.lattice = lattice, .layout = layout, .mesh = mesh};
    *layout = (Layout){.levels = level};
    *mesh = (LatticeMesh){0};
    long cells = 1, points = 1;
    for (int d = 0; d < 3; d++) {
        layout->lattice_count[d] = lattice->count[d];
        layout->count[d] = c.count[d] = ((lattice->count[d] - 1) / (1 << level) + 1) << level;
        cells *= c.count[d];
        points *= c.count[d] + 1;
    }
    c.level = zeroed((size_t)cells, sizeof *c.level);
    c.leaf = zeroed((size_t)cells, sizeof *c.leaf);
    layout->leaf = zeroed((size_t)cells, sizeof *layout->leaf);
    for (long i = 0; i < cells; i++) {
        const int n = (int)(i % c.count[0]), m = (int)(i / c.count[0] % c.count[1]);
        c.level[i] = is_solid(lattice, n, m, (int)(i / c.count[0] / c.count[1])) ? 0 : -1;
        c.leaf[i] = -1;
    }
    for (int l = 1; l <= level; l++)
        merge_level(&c, l, may);
    list_leaves(&c);
    // Up to eight vertices at a point.
    mesh->element_count = layout->leaf_count;
    mesh->vertex = zeroed((size_t)mesh->element_count, sizeof *mesh->vertex);
    memset(mesh->vertex, -1, (size_t)mesh->element_count * sizeof *mesh->vertex);
    mesh->point = zeroed((size_t)(8 * points), sizeof *mesh->point);
    int at[3];
    for (at[2] = 0; at[2] <= c.count[2]; at[2]++)
        for (at[1] = 0; at[1] <= c.count[1]; at[1]++)
            for (at[0] = 0; at[0] <= c.count[0]; at[0]++)
                visit_point(&c, at);
    free(c.level);
    free(c.leaf);
}
