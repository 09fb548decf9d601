// Records a running daemon: receives on this thread, writes on another.
#ifndef PLIANT_CLIENTS_RECORD_LIVE_H
#define PLIANT_CLIENTS_RECORD_LIVE_H

#include "client.h"
#include "intake.h"

typedef struct LiveOptions {
    ClientOptions client;
    IntakeOptions intake;
    char (*body)[RECORDING_BODY_TEXT]; // [body_count]; count 0: all
    int body_count;
    double duration; // [s] from the start of the first file; 0: until a signal
    double wait;     // [s] for a daemon; 0: unlimited
    size_t queue_bytes;
} LiveOptions;

// Returns false with a sentence if nothing could be recorded, or not all was written. A stop by
// signal is no failure.
bool live_record(const LiveOptions *options, ClientError *error);

#endif
