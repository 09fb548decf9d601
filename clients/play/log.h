// SPDX-License-Identifier: MIT
// Event logs of lcm-logger as recordings: converted as `pliant-record --convert` does, into a
// folder that is removed at once.
#ifndef PLIANT_PLAY_LOG_H
#define PLIANT_PLAY_LOG_H

#include "client.h"
#include "timeline.h"

// True if the file begins like an event log.
bool log_is_one(const char *path);
// Converts logs and opens them; prints how long it took. One that is damaged or cut off is used as
// far as it goes: prints what is wrong, and clears `whole`. Returns NULL with `status`.
Timeline *log_open(char *const *path, int count, const PliantOptions *client, bool *whole,
                   Status *status);

#endif
