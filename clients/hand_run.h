// Runs a hand (hand.h) against a live daemon: a thousand ticks a second, poses out and forces in
// through whoever owns the tool; one run, or a table of streams. One thread.
#ifndef PLIANT_CLIENTS_HAND_RUN_H
#define PLIANT_CLIENTS_HAND_RUN_H

#include "client.h"
#include "hand.h"

#include "pliant_contact_t.h"

typedef struct HandRun {
    Client *client;
    void (*send)(void *user, const double position[3], const double linear[3], bool twist);
    void *user;
    double touch[3], direction[3];   // as Hand
    int cycles;                      // that count
    bool active;                     // contacts are wanted
    int64_t start_ns, forces, stiff; // forces heard; those that told a stiffness
    Hand hand;
} HandRun;

// A contact of the tool has come, while messages are handled.
void hand_run_hear(HandRun *run, const pliant_contact_t *contact);
// Rests at the point of touch, then moves; the figures are in run->hand. False: stopped, or the
// connection broke.
bool hand_run(HandRun *run, const HandOptions *options, ClientError *error);
// One line of what came of it.
void hand_run_print(const HandRun *run);
// Streams of 1 kHz and 60 Hz, prompt and 20 ms late, with losses, interpolated and by twist, with
// and without stiffness, at 2 and 6 Hz; depth and the device's force as in `like`.
bool hand_run_table(HandRun *run, const HandOptions *like, ClientError *error);

#endif
