// Who shares which vertex: elements joined at lattice points (voxel.md 5.2). A pure function of the
// leaves (point_parts.h): around a lattice point the cells that lead to one another through faces
// share one vertex, others have their own. A point in the middle
// of an element's edge or face has a vertex there as soon as one of the elements around has a
// corner there.
#ifndef PLIANT_VOXEL_LATTICE_MESH_H
#define PLIANT_VOXEL_LATTICE_MESH_H

#include "voxel/layout.h"
#include "voxel/template.h"

// malloc'ed; lattice_mesh_destroy.
typedef struct LatticeMesh {
    int element_count;               // = layout->leaf_count, in its order
    int (*vertex)[NODE_COUNT];       // [element] by node; -1: not there
    int vertex_count, surface_count; // those on the outer faces come first
    int (*point)[3];                 // [vertex] lattice point, in cells
    int *id;                         // [vertex] stable: index of the lattice point, x fastest, in
                                     // the (n + 1)^3 points of a lattice of n^3 cells (those of
                                     // lattice_count, whatever the levels); a further vertex at
                                     // the same point: + points * (its lowest slot among the 8
                                     // cells around, x + 2 y + 4 z)
    int *piece;                      // [vertex] parts that no face joins, numbered by their
                                     // lowest element
    int piece_count;
    // Outer faces as triangles, two a square, counter-clockwise from outside; vertices below
    // surface_count. Triangles 2 q and 2 q + 1 are square q.
    int face_count;
    int (*face)[3];
    int (*face_neighbor)[3]; // across edge (k, k + 1); on an edge of four faces the one
                             // that belongs to the same solid corner
    int *face_element;       // [face] whose face it is
} LatticeMesh;

// Within each of the two groups vertices are in the order of z, y, x of their point, then of their
// lowest slot. False: more points than an id can tell.
bool lattice_mesh_create(LatticeMesh *mesh, const Layout *layout, Status *status);
void lattice_mesh_destroy(LatticeMesh *mesh);
unsigned lattice_mesh_mask(const LatticeMesh *mesh, int element); // Template.mask

#endif
