// SPDX-License-Identifier: MIT
// The change of forces by divisions comes over some ticks. A bent element that is divided is softer
// at once, and its new vertices are not where they would be at rest: it sends a wave through the
// body, which a tool feels. So forces on the vertices around make up for the change at first: they
// go on as in the tick before; then these forces fade. They have no resultant and no moment.
//
// Step thread, except cut_release_create.
#ifndef PLIANT_VOXEL_CUT_CUT_RELEASE_H
#define PLIANT_VOXEL_CUT_CUT_RELEASE_H

#include "voxel/cut/cut_masses.h"

enum { RELEASE_FORCES = 8192 };

// A force on a vertex, in the rows' axes, when it began [N]. Plain data, part of the state.
typedef struct ReleaseForce {
    int vertex;
    int left; // ticks until it is gone: those of one tick end together
    float force[3];
} ReleaseForce;

typedef struct CutRelease {
    const CutMasses *masses;
    // --- part of the state ---
    int64_t *count;
    int64_t *known;      // 1: `before` is of the begin of the last tick; 0: it is zero
    float (*before)[3];  // [vertex] velocity of those that elements have, in the rows' axes [m/s]
    ReleaseForce *force; // [count] those that end first come first
    // --- within a tick ---
    int begun; // those from here on are mass times acceleration before a division, until the first
               // evaluation
    int ticks; // that a force acts
    double tick; // [s]
} CutRelease;

// Load time.
void cut_release_create(CutRelease *release, const CutMasses *masses, const char *name,
                        Arena *arena, StateList *state);
// Begins a tick [s]: forces fade.
void cut_release_begin(CutRelease *release, double tick);
// After cut_masses_follow. `divided`: by adaptation, where nothing from outside acts.
void cut_release_follow(CutRelease *release, bool divided);
// After the changes of a tick, before its motion. `soon`: a tool may come.
void cut_release_note(CutRelease *release, bool soon);
// Adds the forces, after those of the elements. `gravity`: in the rows' axes [m/s2].
void cut_release_add(CutRelease *release, Vec3 gravity);
// Drops all forces. `whole`: the rows have changed otherwise than in a tick, too.
void cut_release_forget(CutRelease *release, bool whole);
// False: an impossible state.
bool cut_release_check(const CutRelease *release);

#endif
