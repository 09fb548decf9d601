// SPDX-License-Identifier: MIT
// The real pliantd, run at its rate in a private network; what it says about itself at the end.
#ifndef PLIANT_TESTS_BENCH_DAEMON_H
#define PLIANT_TESTS_BENCH_DAEMON_H

#include <stdbool.h>
#include <stddef.h>

enum { DAEMON_PARTS = 4 }; // p50, p99, p99.9, max

typedef struct DaemonRun {
    double ticks, late_ticks;
    double step[DAEMON_PARTS], wake[DAEMON_PARTS]; // [us]
} DaemonRun;

typedef enum DaemonEnd { DAEMON_DONE, DAEMON_SKIPPED, DAEMON_FAILED } DaemonEnd;

// The pliantd beside this program; NULL when there is none.
const char *daemon_path(void);
// Writes a scene to a new temporary file, for the caller to unlink; false when that fails.
bool daemon_write_scene(const char *text, char *path, size_t size);
// Runs the scene for some seconds. `why` names what was missing or went wrong.
DaemonEnd daemon_run(const char *scene, int seconds, DaemonRun *run, const char **why);
// Likewise, with a shell command that runs in the same network from half a second after its start;
// $BIN is the folder of the programs. What it prints is lost.
DaemonEnd daemon_run_beside(const char *scene, int seconds, const char *beside, DaemonRun *run,
                            const char **why);

#endif
