// pliant-record: records a running daemon from its messages, converts an event log to a recording,
// and describes a recording.
#include "arguments.h"
#include "live.h"

#include "io/recording.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

typedef struct Options {
    LiveOptions live;
    const char *output, *info, *convert;
    bool overwrite;
    long queue_mb;
    char body[ITEM_BODIES][RECORDING_BODY_TEXT];
} Options;

enum {
    KEY_INPUT_PREFIX = 0x600,
    KEY_HZ,
    KEY_INFO,
    KEY_CONVERT,
    KEY_OVERWRITE,
    KEY_WAIT,
    KEY_QUEUE
};

const char *argp_program_version = "pliant-record " PLIANT_VERSION; // argp prints it for --version

static const struct argp_option OPTIONS[] = {
    {"output", 'o', "FILE", 0, "the recording (HDF5, with a sidecar FILE.xdmf for ParaView)", 1},
    {"overwrite", KEY_OVERWRITE, 0, 0, "replace an existing recording", 1},
    {"body", 'b', "NAME", 0, "record this body; may be repeated (default: all bodies)", 1},
    {"hz", KEY_HZ, "HZ", 0, "at most HZ frames per simulated second (default: all)", 1},
    {"duration", 'd', "S", 0, "end S seconds after the recording began", 1},
    {"wait", KEY_WAIT, "S", 0, "give up when no daemon is found within S seconds", 1},
    {"queue", KEY_QUEUE, "MB", 0, "memory for frames that wait for the disk (default: 256)", 1},
    {"info", KEY_INFO, "FILE", 0, "print the contents of a recording, instead of making one", 2},
    {"convert", KEY_CONVERT, "LOG", 0,
     "record from an event log of lcm-logger, instead of from a daemon", 2},
    {"input-prefix", KEY_INPUT_PREFIX, "NAME", 0,
     "prefix of tools and commands, if the scene has an input_prefix (default: as --prefix)", 3},
    {0},
};

static void add_body(Options *options, const char *name, struct argp_state *state)
{
    if (!client_name_valid(name, RECORDING_BODY_TEXT - 1))
        argp_error(state, "--body '%s': 1 to %d letters, digits, '_' or '-'", name,
                   RECORDING_BODY_TEXT - 1);
    for (int i = 0; i < options->live.body_count; i++) {
        if (strcmp(options->body[i], name) == 0)
            return;
    }
    if (options->live.body_count == ITEM_BODIES)
        argp_error(state, "--body '%s': more than %d", name, ITEM_BODIES);
    snprintf(options->body[options->live.body_count++], RECORDING_BODY_TEXT, "%s", name);
}

static void check(Options *options, struct argp_state *state)
{
    if (options->info) {
        if (options->output || options->convert)
            argp_error(state, "--info goes without --output and --convert");
        return;
    }
    if (!options->output)
        argp_error(state, "--output FILE says where to record to");
    if (options->convert && (options->live.duration > 0.0 || options->live.wait > 0.0))
        argp_error(state, "--duration and --wait do not go with --convert");
}

static error_t parse_option(int key, char *argument, struct argp_state *state)
{
    Options *options = state->input;
    LiveOptions *live = &options->live;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = &live->client;
        return 0;
    case 'o':
        options->output = argument;
        return 0;
    case KEY_OVERWRITE:
        options->overwrite = true;
        return 0;
    case 'b':
        add_body(options, argument, state);
        return 0;
    case KEY_HZ:
        argument_number(state, "hz", argument, 1e-3, 1e4, &live->intake.hz);
        return 0;
    case 'd':
        argument_number(state, "duration", argument, 0.01, 1e7, &live->duration);
        return 0;
    case KEY_WAIT:
        argument_number(state, "wait", argument, 0.01, 1e7, &live->wait);
        return 0;
    case KEY_QUEUE:
        argument_integer(state, "queue", argument, 1, 65536, &options->queue_mb);
        return 0;
    case KEY_INFO:
        options->info = argument;
        return 0;
    case KEY_CONVERT:
        options->convert = argument;
        return 0;
    case KEY_INPUT_PREFIX:
        if (!client_name_valid(argument, CLIENT_PREFIX_MAX - 1))
            argp_error(state, "--input-prefix '%s': 1 to %d letters, digits, '_' or '-'", argument,
                       CLIENT_PREFIX_MAX - 1);
        live->intake.input_prefix = argument;
        return 0;
    case ARGP_KEY_END:
        check(options, state);
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static void complete(Options *options)
{
    LiveOptions *live = &options->live;
    IntakeOptions *intake = &live->intake;
    live->body = options->body;
    live->queue_bytes = (size_t)options->queue_mb * 1000000;
    intake->prefix = live->client.prefix ? live->client.prefix : "PLIANT";
    intake->input_prefix = intake->input_prefix ? intake->input_prefix : intake->prefix;
    intake->path = options->output;
    intake->overwrite = options->overwrite;
}

// --- what is asked for ---------------------------------------------------------------------------

static int fail_with(const char *text, int code)
{
    ClientError error;
    client_fail(&error, "%s", text);
    client_print_error("pliant-record", &error);
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
    ClientError error = {0};
    if (options->convert && access(options->convert, R_OK) != 0) {
        client_fail(&error, "%s: cannot be read", options->convert);
        return fail_with(error.text, 2);
    }
    struct stat facts;
    const bool kept =
        stat(options->output, &facts) == 0 && S_ISREG(facts.st_mode) && facts.st_size > 0;
    if (!recording_claim(options->output, options->overwrite, &status)) {
        client_fail(&error, "%s%s", status.text,
                    kept && !options->overwrite ? "; --overwrite replaces a recording" : "");
        return fail_with(error.text, 2);
    }
    client_catch_signals();
    bool ok = options->convert ? convert_log(options->convert, &options->live, &error)
                               : live_record(&options->live, &error);
    remove_unused(options->output);
    return ok ? 0 : fail_with(error.text, 1);
}

int main(int argc, char **argv)
{
    static const struct argp argp = {
        .options = OPTIONS,
        .parser = parse_option,
        .children = CLIENT_WHERE,
        .doc = "Records what a running pliantd publishes: node positions and meshes of its bodies, "
               "its "
               "tools and events. The daemon needs no option for it, may start later, and may "
               "restart: the recording then continues in another file.\v"
               "The file can be read while it is written, and up to its last second after this "
               "program was killed. The recording ends on SIGINT or SIGTERM, after --duration, or "
               "when the disk is full.\n"
               "Exit status: 0 done, 1 nothing arrived or not everything could be written, 2 bad "
               "usage or a file that cannot be used."};
    static Options options = {.queue_mb = 256};
    argp_err_exit_status = 2;
    argp_parse(&argp, argc, argv, 0, NULL, &options);
    complete(&options);
    return options.info ? print_info(options.info) : record(&options);
}
