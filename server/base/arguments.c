#include "base/arguments.h"

#include "base/isa.h"
#include "base/log.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void arguments_refuse(Arguments *arguments, const char *option, const char *value, const char *why)
{
    status_fail(&arguments->status, STATUS_INVALID, "%s: %s '%s' %s (see %s --help)",
                arguments->program, option, value, why, arguments->program);
}

double arguments_number(Arguments *arguments, const char *option, const char *text, double low,
                        double high)
{
    char *end, why[64];
    double value = strtod(text, &end);
    if (end == text || *end != '\0' || !(value >= low && value <= high)) {
        snprintf(why, sizeof why, "is not a number in [%g, %g]", low, high);
        arguments_refuse(arguments, option, text, why);
    }
    return value;
}

int arguments_count(Arguments *arguments, const char *option, const char *text, int most)
{
    char *end, why[64];
    long value = strtol(text, &end, 10);
    if (end == text || *end != '\0' || value < 1 || value > most) {
        snprintf(why, sizeof why, "is not an integer in [1, %d]", most);
        arguments_refuse(arguments, option, text, why);
        return 1;
    }
    return (int)value;
}

// Channels are matched as regular expressions and have at most 63 characters.
const char *arguments_prefix(Arguments *arguments, const char *text)
{
    static const char letters[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
    if (text[0] == '\0' || strlen(text) > 31 || strspn(text, letters) != strlen(text))
        arguments_refuse(arguments, "--prefix", text, "is not 1 to 31 letters, digits, _ or -");
    return text;
}

const char *arguments_isa(Arguments *arguments, const char *text)
{
    char why[192] = "is not one of auto";
    for (const char *const *level = isa_available(); *level != NULL; level++)
        snprintf(why + strlen(why), sizeof why - strlen(why), ", %s", *level);
    snprintf(why + strlen(why), sizeof why - strlen(why), " here");
    if (isa_find(text) == ISA_COUNT)
        arguments_refuse(arguments, "--isa", text, why);
    return text;
}

void arguments_log_level(Arguments *arguments, const char *text)
{
    LogLevel level;
    if (log_parse_level(text, &level))
        log_set_level(level);
    else
        arguments_refuse(arguments, "--log-level", text, "is not error, warning, info or debug");
}

void arguments_scene(Arguments *arguments, const char **scene, const char *text)
{
    if (*scene != NULL)
        status_fail(&arguments->status, STATUS_INVALID,
                    "%s: one scene at a time, got '%s' and '%s' (see %s --help)",
                    arguments->program, *scene, text, arguments->program);
    *scene = text;
}

error_t arguments_parse_one(int key, char *text, struct argp_state *state, ArgumentParser *own)
{
    Arguments *arguments = state->input;
    switch (key) {
    case ARGP_KEY_INIT:
    case ARGP_KEY_SUCCESS:
    case ARGP_KEY_END:
    case ARGP_KEY_FINI:
    case ARGP_KEY_NO_ARGS:
        return 0;
    case 'V':
        arguments->version = true;
        break;
    case '?':
        arguments->help = true;
        break;
    case ARGUMENT_USAGE:
        arguments->usage = true;
        break;
    default:
        if (!own(key, text, arguments))
            return ARGP_ERR_UNKNOWN;
    }
    arguments->parsed = state->next;
    return 0;
}

// With ARGP_NO_ERRS argp prints no help either.
bool arguments_parse(Arguments *arguments, const struct argp *argp, int argc, char **argv)
{
    arguments->parsed = 1;
    if (argp_parse(argp, argc, argv, ARGP_IN_ORDER | ARGP_NO_ERRS | ARGP_NO_HELP, NULL,
                   arguments) != 0)
        status_fail(&arguments->status, STATUS_INVALID,
                    "%s: '%s' is no option or lacks its value (see %s --help)", arguments->program,
                    arguments->parsed < argc ? argv[arguments->parsed] : "?", arguments->program);
    char name[32];
    snprintf(name, sizeof name, "%s", arguments->program);
    if (arguments->help || arguments->usage)
        argp_help(argp, stdout,
                  arguments->help ? ARGP_HELP_SHORT_USAGE | ARGP_HELP_LONG | ARGP_HELP_DOC
                                  : ARGP_HELP_USAGE,
                  name);
    else if (arguments->version)
        printf("%s %s\n", arguments->program, PLIANT_VERSION);
    return !arguments_only_print(arguments);
}

bool arguments_only_print(const Arguments *arguments)
{
    return arguments->help || arguments->usage || arguments->version;
}
