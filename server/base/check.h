// SPDX-License-Identifier: MIT
// The two kinds of errors: programming errors abort, and what the outside world gets wrong (files,
// options, messages) is told by a Status.
#ifndef PLIANT_BASE_CHECK_H
#define PLIANT_BASE_CHECK_H

#include <stdbool.h>

// --- programming errors ---
// Assertions are cheap and always on. Checks that sweep over all nodes belong in tests.

// Prints the broken condition and aborts.
_Noreturn void check_failed(const char *condition, const char *file, int line);

#define ASSERT(condition) ((condition) ? (void)0 : check_failed(#condition, __FILE__, __LINE__))

// --- errors of the outside world ---
// Called at load time and where input enters, never on the step thread.

typedef enum StatusCode {
    STATUS_OK = 0,
    STATUS_FAILED = 1,  // run-time failure: exit code 1
    STATUS_INVALID = 2, // bad usage, scene, mesh or file: exit code 2
} StatusCode;

// One sentence that names the object, the value and the limit: "press.cfg:12: rate_hz 0 outside
// ...".
typedef struct Status {
    StatusCode code;
    char text[512];
} Status;

// Sets code and text (printf style, truncated at the buffer's end) and returns false, so that
// callers can write `return status_fail(status, ...)`. A status that already holds a failure keeps
// the first one. `status` may be NULL.
bool status_fail(Status *status, StatusCode code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

#endif
