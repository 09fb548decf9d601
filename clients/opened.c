// SPDX-License-Identifier: MIT
// Clients of programs that a signal stops: of what program.h declares, what needs the library.
#include "program.h"

static void end(void *client)
{
    pliant_stop(client);
}

PliantClient *program_open(const PliantOptions *options, PliantError *error)
{
    const bool there = program_await_network(options->url, error);
    PliantClient *client = there ? pliant_open(options, error) : NULL;
    if (client)
        program_stops(end, client);
    return client;
}

void program_close(PliantClient *client)
{
    program_stops(NULL, NULL);
    pliant_close(client);
}
