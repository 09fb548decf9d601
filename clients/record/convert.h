// Makes a recording of an event log, as lcm-logger writes it. It is read twice: what is in it, and
// then all of it.
#ifndef PLIANT_CLIENTS_RECORD_CONVERT_H
#define PLIANT_CLIENTS_RECORD_CONVERT_H

#include "live.h"

// Of the options only those of the intake, the bodies and the queue matter. False with a sentence;
// what came before a place where the log is damaged is recorded all the same.
bool convert_log(const char *log, const LiveOptions *options, ClientError *error);

#endif
