// SPDX-License-Identifier: MIT
// The outer faces of a lattice mesh; part of lattice_mesh.c. Also how a face of a cube is a square
// of two triangles.
#ifndef PLIANT_VOXEL_LATTICE_FACES_H
#define PLIANT_VOXEL_LATTICE_FACES_H

#include "base/check.h"
#include "voxel/lattice_mesh.h"

enum { SQUARE_DIRECTIONS = 6 }; // -x, +x, -y, +y, -z, +z
// Corners of the face in each direction, counter-clockwise from outside, starting at the lowest
// corner. The diagonal from the first to the third corner divides the square; it joins the lowest
// corner with the highest, so that two coinciding faces are divided alike.
extern const int SQUARE_CORNER[SQUARE_DIRECTIONS][4];
// Direction from the middle of the square to its edge between corners k and k + 1.
extern const int SQUARE_SIDE[SQUARE_DIRECTIONS][4];

// The edge of a square between its corners k and k + 1 is edge k of triangle 2 q (k = 0, 1) or edge
// k - 1 of triangle 2 q + 1 (k = 2, 3); the remaining edges, 2 and 0, are the diagonal.
enum { NEAR_DIAGONAL = 2, FAR_DIAGONAL = 0 };

static inline int square_triangle(int square, int k)
{
    return 2 * square + k / 2;
}

static inline int square_edge(int k)
{
    return k < 2 ? k : k - 1;
}

// An edge of a square: its edge k on the side `direction` of a cell.
typedef struct SquareEdge {
    int cell, direction, k;
} SquareEdge;

// Returns the cell that is connected to a cell across its face in a direction; -1: none.
typedef int SquareBeyond(const void *cells, int cell, int direction);
// Returns the same edge as part of the square that meets this one there, on the same solid corner:
// walks around it through the solid, to the side, outwards, back and down again, until a face leads
// to no cell. All cells around an edge are of one size.
static inline SquareEdge square_across(SquareBeyond *beyond, const void *cells, SquareEdge edge)
{
    const int side = SQUARE_SIDE[edge.direction][edge.k];
    const int turn[4] = {side, edge.direction, side ^ 1, edge.direction ^ 1};
    SquareEdge to = {.cell = edge.cell};
    int t = 0; // it ends at the latest at the other side of the square itself
    for (int next; (next = beyond(cells, to.cell, turn[t])) >= 0; t++) {
        ASSERT(t < 3);
        to.cell = next;
    }
    to.direction = turn[t];
    while (SQUARE_SIDE[to.direction][to.k] != turn[(t + 1) % 4])
        to.k++;
    return to;
}

// Fills the face arrays of a mesh whose vertices exist.
void lattice_faces_create(LatticeMesh *mesh, const Layout *layout);

#endif
