// pliantd: the daemon's command line. Reads and builds the scene, then runs it live, off line, or
// prints what it is.
#include "arguments.h"

#include "base/isa.h"
#include "base/log.h"
#include "files/checkpoint.h"
#include "run/explain.h"
#include "run/live.h"
#include "run/offline.h"
#include "run/realtime.h"
#include "run/report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    OPTION_CHECK = ARGUMENT_OWN,
    OPTION_EXPLAIN,
    OPTION_OFFLINE,
    OPTION_INPUT,
    OPTION_LOG_INPUTS,
    OPTION_RECORD,
    OPTION_CHECKPOINT,
    OPTION_CHECKPOINT_EVERY,
    OPTION_RESUME,
    OPTION_PREPARED,
    OPTION_RATE,
    OPTION_DURATION,
    OPTION_SEED,
    OPTION_LOG_LEVEL,
    OPTION_ISA,
    OPTION_PREFIX,
};

typedef struct DaemonArguments {
    Arguments common;
    const char *scene, *lcm_url, *input, *log_inputs, *record, *checkpoint, *resume, *isa, *prefix;
    const char *prepared;
    bool check, explain, offline;
    double offline_s, checkpoint_s, duration_s, rate_hz; // 0: not given
} DaemonArguments;

static const struct argp_option options[] = {
    {"lcm-url", 'l', "URL", 0, "Where messages travel (else the scene's, LCM_DEFAULT_URL, ttl 0)",
     1},
    {"prefix", OPTION_PREFIX, "NAME", 0,
     "First part of the channels' names, instead of the scene's", 1},
    {"check", OPTION_CHECK, 0, 0, "Read and validate everything, print a summary, exit", 2},
    {"explain", OPTION_EXPLAIN, 0, 0,
     "Print stages, kernels, bytes of every array and what is left out, exit", 2},
    {"offline", OPTION_OFFLINE, "SECONDS", 0,
     "Simulate that long as fast as possible, without network", 3},
    {"input", OPTION_INPUT, "LOG", 0,
     "Off line: apply the inputs of an LCM event log; with --resume, a log of --log-inputs is gone "
     "on with from the checkpoint's step",
     3},
    {"log-inputs", OPTION_LOG_INPUTS, "FILE", 0,
     "Write every accepted input with its tick; --input of it repeats the run bit for bit", 3},
    {"record", OPTION_RECORD, "FILE", 0,
     "Record node positions at publish.nodes_hz into a new HDF5 file (one that exists is refused "
     "unless it is empty), with FILE.xdmf beside it for ParaView",
     4},
    {"checkpoint", OPTION_CHECKPOINT, "FILE", 0,
     "Write a checkpoint at the end, on SIGUSR1 and on command", 4},
    {"checkpoint-every", OPTION_CHECKPOINT_EVERY, "S", 0, "And every S simulated seconds", 4},
    {"resume", OPTION_RESUME, "FILE", 0, "Start from a checkpoint", 4},
    {"prepared", OPTION_PREPARED, "FILE", 0,
     "Read meshes and levels from FILE, which pliant-prepare SCENE.cfg -o FILE made, instead of "
     "the "
     "scene's",
     4},
    {"rate", OPTION_RATE, "HZ", 0, "Ticks a second, instead of the scene's", 5},
    {"duration", OPTION_DURATION, "S", 0, "End after S seconds (late ticks included)", 5},
    {"seed", OPTION_SEED, "N", 0, "Accepted; nothing is random in this version", 5},
    {"isa", OPTION_ISA, "LEVEL", 0, "Instruction-set level of the kernels: auto or a level's name",
     5},
    {"log-level", OPTION_LOG_LEVEL, "L", 0, "error, warning, info or debug", 6},
    ARGUMENTS_COMMON(7),
    {0}};

