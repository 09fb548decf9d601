// SPDX-License-Identifier: MIT
#include "run/input_log.h"

#include "base/check.h"
#include "base/output.h"

#include <lcm/lcm.h>

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char CHANNEL[] = "PLIANT_INPUT_LOG";
static const double LONGEST_US = 1e15; // of a run

// --- writing ---

struct InputLogWriter {
    lcm_eventlog_t *log;
    char *path;
    InputLogHeader header;
    bool named;    // the file had a name
    off_t bytes;   // written, or waiting to be
    char why[100]; // of the first failure; "": none
};

static void note_failure(InputLogWriter *writer, const char *why)
{
    if (writer->why[0] == '\0')
        snprintf(writer->why, sizeof writer->why, "%s", why);
}

// Notices what other programs do to the file, since writing into one that has no name succeeds.
// Writes append: after a truncation the file is shorter than what was written. Devices and pipes
// have neither name nor size.
static void check_place(InputLogWriter *writer)
{
    struct stat facts;
    if (fstat(fileno(writer->log->f), &facts) != 0 || !S_ISREG(facts.st_mode))
        return;
    writer->named |= facts.st_nlink > 0; // not all file systems count names
    if (writer->named && facts.st_nlink == 0)
        note_failure(writer, "the file was removed");
    else if (facts.st_size != writer->bytes)
        note_failure(writer, facts.st_size < writer->bytes ? "the file was truncated"
                                                           : "another program wrote there");
}

static bool write_event(InputLogWriter *writer, const char *channel, int64_t step, const void *data,
                        size_t size)
{
    char name[128];
    snprintf(name, sizeof name, "%s", channel);
    lcm_eventlog_event_t event = {.timestamp = llround((double)step * 1e6 / writer->header.rate_hz),
                                  .channellen = (int32_t)strlen(name),
                                  .datalen = (int32_t)size,
                                  .channel = name,
                                  .data = (void *)(uintptr_t)data};
    enum { EVENT_HEAD = 28 };
    if (writer->why[0] == '\0' && lcm_eventlog_write_event(writer->log, &event) != 0)
        note_failure(writer, strerror(errno));
    writer->bytes += EVENT_HEAD + event.channellen + event.datalen;
    return writer->why[0] == '\0';
}

static bool write_text(InputLogWriter *writer, int64_t step, const char *text)
{
    return write_event(writer, CHANNEL, step, text, strlen(text));
}

// Fails with the process that has locked the file, if it is known.
static bool refuse_locked(const char *path, int fd, Status *status)
{
    struct flock lock = {.l_type = F_WRLCK, .l_whence = SEEK_SET};
    char holder[40] = "another program";
    if (fcntl(fd, F_GETLK, &lock) == 0 && lock.l_type != F_UNLCK && lock.l_pid > 0)
        snprintf(holder, sizeof holder, "process %ld", (long)lock.l_pid);
    return status_fail(status, STATUS_INVALID, "%s: %s is writing its log there", path, holder);
}

// Opens the file for writing and locks it while it is open. Never replaces data, nor a file that
// another daemon is writing. Returns a descriptor or -1.
static int claim(const char *path, Status *status)
{
    struct stat facts;
    bool is_free = false;
    // Open without waiting for the reader of a pipe, and lock before looking at the size.
    int fd = open(path, O_WRONLY | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0666);
    if (fd < 0 || fstat(fd, &facts) != 0)
        status_fail(status, STATUS_FAILED, "%s: cannot write: %s", path,
                    fd < 0 && errno == ENXIO ? "nobody reads this pipe" : strerror(errno));
    else if (S_ISREG(facts.st_mode) && !output_lock(fd, F_SETLK, F_GETLK))
        refuse_locked(path, fd, status);
    else if (S_ISREG(facts.st_mode) && fstat(fd, &facts) == 0 && facts.st_size > 0)
        status_fail(status, STATUS_INVALID,
                    "%s: exists already, and a log replaces no file: remove it, name another, or "
                    "let --continue number it",
                    path);
    else
        is_free = true;
    // Devices, pipes and empty files are fine.
    if (is_free &&
        fcntl(fd, F_SETFL, O_WRONLY | O_APPEND) == 0) // a pipe blocks until it has a reader
        return fd;
    if (fd >= 0)
        close(fd);
    return -1;
}

