// SPDX-License-Identifier: MIT
// pliant-fit: fits a material to a measured curve of stress over strain.
#include "fit/fit.h"

#include "base/log.h"
#include "run/realtime.h"

#include <stddef.h>

static bool take_table(void *target, const char *text, Status *why)
{
    FitOptions *options = target;
    if (options->table_path != NULL)
        return status_fail(why, STATUS_INVALID, "one table at a time, got '%s' and '%s'",
                           options->table_path, text);
    options->table_path = text;
    return true;
}

static bool check(void *target, Status *why)
{
    const FitOptions *options = target;
    return options->table_path != NULL ? fit_check(options, why)
                                       : status_fail(why, STATUS_INVALID, "no table given");
}

static const ArgumentRow ROWS[] = {
    {NULL, 0, ARGUMENT_OPERAND, .handler = take_table},
    {.type = ARGUMENT_ROWS, .rows = FIT_ARGUMENTS},
    {"out", 0, ARGUMENT_TEXT, "FOLDER", offsetof(FitOptions, out_folder),
     .help = "Folder for table, picture and strip, instead of fit-NAME"},
    {.type = ARGUMENT_ROWS, .rows = ARGUMENTS_LOG_LEVEL},
    {0}};

static const ArgumentTable TABLE = {
    .program = "pliant-fit",
    .usage = "CURVE.csv",
    .about = "Fits youngs_modulus, alone and with stiffening, to a table of one uniaxial pull, and "
             "prints the material group, the rms error of both, and that of a simulated strip. "
             "Columns, separated by commas: nominal strain [-], from 0 up, never falling; nominal "
             "stress (force over the section at rest) [Pa]; # begins a comment, the first line may "
             "be a header; 4 to 100000 points.",
    .end = "Exit code 0: done; 1: failed while running; 2: bad usage or table.",
    .rows = ROWS,
    .check = check};

int main(int argc, char **argv)
{
    log_set_program("pliant-fit");
    log_set_level(LOG_ERROR); // pliantd reports what is clamped or repaired
    realtime_flush_denormals();
    static FitOptions options;
    Status status = {0};
    if (arguments_parse(&TABLE, argc, argv, &options, &status))
        fit_run(&options, &status);
    return arguments_exit(&status);
}