static bool parse_own(int key, char *text, void *arguments)
{
    DaemonArguments *a = arguments;
    Arguments *common = &a->common;
    char *end;
    switch (key) {
    case 'l':
        a->lcm_url = text;
        break;
    case OPTION_PREFIX:
        a->prefix = arguments_prefix(common, text);
        break;
    case OPTION_CHECK:
        a->check = true;
        break;
    case OPTION_EXPLAIN:
        a->explain = true;
        break;
    case OPTION_OFFLINE:
        a->offline = true;
        a->offline_s = arguments_number(common, "--offline", text, 0.0, 1e7);
        break;
    case OPTION_INPUT:
        a->input = text;
        break;
    case OPTION_LOG_INPUTS:
        a->log_inputs = text;
        break;
    case OPTION_RECORD:
        a->record = text;
        break;
    case OPTION_CHECKPOINT:
        a->checkpoint = text;
        break;
    case OPTION_CHECKPOINT_EVERY:
        a->checkpoint_s = arguments_number(common, "--checkpoint-every", text, 1e-3, 1e7);
        break;
    case OPTION_RESUME:
        a->resume = text;
        break;
    case OPTION_PREPARED:
        a->prepared = text;
        break;
    case OPTION_RATE:
        a->rate_hz = arguments_number(common, "--rate", text, 1.0, 10000.0);
        break;
    case OPTION_DURATION:
        a->duration_s = arguments_number(common, "--duration", text, 1e-3, 1e9);
        break;
    case OPTION_SEED:
        strtoll(text, &end, 0);
        if (end == text || *end != '\0')
            arguments_refuse(common, "--seed", text, "is not an integer");
        break;
    case OPTION_ISA:
        a->isa = arguments_isa(common, text);
        break;
    case OPTION_LOG_LEVEL:
        arguments_log_level(common, text);
        break;
    case ARGP_KEY_ARG:
        arguments_scene(common, &a->scene, text);
        break;
    default:
        return false;
    }
    return true;
}

static error_t parse_option(int key, char *text, struct argp_state *state)
{
    return arguments_parse_one(key, text, state, parse_own);
}

// Options that only make sense together.
static void check_together(DaemonArguments *a)
{
    Status *status = &a->common.status;
    if (a->scene == NULL)
        status_fail(status, STATUS_INVALID, "pliantd: no scene given (see pliantd --help)");
    if (a->input != NULL && !a->offline)
        status_fail(status, STATUS_INVALID, "pliantd: --input needs --offline SECONDS");
    if (a->log_inputs != NULL && a->offline)
        status_fail(status, STATUS_INVALID, "pliantd: --log-inputs logs a live run, not --offline");
    if (a->duration_s > 0.0 && a->offline)
        status_fail(status, STATUS_INVALID,
                    "pliantd: --offline SECONDS has its own duration, drop --duration");
    if (a->record != NULL && ((a->checkpoint != NULL && strcmp(a->record, a->checkpoint) == 0) ||
                              (a->log_inputs != NULL && strcmp(a->record, a->log_inputs) == 0)))
        status_fail(status, STATUS_INVALID, "pliantd: --record '%s' needs a file of its own",
                    a->record);
    if (a->checkpoint_s > 0.0 && a->checkpoint == NULL)
        status_fail(status, STATUS_INVALID, "pliantd: --checkpoint-every needs --checkpoint FILE");
}

static void parse_arguments(int argc, char **argv, DaemonArguments *arguments)
{
    static const struct argp argp = {
        options,
        parse_option,
        "SCENE.cfg",
        "Simulates the soft bodies of a scene in real time and serves them over LCM.\v"
        "Exit code 0: done; 1: failed while running; 2: bad usage, scene, mesh or file.",
        NULL,
        NULL,
        NULL};
    if (arguments_parse(&arguments->common, &argp, argc, argv))
        check_together(arguments);
}

// --- the scene ---

// The level asked for, else that of the log to be repeated, else the best.
static const char *choose_isa(const DaemonArguments *arguments, const InputLogReader *input)
{
    if (arguments->isa != NULL)
        return arguments->isa;
    if (input == NULL || !input->exact)
        return "auto";
    if (isa_find(input->header.isa) != ISA_COUNT)
        return input->header.isa;
    log_line(LOG_WARNING, "%s: made with the kernels '%s', which this machine cannot run",
             arguments->input, input->header.isa);
    return "auto";
}

// --- the run ---

static sigset_t block_signals(void)
{
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGTERM);
    sigaddset(&signals, SIGHUP);
    sigaddset(&signals, SIGUSR1);
    pthread_sigmask(SIG_BLOCK, &signals, NULL);
    signal(SIGPIPE, SIG_IGN);
    return signals;
}

