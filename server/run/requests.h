// SPDX-License-Identifier: MIT
// Executes the requests of other programs on a running scene. Called by the step thread between two
// ticks; offline runs call requests_execute too. Allocates nothing.
#ifndef PLIANT_RUN_REQUESTS_H
#define PLIANT_RUN_REQUESTS_H

#include "run/exchange.h"

typedef struct Loop Loop;

// Executes the waiting requests in order and answers each, within their share of the clock: ticks
// with a rate to keep get at least half of it, and the other requests stay in the ring. Returns
// true if the next request is a STEP: the caller runs its ticks, then calls requests_finish_step.
bool requests_take(Loop *loop);
void requests_finish_step(Loop *loop);
// Takes a checkpoint image if one is due and the last one has been written.
void requests_checkpoint(Loop *loop);
// Waits for the last image to be written and takes the final one; called at the end of the loop.
void requests_last_checkpoint(Loop *loop);
// Records an input as applied at the current tick, for --log-inputs.
void requests_log(Loop *loop, const Input *input);
// Records there that the daemon stood still, which is no input: a replay only reports it.
void requests_log_stop(Loop *loop, double seconds);
// The governor of the time budget, in scenes with adaptive bodies. requests_govern runs at the end
// of each real-time tick, which began at `begin_ns`; requests_release restores full
// detail when no time is measured. Their changes are SETs, logged like a client's.
void requests_govern(Loop *loop, int64_t begin_ns, int64_t tick_ns);
void requests_release(Loop *loop);
// Sends the bus an event; body -1: none in particular.
void requests_event(Loop *loop, int body, const char *kind, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
// Sends the bus the events of the simulation itself: strokes, tears, pieces.
void requests_report(Loop *loop);

// True for what requests_execute knows: cuts, loads, ties, SET and RESET. Other commands are the
// loop's.
bool requests_change_scene(const Input *input);
// Executes a cut, load, RESET or SET on the scene, live or offline. Sets `ok`, `text` and the
// counts of a cut in the answer; returns `ok`. If false, nothing was changed and `text` says why;
// else `text` says what was done.
bool requests_execute(Sim *sim, const Input *input, Answer *answer);

#endif