// liblcm opens files by name and truncates them: open a dummy file, then substitute ours.
static lcm_eventlog_t *open_log(const char *path, Status *status)
{
    int fd = claim(path, status);
    if (fd < 0)
        return NULL;
    // liblcm opens by name; ours is open and locked already, so exchange the file.
    lcm_eventlog_t *log = lcm_eventlog_create("/dev/null", "w");
    FILE *file = log != NULL ? fdopen(fd, "w") : NULL;
    if (file != NULL) {
        fclose(log->f);
        log->f = file;
        return log;
    }
    // Neither object is left behind.
    status_fail(status, STATUS_FAILED, "%s: cannot write: %s", path, strerror(errno));
    if (log != NULL)
        lcm_eventlog_destroy(log);
    close(fd);
    return NULL;
}

InputLogWriter *input_log_create(const char *path, const InputLogHeader *header, Status *status)
{
    lcm_eventlog_t *log = open_log(path, status);
    if (log == NULL)
        return NULL;
    InputLogWriter *writer = malloc(sizeof *writer);
    ASSERT(writer != NULL);
    *writer = (InputLogWriter){.log = log, .path = strdup(path), .header = *header};
    // The header is the log's first event.
    char text[512];
    snprintf(text, sizeof text,
             "format = pliant-input-log\nversion = 1\nscene = %s\nprefix = %s\nisa = %s\n"
             "rate_hz = %.17g\nstep = %lld\ninputs = %lld\n",
             header->scene, header->prefix, header->isa, header->rate_hz, (long long)header->step,
             (long long)header->inputs);
    // It is on the disk before the first input is.
    write_text(writer, header->step, text);
    input_log_flush(writer);
    return writer;
}

bool input_log_write(InputLogWriter *writer, const AppliedInput *applied)
{
    if (applied->stopped_s > 0.0) {
        char text[64]; // no key of the end mark, for which readers of before look
        snprintf(text, sizeof text, "stopped\nseconds = %.3f\n", applied->stopped_s);
        return write_text(writer, applied->step, text);
    }
    unsigned char data[INPUT_WIRE_MAX];
    size_t size = input_encode(&applied->input, data);
    char channel[128];
    snprintf(channel, sizeof channel, "%s_%s", writer->header.prefix,
             input_channel(applied->input.kind));
    return write_event(writer, channel, applied->step, data, size);
}

void input_log_flush(InputLogWriter *writer)
{
    if (writer->why[0] != '\0')
        return;
    if (fflush(writer->log->f) != 0)
        note_failure(writer, strerror(errno));
    else
        check_place(writer);
}

bool input_log_whole(const InputLogWriter *writer, Status *status)
{
    return writer->why[0] == '\0' ||
           status_fail(status, STATUS_FAILED, "%s: could not write every input: %s", writer->path,
                       writer->why);
}

void input_log_sync(InputLogWriter *writer)
{
    input_log_flush(writer);
    if (fdatasync(fileno(writer->log->f)) != 0 && errno != EINVAL) // a pipe has no disk
        note_failure(writer, strerror(errno));
}

void input_log_lacks(InputLogWriter *writer, int64_t step, int64_t lost)
{
    char text[64];
    snprintf(text, sizeof text, "lost = %lld\n", (long long)lost);
    write_text(writer, step, text);
}

bool input_log_close(InputLogWriter *writer, int64_t step, int64_t lost, Status *status)
{
    char text[128];
    snprintf(text, sizeof text, "end\nstep = %lld\nlost = %lld\n", (long long)step,
             (long long)lost);
    // The end mark tells a log that ended from one that was cut off.
    write_text(writer, step, text);
    input_log_flush(writer);
    bool whole = input_log_whole(writer, status);
    lcm_eventlog_destroy(writer->log);
    free(writer->path);
    free(writer);
    return whole;
}

