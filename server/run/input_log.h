// SPDX-License-Identifier: MIT
// The log of applied inputs (--log-inputs) and the reader of logs (--input). The log is an LCM
// event log. Its first event, on the channel PLIANT_INPUT_LOG, describes the run; the last one says
// where the run ended, and those between for how long it was stopped there. The others are the
// messages as they were accepted, stamped with the simulated time [us] of the tick at whose start
// they were applied; the tick follows exactly from it. The files thread writes it; offline runs
// read it.
#ifndef PLIANT_RUN_INPUT_LOG_H
#define PLIANT_RUN_INPUT_LOG_H

#include "io/event_log.h"
#include "run/exchange.h"
#include "scene/build.h"

typedef struct InputLogHeader {
    char scene[64];
    char prefix[64]; // of the input channels
    char isa[32];    // instruction-set level of the kernels
    double rate_hz;
    int64_t step;   // ticks completed at the start of the run
    int64_t inputs; // applied before that tick and not in this log (a resumed run)
} InputLogHeader;

typedef struct InputLogWriter InputLogWriter;

// Creates the file and locks it until it is closed. Refuses a file that is not empty or that
// another program has locked; accepts devices and pipes. Returns NULL with `status` on failure.
InputLogWriter *input_log_create(const char *path, const InputLogHeader *header, Status *status);
// Returns false after a write error, which input_log_close reports.
bool input_log_write(InputLogWriter *writer, const AppliedInput *applied);
// Marks that `lost` inputs are missing so far: a run that is killed has no end mark to say so.
void input_log_lacks(InputLogWriter *writer, int64_t step, int64_t lost);
// Also notices if the file was removed, truncated or changed by another program.
void input_log_flush(InputLogWriter *writer);
// Flushes the file and syncs it to the disk.
void input_log_sync(InputLogWriter *writer);
// Returns false with `status` after any failure.
bool input_log_whole(const InputLogWriter *writer, Status *status);
// Ends the log of a run of `step` ticks, of whose inputs `lost` are missing. Destroys the writer.
bool input_log_close(InputLogWriter *writer, int64_t step, int64_t lost, Status *status);

enum { INPUT_LOG_STOPPED = INPUT_KINDS }; // in place of a kind: the run stood still there

typedef struct InputLogReader {
    EventLog log;
    bool exact;            // written by --log-inputs
    InputLogHeader header; // exact logs
    bool ended;            // exact logs: the end of the run was read
    int64_t end_step, lost;
    double stopped_s; // of the newest INPUT_LOG_STOPPED
    char prefix[64];
    int64_t first_us; // plain logs: time stamp of the first event
    int64_t last_us;  // of the newest event read
    bool started;
    bool has_event; // `event` was read ahead
    LogEvent event;
    int64_t used, skipped;      // messages on our channels, and others
    int64_t jumps;              // plain logs: gaps and steps of their clock
    int64_t jump_us, jumped_us; // of the first: how far, and when [us]
} InputLogReader;

// Opens a plain or exact log and reads the header of an exact one. `path` outlives the reader.
bool input_log_open(InputLogReader *reader, const char *path, Status *status);
// Finds the next message on one of our channels. Sets its kind, its bytes in reader->event and the
// tick at whose start it is applied. In plain logs that is the first tick at or after the message's
// time since the log's first event, counted from `first_step`. The kind may be INPUT_LOG_STOPPED,
// which is no message. Returns false at the end; `status`
// is set if the log is truncated or corrupt.
bool input_log_next(InputLogReader *reader, double rate_hz, int64_t first_step, InputKind *kind,
                    int64_t *step, Status *status);
// Returns the tick of the newest event on any channel: the end of a log that has no end mark.
int64_t input_log_last_step(const InputLogReader *reader, double rate_hz, int64_t first_step);
void input_log_close_reader(InputLogReader *reader);

// --- applying a log again ------------------------------------------------------------------------

// Applies a log of inputs to a simulation offline. Messages of a plain log pass the same gate as
// live ones; those of an exact log passed it when they were recorded. Called by the thread that
// steps the simulation.

// Receives what a live run would publish as an event; body -1: no body in particular.
typedef void ReplayReport(void *user, int body, const char *kind, const char *text);

typedef struct ReplayOptions {
    InputLogReader *input; // opened, or NULL: there is no log
    bool to_its_end;       // the run ends with the log, even if the log has no end mark
    bool any_rate;         // accept an exact log of another tick rate, by its times
    bool quiet;            // no warnings about inputs that were refused or do not fit
    ReplayReport *tell;    // or NULL
    void *user;
} ReplayOptions;

typedef struct Replay {
    World *world;
    Sim *sim;
    double rate_hz;
    ReplayOptions options;
    Gate gate;
    bool lockstep; // poses take effect at once
    bool stopped;  // by STOP
    bool ignored_pacing;
    int64_t first_step;
    int64_t end_step; // of the run; a log of applied inputs may bring it forward
    int64_t applied;
    // read ahead
    bool waiting;
    InputKind kind;
    int64_t waiting_step;
} Replay;

// Begins a replay. `end_step`: the end of the run if the log does not end it. Skips the part of an
// exact log that precedes the world's current step. Returns false with `status` if the log does not
// belong to this run.
bool replay_begin(Replay *replay, World *world, const Scene *scene, int64_t end_step,
                  const ReplayOptions *options, Status *status);
// Applies all inputs due at the start of the next tick.
void replay_due(Replay *replay);
// Warns about inputs of the log that were not used.
void replay_report(const Replay *replay);

#endif
