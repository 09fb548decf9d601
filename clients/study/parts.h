// SPDX-License-Identifier: MIT
// The parts of a study that have ended, as files in its folder: an interrupted study continues from
// them, and any number of processes on any machines that see the folder share one study. A process
// claims a part by locking a file, and the system unlocks it when the process ends, however it
// ends: what a process that died was doing is claimed by another.
#ifndef PLIANT_STUDY_PARTS_H
#define PLIANT_STUDY_PARTS_H

#include "fit/results.h"
#include "study/pool.h"

#include <stdint.h>

typedef struct Parts {
    char folder[RESULTS_PATH];
    int study; // the file that says which study this is, locked as long as a process takes part
} Parts;

// Opens the parts of a study in its folder. `key`: of all that its results depend on. `fresh`:
// begins again, and is refused while another process takes part; else continues, if there is
// anything, and is refused if the parts are of another study. False with `status`.
bool parts_open(Parts *parts, const char *folder, uint64_t key, bool fresh, Status *status);
void parts_close(Parts *parts);

// Claims what one process is to do; -1: another does it.
int parts_claim(const Parts *parts, const char *name);
void parts_release(int claim);
// Waits a moment for what another process does.
void parts_wait(void);

// True if the whole study has ended and nothing is left to do.
bool parts_complete(const Parts *parts);
// Says so, and removes the parts.
void parts_finish(const Parts *parts);

// Reads the result of a part; false if it has not ended.
bool parts_load(const Parts *parts, const char *kind, int task, void *result, size_t bytes);

// Runs the tasks of a pool that have not ended, and waits for those of other processes.
// pool->done gets every result, whoever computed it. `lose` fills the result of a task whose
// process died or took too long; it is lost for all. `parts` NULL: the same as pool_run. Returns
// early if another process completes the study.
typedef void PartsLose(void *user, int task, void *result, const char *why);
bool parts_run(const Parts *parts, const char *kind, const Pool *pool, PartsLose *lose,
               Status *status);

#endif
