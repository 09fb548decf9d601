// SPDX-License-Identifier: MIT
// Finds the faces of a voxel body that a blade breaks (README.md, "Links"): those whose link,
// between the centres of two finest cells, meets the blade's edge while both move
// (body/cut_exact.h). Centres are quantised once: a tick starts with the points at which the
// last one ended, which are stored for the cells around each blade.
//
// Boxes around all links of a brick of cells (a window of level 0) exclude bricks that are far
// away. A box is kept, and enlarged by the distance that anything can have moved since it was
// computed, until that would make the brick near.
//
// Step thread, except the functions marked as load time.
#ifndef PLIANT_VOXEL_CUT_CUT_BLADE_H
#define PLIANT_VOXEL_CUT_CUT_BLADE_H

#include "body/cut.h"
#include "body/rows.h"
#include "geometry/box.h"
#include "voxel/cut/cut_cross.h"
#include "voxel/cut/cut_lattice.h"

// The box of the links of a brick.
typedef struct BladeBox {
    Box world;   // [m]
    double made; // BladeStroke.travel when it was computed; negative: never
} BladeBox;

// The state of a stroke from tick to tick; part of the body's state.
typedef struct BladeStroke {
    int64_t under_way; // 0 or 1
    int64_t fresh;     // no sub-tick was done yet: the start may still be shifted
    int64_t now;       // ticks of this stroke, from 1
    CutPoint edge[2];  // its ends as last used
    double travel;     // longest distance that anything can have moved since the stroke began [m]
} BladeStroke;

typedef struct BladeMemory {
    BladeStroke *stroke;
    int (*centre)[3]; // [cell] in units of q, at the end of tick `stamp`
    int *stamp;       // [cell] 0: never in this stroke
    BladeBox *box;    // [brick]
} BladeMemory;

typedef struct CutBlades {
    const CutLattice *lattice;
    const Rows *rows;
    int cell_count, brick_count;
    double size;      // of a cell [m]
    LinkFinder links; // link 3 cell + axis is that towards +axis
    int (*beyond)[3]; // [cell] cut_lattice_beyond by axis; constant. NULL: looked up
    int blade_count;
    BladeMemory *blade; // [blade_count]

    // --- result of the last call ---
    int (*hit)[2];           // [hit_count, hit_most at most] {cell, axis}, in the order found
    int hit_count, hit_most; // for more broken faces there can be no vertices
    CutCrossing *crossing;   // [hit_most] where they were met; NULL: not wanted

    // --- scratch ---
    int *larger; // larger elements that a command may meet; NULL: the body does not adapt
    // Cells that a sweep has looked at, where not every cell has its own place.
    int *cell_at;                // [place_most] cell of a place
    int *place_at;               // [2^place_bits] place of a cell, by hash; -1: free. NULL: its own
    int place_bits;              // twice as many as places
    int place_count, place_most; // as many as there are cells
    BladeMemory whole;           // [place] memory for commands
    int (*before)[3];            // [place] centre at the start of the tick, in units of q
    int *code_stamp;             // [place] stamp for which its code is valid
    unsigned char *code;         // [place]
    int last_code;               // stamp
    unsigned short *vertex_code; // [vertex] outside which sides of a command's sweep
    unsigned short *near_code; // [cell] sides that its whole element is outside of. NULL: those of
                               // each leaf are found when they are needed
    int *brick;                // [brick_count] bricks that the sweep may meet
} CutBlades;

// Load time. The arena owns the arrays.
void cut_blades_create(CutBlades *blades, const char *name, const CutLattice *lattice,
                       const Rows *rows, double size, Arena *arena);
// Load time: BodyOps.reserve_blades.
void cut_blades_reserve(CutBlades *blades, const char *name, int count, Arena *arena,
                        StateList *state);
// Load time: also find where links are met.
void cut_blades_want_crossings(CutBlades *blades, const char *name, Arena *arena);
// Finds the unbroken faces that the sweep breaks, in blades->hit; `row`: the current rows, `tick`
// [s]. The body is not changed. True if there are any; otherwise outcome->verdict has the reason.
// Only sets `verdict` and `separated`.
bool cut_blades_find(CutBlades *blades, const void *row, double tick, const CutSweep *sweep,
                     CutOutcome *outcome);
// In a body that adapts: finds the leaves of a level that a command's sweep may meet, in
// blades->larger. Returns how many.
int cut_blades_find_larger(CutBlades *blades, const void *row, const CutSweep *sweep, int level);
// Call it when the lattice has changed: merging moves the centres of cells, which division does
// not.
void cut_blades_follow(CutBlades *blades);
// Call it when the body is elsewhere: all strokes start again.
void cut_blades_forget(CutBlades *blades);
// Validates memory that was read from a file, and clears it if it is invalid.
void cut_blades_restored(CutBlades *blades);

#endif
