// SPDX-License-Identifier: MIT
// Rest shapes of the elements of a cuttable body: whole cubes, and in a body that adapts partly
// filled ones.
#ifndef PLIANT_VOXEL_CUT_CUT_SHAPE_H
#define PLIANT_VOXEL_CUT_CUT_SHAPE_H

#include "voxel/cut/cut_lattice.h"
#include "voxel/template.h"

// True if some cells of an element were void at load. Only of a body that adapts such elements are
// leaves, and never with a cell that has gone.
static inline bool cut_shape_is_partial(const CutLattice *lattice, int element)
{
    return lattice->adapts && !lattice->element[element].whole;
}
// True if a larger element is, and can be a leaf.
static inline bool cut_shape_may_be_part(const CutLattice *lattice, int element)
{
    return cut_shape_is_partial(lattice, element) && lattice->element[element].mergeable;
}
// Returns how many such elements there are.
int cut_shape_count_parts(const CutLattice *lattice);

// Returns the key of a leaf's shape (template.h).
static inline TemplateKey cut_shape_key(const CutLattice *lattice, int element)
{
    if (element < lattice->level_first[1])
        return 0;
    const unsigned mask = template_mask_of(cut_lattice_nodes(lattice, element));
    return cut_shape_is_partial(lattice, element) ? template_key_of_part(mask, element) : mask;
}

// Returns the number of an element's cells that were solid at load.
int cut_shape_cells(const CutLattice *lattice, int element);
// As TemplateSolid, of a lattice.
int cut_shape_solid(const void *lattice, int element, uint64_t *solid);

#endif
