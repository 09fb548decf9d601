// SPDX-License-Identifier: MIT
// Shared by the client programs: common options, signals, printing, files that they write. One
// thread. Only program_print_* print; none exits.
#ifndef PLIANT_CLIENTS_PROGRAM_H
#define PLIANT_CLIENTS_PROGRAM_H

#include "base/arguments.h"

#include <pliant/client.h>

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

// Sets the text and returns false, for `return program_fail(error, ...)`. A sentence that names the
// thing, the value and the limit.
bool program_fail(PliantError *error, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

// Returns CLOCK_MONOTONIC [ns].
int64_t program_now_ns(void);

// --- options ---

// -l/--lcm-url and --prefix; the offset is that of a PliantOptions.
extern const ArgumentRow PROGRAM_WHERE[];
// --input-prefix; the offset is that of a const char *, NULL: as the prefix.
extern const ArgumentRow PROGRAM_INPUT_PREFIX[];

// Reads the numbers of a line, separated by white space: returns how many, at most `most`; -1 for
// other text or too many.
int program_read_numbers(const char *line, double *number, int most);

// --- signals ---

// Makes SIGINT, SIGTERM and SIGHUP end waits instead of the program.
void program_catch_signals(void);
bool program_stopped(void);
// Has such a signal, also one that came before, call `end` with `client`: client_stop or the like.
// NULL: none any more. Returns true.
bool program_stops(void (*end)(void *client), void *client);

// Waits until there is a network for the URL (NULL: as PliantOptions), which may come later; says
// so once. Returns false with `error` for a bad URL, or if such a signal comes.
bool program_await_network(const char *url, PliantError *error);
// Waits by `wait`, pliant_wait_server or the like, for a server: for `patience_s`, but as long as
// it takes, said once, if that is what the programs have where no time was given: it may be
// preparing.
static const double PROGRAM_PATIENCE_S = 3.0;
bool program_await_server(PliantClient *client, bool (*wait)(PliantClient *client, double seconds),
                          double patience_s, PliantError *error);
// Connects a client that such a signal stops, and closes it; waits for a network.
PliantClient *program_open(const PliantOptions *options, PliantError *error);
void program_close(PliantClient *client); // NULL is allowed

// --- printing ---

// Prints text from the network: control characters become '?', line breaks stay if `lines`.
void program_print_text(FILE *out, const char *text, bool lines);
// Prints "program: text" on stderr.
void program_print_error(const char *program, const PliantError *error);

// --- text files that a client writes -------------------------------------------------------------

// A client replaces its own files only.

// Opens PATH for writing and empties it. A regular file that is not empty must begin with `mark`,
// as the client's own do; devices and pipes are accepted. Returns NULL with `error` on failure.
FILE *program_open_output(const char *path, const char *mark, PliantError *error);
// Checks the same before there is anything to write; makes no file.
bool program_may_write(const char *path, const char *mark, PliantError *error);

#endif
