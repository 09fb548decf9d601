// SPDX-License-Identifier: MIT
// Settings of the operating system and the processor for real-time threads.
#ifndef PLIANT_RUN_REALTIME_H
#define PLIANT_RUN_REALTIME_H

#include "base/check.h"
#include "base/team.h"

#include <pthread.h>

// Sets denormal numbers to zero on the calling thread. Without it a decaying body runs much slower
// (server/PERFORMANCE.md, "Denormal numbers"). Every computing thread calls it, also while bodies
// settle, so that all give the same bits; the workers of a team inherit the setting of the thread
// that starts them.
void realtime_flush_denormals(void);
// Gives threads that are started from now on, also LCM's, stacks of the size that they need: locked
// memory is resident whether it is used or not, and the default is 8 MB each.
void realtime_size_stacks(void);
// Locks all memory and gives `thread` SCHED_FIFO. If that is not permitted, logs one warning that
// says which permission to grant, and goes on.
void realtime_request(pthread_t thread);
// Starts the workers of a step that has several threads, each on its own processor, with SCHED_FIFO
// if `live`. With too few processors it logs a warning and starts fewer. `team` may be NULL.
// Returns false with a sentence in `status` if a thread did not start.
bool realtime_start_team(Team *team, bool live, Status *status);
// Pins the thread that computes the step to the processor that the workers left free.
void realtime_pin_step(const Team *team, pthread_t step);
// Make the calling thread give up SCHED_FIFO, or take it again if that is permitted.
void realtime_pause(void);
void realtime_resume(void);

// How long the control group's quota of processors (cgroup v2, cpu.max) has stopped this process.
typedef struct Quota {
    char limit[64]; // as in cpu.max: "20000 100000", microseconds of a period; "": none
    char stat[512]; // file of the group that has it
    int64_t first_us, held_us;
} Quota;

// Finds the group with the quota. Main thread, once.
void quota_find(Quota *quota);
// Returns how long all threads together were stopped since the last call [us]; held_us is the sum.
int64_t quota_look(Quota *quota);

#endif
