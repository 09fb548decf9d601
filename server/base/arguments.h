// Command-line handling shared by the server's programs: common options, values with ranges, and
// errors of one line. argp's own errors take two lines and have another exit code.
#ifndef PLIANT_BASE_ARGUMENTS_H
#define PLIANT_BASE_ARGUMENTS_H

#include "base/check.h"

#include <argp.h>
#include <stdbool.h>

// First member of a program's own arguments, so that argp's input is valid as either.
typedef struct Arguments {
    const char *program; // "pliantd"
    bool help, usage, version;
    int parsed;    // arguments understood so far, to name the one that was not
    Status status; // the first error
} Arguments;

enum {
    ARGUMENT_USAGE = 256,
    ARGUMENT_OWN
}; // keys; a program's own long options start at the latter

// The last rows of every option table, before {0}.
#define ARGUMENTS_COMMON(group)                                                                    \
    {"version", 'V', 0, 0, "Print the version, exit", (group)},                                    \
        {"help", '?', 0, 0, "Print this list, exit", (group)},                                     \
    {                                                                                              \
        "usage", ARGUMENT_USAGE, 0, 0, "Print the options in short, exit", (group)                 \
    }

// argp's parser calls `own` for options that are not common; it returns false for unknown ones.
typedef bool ArgumentParser(int key, char *text, void *arguments);
error_t arguments_parse_one(int key, char *text, struct argp_state *state, ArgumentParser *own);
// Parses all arguments and handles --help, --usage and --version. Returns true if the program must
// run; it then checks combinations of options, and status.
bool arguments_parse(Arguments *arguments, const struct argp *argp, int argc, char **argv);
bool arguments_only_print(const Arguments *arguments);

// Sets the status to `option` '`value`' `why`.
void arguments_refuse(Arguments *arguments, const char *option, const char *value, const char *why);
// Parse a number in [low, high] or an integer in [1, most]; refuse others.
double arguments_number(Arguments *arguments, const char *option, const char *text, double low,
                        double high);
int arguments_count(Arguments *arguments, const char *option, const char *text, int most);
// Checks the first part of channel names; returns text.
const char *arguments_prefix(Arguments *arguments, const char *text);
// Checks "auto" or an instruction-set level of this machine; returns text.
const char *arguments_isa(Arguments *arguments, const char *text);
// Sets the level of the log.
void arguments_log_level(Arguments *arguments, const char *text);
// Takes the scene; refuses a second one.
void arguments_scene(Arguments *arguments, const char **scene, const char *text);

#endif
