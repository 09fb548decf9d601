// SPDX-License-Identifier: MIT
// pliant-record: records a running daemon from its messages, converts an event log to a recording,
// and describes a recording.
#include "live.h"
#include "program.h"

#include "io/recording.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

typedef struct Options {
    LiveOptions live;
    const char *output, *info, *convert;
    const char *newest; // of the bodies
    bool overwrite;
    int queue_mb;
    char body[ITEM_BODIES][RECORDING_BODY_TEXT];
} Options;

static bool add_body(void *target, const char *name, Status *why)
{
    Options *options = target;
    for (int i = 0; i < options->live.body_count; i++) {
        if (strcmp(options->body[i], name) == 0)
            return true;
    }
    if (options->live.body_count == ITEM_BODIES)
        return status_fail(why, STATUS_INVALID, "is one more than %d", ITEM_BODIES);
    snprintf(options->body[options->live.body_count++], RECORDING_BODY_TEXT, "%s", name);
    return true;
}

#define AT(member) offsetof(Options, member)

static const ArgumentRow ROWS[] = {
    {.type = ARGUMENT_HEADING, .help = "What to record:"},
    {"output", 'o', ARGUMENT_TEXT, "FILE", AT(output),
     .help = "the recording (HDF5, with a sidecar FILE.xdmf for ParaView)"},
    {"overwrite", 0, ARGUMENT_FLAG, NULL, AT(overwrite), .help = "replace an existing recording"},
    {"body", 'b', ARGUMENT_NAME, "NAME", AT(newest), .handler = add_body,
     .help = "record this body; may be repeated (default: all bodies)"},
    {"hz", 0, ARGUMENT_NUMBER, "HZ", AT(live.intake.hz), 1e-3, 1e4,
     .help = "at most HZ frames per simulated second (default: all)"},
    {"still", 0, ARGUMENT_NUMBER, "M", AT(live.intake.still), 0.0, 1.0,
     .help = "do not store a body again while no coordinate of it is farther than M metres from "
             "its last stored frame (default: 0, while it is bit-identical)"},
    {"duration", 'd', ARGUMENT_NUMBER, "S", AT(live.duration), 0.01, 1e7,
     .help = "end S seconds after the recording began"},
    {"wait", 0, ARGUMENT_NUMBER, "S", AT(live.wait), 0.01, 1e7,
     .help = "give up when no daemon is found within S seconds"},
    {"queue", 0, ARGUMENT_INTEGER, "MB", AT(queue_mb), 1, 65536, .preset = 256,
     .help = "memory for frames that wait for the disk"},
    {.type = ARGUMENT_HEADING, .help = "Instead of recording a daemon:"},
    {"info", 0, ARGUMENT_TEXT, "FILE", AT(info),
     .help = "print the contents of a recording, instead of making one"},
    {"convert", 0, ARGUMENT_TEXT, "LOG", AT(convert),
     .help = "record from an event log of lcm-logger, instead of from a daemon"},
    {.type = ARGUMENT_HEADING, .help = "Where:"},
    {.type = ARGUMENT_ROWS, .rows = PROGRAM_WHERE, .offset = AT(live.client)},
    {.type = ARGUMENT_ROWS, .rows = PROGRAM_INPUT_PREFIX, .offset = AT(live.intake.input_prefix)},
    {0}};

static void complete(Options *options)
{
    LiveOptions *live = &options->live;
    IntakeOptions *intake = &live->intake;
    live->body = options->body;
    live->queue_bytes = (size_t)options->queue_mb * 1000000;
    intake->prefix = live->client.prefix;
    intake->input_prefix = intake->input_prefix ? intake->input_prefix : intake->prefix;
    intake->path = options->output;
    intake->overwrite = options->overwrite;
}

static bool check(void *target, Status *why)
{
    Options *options = target;
    complete(options);
    if (options->info)
        return !(options->output || options->convert) ||
               status_fail(why, STATUS_INVALID, "--info goes without --output and --convert");
    if (!options->output)
        return status_fail(why, STATUS_INVALID, "--output FILE says where to record to");
    return !options->convert || !(options->live.duration > 0.0 || options->live.wait > 0.0) ||
           status_fail(why, STATUS_INVALID, "--duration and --wait do not go with --convert");
}

static const ArgumentTable TABLE = {
    .program = "pliant-record",
    .about = "Records what a running pliantd publishes: node positions and meshes of its bodies, "
             "its tools and events. The daemon needs no option for it, may start later, and may "
             "restart: the recording then continues in another file.",
    .end = "The file can be read while it is written, and up to its last second after this program "
           "was killed. The recording ends on SIGINT or SIGTERM, after --duration, or when the "
           "disk is full.\n"
           "Exit status: 0 done, 1 nothing arrived or not everything could be written, 2 bad usage "
           "or a file that cannot be used.",
    .rows = ROWS,
    .check = check};

// --- what is asked for ---------------------------------------------------------------------------

static int fail_with(const char *text, int code)
{
    PliantError error;
    client_fail(&error, "%s", text);
    program_print_error("pliant-record", &error);
    return code;
}

static int print_info(const char *path)
{
    static RecordingInfo info;
    Status status = {0};
    if (!recording_info_read(path, &info, &status))
        return fail_with(status.text, 2);
    recording_info_print(&info, stdout);
    return 0;
}

// The empty file that was claimed and not used.
static void remove_unused(const char *path)
{
    struct stat facts;
    if (stat(path, &facts) == 0 && S_ISREG(facts.st_mode) && facts.st_size == 0)
        unlink(path);
}

static int record(const Options *options)
{
    Status status = {0};
    PliantError error = {0};
    if (options->convert && access(options->convert, R_OK) != 0) {
        client_fail(&error, "%s: cannot be read", options->convert);
        return fail_with(error.text, 2);
    }
    // Refuse a file before anything is received.
    struct stat facts;
    const bool kept =
        stat(options->output, &facts) == 0 && S_ISREG(facts.st_mode) && facts.st_size > 0;
    if (!recording_claim(options->output, options->overwrite, &status)) {
        client_fail(&error, "%s%s", status.text,
                    kept && !options->overwrite ? "; --overwrite replaces a recording" : "");
        return fail_with(error.text, 2);
    }
    program_catch_signals();
    // From a log, or from a running daemon.
    bool ok = options->convert ? convert_log(options->convert, &options->live, &error)
                               : live_record(&options->live, &error);
    // A file that was claimed and never begun is not left behind.
    remove_unused(options->output);
    return ok ? 0 : fail_with(error.text, 1);
}

int main(int argc, char **argv)
{
    static Options options;
    Status status = {0};
    if (!arguments_parse(&TABLE, argc, argv, &options, &status))
        return arguments_exit(&status);
    return options.info ? print_info(options.info) : record(&options);
}
