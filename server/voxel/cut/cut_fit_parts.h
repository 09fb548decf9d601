// SPDX-License-Identifier: MIT
// Private to the smooth surface of cut bodies: what its files share.
#ifndef PLIANT_VOXEL_CUT_CUT_FIT_PARTS_H
#define PLIANT_VOXEL_CUT_CUT_FIT_PARTS_H

#include "voxel/cut/cut_carry.h"
#include "voxel/cut/cut_fit.h"

static inline bool cut_fit_is_node(const CutFit *fit, int vertex)
{
    return fit->faces->slot_of[vertex] >= 0 && fit->lattice->anchor[vertex] >= 0;
}

// Finds what is around a point: finest cells, also those in larger leaves if all their corners are
// vertices, which they are for ever; else the leaf; -1: void.
void cut_fit_around(const CutFit *fit, CutMoved *at);
// Returns the vertex at a corner of a finest cell.
static inline int cut_fit_corner(const CutFit *fit, int cell, int corner)
{
    return fit->lattice->adapts ? cut_carry_corner(fit->lattice, cell, corner)
                                : cut_lattice_nodes(fit->lattice, cell)[corner];
}
// Returns the vertex at a point of a cell around it; -1: void, or a leaf of several cells.
static inline int cut_fit_vertex_of(const CutFit *fit, const CutMoved *at, int slot)
{
    const int leaf = at->leaf[slot];
    return leaf < 0 || leaf >= fit->faces->cell_count ? -1 : cut_fit_corner(fit, leaf, 7 - slot);
}

// cut_fit_fade.c. Lets the nodes of a point start from where they, or what they were part of, are
// shown.
void cut_fit_start_fades(CutFit *fit, const void *row, const CutMoved *at);
// Lets nodes whose vertices a merge has moved start from where they are shown.
void cut_fit_fade_moves(CutFit *fit, const void *row);
// Counts the vertices with the newest fade again.
void cut_fit_count_newest(CutFit *fit);
// Lists a vertex whose fade has begun, unless there are too many.
void cut_fit_list_fade(CutFit *fit, int vertex);
// Drops fades that have ended, and writes the others for clients.
void cut_fit_write_fades(CutFit *fit);

#endif
