// The log of applied inputs (--log-inputs) and the reader of logs (--input). The log is an LCM
// event log whose first event, on the channel PLIANT_INPUT_LOG, says how it was made; the others
// are the messages as they were accepted, stamped with the simulated time [us] of the tick at whose
// start they were applied, from which the tick follows exactly. Its last event says where the run
// ended. Writing: the files thread. Reading: off line.
#ifndef PLIANT_RUN_INPUT_LOG_H
#define PLIANT_RUN_INPUT_LOG_H

#include "files/event_log.h"
#include "run/exchange.h"

typedef struct InputLogHeader {
    char scene[64];
    char prefix[64]; // of the input channels
    char isa[32];    // instruction-set level of the kernels
    double rate_hz;
    int64_t step;   // ticks completed at the start of the run
    int64_t inputs; // applied since that tick before it, and not in this log (a resumed run)
} InputLogHeader;

typedef struct InputLogWriter InputLogWriter;

// Creates or replaces the file. NULL with `status`.
InputLogWriter *input_log_create(const char *path, const InputLogHeader *header, Status *status);
// False once the disk refuses (reported by input_log_close).
bool input_log_write(InputLogWriter *writer, const AppliedInput *applied);
void input_log_flush(InputLogWriter *writer);
// And to the disk.
void input_log_sync(InputLogWriter *writer);
// False with `status` once something could not be written.
bool input_log_whole(const InputLogWriter *writer, Status *status);
// The run ended after `step` ticks; `lost` inputs are missing. Destroys the writer.
bool input_log_close(InputLogWriter *writer, int64_t step, int64_t lost, Status *status);

typedef struct InputLogReader {
    EventLog log;
    bool exact;            // written by --log-inputs
    InputLogHeader header; // exact logs
    bool ended;            // exact logs: the run's end was read
    int64_t end_step, lost;
    char prefix[64];
    int64_t first_us; // plain logs: time stamp of the first event
    bool started;
    bool has_event; // `event` was read ahead
    LogEvent event;
    int64_t used, skipped; // messages on our channels, and others
} InputLogReader;

// Opens either kind and reads an exact log's header. `path` outlives the reader.
bool input_log_open(InputLogReader *reader, const char *path, Status *status);
// The next message on one of our channels: its kind, bytes in reader->event, and the tick at whose
// start it is to be applied (plain logs: the first tick at or after its time since the log's first
// event, counted from `first_step`). False at the end, with a failure in `status` if the log is cut
// off or corrupt.
bool input_log_next(InputLogReader *reader, double rate_hz, int64_t first_step, InputKind *kind,
                    int64_t *step, Status *status);
void input_log_close_reader(InputLogReader *reader);

#endif
