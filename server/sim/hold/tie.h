// SPDX-License-Identifier: MIT
// Private to the module sim: ties that messages make (tie.c), their memory and what calls them.
#ifndef PLIANT_SIM_TIE_H
#define PLIANT_SIM_TIE_H

#include "sim/sim_data.h"

// One tie; plain data, part of the state. All zero: the slot is free.
typedef struct TieRecord {
    int64_t number;              // from 1
    int64_t kind;                // TieKind
    int64_t body, to_body, tool; // indices, or -1
    double stiffness, damping_ratio;
    double break_force; // [N]; 0: never
    double closing;     // of a clip: how fast its gap closes [m/s]
} TieRecord;

// All memory of a scene's ties. A slot is an attachment while it is used.
typedef struct TiePool {
    int capacity; // slots
    int room;     // nodes that each may hold
    TieRecord *record;
    Attachment **slot; // [capacity] reserved

    // --- what the scene has without ties, constant ---
    GroupMember *group; // [body_count]
    Attachment **own;   // of the scene, and graspers, for each body
    int *own_start;     // [body_count + 1]
    int joint_count;

    // --- follows from the state ---
    bool *live;               // [capacity] used, and its state is consistent
    double *lambda, *damping; // [body_count] what ties add to the bounds: [1/s2], [1/s]

    // --- scratch, for the largest body ---
    TieScratch shared;
    int *found;           // [node slots]
    int *face;            // [TIE_FACES] on which ends may be
    Vec3 *corner;         // [3 TIE_FACES] of them
    uint64_t *mark_face;  // one bit per face: all 0 between calls
    int *id;              // [state rows]
    Vec3 *x, *v;          // [state rows]
    double *share, *root; // [node slots] sums of g, and of 2 zeta sqrt(g)
} TiePool;

// Reserves the pool. Load time, when all that the scene itself attaches exists.
void ties_create(Sim *sim);
// Returns the most entries that the ties can push on a body in one evaluation.
int ties_node_capacity(const Sim *sim);
// Recomputes what follows from the state: which ties act, groups and time steps.
// Returns the largest sum of their stiffness at one node.
double ties_follow(Sim *sim);
// Recomputes what ties add to the bounds of the bodies, after a change of topology; returns
// likewise.
double ties_bound(Sim *sim);
void ties_begin_tick(Sim *sim);
// Ends the ties that have pulled harder than they may.
void ties_stage(Sim *sim);
// True if the state is consistent, after ties_follow.
bool ties_check(const Sim *sim);
int64_t ties_refused(const Sim *sim);

#endif
