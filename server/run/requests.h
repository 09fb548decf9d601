// What the requests of other programs do to a running scene. Called by the step thread between two
// ticks; requests_execute also by the off-line runner. Allocates nothing.
#ifndef PLIANT_RUN_REQUESTS_H
#define PLIANT_RUN_REQUESTS_H

#include "run/loop.h"

// Executes the waiting requests in their order and answers each. True: the next one is a STEP, its
// ticks are to be run now, then requests_finish_step.
bool requests_take(Loop *loop);
void requests_finish_step(Loop *loop);

// Takes a checkpoint image if one is wanted and the last one has been written.
void requests_checkpoint(Loop *loop);
// At the end of the loop: waits for the last one to be written and takes the final image.
void requests_last_checkpoint(Loop *loop);

// Notes an input as applied at the present tick, for --log-inputs.
void requests_log(Loop *loop, const Input *input);
// The governor of the time budget, where some body adapts: at the end of each tick in real time,
// which took `tick_ns`; and all detail again, as it must be where no time is measured. What they
// change they change by SET, logged like anybody's.
void requests_govern(Loop *loop, int64_t tick_ns);
void requests_release(Loop *loop);
// Tells the bus of something that happened once; body -1: none in particular.
void requests_event(Loop *loop, int body, const char *kind, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

// Tells the bus of what happened in the simulation itself: strokes, tears, pieces.
void requests_tell(Loop *loop);

// A cut, load, RESET or SET on the scene, live or off line. Sets `ok` and `text` of the answer, and
// the counts of a cut; returns `ok`. False: nothing was changed, and `text` says why; else what was
// done.
bool requests_execute(Sim *sim, const Input *input, Answer *answer);

#endif
