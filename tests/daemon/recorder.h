// SPDX-License-Identifier: MIT
// pliant-record as a second program beside the daemon, and what is in its files.
#ifndef PLIANT_TESTS_DAEMON_RECORDER_H
#define PLIANT_TESTS_DAEMON_RECORDER_H

#include "lcm_client.h"
#include "recording_view.h"

#include "io/recording.h"

static inline void record_start(Process *program, const char *path, const char *more)
{
    process_start(program, program_path("pliant-record"), "-o %s %s", path, more);
}

static inline void record_run(Process *program, const char *arguments)
{
    process_run(program, program_path("pliant-record"), "%s", arguments);
}

static inline bool has_sidecar(const char *path)
{
    char xdmf[1100];
    snprintf(xdmf, sizeof xdmf, "%s.xdmf", path);
    return access(xdmf, F_OK) == 0;
}

// Frames of all bodies in the file: those that were flushed. (The sidecar leaves out some.)
static inline int flushed_frames(const char *path)
{
    static RecordingInfo info;
    Status status = {0};
    int64_t count = 0;
    if (!has_sidecar(path) || !recording_info_read(path, &info, &status))
        return 0;
    for (int i = 0; i < info.body_count; i++)
        count += info.body[i].frames;
    return (int)count;
}

static inline void end(Process *program, int number, int code)
{
    process_signal(program, number);
    process_wait_for(program, code);
}

static inline bool log_has(const char *path, const char *channel)
{
    size_t size = 0;
    FREED unsigned char *log = file_read(path, &size);
    bool has = memmem(log, size, channel, strlen(channel)) != NULL;
    return has;
}

// What has come before a message of ours is in the log when that is.
static inline void wait_for_log(Client *client, const char *path, const char *channel)
{
    wait_until(client,
               lcm_publish(client->lcm, channel, channel, 1) == 0 && log_has(path, channel));
}

// Returns false, and says so, where lcm-logger is not installed.
static inline bool logger_begin(Process *logger, Client *client, const char *path)
{
    if (access("/usr/bin/lcm-logger", X_OK) != 0) {
        print_message("no lcm-logger: its log is left out\n");
        return false;
    }
    process_start(logger, "/usr/bin/lcm-logger", "-q --flush-interval=10 %s", path);
    wait_until(client, access(path, F_OK) == 0);
    wait_for_log(client, path, "TEST_BEGINS");
    return true;
}

static inline void logger_end(Process *logger, Client *client, const char *path)
{
    wait_for_log(client, path, "TEST_ENDS");
    end(logger, SIGTERM, 0);
}

static inline const RecordingInfo *info_of(const char *path)
{
    static RecordingInfo info;
    Status status = {0};
    expect_ok(recording_info_read(path, &info, &status), status);
    return &info;
}

#endif