// --- reading ---

// Finds the value after "
// key = " in a header's text, up to the end of its line.
static bool find_value(const char *text, const char *key, char *value, size_t size)
{
    char pattern[64];
    snprintf(pattern, sizeof pattern, "\n%s = ", key);
    // A line "key = value".
    const char *at = strstr(text, pattern);
    if (at == NULL)
        return false;
    at += strlen(pattern);
    // Cut short it would be another value.
    size_t length = strcspn(at, "\n");
    if (length >= size)
        return false;
    memcpy(value, at, length);
    value[length] = '\0';
    return true;
}

static bool find_integer(const char *text, const char *key, int64_t *value)
{
    char number[64], *end;
    if (!find_value(text, key, number, sizeof number))
        return false;
    *value = strtoll(number, &end, 10);
    return end != number && *end == '\0' && *value >= 0;
}

// Copies the text of a header or end event, preceded by a line break so that find_value works.
static void event_text(const LogEvent *event, char text[EVENT_LOG_DATA_MAX + 2])
{
    size_t size = event->size < EVENT_LOG_DATA_MAX ? event->size : EVENT_LOG_DATA_MAX;
    text[0] = '\n';
    memcpy(text + 1, event->data, size);
    text[size + 1] = '\0';
}

static bool read_header(InputLogReader *reader, Status *status)
{
    char text[EVENT_LOG_DATA_MAX + 2], value[64], *end;
    event_text(&reader->event, text);
    InputLogHeader *header = &reader->header;
    // Format and version, then what the run was.
    if (!find_value(text, "format", value, sizeof value) ||
        strcmp(value, "pliant-input-log") != 0 ||
        !find_value(text, "version", value, sizeof value) || strcmp(value, "1") != 0)
        return status_fail(status, STATUS_INVALID,
                           "%s: not an input log of version 1, as --log-inputs writes",
                           reader->log.path);
    if (!find_value(text, "scene", header->scene, sizeof header->scene) ||
        !find_value(text, "prefix", header->prefix, sizeof header->prefix) ||
        !find_value(text, "isa", header->isa, sizeof header->isa) ||
        !find_value(text, "rate_hz", value, sizeof value) ||
        !find_integer(text, "step", &header->step))
        return status_fail(status, STATUS_INVALID, "%s: header without %s", reader->log.path,
                           "scene, prefix, isa, rate_hz or step");
    // Values that later versions added, or that must make sense.
    if (!find_integer(text, "inputs", &header->inputs))
        header->inputs = 0; // logs of older versions
    header->rate_hz = strtod(value, &end);
    if (*end != '\0' || !(header->rate_hz > 0.0) || !isfinite(header->rate_hz))
        return status_fail(status, STATUS_INVALID, "%s: header with rate_hz '%s'", reader->log.path,
                           value);
    snprintf(reader->prefix, sizeof reader->prefix, "%s", header->prefix);
    return true;
}

bool input_log_open(InputLogReader *reader, const char *path, Status *status)
{
    memset(reader, 0, sizeof *reader);
    if (!event_log_open(&reader->log, path, status))
        return false;
    // The first event says what kind of log it is.
    reader->has_event = event_log_next(&reader->log, &reader->event, status);
    if (!reader->has_event)
        return status->code == STATUS_OK
                   ? status_fail(status, STATUS_INVALID, "%s: holds no event", path)
                   : false;
    // A plain log begins with data, an exact one with its header.
    if (strcmp(reader->event.channel, CHANNEL) != 0)
        return true;
    reader->exact = true;
    reader->has_event = false;
    return read_header(reader, status);
}

