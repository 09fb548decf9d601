// Converts an event log of lcm-logger to a recording. Reads it twice: once for the bodies and
// tools, then for the data.
#ifndef PLIANT_CLIENTS_RECORD_CONVERT_H
#define PLIANT_CLIENTS_RECORD_CONVERT_H

#include "live.h"

// Uses only the options of the intake, the bodies and the queue. Returns false with a sentence on
// failure; messages before a damaged part of the log are recorded all the same.
bool convert_log(const char *log, const LiveOptions *options, ClientError *error);

#endif
