// SPDX-License-Identifier: MIT
#include "voxel/cut/cut_shape.h"

#include <string.h>

int cut_shape_count_parts(const CutLattice *lattice)
{
    int count = 0;
    for (int e = lattice->level_first[1]; e < lattice->element_count; e++)
        count += cut_shape_may_be_part(lattice, e);
    return count;
}

int cut_shape_cells(const CutLattice *lattice, int element)
{
    const CutElement *of = &lattice->element[element];
    if (!cut_shape_is_partial(lattice, element))
        return 1 << 3 * of->level;
    int cells = 0;
    for (int k = 0; k < __builtin_popcount(cut_lattice_children(lattice, element)); k++)
        cells += cut_shape_cells(lattice, cut_lattice_first_child(lattice, element) + k);
    return cells;
}

int cut_shape_solid(const void *of, int element, uint64_t *solid)
{
    const CutLattice *lattice = of;
    const CutElement *block = &lattice->element[element];
    const int edge = 1 << block->level;
    memset(solid, 0, (size_t)template_solid_words(block->level) * sizeof *solid);
    // Row by row; blocks lie within the rounded counts.
    for (int z = 0, bit = 0; z < edge; z++)
        for (int y = 0; y < edge; y++) {
            const long row = ((long)(block->cell[2] + z) * lattice->count[1] + block->cell[1] + y) *
                                 lattice->count[0] +
                             block->cell[0];
            for (int x = 0; x < edge; x++, bit++)
                solid[bit / 64] |= (uint64_t)(lattice->lut[0][row + x] >= 0) << bit % 64;
        }
    return block->level;
}
