// SPDX-License-Identifier: MIT
// The ledger of a run: what became of the tissue of the bodies that can be cut, drawn up from their
// accounts by the step thread or an offline run. Plain data in the form of a recording, from which
// the bus makes its message, so that file and message have the same numbers.
#ifndef PLIANT_RUN_LEDGER_H
#define PLIANT_RUN_LEDGER_H

#include "io/recording.h"
#include "scene/scene.h"
#include "sim/sim.h"

enum { LEDGER_HZ = 20 }; // most often, while it changes

typedef struct Ledger {
    int count;
    RecordingLedger line[]; // bodies, then tissues, then regions
} Ledger;

// When the newest ledger was drawn up.
typedef struct LedgerClock {
    bool on;         // some body has an account
    int64_t version; // of the accounts
    int64_t visits;  // to regions
    int64_t step;
    bool drawn;
} LedgerClock;

// Returns the bytes of a ledger of this run; 0: no body has an account.
size_t ledger_bytes(Sim *sim, const Scene *scene);
// Starts the clock.
LedgerClock ledger_clock(Sim *sim);
// True if a ledger is due: it changed, and the last one is old enough, or `now`. Time that passes
// in regions makes one due once a second.
bool ledger_is_due(LedgerClock *clock, Sim *sim, bool now);
// Draws it up. Between two ticks; allocates nothing.
void ledger_draw(Ledger *ledger, Sim *sim, const Scene *scene);

#endif
