// Which faces of a voxel body a blade breaks: those whose link, between the centres of two finest
// cells, meets the blade's edge while both move (dynamics/cut_exact.h). Centres are quantised once:
// where a cell's was at the end of a tick is where the next tick begins, remembered for the cells
// around each blade.
//
// Far bricks of cells (windows of level 0) are passed over by boxes around all their links. A box
// is kept, and taken for larger by what anything can have moved since it was made, until that would
// bring the brick near.
//
// Step thread, but for the functions said to be of load time.
#ifndef PLIANT_VOXEL_CUT_CUT_BLADE_H
#define PLIANT_VOXEL_CUT_CUT_BLADE_H

#include "dynamics/cut.h"
#include "dynamics/rows.h"
#include "voxel/cut/cut_lattice.h"

typedef struct BladeBox {
    double low[3], high[3]; // world [m]
    double made;            // BladeStroke.travel then; negative: never
} BladeBox;

// What is remembered from tick to tick; part of the state.
typedef struct BladeStroke {
    int64_t under_way; // 0 or 1
    int64_t fresh;     // no sub-tick was done yet: the beginning may still be shifted
    int64_t now;       // ticks of this stroke, from 1
    CutPoint edge[2];  // its ends as they were last used
    double travel;     // that anything can have moved since the stroke began [m]
} BladeStroke;

typedef struct BladeMemory {
    BladeStroke *stroke;
    int (*centre)[3]; // [cell] in q, at the end of tick `stamp`
    int *stamp;       // [cell] 0: never in this stroke
    BladeBox *box;    // [brick]
} BladeMemory;

typedef struct CutBlades {
    const CutLattice *lattice;
    const Rows *rows;
    int cell_count, brick_count;
    double size;      // of a cell [m]
    double q;         // [m]
    int (*beyond)[3]; // [cell] cut_lattice_beyond by axis; constant
    int blade_count;
    BladeMemory *blade; // [blade_count]

    // --- the last answer ---
    int (*hit)[2]; // [hit_count] {cell, axis}, in the order found
    int hit_count;

    // --- scratch ---
    unsigned char *hit_bits;     // [cell] bit d: its face towards +d is among them
    BladeMemory whole;           // of commands
    int (*before)[3];            // [cell] where it was when the tick began, in q
    int *code_stamp;             // [cell] for which its code holds
    unsigned char *code;         // [cell]
    int last_code;               // stamp
    unsigned short *vertex_code; // [vertex] on which sides of a command's sweep
    unsigned short *near_code;   // [cell] on which all of its element is
    int *brick;                  // [brick_count] that the sweep may meet
    int64_t looked_at;           // links, since the start
} CutBlades;

// Load time.
void cut_blades_create(CutBlades *blades, const char *name, const CutLattice *lattice,
                       const Rows *rows, double size, Arena *arena);
// Load time, as BodyOps.reserve_blades.
void cut_blades_reserve(CutBlades *blades, const char *name, int count, Arena *arena,
                        StateList *state);
// The unbroken faces that the sweep breaks, into blades->hit; `row` is the present one, `tick` [s].
// Nothing of the body is touched. True when there are any; else outcome->verdict says why not.
// Fills `verdict` and `separated` alone.
bool cut_blades_find(CutBlades *blades, const void *row, double tick, const CutSweep *sweep,
                     CutOutcome *outcome);
// The hits could not be carried out: the stroke begins anew where the edge is.
void cut_blades_refused(CutBlades *blades, const void *row, const CutSweep *sweep);
// The body is somewhere else: strokes begin anew.
void cut_blades_forget(CutBlades *blades);
// Makes whatever was read from a file harmless.
void cut_blades_restored(CutBlades *blades);

#endif
