// Private to the blades of voxel bodies: a sweep that is being looked at.
#ifndef PLIANT_VOXEL_CUT_CUT_BLADE_PARTS_H
#define PLIANT_VOXEL_CUT_CUT_BLADE_PARTS_H

#include "voxel/cut/cut_blade.h"
#include "voxel/cut/cut_centre.h"

// One sweep that is being looked at.
typedef struct BladeSearch {
    CutBlades *blades;
    BladeMemory *memory;
    bool whole;   // a command: nothing is remembered of the cells
    bool coded;   // it is near what blades->near_code says, not boxes
    int now, was; // stamps of this tick and of the one before; -1: none
    CellCentres centres;
    int brick_count; // near the sweep
    double travel;   // see BladeStroke
    double margin;   // that is kept around the sweep [m]
    bool lost;       // a cell is beyond what can be told
    int stamp;       // of the codes
    bool met_broken;
    // --- the edge in this sub-tick ---
    CutPath edge[2];
    double low[3], high[3];        // its box, in q
    double at[2][3], normal[2][3]; // planes of its two triangles
    double normal_size[2][3];      // sizes of the products that add up to the normals
} BladeSearch;

// cut_near.c: what may be near a sweep, and where it is.
void cut_near_note_motion(BladeSearch *search, double tick, const void *row);
// Of a stroke, the bricks near it, by boxes; `from`, `to`: the ends of the edge.
void cut_near_find_bricks(BladeSearch *search, const CutPoint from[2], const CutPoint to[2]);
bool cut_near_brick_may_meet(const BladeSearch *search, int brick);
// Of a command in one part, codes of all cells, with the edge set to what it is without shifts.
void cut_near_find_codes(BladeSearch *search);
static inline bool cut_near_link_may_meet(const BladeSearch *search, int cell, int beyond)
{
    const unsigned both = search->blades->near_code[cell] & search->blades->near_code[beyond];
    return (both & 0x3f) == 0 && ((both & 0xc0) == 0 || (both & 0x300) == 0);
}
void cut_near_look_at(BladeSearch *search, int cell);
void cut_near_look_at_brick(BladeSearch *search, int brick);

// cut_sweep.c: the edge's way through a tick, in sub-ticks.
void cut_sweep_set_edge(BladeSearch *search, const CutPath edge[2]);
// `used`: its ends where the tick before left them; `base`: the way without shifts. Where it stands
// on an answer that hangs on nothing but rounding its end is shifted, in the first sub-tick of a
// stroke its start as well, and the sub-tick is done again. False: unresolved.
bool cut_sweep_parts(BladeSearch *search, const CutPath base[2], CutPoint used[2], bool fresh,
                     int64_t *tries, int parts);

#endif
