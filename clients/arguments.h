// Values in a client's arguments: a wrong one ends the program with a sentence.
#ifndef PLIANT_CLIENTS_ARGUMENTS_H
#define PLIANT_CLIENTS_ARGUMENTS_H

#include "client.h"

#include <argp.h>

static inline void argument_number(struct argp_state *state, const char *name, const char *text,
                                   double low, double high, double *number)
{
    if (!client_parse_number(text, low, high, number))
        argp_error(state, "--%s '%s' outside [%g, %g]", name, text, low, high);
}

static inline void argument_integer(struct argp_state *state, const char *name, const char *text,
                                    long low, long high, long *number)
{
    if (!client_parse_integer(text, low, high, number))
        argp_error(state, "--%s '%s' outside [%ld, %ld]", name, text, low, high);
}

// The name of a body.
static inline void argument_body(struct argp_state *state, const char *name, const char *text,
                                 const char **body)
{
    if (!client_name_valid(text, 31))
        argp_error(state, "--%s '%s': 1 to 31 letters, digits, '_' or '-'", name, text);
    *body = text;
}

#endif
