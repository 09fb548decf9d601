#include "base/log.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static LogLevel log_level = LOG_INFO;
static const char *program = "pliant";
static const char *const level_names[] = {"error", "warning", "info", "debug"};

void log_set_level(LogLevel level)
{
    log_level = level;
}

void log_set_program(const char *name)
{
    program = name;
}

bool log_parse_level(const char *name, LogLevel *level)
{
    for (int i = LOG_ERROR; i <= LOG_DEBUG; i++) {
        if (strcmp(name, level_names[i]) == 0) {
            *level = (LogLevel)i;
            return true;
        }
    }
    return false;
}

void log_line(LogLevel level, const char *format, ...)
{
    if (level > log_level)
        return;
    char text[1024]; // one write a line, so that lines of several threads do not mix
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (level == LOG_INFO)
        fprintf(stderr, "%s: %s\n", program, text);
    else
        fprintf(stderr, "%s: %s: %s\n", program, level_names[level], text);
}
