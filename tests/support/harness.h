// SPDX-License-Identifier: MIT
// Runs programs, the server above all, in a scratch folder, and collects what they printed and how
// they ended.
#ifndef PLIANT_TESTS_HARNESS_H
#define PLIANT_TESTS_HARNESS_H

#include "test.h"
#include "scratch.h"

#include <signal.h>
#include <stdarg.h>
#include <sys/types.h>

enum { OUTPUT_MAX = 65536, PATH_TEXT = 512 };

// Before its first test a program of this harness makes a scratch folder, which is removed behind
// the last; its first argument is the server's path. A path of a program beside the server, valid
// forever:
const char *program_path(const char *name);
// Behind each test that has no AROUND_EACH the processes end that a failed one has left behind: all
// that were started in it, by harness_teardown, which an AROUND_EACH of a test's own calls.
int harness_teardown(void **state);
// A path in the scratch folder, valid forever.
const char *scratch(const char *name);
bool file_exists(const char *path);
void write_text(const char *path, const char *text);

typedef struct Process {
    pid_t pid;
    int number;
    // after process_wait or process_run
    int code; // exit code; 1000 + signal when killed
    char out[OUTPUT_MAX], err[OUTPUT_MAX];
} Process;

// The server of a test that has one.
extern Process pliantd;

// Starts `program` (NULL: the server), found as a shell finds it, with the scratch folder as its
// current folder. The arguments are words separated by blanks, in '' if they contain blanks; words
// NAME=value (in capitals) before them are added to its environment.
void process_start(Process *process, const char *program, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void process_signal(const Process *process, int number);
// Sends a signal that ends it and waits.
void process_finish(Process *process, int number);
// Waits for its end (at most two minutes, then the test fails) and reads what it printed.
void process_wait(Process *process);
// Asks it to end with SIGTERM and waits; fails the test unless its exit code is 0.
void process_end(Process *process);
// Start and wait.
void process_run(Process *process, const char *program, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
// The file that its standard output goes to, valid until the next call.
const char *process_output(const Process *process);
const char *process_errors(const Process *process); // that of its standard error

// Fails the test, with what it printed, unless it ended with this code.
void expect_code(const Process *process, int code);
// The same, and `text` is in what it printed: to stdout where the code is 0, else to stderr.
void expect_ended(const Process *process, int code, const char *text);
// What a program says of its command line.
typedef struct Usage {
    const char *arguments;
    int code;
    const char *says; // on stderr
} Usage;
// Fails the test, with the row's arguments, unless each row ends so.
void expect_usage(const char *program, const Usage *row, size_t count);
// Waits for an end with this code.
void process_wait_for(Process *process, int code);
// Runs until an end with code 0.
#define process_run_well(process, ...)                                                             \
    do {                                                                                           \
        process_run(process, __VA_ARGS__);                                                         \
        expect_code(process, 0);                                                                   \
    } while (0)

#define daemon_start(process, ...)    process_start(process, NULL, __VA_ARGS__)
#define run_daemon(process, ...)      process_run(process, NULL, __VA_ARGS__)
#define run_daemon_well(process, ...) process_run_well(process, NULL, __VA_ARGS__)

// Fails the test unless it ended with this code and one line on stderr, which has `text` in it.
void expect_refusal(const Process *process, int code, const char *text);
// Fails the test unless `text` is in what it printed.
void expect_printed(const Process *process, const char *text);
// The number behind "name: " in what the process printed; fails the test when it is not there.
long long printed(const Process *daemon, const char *name);
// The hash of the final state, as printed.
void printed_state(const Process *daemon, char state[32]);

#endif
