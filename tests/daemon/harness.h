// Starts the real daemon on small scenes in a scratch folder and collects how it ended.
#ifndef PLIANT_TESTS_DAEMON_HARNESS_H
#define PLIANT_TESTS_DAEMON_HARNESS_H

#include "expect.h"

#include <sys/types.h>

enum { OUTPUT_MAX = 65536, PATH_TEXT = 512 };

// The scratch folder of this test program and the daemon's path (argv[1]).
void harness_start(int argc, char **argv);
// Removes the folder; returns `result`, for main.
int harness_end(int result);
// For cmocka: ends the daemon that a failed test has left behind.
int harness_teardown(void **state);
// A path in the scratch folder, valid for the next 31 calls.
const char *scratch(const char *name);
// Writes a scene: `head` are keys of the scene, `tail` goes behind the body (tools, loads).
const char *write_scene(const char *name, const char *head, const char *tail);
void write_text(const char *path, const char *text);

// What the small scene is: an ico sphere of 42 nodes, radius 0.05 m, its lower part held.
extern const char *const PROBE_TOOL; // tail: tool 1, a ball of 5 mm, max_force 5 N
enum { SPHERE_NODES = 42, SPHERE_TRIANGLES = 80 };

typedef struct Daemon {
    pid_t pid;
    int number;
    // after daemon_wait or run_daemon
    int code; // exit code; 1000 + signal when killed
    char out[OUTPUT_MAX], err[OUTPUT_MAX];
} Daemon;

// `arguments`: words separated by blanks.
void daemon_start(Daemon *daemon, const char *format, ...) __attribute__((format(printf, 2, 3)));
// What the next starts run in the daemon's place: a client; NULL: the daemon again.
void daemon_program(const char *path);
// Extra environment "NAME=value" for the next start; NULL for none.
void daemon_environment(const char *assignment);
void daemon_signal(const Daemon *daemon, int number);
// Waits for its end (at most a minute, then the test fails) and reads what it printed.
void daemon_wait(Daemon *daemon);
// Asks it to end with SIGTERM and waits; fails the test unless its exit code is 0.
void daemon_end(Daemon *daemon);
// Start and wait.
void run_daemon(Daemon *daemon, const char *format, ...) __attribute__((format(printf, 2, 3)));

// The number behind "name: " in what the daemon printed; fails the test when it is not there.
long long printed(const Daemon *daemon, const char *name);
// The hash of the final state, as printed.
void printed_state(const Daemon *daemon, char state[32]);

#define daemon_test(function) cmocka_unit_test_teardown(function, harness_teardown)

#endif
