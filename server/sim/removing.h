// SPDX-License-Identifier: MIT
// Private to the module sim: tools that take tissue away, and what they took.
#ifndef PLIANT_SIM_REMOVING_H
#define PLIANT_SIM_REMOVING_H

#include "sim/sim_data.h"

// A remover; plain data, part of the state.
typedef struct Remover {
    int64_t on;    // 0 or 1: its pedal is down
    double credit; // of a rate: volume that may still be taken [m3]
} Remover;

// What a remover took from one body since its pedal went down; plain data, part of the state.
typedef struct Taking {
    int64_t removed;      // cells or faces
    double volume, area;  // [m3], [m2] at rest
    double mass;          // [kg]
    int64_t refused_step; // when a refusal was last reported
} Taking;

// What diathermy gave to it since then, and what of the body is coagulated; plain data, state.
typedef struct Heated {
    double joules, coagulated; // [J], [m3]
} Heated;

// The removers of a scene, and the bodies from which they can take.
typedef struct Removing {
    int count, tool[SIM_TOOLS]; // in the order of the tools
    Remover *remover;           // [count]
    Taking *taking[SIM_BODIES]; // [count]; NULL: nothing can be taken from the body
    Heated *heated[SIM_BODIES]; // [count]; NULL: nothing heats the body
} Removing;

// Load time, when all bodies and tools exist, after cutting_create. Leaves sim->removing NULL
// without a remover or a body from which it can take.
void removing_create(Sim *sim);
void removing_stage(Sim *sim);
// True if the state read from a checkpoint is consistent.
bool removing_check(const Sim *sim);

#endif
