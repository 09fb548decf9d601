// Log lines on stderr. Any thread but the step thread.
#ifndef PLIANT_BASE_LOG_H
#define PLIANT_BASE_LOG_H

#include <stdbool.h>

typedef enum LogLevel { LOG_ERROR, LOG_WARNING, LOG_INFO, LOG_DEBUG } LogLevel;

// Lines above this level are dropped; LOG_INFO at the start. Set once, before threads start.
void log_set_level(LogLevel level);
// "error", "warning", "info" or "debug"; false for anything else.
bool log_parse_level(const char *name, LogLevel *level);
// One line: "pliantd: warning: text".
void log_line(LogLevel level, const char *format, ...) __attribute__((format(printf, 2, 3)));
// The program's name in front of each line; not copied. Where stderr leads to the journal of
// systemd, each line also begins with its priority, "<4>", which the journal takes off.
void log_set_program(const char *name);
// What a line of this level begins with on stderr: "", or its priority for the journal.
const char *log_priority(LogLevel level);

#endif
