// SPDX-License-Identifier: MIT
// Private to the blades of voxel bodies: one sweep in progress, and the links near it.
#ifndef PLIANT_VOXEL_CUT_CUT_NEAR_H
#define PLIANT_VOXEL_CUT_CUT_NEAR_H

#include "voxel/cut/cut_blade.h"
#include "voxel/cut/cut_centre.h"

// The search along one sweep.
typedef struct BladeSearch {
    CutBlades *blades;
    BladeMemory *memory;
    bool whole;   // a command: nothing is stored for the cells
    int now, was; // stamps of this tick and of the one before; -1: none
    CellCentres centres;
    int brick_count; // near the sweep
    double travel;   // see BladeStroke
    double margin;   // added around the sweep [m]
    bool lost;       // a cell is outside the representable range
    int stamp;       // of the codes
    // --- what the edge sweeps, in units of q ---
    Box box;
    double at[2][3], normal[2][3]; // planes of its two triangles
    double slack;                  // by which its sub-ticks lie off them at most
} BladeSearch;

// Forgets which cells a sweep has looked at.
void cut_near_forget_places(CutBlades *blades);
void cut_near_set_edge(BladeSearch *search, const CutPath edge[2]);
// Strokes: notes how far cells can have moved; finds the bricks near the sweep, whose ends are
// `from` and `to`; takes the centres of a brick's cells.
void cut_near_note_motion(BladeSearch *search, double tick, const void *row);
void cut_near_find_bricks(BladeSearch *search, const CutPoint from[2], const CutPoint to[2]);
void cut_near_look_at_brick(BladeSearch *search, int brick);
// Commands: computes the codes of all cells, with the edge set without shifts.
void cut_near_find_codes(BladeSearch *search);
// Commands: finds the leaves of a level that the sweep may meet, with the edge set without shifts.
int cut_near_find_larger(BladeSearch *search, int level, int *leaf);
// Returns the path of a cell's centre, after it was looked at.
CutPath cut_near_path(const BladeSearch *search, int cell);
// Returns cut_lattice_beyond as it was at load.
static inline int cut_near_beyond(const CutBlades *blades, int cell, int axis)
{
    return blades->beyond != NULL ? blades->beyond[cell][axis]
                                  : cut_lattice_across(blades->lattice, cell, 2 * axis + 1);
}
// LinkOffer; the model is a BladeSearch.
bool cut_near_offer(LinkFinder *links, void *model);

#endif
