// The outer faces of a lattice mesh; part of lattice_mesh.c. Also how a face of a cube is a square
// of two triangles.
#ifndef PLIANT_VOXEL_LATTICE_FACES_H
#define PLIANT_VOXEL_LATTICE_FACES_H

#include "voxel/lattice_mesh.h"

enum { SQUARE_DIRECTIONS = 6 }; // -x, +x, -y, +y, -z, +z
// Corners of the face in each direction, counter-clockwise from outside, starting at the lowest
// corner. The diagonal from the first to the third corner divides the square; it joins the lowest
// corner with the highest, so that two coinciding faces are divided alike.
extern const int SQUARE_CORNER[SQUARE_DIRECTIONS][4];

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

// Returns the direction from the middle of a square to its edge k.
int square_side(int direction, int k);

// Fills the face arrays of a mesh whose vertices exist.
void lattice_faces_create(LatticeMesh *mesh, const Layout *layout);

#endif
