// SPDX-License-Identifier: MIT
#include "voxel/cut/cut_centre.h"

void cut_centres_begin(CellCentres *centres, const CutLattice *lattice, const Rows *rows,
                       const void *row)
{
    centres->lattice = lattice;
    centres->rows = rows;
    centres->row = row;
    for (int level = 0; level <= VOXEL_LEVELS_MAX; level++)
        centres->element[level] = -1;
    for (int c = 0; c < 3; c++) {
        Vec3 axis = {c == 0, c == 1, c == 2};
        if (rows->turned)
            axis = quat_rotate(rows->frame->turn, axis);
        centres->turn[0][c] = axis.x, centres->turn[1][c] = axis.y, centres->turn[2][c] = axis.z;
    }
    const Vec3 origin = rows->frame->origin;
    centres->shift[0] = origin.x, centres->shift[1] = origin.y, centres->shift[2] = origin.z;
}

static inline Vec3 vertex_at(const CellCentres *centres, int vertex)
{
    const double *place = centres->rows->rest[vertex];
    if (centres->rows->precision == PRECISION_SINGLE) {
        const float *u = (const float *)centres->row + (long)vertex * ROW;
        return (Vec3){place[0] + (double)u[0], place[1] + (double)u[1], place[2] + (double)u[2]};
    }
    const double *u = (const double *)centres->row + (long)vertex * ROW;
    return (Vec3){place[0] + u[0], place[1] + u[1], place[2] + u[2]};
}

static Vec3 to_world(const CellCentres *centres, Vec3 p)
{
    const double(*m)[3] = centres->turn;
    return (Vec3){m[0][0] * p.x + m[0][1] * p.y + m[0][2] * p.z + centres->shift[0],
                  m[1][0] * p.x + m[1][1] * p.y + m[1][2] * p.z + centres->shift[1],
                  m[2][0] * p.x + m[2][1] * p.y + m[2][2] * p.z + centres->shift[2]};
}

void cut_fill_middles(Vec3 point[27], unsigned there)
{
    static const int step[3] = {1, 3, 9};
    for (int d = 0; d < 3; d++) // edges
        for (int k = 0; k < 4; k++) {
            const int at =
                step[d] + (k & 1) * 2 * step[(d + 1) % 3] + (k >> 1) * 2 * step[(d + 2) % 3];
            if (!(there >> at & 1))
                point[at] = vec3_scale(0.5, vec3_add(point[at - step[d]], point[at + step[d]]));
        }
    for (int d = 0; d < 3; d++) // faces
        for (int side = 0; side < 2; side++) {
            const int a = step[(d + 1) % 3], b = step[(d + 2) % 3], at = 2 * side * step[d] + a + b;
            if (!(there >> at & 1))
                point[at] = vec3_scale(0.25, vec3_add(vec3_add(point[at - a], point[at + a]),
                                                      vec3_add(point[at - b], point[at + b])));
        }
    Vec3 sum = {0.0, 0.0, 0.0};
    for (int c = 0; c < 8; c++)
        sum = vec3_add(sum, point[2 * (c & 1) + 6 * (c >> 1 & 1) + 18 * (c >> 2)]);
    point[13] = vec3_scale(0.125, sum);
}

// Computes the points of an element of level 1 or more that is a leaf or inside one.
static const Vec3 *find_points(CellCentres *centres, int element)
{
    const CutLattice *lattice = centres->lattice;
    const int level = lattice->element[element].level;
    Vec3 *point = centres->point[level];
    if (centres->element[level] == element)
        return point;
    unsigned there = 0;
    // A leaf has vertices; other elements take their corners from the points of their parent.
    if (cut_lattice_is_leaf(lattice, element)) {
        const int *node = cut_lattice_nodes(lattice, element);
        for (int n = 0; n < NODE_COUNT; n++) {
            if (node[n] < 0)
                continue;
            const int at = NODE_OFFSET[n][0] + 3 * NODE_OFFSET[n][1] + 9 * NODE_OFFSET[n][2];
            point[at] = vertex_at(centres, node[n]);
            there |= 1u << at;
        }
    } else {
        const int parent = cut_lattice_parent(lattice, element);
        const int child = cut_lattice_which(lattice, element);
        const Vec3 *above = find_points(centres, parent);
        for (int c = 0; c < 8; c++)
            point[2 * (c & 1) + 6 * (c >> 1 & 1) + 18 * (c >> 2)] =
                above[(c & 1) + (child & 1) + 3 * ((c >> 1 & 1) + (child >> 1 & 1)) +
                      9 * ((c >> 2) + (child >> 2))];
    }
    cut_fill_middles(point, there);
    centres->element[level] = element;
    return point;
}

Vec3 cut_centre(CellCentres *centres, int cell)
{
    const CutLattice *lattice = centres->lattice;
    Vec3 sum = {0.0, 0.0, 0.0};
    if (cut_lattice_is_leaf(lattice, cell)) {
        for (int c = 0; c < NODE_CORNERS; c++)
            sum = vec3_add(sum, vertex_at(centres, cut_lattice_nodes(lattice, cell)[c]));
        return to_world(centres, vec3_scale(0.125, sum));
    }
    const int parent = cut_lattice_parent(lattice, cell);
    const Vec3 *point = find_points(centres, parent);
    const int child = cut_lattice_which(lattice, cell);
    for (int c = 0; c < 8; c++)
        sum = vec3_add(sum, point[(c & 1) + (child & 1) + 3 * ((c >> 1 & 1) + (child >> 1 & 1)) +
                                  9 * ((c >> 2) + (child >> 2))]);
    return to_world(centres, vec3_scale(0.125, sum));
}

Vec3 cut_centres_vertex(const CellCentres *centres, int vertex)
{
    return to_world(centres, vertex_at(centres, vertex));
}

void cut_centres_grow(const CellCentres *centres, int cell, unsigned corners, Box *box)
{
    const CutLattice *lattice = centres->lattice;
    const int leaf = cut_lattice_leaf_of(lattice, cell);
    const int *node = cut_lattice_nodes(lattice, leaf);
    if (leaf != cell)
        corners = (1u << NODE_COUNT) - 1;
    for (; corners != 0; corners &= corners - 1) {
        const int n = __builtin_ctz(corners);
        if (node[n] >= 0)
            box_add(box, vertex_at(centres, node[n]));
    }
}
