// What the command lines of the server's programs share: options that all have, values with ranges,
// and one line for what is wrong. argp's own errors take two lines and an exit code of their own.
#ifndef PLIANT_SERVER_ARGUMENTS_H
#define PLIANT_SERVER_ARGUMENTS_H

#include "base/status.h"

#include <argp.h>
#include <stdbool.h>

// Comes first in a program's own arguments, so that argp's input is either.
typedef struct Arguments {
    const char *program; // "pliantd"
    bool help, usage, version;
    int parsed;    // arguments that were understood, for the message about the one that was not
    Status status; // the first that was wrong
} Arguments;

enum { ARGUMENT_USAGE = 256, ARGUMENT_OWN }; // keys; a program's own long options from the latter

// The last rows of every table of options, before {0}.
#define ARGUMENTS_COMMON(group)                                                                    \
    {"version", 'V', 0, 0, "Print the version, exit", (group)},                                    \
        {"help", '?', 0, 0, "Print this list, exit", (group)},                                     \
    {                                                                                              \
        "usage", ARGUMENT_USAGE, 0, 0, "Print the options in short, exit", (group)                 \
    }

// argp's parser calls `own` for what is not common; that returns false for what it does not know.
typedef bool ArgumentParser(int key, char *text, void *arguments);
error_t arguments_parse_one(int key, char *text, struct argp_state *state, ArgumentParser *own);
// All of them, then --help, --usage or --version. True when the program has still to do its work:
// then look at what was given together, and at status.
bool arguments_parse(Arguments *arguments, const struct argp *argp, int argc, char **argv);
bool arguments_only_print(const Arguments *arguments);

// `option` '`value`' `why`, for the status.
void arguments_refuse(Arguments *arguments, const char *option, const char *value, const char *why);
// A number in [low, high], an integer in [1, most]; else refused.
double arguments_number(Arguments *arguments, const char *option, const char *text, double low,
                        double high);
int arguments_count(Arguments *arguments, const char *option, const char *text, int most);
// First part of channels' names; returns text.
const char *arguments_prefix(Arguments *arguments, const char *text);
// "auto" or a level of this machine; returns text.
const char *arguments_isa(Arguments *arguments, const char *text);
// Sets the level of the log.
void arguments_log_level(Arguments *arguments, const char *text);
// One scene at a time.
void arguments_scene(Arguments *arguments, const char **scene, const char *text);

#endif
