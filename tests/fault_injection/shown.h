// SPDX-License-Identifier: MIT
// What a viewer would show of one body: frames whose mesh is known, put together by the clients'
// own assembler, each remembered as a number, so that two viewers of the same daemon can be
// compared.
#ifndef PLIANT_TESTS_FAULT_INJECTION_SHOWN_H
#define PLIANT_TESTS_FAULT_INJECTION_SHOWN_H

#include "frames.h"

#include <lcm/lcm.h>

enum { SHOWN_MOST = 1 << 14 };

typedef struct Shown {
    MeshFrame mesh;
    NodesFrame nodes;
    uint64_t *hash; // [SHOWN_MOST] of the frame with this sequence, modulo SHOWN_MOST; 0: not shown
    int64_t count;  // shown
    int64_t whole;  // frames that came whole, shown or not
    int64_t meshes; // whole meshes and deltas taken
    int32_t begun;  // sequence of the first frame of which something came
    lcm_subscription_t *on[3];
    lcm_t *lcm;
} Shown;

// Listens to `body` under the prefix PLIANT on a connection that outlives it. The handlers run
// where the connection is handled.
Shown *shown_create(lcm_t *lcm, const char *body);
void shown_destroy(Shown *shown);
// How many frames both have shown; -1 when one of them was not the same.
int64_t shown_compare(const Shown *one, const Shown *other);

#endif
