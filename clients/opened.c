// SPDX-License-Identifier: MIT
// Clients of programs that a signal stops: of what program.h declares, what needs the library.
#include "program.h"

#include <string.h>

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

// Any other failure than that nobody is there.
static bool is_absence(const char *why)
{
    return strstr(why, "no pliantd on") != NULL || strstr(why, "is pliantd running") != NULL;
}

bool program_await_server(PliantClient *client, bool (*wait)(PliantClient *client, double seconds),
                          double patience_s, PliantError *error)
{
    for (bool said = false; !wait(client, patience_s); said = true) {
        const char *why = pliant_error(client), *refusal = pliant_refusal(client);
        // A server that is there but takes no messages of this host is not waited for.
        if (refusal != NULL)
            return program_fail(error, "%s; %s", why, refusal);
        if (patience_s != PROGRAM_PATIENCE_S || program_stopped() || !is_absence(why))
            return program_fail(error, "%s", why);
        if (!said)
            fprintf(stderr, "waiting for a server: %s\n", why);
    }
    return true;
}

void program_close(PliantClient *client)
{
    program_stops(NULL, NULL);
    pliant_close(client);
}
