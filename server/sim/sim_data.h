// SPDX-License-Identifier: MIT
// Private to the module sim: the data of a Sim. sim.c makes it, inputs.c changes it, step.c
// runs it with cutting.c, follow.c and guard.c, time_step.c chooses the substeps.
#ifndef PLIANT_SIM_SIM_DATA_H
#define PLIANT_SIM_SIM_DATA_H

#include "base/vec.h"
#include "sim/hold/attachment.h"
#include "sim/load.h"
#include "sim/sim.h"
#include "sim/contact/stiffness.h"

enum {
    SIM_BODIES = 64,
    SIM_TOOLS = 32,
    SIM_SCENE_LOADS = 64,
    SIM_ATTACHMENTS = 64,
    SIM_TOUCHES = 64
};

// The time of a scene; plain data, part of the state.
typedef struct SimClock {
    int64_t step;      // ticks completed
    int64_t lockstep;  // 0 or 1: tools do not become stale
    int64_t next_load; // first of the scene's loads not yet started
} SimClock;

// Bodies connected by joints, or that touch, over any number of others, advance together stage by
// stage. Other bodies are groups of one.
typedef struct GroupMember {
    int first; // of the group, by index: itself if it is alone
    int next;  // in the group; -1: none
} GroupMember;

// --- all of it ---

typedef struct Ahead Ahead;             // ahead.h
typedef struct Cutting Cutting;         // cutting.h
typedef struct ErrorRounds ErrorRounds; // error.h
typedef struct Estimator Estimator;     // estimate.h
typedef struct EventRing EventRing;     // events.h
typedef struct Guard Guard;             // guard/guard.h
typedef struct Removing Removing;       // removing.h
typedef struct TiePool TiePool;         // hold/tie.h

struct Sim {
    // --- constant after sim_seal ---
    SimOptions options;
    Arena *arena;
    StateList *state;
    double tick; // [s]
    int body_count, tool_count, scene_load_count, contact_count;
    SimCounts capacity;      // capacities of the scene's own arrays
    GroupMember *group;      // [capacity.bodies]
    ToolOptions *tool;       // [capacity.tools]
    LoadOptions *scene_load; // [capacity.loads] by start
    int stage_count;
    StageId stage[STAGE_COUNT];
    int *pieces_at_load; // [body_count]
    void *start_state;   // packed copy of the state that sim_reset returns to

    // --- changes while running; what `state` lists ---
    SimClock *clock;
    Body *body;         // [capacity.bodies]
    ToolMotion *motion; // [tool_count]
    Contact **contact;  // [contact_count], tool by tool for each body
    int *contact_tool;  // [contact_count]
    int *contact_start; // [body_count + 1]
    LoadSet loads;
    Cutting *cutting;              // NULL: no body can be cut
    Removing *removing;            // NULL: nothing can be taken away
    Ahead *ahead;                  // NULL: no body looks ahead for tools
    Attachment **scene_attachment; // [capacity.attachments] as given
    int scene_attachment_count;
    Attachment **joint; // [joint_count] those to bodies, of the scene, then of ties
    int joint_count;
    Attachment **attachment; // [attachment_count] all others, of the scene, then graspers, for each
    int attachment_count;    // body; NULL: none
    int *attachment_start;   // [body_count + 1]
    GraspEvent *told;        // [attachment_count] grasps that sim_next_grasp has reported
    Touch **touch;           // [capacity.touches] as given
    int touch_count;
    Estimator *estimator;          // of the steps' error; NULL: disabled
    ErrorRounds *errors;           // of the whole error; NULL: nobody asks
    ErrorRounds *drive;            // of bodies that are driven by it; NULL: none
    StiffnessEstimator *stiffness; // NULL: disabled, or no contact has any
    TiePool *ties;                 // NULL: none by message

    // --- results of the last tick ---
    EventRing *events; // including earlier ones that were not taken
    Guard *guard;
    ToolWrench *wrench; // [tool_count]
    bool settling;      // loads wait, and tools do not become stale

    // --- accounting, since the start ---
    int64_t stage_ns[STAGE_COUNT];
    int64_t resets;
};

static inline bool in_one_group(const Sim *sim, int a, int b)
{
    return sim->group[a].first == sim->group[b].first;
}

#endif
