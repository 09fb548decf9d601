// SPDX-License-Identifier: MIT
// Private to the module sim: strokes of blades, tearing, and what a body remembers of them.
#ifndef PLIANT_SIM_CUTTING_H
#define PLIANT_SIM_CUTTING_H

#include "sim/sim_data.h"

#define STEP_NEVER (INT64_MIN / 2) // long before the first

enum { STROKE_BROKEN = 1, STROKE_LIFTED };

// One blade in one body; plain data, part of the state.
typedef struct Stroke {
    CutStroke cut;
    int64_t separated, nodes_added; // since it began
    int64_t lifted; // the next motion starts another stroke, though the blade is active:
                    // STROKE_BROKEN off by the body, or STROKE_LIFTED
} Stroke;

// A body that can be cut or torn; plain data, part of the state.
typedef struct BodyCuts {
    int64_t pieces;
    int64_t torn, torn_nodes;            // not reported yet
    int64_t reported_step, refused_step; // last reports of a tear and of a refusal
} BodyCuts;

// The blades, strokes and cuttable bodies of a scene.
typedef struct Cutting {
    int blade_count, blade_tool[SIM_TOOLS]; // blades in the order of the tools
    BodyCuts *cuts[SIM_BODIES];             // NULL: neither cuttable nor tears
    Stroke *stroke[SIM_BODIES];             // [blade_count]; NULL likewise, or without blades
} Cutting;

// Load time, when all bodies and tools exist.
void cutting_create(Sim *sim);
void cutting_settled(Sim *sim);
void cutting_stage(Sim *sim);
void reconstruct_stage(Sim *sim);
// Ends the strokes of a withdrawn tool; its next motion is another stroke.
void cutting_lift(Sim *sim, int tool);
// Ends the strokes in a restored body: the jump of its links is no motion that a blade cuts.
void cutting_break_off(Sim *sim, int body);
// Reports a body that is in more pieces than before; 0: unknown.
void cutting_note_pieces(Sim *sim, int body, int pieces);
// True for a step in the past, or STEP_NEVER.
bool cutting_was(const Sim *sim, int64_t step);
// True if the state read from a checkpoint is consistent.
bool cutting_check(const Sim *sim);

#endif
