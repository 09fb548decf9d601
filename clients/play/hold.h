// SPDX-License-Identifier: MIT
// Holds the prefix like a server (claim_t; server/run/bus_claim.c): asks before the start whether a
// server publishes there, answers those that ask, and gives way to one that has held it for longer.
// A server moves with the poses that a player publishes, so both must never share a prefix. One
// thread, the one that connected.
#ifndef PLIANT_PLAY_HOLD_H
#define PLIANT_PLAY_HOLD_H

#include "client.h"

enum { HOLD_OWN = 16 };

typedef struct Hold {
    Client *client;
    int64_t number;   // random: who we are
    int64_t question; // open; 0: none
    int64_t since_ns; // held since (CLOCK_MONOTONIC); 0: not yet
    int64_t asked_ns;
    int64_t own[HOLD_OWN]; // utimes of our newest statuses, by which we know them
    unsigned statuses;     // published
    bool taken;            // another server answered before the start
    bool lost;             // to one that has held the prefix for longer: end
} Hold;

// Asks for a quarter of a second. Returns false with a sentence if the prefix is taken.
bool hold_take(Hold *hold, Client *client, PliantError *error);
// Notes a status before it is published.
void hold_note_status(Hold *hold, int64_t utime);

#endif
