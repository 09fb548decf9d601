// What the operating system and the processor must do for a real-time thread.
#ifndef PLIANT_RUN_REALTIME_H
#define PLIANT_RUN_REALTIME_H

#include "base/status.h"
#include "base/team.h"

#include <pthread.h>

// Denormal numbers become zero on the calling thread: a decaying body runs much slower without.
// Every computing thread calls it, settling included, so that all of them give the same bits; the
// workers of a team begin with the setting of the thread that starts them.
void realtime_flush_denormals(void);
// Locks all memory and gives `thread` SCHED_FIFO. Where that is not permitted: goes on and logs one
// warning that says what to grant.
void realtime_request(pthread_t thread);
// Starts the workers of a step that has several threads, each on a processor of its own and with
// SCHED_FIFO where `live`. Where there are too few processors, it logs a warning and starts fewer.
// `team` may be NULL. False with a sentence: a thread did not start.
bool realtime_start_team(Team *team, bool live, Status *status);
// Gives the thread that computes the step the processor that the workers left.
void realtime_pin_step(const Team *team, pthread_t step);
// The calling thread gives up SCHED_FIFO, or takes it again where that is permitted.
void realtime_pause(void);
void realtime_resume(void);

#endif
