// Rows that several programs of the server have.
#include "base/arguments.h"

#include "base/isa.h"
#include "base/log.h"

#include <string.h>

static bool take_scene(void *target, const char *text, Status *why)
{
    const char **scene = target;
    if (*scene != NULL)
        return status_fail(why, STATUS_INVALID, "one scene at a time, got '%s' and '%s'", *scene,
                           text);
    *scene = text;
    return true;
}

static bool take_isa(void *target, const char *text, Status *why)
{
    char levels[192] = "auto";
    for (const char *const *level = isa_available(); *level != NULL; level++)
        snprintf(levels + strlen(levels), sizeof levels - strlen(levels), ", %s", *level);
    if (isa_find(text) == ISA_COUNT)
        return status_fail(why, STATUS_INVALID, "is not one of %s here", levels);
    *(const char **)target = text;
    return true;
}

static bool take_log_level(void *target, const char *text, Status *why)
{
    (void)target;
    LogLevel level;
    if (!log_parse_level(text, &level))
        return status_fail(why, STATUS_INVALID, "is not error, warning, info or debug");
    log_set_level(level);
    return true;
}

const ArgumentRow ARGUMENTS_SCENE[] = {{NULL, 0, ARGUMENT_OPERAND, .handler = take_scene}, {0}};

const ArgumentRow ARGUMENTS_ISA[] = {
    {"isa", 0, ARGUMENT_OTHER, "LEVEL", .handler = take_isa,
     .help = "Instruction-set level of the kernels: auto or a level's name"},
    {0}};

const ArgumentRow ARGUMENTS_LOG_LEVEL[] = {
    {"log-level", 0, ARGUMENT_OTHER, "L", .handler = take_log_level,
     .help = "What to report on stderr: error, warning, info or debug (default: pliantd info, "
             "pliant-study error)"},
    {0}};
