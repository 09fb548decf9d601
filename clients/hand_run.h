// SPDX-License-Identifier: MIT
// Runs a hand (hand.h) against a live daemon: a thousand ticks per second, poses out and forces in
// through the owner of the tool; one run, or a table of streams. One thread.
#ifndef PLIANT_CLIENTS_HAND_RUN_H
#define PLIANT_CLIENTS_HAND_RUN_H

#include "hand.h"
#include "program.h"

typedef struct HandRun {
    // `now_ns`: when this tick was to be
    void (*send)(void *user, int64_t now_ns, const double position[3], const double linear[3],
                 bool twist);
    bool (*wait)(void *user, int64_t until_ns); // handles messages; false: stopped, or broken
    void *user;
    double touch[3], direction[3];   // as in Hand
    int cycles;                      // counted cycles
    bool active;                     // contacts are taken
    int64_t start_ns, forces, stiff; // forces received; those with a stiffness
    Hand hand;
} HandRun;

// Takes a contact of the tool; called while messages are handled.
void hand_run_hear(HandRun *run, const PliantContact *contact);
// Rests at the point of contact, then moves; the figures are in run->hand. Returns false if it was
// stopped or the connection broke.
bool hand_run(HandRun *run, const HandOptions *options, PliantError *error);
// Prints the result in one line.
void hand_run_print(const HandRun *run);
// Runs streams of 1 kHz and 60 Hz, prompt and 20 ms late, with losses, interpolated and by twist,
// with and without stiffness, at 2 and 6 Hz; depth and the device's force as in `like`.
bool hand_run_table(HandRun *run, const HandOptions *like, PliantError *error);

#endif
