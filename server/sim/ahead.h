// SPDX-License-Identifier: MIT
// Private to the module sim: where tools will be soon, and where bodies are held, loaded or
// touched, for bodies that are finer there (BodyOps.approach). Step thread.
#ifndef PLIANT_SIM_AHEAD_H
#define PLIANT_SIM_AHEAD_H

#include "sim/sim_data.h"

// The rest is for tools.
enum { AHEAD_PLACES = APPROACH_MOST / 2 };

// Where something acts on a body all the time; plain data, part of the state.
typedef struct AheadPlaces {
    int64_t count;
    Approach place[AHEAD_PLACES];
} AheadPlaces;

// What bodies that look ahead need.
typedef struct Ahead {
    AheadPlaces *places[SIM_BODIES]; // NULL: the body does not look ahead
    int *found;                      // [nodes of the largest of them] scratch
} Ahead;

// Load time, when all bodies and tools exist. Leaves sim->ahead NULL if no body looks ahead.
void ahead_create(Sim *sim);
// Tells a body with BodyOps.approach what approaches it; before it adapts, in each tick. A function
// of the state alone.
void ahead_tell(Sim *sim, int body);
// True if the state read from a checkpoint is consistent.
bool ahead_check(const Sim *sim);

// Adds one to a list of at most `most`: a full list unites it with the one that grows least by it.
// Returns the number in the list.
int ahead_add(Approach *list, int count, int most, const Approach *approach);
// Covers a box with capsules, at most `most`: strips along its longest side, four finest cells of a
// size [m] wide if there are not too many, if it is flat half of one thick beyond its shortest
// side. Returns their number; 0: the box is empty.
int ahead_cover(const Box *box, double size, bool flat, int most, Approach *list);

#endif
