// SPDX-License-Identifier: MIT
// Elements joined at lattice points (README.md, "Who shares which vertex"). A pure function of the
// leaves (point_parts.h): the cells around a lattice point that are connected through faces share
// one vertex, other cells have their own. A point in the middle of an element's edge or face has a
// vertex there as soon as one of the elements around has a corner there.
#ifndef PLIANT_VOXEL_LATTICE_MESH_H
#define PLIANT_VOXEL_LATTICE_MESH_H

#include "voxel/layout.h"
#include "voxel/template.h"

// malloc'ed; free with lattice_mesh_destroy.
typedef struct LatticeMesh {
    int element_count;               // = layout->leaf_count, in its order
    int (*vertex)[NODE_COUNT];       // [element] vertices by node; -1: absent
    int vertex_count, surface_count; // vertices on the outer faces come first
    int (*point)[3];                 // [vertex] lattice point, in cells
    int *id; // [vertex] stable: index of the lattice point, x fastest, in the (n + 1)^3 points of a
             // lattice of n^3 cells (those of lattice_count, for any levels); a further vertex at
             // the same point: + points * (its lowest slot among the 8 cells around, x + 2 y + 4 z)
    int *piece; // [vertex] parts that are not connected through faces, numbered by their lowest
                // element
    int piece_count;
    // Outer faces as triangles, two per square, counter-clockwise from outside; vertices below
    // surface_count. Triangles 2 q and 2 q + 1 are square q.
    int face_count;
    int (*face)[3];
    int (*face_neighbor)[3]; // across edge (k, k + 1); on an edge of four faces the one that
                             // belongs to the same solid corner
    int *face_element;       // [face] the element that it belongs to
} LatticeMesh;

// Creates the mesh. Within each of the two groups vertices are ordered by z, y, x of their point,
// then by their lowest slot. False with `status`: more points than an id can express.
bool lattice_mesh_create(LatticeMesh *mesh, const Layout *layout, Status *status);
void lattice_mesh_destroy(LatticeMesh *mesh);
// Orders the vertices of each group anew: first those that are corners of the coarsest blocks, then
// those of the next, and within these by coarsest block; vertices of one point stay together. So
// the rows that a body uses while its elements are large are few and adjacent.
void lattice_mesh_sort(LatticeMesh *mesh, int levels);
// Moves the vertices to an order: order[v] becomes vertex v; those on the outer faces stay first.
void lattice_mesh_order(LatticeMesh *mesh, const int *order);

// Returns the vertices of an outer square, counter-clockwise from outside; its triangles have the
// first three, and the first, third and fourth.
static inline void lattice_mesh_corners(const LatticeMesh *mesh, int square, int corner[4])
{
    const int(*triangle)[3] = (const int(*)[3])mesh->face + 2 * square;
    for (int k = 0; k < 3; k++)
        corner[k] = triangle[0][k];
    corner[3] = triangle[1][2];
}

#endif
