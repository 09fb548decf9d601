// SPDX-License-Identifier: MIT
// Reader of LCM event logs as lcm-logger writes them. It replaces the library's, which trusts the
// lengths in the file. One thread; load time and offline only. Any message of ours fits, since it
// is smaller than a datagram.
#ifndef PLIANT_IO_EVENT_LOG_H
#define PLIANT_IO_EVENT_LOG_H

#include "base/check.h"

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
    const char *path;          // not copied
    int64_t events;            // read so far
    int64_t first_us, last_us; // time stamps of the first and of the newest event
    int64_t jump_us;           // by which the clock went on, or back, to the newest; 0: no jump
} EventLog;

// A server publishes its status at least this often: longer, the logger or its machine stood still.
#define EVENT_LOG_GAP_US INT64_C(2000000)
// Back by less is the order in which its threads took messages.
#define EVENT_LOG_BACK_US INT64_C(100000)

bool event_log_open(EventLog *log, const char *path, Status *status);
// Reads the next event. Returns false at the end; also sets `status` if the file is truncated or
// invalid from here on.
bool event_log_next(EventLog *log, LogEvent *event, Status *status);
void event_log_close(EventLog *log);

#endif