static bool match_channel(const char *channel, const char *prefix, InputKind *kind)
{
    size_t length = strlen(prefix);
    // The prefix and one of our names behind it.
    if (strncmp(channel, prefix, length) != 0 || channel[length] != '_')
        return false;
    for (int k = 0; k < INPUT_KINDS; k++) {
        if (strcmp(channel + length + 1, input_channel((InputKind)k)) == 0) {
            *kind = (InputKind)k;
            return true;
        }
    }
    return false;
}

// Returns the tick of a time stamp that lies `since` [us] after the start of the run.
static int64_t step_at(const InputLogReader *reader, double since, double rate_hz,
                       int64_t first_step)
{
    if (reader->exact)
        return llround(since * rate_hz / 1e6);
    // with a tolerance of a millionth of a tick for rounding
    return first_step + (int64_t)ceil(fmax(since, 0.0) * rate_hz / 1e6 - 1e-6);
}

static double since_start(const InputLogReader *reader, int64_t stamp)
{
    return reader->exact ? (double)stamp : (double)stamp - (double)reader->first_us;
}

// Finds the tick; returns false for a time stamp that no run can have.
static bool find_step(InputLogReader *reader, double rate_hz, int64_t first_step, int64_t *step,
                      Status *status)
{
    int64_t stamp = reader->event.timestamp;
    double since = since_start(reader, stamp);
    if (!(fabs(since) <= LONGEST_US))
        return status_fail(status, STATUS_INVALID, "%s: event %lld has the time stamp %lld us",
                           reader->log.path, (long long)reader->log.events, (long long)stamp);
    *step = step_at(reader, since, rate_hz, first_step);
    return true;
}

int64_t input_log_last_step(const InputLogReader *reader, double rate_hz, int64_t first_step)
{
    double since = since_start(reader, reader->last_us);
    if (!reader->started || !(fabs(since) <= LONGEST_US))
        return first_step;
    return step_at(reader, since, rate_hz, first_step);
}

// Reads an event about the run: its end, what the log lacks so far, or a stop; true of that.
static bool read_mark(InputLogReader *reader)
{
    char text[EVENT_LOG_DATA_MAX + 2], seconds[64];
    event_text(&reader->event, text);
    if (find_value(text, "seconds", seconds, sizeof seconds)) {
        reader->stopped_s = strtod(seconds, NULL);
        return reader->stopped_s > 0.0 && isfinite(reader->stopped_s);
    }
    // Only the end has a step.
    reader->ended =
        find_integer(text, "lost", &reader->lost) && find_integer(text, "step", &reader->end_step);
    return false;
}

bool input_log_next(InputLogReader *reader, double rate_hz, int64_t first_step, InputKind *kind,
                    int64_t *step, Status *status)
{
    for (;;) {
        if (!reader->has_event && !event_log_next(&reader->log, &reader->event, status))
            return false;
        reader->has_event = false;
        const LogEvent *event = &reader->event;
        // A mark of an exact log.
        if (reader->exact && strcmp(event->channel, CHANNEL) == 0) {
            if (!read_mark(reader))
                continue;
            *kind = (InputKind)INPUT_LOG_STOPPED;
            return find_step(reader, rate_hz, first_step, step, status);
        }
        // The test message of lcm-logger may come first; it is not part of the recording.
        if (strcmp(event->channel, "LCM_SELF_TEST") == 0)
            continue;
        if (reader->started && !reader->exact && reader->log.jump_us != 0 && reader->jumps++ == 0) {
            reader->jump_us = reader->log.jump_us;
            reader->jumped_us = reader->last_us - reader->first_us;
        }
        // The first event defines time zero of a plain log.
        if (!reader->started) {
            reader->started = true;
            reader->first_us = event->timestamp;
        }
        reader->last_us = event->timestamp;
        if (match_channel(event->channel, reader->prefix, kind)) {
            reader->used++;
            return find_step(reader, rate_hz, first_step, step, status);
        }
        reader->skipped++;
    }
}

void input_log_close_reader(InputLogReader *reader)
{
    event_log_close(&reader->log);
}
