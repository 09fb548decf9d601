// SPDX-License-Identifier: MIT
// A program that this one runs and watches: started without a shell, with limits, its words kept,
// ended with this program. One thread, the same for all calls, and it must outlive the child: the
// kernel ends the child when that thread is gone, however it went (but not a program with
// capabilities of its file, for which it forgets to).
#ifndef PLIANT_WEB_CHILD_H
#define PLIANT_WEB_CHILD_H

#include "client.h"

#include <sys/types.h>

enum { CHILD_TEXT_MAX = 65536, CHILD_HOW_MAX = 64 };

typedef struct Child {
    pid_t pid;           // 0: none runs
    int fd;              // what it prints; meaningless if none runs
    int64_t patience_ns; // from asking it to end to killing it
    int64_t kill_ns;     // when it is killed, if it has not ended (CLOCK_MONOTONIC); 0: never
    bool asked;          // it has been asked to end
    bool over;           // it has run and ended,
    int status;          // as waitpid reports it
    int64_t ended_ns;    // when (CLOCK_MONOTONIC)
    bool cut;            // of `text` the beginning is missing
    size_t size;         // of `text`
    char text[CHILD_TEXT_MAX + 1]; // the last that it printed, on stdout and stderr
} Child;

typedef struct ChildOptions {
    const char *folder;   // current folder of the child
    double patience_s;    // from asking it to end to killing it; 0: 5
    double seconds;       // of wall and of processor time; 0: no limit
    int64_t memory_bytes; // of its address space; 0: no limit
    bool gentle;          // with a lower priority than ours
} ChildOptions;

// Starts argv[0], a path, with argv (NULL-terminated). The text of the last one is forgotten. If
// the program cannot be run, the child ends with 127 and says why. Returns false with a sentence if
// there is no process or memory.
bool child_start(Child *child, const char *const argv[], const ChildOptions *options,
                 PliantError *error);
// Reads what it prints and whether it has ended, kills it if it is late. Call every few ms. Returns
// true once, when it has ended.
bool child_turn(Child *child, int64_t now_ns);
// Asks it to end, and gives it the time of its options.
void child_stop(Child *child, int64_t now_ns);
// The same, and waits for it.
void child_end(Child *child);
// Writes "exit status 2" or "signal 9 (Killed)"; "" while it has not ended.
void child_how(const Child *child, char how[CHILD_HOW_MAX]);

#endif
