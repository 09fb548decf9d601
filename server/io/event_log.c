// SPDX-License-Identifier: MIT
#include "io/event_log.h"

#include <errno.h>
#include <math.h>
#include <string.h>
#include <sys/stat.h>

// An event: sync word, number, time stamp, two lengths (big endian), channel, data.
enum { HEADER_BYTES = 28, DATA_LIMIT = 1 << 28 };
static const uint32_t SYNC = 0xEDA1DA01;

bool event_log_open(EventLog *log, const char *path, Status *status)
{
    *log = (EventLog){.path = path};
    struct stat facts;
    log->file = fopen(path, "rb");
    if (log->file == NULL || fstat(fileno(log->file), &facts) != 0)
        return status_fail(status, STATUS_INVALID, "%s: %s", path, strerror(errno));
    if (!S_ISREG(facts.st_mode))
        return status_fail(status, STATUS_INVALID, "%s: not a file", path);
    return true;
}

void event_log_close(EventLog *log)
{
    if (log->file != NULL)
        fclose(log->file);
    log->file = NULL;
}

static uint64_t big_endian(const unsigned char *byte, int count)
{
    uint64_t value = 0;
    for (int i = 0; i < count; i++)
        value = value << 8 | byte[i];
    return value;
}

static bool cut_off(const EventLog *log, Status *status)
{
    return status_fail(status, STATUS_INVALID, "%s: cut off after %lld whole events", log->path,
                       (long long)log->events);
}

// Forged time stamps may be anything.
static void note_time(EventLog *log, int64_t time_us)
{
    const bool first = log->events == 0;
    const double since = first ? 0.0 : (double)time_us - (double)log->last_us;
    const bool jumps = since > (double)EVENT_LOG_GAP_US || since < -(double)EVENT_LOG_BACK_US;
    log->jump_us = jumps && fabs(since) < 1e18 ? (int64_t)since : 0;
    log->first_us = first ? time_us : log->first_us;
    log->last_us = time_us;
}

bool event_log_next(EventLog *log, LogEvent *event, Status *status)
{
    unsigned char header[HEADER_BYTES];
    // The end of the file is the end of the log only between two events.
    size_t got = fread(header, 1, sizeof header, log->file);
    if (got == 0 && feof(log->file))
        return false;
    // An event begins with a sync word; without it the file is no log, or is damaged from here on.
    if (got < 4 || big_endian(header, 4) != SYNC)
        return log->events == 0
                   ? status_fail(status, STATUS_INVALID,
                                 "%s: not an LCM event log, as lcm-logger and --log-inputs write",
                                 log->path)
                   : status_fail(status, STATUS_INVALID, "%s: no LCM event after %lld of them",
                                 log->path, (long long)log->events);
    if (got < sizeof header)
        return cut_off(log, status);

    // When, and how long channel and message are.
    event->timestamp = (int64_t)big_endian(header + 12, 8);
    int64_t channel_size = (int32_t)big_endian(header + 20, 4);
    int64_t size = (int32_t)big_endian(header + 24, 4);
    // Lengths decide what is read next: refuse what no log can have.
    if (channel_size < 1 || channel_size > EVENT_LOG_CHANNEL_MAX || size < 0 || size > DATA_LIMIT)
        return status_fail(status, STATUS_INVALID,
                           "%s: event %lld states a channel of %lld and data of %lld bytes",
                           log->path, (long long)log->events, (long long)channel_size,
                           (long long)size);

    memset(event->channel, 0, sizeof event->channel);
    if (fread(event->channel, 1, (size_t)channel_size, log->file) != (size_t)channel_size)
        return cut_off(log, status);
    event->size = (size_t)size;
    // Keep what fits and skip the rest, so that a long event of another program is no error.
    size_t kept = event->size < EVENT_LOG_DATA_MAX ? event->size : EVENT_LOG_DATA_MAX;
    if (fread(event->data, 1, kept, log->file) != kept)
        return cut_off(log, status);
    for (size_t left = event->size - kept; left > 0;) {
        unsigned char rest[4096];
        size_t part = left < sizeof rest ? left : sizeof rest;
        if (fread(rest, 1, part, log->file) != part)
            return cut_off(log, status);
        left -= part;
    }
    note_time(log, event->timestamp);
    log->events++;
    return true;
}
