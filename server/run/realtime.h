// What the operating system and the processor must do for a real-time thread.
#ifndef PLIANT_RUN_REALTIME_H
#define PLIANT_RUN_REALTIME_H

#include <pthread.h>

// Denormal numbers become zero on the calling thread: a decaying body runs much slower without.
// Every computing thread calls it, settling included, so that all of them give the same bits.
void realtime_flush_denormals(void);
// Locks all memory and gives `thread` SCHED_FIFO. Where that is not permitted: goes on and logs one
// warning that says what to grant.
void realtime_request(pthread_t thread);
// The calling thread gives up SCHED_FIFO, or takes it again where that is permitted.
void realtime_pause(void);
void realtime_resume(void);

#endif
