// Reader of LCM event logs, as lcm-logger writes them. Our own, because the library's trusts the
// lengths in the file. One thread; load time and off line only. Any message of ours fits: they stay
// below a datagram.
#ifndef PLIANT_FILES_EVENT_LOG_H
#define PLIANT_FILES_EVENT_LOG_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

enum { EVENT_LOG_CHANNEL_MAX = 63, EVENT_LOG_DATA_MAX = 1 << 16 };

typedef struct LogEvent {
    int64_t timestamp; // [us]
    char channel[EVENT_LOG_CHANNEL_MAX + 1];
    size_t size; // of the message; bytes beyond EVENT_LOG_DATA_MAX are not kept
    unsigned char data[EVENT_LOG_DATA_MAX];
} LogEvent;

typedef struct EventLog {
    FILE *file;
    const char *path; // not copied
    int64_t events;   // read so far
} EventLog;

bool event_log_open(EventLog *log, const char *path, Status *status);
// False at the end; with a failure in `status` when the file is cut off or not a log from here on.
bool event_log_next(EventLog *log, LogEvent *event, Status *status);
void event_log_close(EventLog *log);

#endif
