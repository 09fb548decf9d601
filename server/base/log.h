// SPDX-License-Identifier: MIT
// Log lines on stderr, from any thread but the step thread.
#ifndef PLIANT_BASE_LOG_H
#define PLIANT_BASE_LOG_H

#include <stdbool.h>

typedef enum LogLevel { LOG_ERROR, LOG_WARNING, LOG_INFO, LOG_DEBUG } LogLevel;

// Drops lines above this level; LOG_INFO by default. Call before threads start.
void log_set_level(LogLevel level);
// Parses "error", "warning", "info" or "debug"; false for anything else.
bool log_parse_level(const char *name, LogLevel *level);
// Writes one line: "pliantd: warning: text".
void log_line(LogLevel level, const char *format, ...) __attribute__((format(printf, 2, 3)));
// Sets the program name at the start of each line (not copied). If stderr is the journal of
// systemd, each line also begins with its priority, "<4>", which the journal removes.
void log_set_program(const char *name);
// Returns the prefix of a line of this level on stderr: "", or its priority for the journal.
const char *log_priority(LogLevel level);

#endif
