// SPDX-License-Identifier: MIT
// Which elements of a body that adapts should be finer, and which may merge. Elements near the
// paths of tools (body/approach.h) are divided before the tools are there, as many in a tick as a
// budget allows, and those that a tool is about to touch at once; elements that nothing needs any
// more merge, a few in a tick, where that moves nothing by more than a twentieth of a cell.
//
// A path wants elements of the finest cells, or those of an eighth of its radius where that is
// more, within REACHES radii of its axis, at least NEAR_CELLS cells, and SKIN_CELLS beyond its
// surface. A sweep looks for them whenever a path has moved by half a cell, and every SWEEP_TICKS
// ticks. It looks only at bricks of 64 elements of the coarsest level whose boxes are near a path.
//
// All of it follows from the state, by counts, never by clocks. Step thread, except
// cut_adapt_create.
#ifndef PLIANT_VOXEL_CUT_CUT_ADAPT_H
#define PLIANT_VOXEL_CUT_CUT_ADAPT_H

#include "body/body.h"
#include "geometry/box.h"
#include "voxel/cut/cut_lattice.h"
#include "voxel/cut/cut_masses.h"

enum {
    ADAPT_BUDGET = 16, // divisions or merges in a tick
    ADAPT_URGENT = 64, // divisions in a tick of what tools are about to touch
    ADAPT_WISHES = ADAPT_BUDGET + ADAPT_URGENT,
};

// Plain data, part of the state.
typedef struct AdaptState {
    int64_t age;   // ticks since the last sweep
    int64_t waits; // 1: it left elements to be divided, or their children
    int64_t next;  // element at which the search for merges goes on
    int64_t brick; // whose box is made next
    int64_t count; // paths of the last sweep
    Approach swept[APPROACH_MOST];
    double scale;    // BODY_ADAPT_SCALE: divides how far around paths elements are fine
    int64_t finest;  // BODY_ADAPT_LEVEL: levels by which elements may be finer than the coarsest
    double error;    // BODY_ADAPT_ERROR; 0: the body is not driven by it
    double fineness; // BODY_ADAPT_FINENESS
} AdaptState;

// The box around a brick when it was made, in the rows' coordinates [m]; part of the state.
typedef struct AdaptBox {
    float low[3], high[3];
} AdaptBox;

// A leaf that should be divided.
typedef struct AdaptWish {
    int element;
    bool urgent;
    bool free;       // nothing acts on it from outside
    double distance; // from the surface of the tool [m]
} AdaptWish;

typedef struct CutAdapt {
    // --- constant ---
    CutLattice *lattice;
    const CutMasses *masses;
    const Rows *rows;
    double size;                  // of a cell [m]
    bool driven;                  // by its error
    int brick_first, brick_count; // windows of the coarsest level

    // --- part of the state ---
    AdaptState *state;
    AdaptBox *box; // [brick_count]

    // --- follows from the lattice ---
    uint64_t *family; // a bit for each element above level 0: it is divided, its children are
                      // leaves, and it may merge

    // --- of the tick ---
    const int *stressed; // leaves under so much stress that they and those around them should be of
    int stressed_count;  // the finest level; 0 unless set before cut_adapt_step, which clears it
    uint64_t *is_stressed;       // as `family`: a leaf below is stressed; empty between ticks
    Box axis[APPROACH_MOST];     // of a sweep: around the axes of paths
    double reach[APPROACH_MOST]; // how far they reach [m]
    int approach_count;
    Approach approach[APPROACH_MOST]; // in the rows' coordinates
    int wish_count, wished;           // kept, the most pressing first; found
    AdaptWish wish[ADAPT_WISHES];
    int merge_count, merge[ADAPT_BUDGET];
    bool free; // nothing acts from outside on what was divided; until the next change

    // --- since the start ---
    int64_t divided, merged, refused;
} CutAdapt;

// Load time. Of an adapting lattice, whose masses know their vertices. `error`:
// BodyOptions.adapt_error.
void cut_adapt_create(CutAdapt *adapt, CutLattice *lattice, const CutMasses *masses, double error,
                      const char *name, Arena *arena, StateList *state);
// BodyOps.approach, of paths in the world.
void cut_adapt_approach(CutAdapt *adapt, const Approach *approach, int count);
// Divides or merges leaves for a tick, from the rows at its start. Returns how many; `merged`: they
// merged. What follows from the lattice is left to the caller.
int cut_adapt_step(CutAdapt *adapt, const void *row, bool *merged);
// BodyOps.set and get, of the BODY_ADAPT_ parameters that are not of walls. False for others.
bool cut_adapt_set(CutAdapt *adapt, BodyParameter parameter, double value);
bool cut_adapt_get(const CutAdapt *adapt, BodyParameter parameter, double *value);
// Returns by how many levels the finest element in use is finer than the coarsest.
int cut_adapt_finest(const CutAdapt *adapt);
// Updates what follows from the lattice after changes, before they are forgotten.
void cut_adapt_follow(CutAdapt *adapt);
// Derives it again, after the lattice was. False: an impossible state.
bool cut_adapt_derive(CutAdapt *adapt);

#endif
