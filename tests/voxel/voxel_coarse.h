// SPDX-License-Identifier: MIT
// Elements and vertices of a solid whose surface is coarse, too, from scratch and with no regard to
// time: what bodies that adapt must come to, once.
#ifndef PLIANT_TESTS_VOXEL_COARSE_H
#define PLIANT_TESTS_VOXEL_COARSE_H

#include "voxel/lattice_mesh.h"
#include "voxel/layout.h"

// Merges from level 0 up to `level`: a block becomes one element if it has a solid cell, its solid
// cells hang together through faces, `may` allows it (NULL: always), and it would differ from no
// neighbour, across a corner only too, by more than one level. One material. Sets the layout's
// leaves and counts, and the mesh's elements, vertices and points; malloc'ed.
//
// Vertices as in lattice_mesh.h, but two elements hold together only where two solid cells meet
// across their common face; a part of a point has a vertex if the point is a corner of one of its
// elements, also in void.
void voxel_coarse_create(const Lattice *lattice, int level,
                         bool (*may)(const int cell[3], int level), Layout *layout,
                         LatticeMesh *mesh);
// Writes the solid cells of an element, as for template_create_partial.
void voxel_coarse_solid(const Lattice *lattice, const Leaf *leaf, uint64_t *solid);

#endif
