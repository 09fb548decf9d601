// SPDX-License-Identifier: MIT
#include "base/log.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static LogLevel log_level = LOG_INFO;
static const char *program = "pliant";
static bool to_journal;
static const char *const level_names[] = {"error", "warning", "info", "debug"};

void log_set_level(LogLevel level)
{
    log_level = level;
}

// True if stderr leads to the journal. JOURNAL_STREAM names device and inode of that stream; a
// program may inherit it although its stderr was redirected since, so both are compared.
static bool stderr_is_the_journal(void)
{
    const char *named = getenv("JOURNAL_STREAM");
    unsigned long long device, inode;
    struct stat own;
    return named != NULL && sscanf(named, "%llu:%llu", &device, &inode) == 2 &&
           fstat(STDERR_FILENO, &own) == 0 && own.st_dev == device && own.st_ino == inode;
}

void log_set_program(const char *name)
{
    program = name;
    to_journal = stderr_is_the_journal();
}

const char *log_priority(LogLevel level)
{
    static const char *const priorities[] = {"<3>", "<4>", "<6>", "<7>"}; // of syslog
    return to_journal ? priorities[level] : "";
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
    char text[1024]; // one write per line, so that lines of several threads do not mix
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (level == LOG_INFO)
        fprintf(stderr, "%s%s: %s\n", log_priority(level), program, text);
    else
        fprintf(stderr, "%s%s: %s: %s\n", log_priority(level), program, level_names[level], text);
}