static LiveOptions live_options(World *world, const DaemonArguments *arguments, sigset_t signals)
{
    const Body *body = sim_body(world->sim, 0); // every scene has a body
    return (LiveOptions){.lcm_url = arguments->lcm_url,
                         .isa = body->ops->isa(body->model),
                         .duration_s = arguments->duration_s,
                         .checkpoint_path = arguments->checkpoint,
                         .checkpoint_s = arguments->checkpoint_s,
                         .input_log_path = arguments->log_inputs,
                         .record_path = arguments->record,
                         .signals = signals};
}

// With everything that a live run adds, unless the plan of a run off line is asked for.
static void explain_run(World *world, const Scene *scene, const DaemonArguments *arguments,
                        sigset_t signals)
{
    const LiveOptions live = live_options(world, arguments, signals);
    const ExchangeOptions asked = live_exchange(scene, &live);
    if (!arguments->offline)
        live_reserve(world, scene, &live);
    explain_plan(world, scene, arguments->offline ? NULL : &asked, stdout);
}

static bool run_world(World *world, Scene *scene, const DaemonArguments *arguments,
                      InputLogReader *input, sigset_t signals, Status *status)
{
    if (arguments->explain) {
        explain_run(world, scene, arguments, signals);
        return true;
    }
    if (arguments->check) {
        explain_summary(world, scene, stdout);
        return true;
    }
    if (arguments->offline) {
        OfflineOptions offline = {.seconds = arguments->offline_s,
                                  .input = input,
                                  .checkpoint_path = arguments->checkpoint,
                                  .checkpoint_s = arguments->checkpoint_s,
                                  .record_path = arguments->record,
                                  .signals = signals};
        OfflineResult result;
        if (!offline_run(world, scene, &offline, &result, status))
            return false;
        report_offline(world, &result, stdout);
        return true;
    }
    const LiveOptions how = live_options(world, arguments, signals);
    Live *live = live_reserve(world, scene, &how);
    LiveResult result = {0};
    bool whole = live_run(live, &result, status);
    if (result.ticks > 0 || whole)
        report_live(world, &result, stdout);
    return whole;
}

// A checkpoint holds the loads in force, so both sides of it must have room for them.
static bool may_load(const DaemonArguments *arguments)
{
    return !arguments->offline || arguments->input != NULL || arguments->checkpoint != NULL ||
           arguments->resume != NULL;
}

static bool may_record(const Scene *scene, const DaemonArguments *arguments, Status *status)
{
    return arguments->record == NULL || scene->publish.nodes_hz > 0.0 ||
           status_fail(status, STATUS_INVALID,
                       "%s: --record records at publish.nodes_hz, which is 0", scene->path);
}

static bool run(const DaemonArguments *arguments, Status *status)
{
    sigset_t signals = block_signals();
    realtime_flush_denormals();
    Scene scene = {0};
    World world = {0};
    InputLogReader *input = NULL;
    bool whole = true;
    if (arguments->input != NULL) {
        input = calloc(1, sizeof *input);
        whole = input != NULL && input_log_open(input, arguments->input, status);
    }
    const char *isa = whole ? choose_isa(arguments, input) : "auto";
    whole = status->code == STATUS_OK && scene_read(arguments->scene, &scene, status) &&
            scene_override(&scene, arguments->rate_hz, arguments->prefix, status) &&
            may_record(&scene, arguments, status);
    if (whole) {
        BuildOptions build = {.isa = isa,
                              .prepared = arguments->prepared,
                              .may_load = may_load(arguments),
                              .publishes = !arguments->offline};
        whole = world_build(&world, &scene, &build, status) &&
                (arguments->resume == NULL ||
                 checkpoint_read(arguments->resume, &world, &scene, status)) &&
                run_world(&world, &scene, arguments, input, signals, status);
        world_destroy(&world);
    }
    scene_destroy(&scene);
    if (input != NULL)
        input_log_close_reader(input);
    free(input);
    return whole;
}

int main(int argc, char **argv)
{
    log_set_program("pliantd");
    static DaemonArguments arguments = {.common.program = "pliantd"};
    parse_arguments(argc, argv, &arguments);
    Status *status = &arguments.common.status;
    if (status->code == STATUS_OK && !arguments_only_print(&arguments.common))
        run(&arguments, status);
    fflush(stdout);
    if (status->code != STATUS_OK)
        fprintf(stderr, "%s%s\n", log_priority(LOG_ERROR), status->text);
    return (int)status->code;
}
