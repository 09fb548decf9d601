// SPDX-License-Identifier: MIT
// Private to the module sim: what happened in a tick, until it is taken.
#ifndef PLIANT_SIM_EVENTS_H
#define PLIANT_SIM_EVENTS_H

#include "sim/sim_data.h"

// Events that have not been taken yet.
typedef struct EventRing {
    SimEvent event[SIM_EVENTS]; // a ring
    int first, count;
} EventRing;

// Appends an event. `kind` is a literal.
void sim_report(Sim *sim, int body, const char *kind, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

#endif
