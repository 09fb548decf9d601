// Private to the blades of voxel bodies: one sweep in progress.
#ifndef PLIANT_VOXEL_CUT_CUT_BLADE_PARTS_H
#define PLIANT_VOXEL_CUT_CUT_BLADE_PARTS_H

#include "voxel/cut/cut_blade.h"
#include "voxel/cut/cut_centre.h"

// The search along one sweep.
typedef struct BladeSearch {
    CutBlades *blades;
    BladeMemory *memory;
    bool whole;   // a command: nothing is stored for the cells
    bool coded;   // nearness is decided by blades->near_code, not by boxes
    int now, was; // stamps of this tick and of the one before; -1: none
    CellCentres centres;
    int brick_count; // near the sweep
    double travel;   // see BladeStroke
    double margin;   // added around the sweep [m]
    bool lost;       // a cell is outside the representable range
    int stamp;       // of the codes
    bool met_broken;
    // --- the edge in the current sub-tick ---
    CutPath edge[2];
    Box box;                       // its box, in units of q
    double at[2][3], normal[2][3]; // planes of its two triangles
    double normal_size[2][3];      // magnitudes of the products that the normals sum
} BladeSearch;

// cut_near.c: what may be near a sweep, and where it is.
void cut_near_note_motion(BladeSearch *search, double tick, const void *row);
// Strokes: finds the bricks near the sweep by boxes; `from`, `to`: the ends of the edge.
void cut_near_find_bricks(BladeSearch *search, const CutPoint from[2], const CutPoint to[2]);
bool cut_near_brick_may_meet(const BladeSearch *search, int brick);
// Commands in one part: computes the codes of all cells, with the edge set without shifts.
void cut_near_find_codes(BladeSearch *search);
static inline bool cut_near_link_may_meet(const BladeSearch *search, int cell, int beyond)
{
    const unsigned both = search->blades->near_code[cell] & search->blades->near_code[beyond];
    return (both & 0x3f) == 0 && ((both & 0xc0) == 0 || (both & 0x300) == 0);
}
void cut_near_look_at(BladeSearch *search, int cell);
void cut_near_look_at_brick(BladeSearch *search, int brick);

// cut_sweep.c: the motion of the edge through a tick, in sub-ticks.
void cut_sweep_set_edge(BladeSearch *search, const CutPath edge[2]);
// Processes all sub-ticks. `used`: the edge's ends where the last tick left them; `base`: the path
// without shifts. Where a result depends on rounding alone the end of the edge is shifted, in the
// first sub-tick of a stroke its start as well, and the sub-tick is repeated. False: unresolved.
bool cut_sweep_parts(BladeSearch *search, const CutPath base[2], CutPoint used[2], bool fresh,
                     int64_t *tries, int parts);

#endif
