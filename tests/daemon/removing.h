// SPDX-License-Identifier: MIT
// What a client of test_removing.c knows of its two bodies, a solid and a wall, from messages
// alone, and what always holds of that.
#ifndef PLIANT_TESTS_DAEMON_REMOVING_H
#define PLIANT_TESTS_DAEMON_REMOVING_H

#include "frames.h"
#include "lcm_client.h"

#include "pliant_event_t.h"
#include "pliant_ledger_t.h"
#include "pliant_status_t.h"

enum { BODIES = 2, TISSUES = 3, EVENTS = 8 }; // two tissues of the solid, and the wall
// A load of LOAD newtons for LOAD_TICKS gives a loose cell of 0.125 g so many m/s at most, and
// there is nothing that stops it before the next RESET. Numbers that have got lost go farther.
enum { LOAD = 4, LOAD_TICKS = 20 };
extern const char *const removing_body[BODIES], *const removing_event[EVENTS];

typedef enum Deed {
    CUT,
    STROKE,
    SUCTION,
    DRILL,
    DIATHERMY,
    TEAR,
    GRASP,
    PRESS,
    TIE,
    RESET,
    SAVE,
    DEEDS
} Deed;
extern const char *const removing_deed[DEEDS];

// What a front end keeps of a body.
typedef struct Follower {
    lcm_subscription_t *on[3];
    MeshFrame mesh, whole; // followed by deltas since the first whole one; the newest whole one
    NodesFrame nodes;
    int wholes, deltas, missed;
    double farthest; // node so far [m]
} Follower;

// One tissue of the ledger, [m3] or [m2].
typedef struct Tissue {
    bool there;
    double density, at_load, attached, cut_off, removed, coagulated;
} Tissue;

typedef struct Trial {
    Client *client;
    Follower follower[BODIES];
    pliant_status_t_subscription_t *on_status;
    pliant_ledger_t_subscription_t *on_ledger;
    // the newest status
    int64_t step;
    int pieces[BODIES], topology[BODIES];
    double mass[BODIES];
    // the newest ledger, and what it must not fall below
    Tissue tissue[TISSUES], before[TISSUES];
    double sections, distance; // of what was cut and torn [m2]; shortest to the region, or -1 [m]
    int ledgers;
    // what is done
    uint64_t random;
    int deed, next_reset; // numbers of deeds
    Deed now;
    int64_t reset_at; // step
    pliant_event_t_subscription_t *on_event;
    int64_t done[DEEDS], made[DEEDS],
        events[EVENTS]; // made: of
                        // cuts, loads and ties, those that did something
} Trial;

// Fails the test with what was being done unless the condition holds.
#define expect_of(trial, condition)                                                                \
    do {                                                                                           \
        if (!(condition))                                                                          \
            fail_msg("deed %d (%s), step %lld: not %s", (trial)->deed,                             \
                     removing_deed[(trial)->now], (long long)(trial)->step, #condition);           \
    } while (0)

// Subscribes the trial's client to all that is checked.
void removing_follow(Trial *trial);
void removing_unfollow(Trial *trial);
// Runs ticks in lockstep; returns the step.
int64_t removing_step(Trial *trial, int ticks);
// True once the messages of a step have come: frames, meshes, status and ledger agree.
bool removing_is_whole(const Trial *trial, int64_t step);
// Waits for the messages of a step, the last one, and fails the test unless all that always holds
// does.
void removing_check(Trial *trial, int64_t step);
// Fails the test unless the meshes of a client that came now are those that this one has followed.
void removing_check_followed(Trial *trial);

#endif
