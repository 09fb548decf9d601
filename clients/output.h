// Text files that a client writes: a client replaces its own files only.
#ifndef PLIANT_CLIENTS_OUTPUT_H
#define PLIANT_CLIENTS_OUTPUT_H

#include "client.h"

#include <stdio.h>

// Opens PATH for writing and empties it. A regular file that is not empty must begin with `mark`,
// as the client's own do; devices and pipes are accepted. Returns NULL with `error` on failure.
FILE *client_open_output(const char *path, const char *mark, ClientError *error);
// Checks the same before there is anything to write; makes no file.
bool client_may_write(const char *path, const char *mark, ClientError *error);

#endif
