// SPDX-License-Identifier: MIT
// Where recordings come from: a running daemon, or an event log.
#ifndef PLIANT_CLIENTS_RECORD_LIVE_H
#define PLIANT_CLIENTS_RECORD_LIVE_H

#include "client.h"
#include "intake.h"

// --- a running daemon ----------------------------------------------------------------------------

// Records a running daemon: receives on this thread, writes on another.

typedef struct LiveOptions {
    PliantOptions client;
    IntakeOptions intake;
    char (*body)[RECORDING_BODY_TEXT]; // [body_count]; count 0: all
    int body_count;
    double duration; // [s] from the start of the first file; 0: until a signal
    double wait;     // [s] for a daemon; 0: unlimited
    size_t queue_bytes;
} LiveOptions;

// Returns false with a sentence if nothing could be recorded, or not all was written. A stop by
// signal is no failure.
bool live_record(const LiveOptions *options, PliantError *error);

// --- an event log --------------------------------------------------------------------------------

// Converts an event log of lcm-logger to a recording. Reads it twice: once for the bodies and
// tools, then for the data.

// Uses only the options of the intake, the bodies and the queue. Returns false with a sentence on
// failure; messages before a damaged part of the log are recorded all the same.
bool convert_log(const char *log, const LiveOptions *options, PliantError *error);

#endif
