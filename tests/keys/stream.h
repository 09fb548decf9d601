// SPDX-License-Identifier: MIT
// What the running daemon publishes of scenes that differ in one key.
#ifndef PLIANT_TESTS_KEYS_STREAM_H
#define PLIANT_TESTS_KEYS_STREAM_H

#include "harness.h"
#include "rows.h"

// Runs the daemon on every STREAM row of a model, all at once, each in a network of its own, and
// prints those whose stream is as that of the scene without the change; how many these are.
int stream_faults(KeyModel model, const char *model_name);

#endif
