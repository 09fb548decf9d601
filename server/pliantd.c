// SPDX-License-Identifier: MIT
// pliantd: the daemon's command line. Reads and builds the scene, then runs it live or offline, or
// describes it.
#include "base/arguments.h"

#include "base/isa.h"
#include "base/log.h"
#include "base/output.h"
#include "io/checkpoint.h"
#include "scene/build.h"
#include "run/modes.h"
#include "run/realtime.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct DaemonArguments {
    const char *scene, *lcm_url, *input, *log_inputs, *record, *checkpoint, *resume, *isa, *prefix;
    const char *prepared;
    bool check, explain, offline, to_log_end, continues, remote, no_stop;
    double offline_s;                                          // negative: not given
    double checkpoint_s, duration_s, rate_hz, record_tools_hz; // 0: not given
} DaemonArguments;

#define AT(member) offsetof(DaemonArguments, member)

static const ArgumentRow ROWS[] = {
    {.type = ARGUMENT_ROWS, .rows = ARGUMENTS_SCENE, .offset = AT(scene)},
    {.type = ARGUMENT_HEADING, .help = "Where:"},
    {"lcm-url", 'l', ARGUMENT_TEXT, "URL", AT(lcm_url),
     .help = "LCM network (default: the scene's lcm_url, else LCM_DEFAULT_URL, else LCM's own, ttl "
             "0)"},
    {"prefix", 0, ARGUMENT_NAME, "NAME", AT(prefix),
     .help = "Prefix of the channels, instead of the scene's"},
    {"remote", 0, ARGUMENT_FLAG, NULL, AT(remote),
     .help = "Accept messages from other hosts, as with the scene's remote = true"},
    {"no-stop", 0, ARGUMENT_FLAG, NULL, AT(no_stop),
     .help = "Refuse the command STOP, as with the scene's stop_command = false"},
    {.type = ARGUMENT_HEADING, .help = "Instead of a live run:"},
    {"check", 0, ARGUMENT_FLAG, NULL, AT(check),
     .help = "Read and validate everything, print a summary and what a tick takes on this "
             "machine, exit"},
    {"explain", 0, ARGUMENT_FLAG, NULL, AT(explain),
     .help = "Print stages, kernels, bytes of every array and disabled features, exit"},
    {"offline", 0, ARGUMENT_NUMBER, "SECONDS", AT(offline_s), 0.0, 1e7, .preset = -1.0,
     .help = "Simulate that long as fast as possible, without network"},
    {"input", 0, ARGUMENT_TEXT, "LOG", AT(input),
     .help = "Offline: apply the inputs of an LCM event log, and end where it ends, or after "
             "--offline SECONDS; with --resume, continue a log of --log-inputs from the "
             "checkpoint's step"},
    {.type = ARGUMENT_HEADING, .help = "Files:"},
    {"log-inputs", 0, ARGUMENT_TEXT, "FILE", AT(log_inputs),
     .help = "Write every accepted input with its tick; --input FILE repeats the run "
             "bit-identically. An existing file is refused unless it is empty (--continue: "
             "numbered)"},
    {"record", 0, ARGUMENT_TEXT, "FILE", AT(record),
     .help = "Record node positions at publish.nodes_hz into a new HDF5 file (an existing file is "
             "refused unless it is empty; --continue: numbered), with a sidecar FILE.xdmf for "
             "ParaView"},
    {"record-tools-hz", 0, ARGUMENT_NUMBER, "HZ", AT(record_tools_hz), 1e-3, 10000.0,
     .help = "Record positions and forces of tools at this rate, instead of with the nodes"},
    {"checkpoint", 0, ARGUMENT_TEXT, "FILE", AT(checkpoint),
     .help = "Write a checkpoint at the end, on SIGUSR1 and on command. It replaces only an "
             "earlier checkpoint: see --continue"},
    {"checkpoint-every", 0, ARGUMENT_NUMBER, "S", AT(checkpoint_s), 1e-3, 1e7,
     .help = "Also write a checkpoint every S simulated seconds"},
    {"resume", 0, ARGUMENT_TEXT, "FILE", AT(resume),
     .help = "Start from a checkpoint; with --continue, only if the file of --checkpoint does not "
             "exist"},
    {"continue", 0, ARGUMENT_FLAG, NULL, AT(continues),
     .help =
         "Continue the last run: start from the file of --checkpoint if it exists, or from FILE.1, "
         "the one before, if that cannot be used, and write the log and the recording of this "
         "run to FILE-2, FILE-3, ... (before the extension) if FILE exists"},
    {"prepared", 0, ARGUMENT_TEXT, "FILE", AT(prepared),
     .help = "Read meshes and levels from FILE, made by pliant-prepare SCENE.cfg -o FILE, instead "
             "of building the scene's"},
    {.type = ARGUMENT_HEADING, .help = "How:"},
    {"rate", 0, ARGUMENT_NUMBER, "HZ", AT(rate_hz), 1.0, 10000.0,
     .help = "Ticks per second, instead of the scene's"},
    {"duration", 0, ARGUMENT_NUMBER, "S", AT(duration_s), 1e-3, 1e9,
     .help = "End after S seconds (late ticks included)"},
    {"seed", 0, ARGUMENT_INTEGER, "N", .low = -HUGE_VAL, .high = HUGE_VAL, .idle = true,
     .help = "deprecated, since nothing is random"},
    {.type = ARGUMENT_ROWS, .rows = ARGUMENTS_ISA, .offset = AT(isa)},
    {.type = ARGUMENT_ROWS, .rows = ARGUMENTS_LOG_LEVEL},
    {0}};

// Refuses options that are not valid together.
static bool check_together(void *target, Status *why)
{
    DaemonArguments *a = target;
    if (a->scene == NULL)
        return status_fail(why, STATUS_INVALID, "no scene given");
    // Which run it is follows from what was given.
    a->offline = a->offline_s >= 0.0;
    a->offline_s = fmax(a->offline_s, 0.0);
    a->to_log_end = a->input != NULL && !a->offline;
    a->offline |= a->to_log_end;
    // Options that contradict it.
    if (a->log_inputs != NULL && a->offline)
        return status_fail(why, STATUS_INVALID, "--log-inputs logs a live run, not %s",
                           a->to_log_end ? "--input" : "--offline");
    if (a->duration_s > 0.0 && a->to_log_end)
        return status_fail(why, STATUS_INVALID,
                           "--input ends with its log: --offline SECONDS, not --duration, ends it "
                           "earlier");
    if (a->duration_s > 0.0 && a->offline)
        return status_fail(why, STATUS_INVALID,
                           "--offline SECONDS has its own duration, drop --duration");
    // Files must differ, and options need the file that they are about.
    if (a->record != NULL && ((a->checkpoint != NULL && strcmp(a->record, a->checkpoint) == 0) ||
                              (a->log_inputs != NULL && strcmp(a->record, a->log_inputs) == 0)))
        return status_fail(why, STATUS_INVALID, "--record '%s' needs a file of its own", a->record);
    if (a->record_tools_hz > 0.0 && a->record == NULL)
        return status_fail(why, STATUS_INVALID, "--record-tools-hz needs --record FILE");
    if (a->checkpoint_s > 0.0 && a->checkpoint == NULL)
        return status_fail(why, STATUS_INVALID, "--checkpoint-every needs --checkpoint FILE");
    return true;
}

static const ArgumentTable TABLE = {
    .program = "pliantd",
    .usage = "SCENE.cfg",
    .about = "Simulates the soft bodies of a scene in real time and publishes them over LCM.",
    .end = "Exit code 0: done; 1: failed while running; 2: bad usage, scene, mesh or file.",
    .rows = ROWS,
    .check = check_together};

// --- the scene ---

// Chooses the level of the command line, else that of the log to be replayed, else the best.
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

static const int END_SIGNALS[] = {SIGINT, SIGTERM, SIGHUP};
enum { END_SIGNAL_COUNT = sizeof END_SIGNALS / sizeof END_SIGNALS[0] };

// While the daemon loads, nothing needs to be ended: a signal ends the program.
static void end_at_once(int number)
{
    static const char text[] = "pliantd: ended by a signal before it had loaded\n";
    ssize_t ignored = write(STDERR_FILENO, text, sizeof text - 1);
    (void)ignored;
    signal(number, SIG_DFL);
    raise(number);
}

static void end_while_loading(void)
{
    sigset_t later;
    sigemptyset(&later);
    sigaddset(&later, SIGUSR1);
    pthread_sigmask(SIG_BLOCK, &later, NULL);
    signal(SIGPIPE, SIG_IGN);
    for (int i = 0; i < END_SIGNAL_COUNT; i++)
        signal(END_SIGNALS[i], end_at_once);
}

// Blocks signals, which wait for signalfd; before the first thread starts.
static sigset_t block_signals(void)
{
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGUSR1);
    for (int i = 0; i < END_SIGNAL_COUNT; i++)
        sigaddset(&signals, END_SIGNALS[i]);
    pthread_sigmask(SIG_BLOCK, &signals, NULL);
    return signals;
}

static LiveOptions live_options(World *world, const DaemonArguments *arguments, sigset_t signals)
{
    const Body *body = sim_body(world->sim, 0); // every scene has a body
    return (LiveOptions){.lcm_url = arguments->lcm_url,
                         .isa = body->ops->isa(body->model),
                         .loop = {.duration_s = arguments->duration_s,
                                  .record_tools_hz = arguments->record_tools_hz,
                                  .checkpoint_s = arguments->checkpoint_s},
                         .checkpoint_path = arguments->checkpoint,
                         .input_log_path = arguments->log_inputs,
                         .record_path = arguments->record,
                         .signals = signals};
}

// Includes everything that a live run adds, unless the plan of an offline run is requested.
static void explain_run(World *world, const Scene *scene, const DaemonArguments *arguments,
                        sigset_t signals)
{
    const LiveOptions live = live_options(world, arguments, signals);
    const ExchangeOptions asked = live_exchange(scene, &live);
    if (!arguments->offline)
        live_reserve(world, scene, &live);
    explain_plan(world, scene, arguments->offline ? NULL : &asked, stdout);
}

static bool run_world(World *world, Scene *scene, const BuildOptions *build,
                      const DaemonArguments *arguments, InputLogReader *input, sigset_t signals,
                      Status *status)
{
    // Print and end,
    if (arguments->explain) {
        explain_run(world, scene, arguments, signals);
        return true;
    }
    if (arguments->check) {
        explain_summary(world, scene, stdout);
        return explain_time(world, scene, build, stdout, status);
    }
    // run without network,
    if (arguments->offline) {
        OfflineOptions offline = {.seconds = arguments->offline_s,
                                  .to_log_end = arguments->to_log_end,
                                  .input = input,
                                  .checkpoint_path = arguments->checkpoint,
                                  .checkpoint_s = arguments->checkpoint_s,
                                  .record_path = arguments->record,
                                  .record_tools_hz = arguments->record_tools_hz,
                                  .signals = signals};
        OfflineResult result;
        if (!offline_run(world, scene, &offline, &result, status))
            return false;
        report_offline(world, &result, stdout);
        return true;
    }
    // or live.
    const LiveOptions how = live_options(world, arguments, signals);
    Live *live = live_reserve(world, scene, &how);
    LiveResult result = {0};
    bool whole = live_run(live, &result, status);
    if (result.ticks > 0 || whole)
        report_live(world, &result, stdout);
    return whole;
}

// A checkpoint contains the active loads, so both of its sides need slots for them.
static bool may_load(const DaemonArguments *arguments)
{
    return !arguments->offline || arguments->input != NULL || arguments->checkpoint != NULL ||
           arguments->resume != NULL;
}

static bool may_record(const Scene *scene, const DaemonArguments *arguments, Status *status)
{
    if (arguments->record == NULL)
        return true;
    if (!(scene->publish.nodes_hz > 0.0))
        return status_fail(status, STATUS_INVALID,
                           "%s: --record records at publish.nodes_hz, which is 0", scene->path);
    return arguments->record_tools_hz <= scene->sim.rate_hz ||
           status_fail(status, STATUS_INVALID, "%s: --record-tools-hz %g above rate_hz %g",
                       scene->path, arguments->record_tools_hz, scene->sim.rate_hz);
}

// Returns the file that the run starts from, or NULL; with --continue its own checkpoint has
// precedence.
static const char *choose_start(const DaemonArguments *arguments)
{
    const bool goes_on = arguments->continues && arguments->checkpoint != NULL;
    if (goes_on && checkpoint_is_there(arguments->checkpoint))
        return arguments->checkpoint;
    if (goes_on)
        log_line(LOG_INFO, "--continue: %s does not exist yet, the run starts %s%s",
                 arguments->checkpoint, arguments->resume == NULL ? "from scratch" : "from ",
                 arguments->resume == NULL ? "" : arguments->resume);
    return arguments->resume;
}

static bool start_world(World *world, const DaemonArguments *arguments, Status *status)
{
    if (arguments->resume != NULL) {
        const bool own = arguments->continues && arguments->resume == arguments->checkpoint;
        if (!checkpoint_read(arguments->resume, world, status) &&
            !(own && checkpoint_fall_back(arguments->resume, world, status)))
            return false;
        if (arguments->continues)
            log_line(LOG_INFO, "--continue: continuing from %s, step %lld", arguments->resume,
                     (long long)sim_steps(world->sim));
    }
    return arguments->checkpoint == NULL ||
           checkpoint_check_target(arguments->checkpoint, world, status);
}

// Numbers the log and recording of successive runs. The names live as long as the program.
static void number_outputs(DaemonArguments *arguments)
{
    const char **path[] = {&arguments->log_inputs, &arguments->record};
    for (int i = 0; i < 2; i++) {
        if (*path[i] == NULL)
            continue;
        const char *first = *path[i];
        *path[i] = output_next(first);
        if (strcmp(first, *path[i]) != 0)
            log_line(LOG_INFO, "--continue: %s exists, this run writes %s", first, *path[i]);
    }
}

static bool run(DaemonArguments *arguments, Status *status)
{
    // A signal must end the program also while it loads.
    end_while_loading();
    realtime_flush_denormals();
    realtime_size_stacks();
    arguments->resume = choose_start(arguments);
    if (arguments->continues)
        number_outputs(arguments);
    Scene scene = {0};
    World world = {0};
    InputLogReader *input = NULL;
    bool whole = true;
    // The log of inputs says for which kernels it was made.
    if (arguments->input != NULL) {
        input = calloc(1, sizeof *input);
        whole = input != NULL && input_log_open(input, arguments->input, status);
    }
    const char *isa = whole ? choose_isa(arguments, input) : "auto";
    // The scene, and what the command line changes of it.
    whole = status->code == STATUS_OK && scene_read(arguments->scene, &scene, status) &&
            scene_override(&scene, arguments->rate_hz, arguments->prefix, status) &&
            may_record(&scene, arguments, status);
    scene.remote |= arguments->remote;
    scene.stop_command &= !arguments->no_stop;
    // Build it, warn of what looks wrong, and run.
    if (whole) {
        BuildOptions build = {.isa = isa,
                              .prepared = arguments->prepared,
                              .may_load = may_load(arguments),
                              .publishes = !arguments->offline};
        whole = world_build(&world, &scene, &build, status);
        if (whole)
            plausible_warn(&world, &scene);
        whole = whole && start_world(&world, arguments, status) &&
                run_world(&world, &scene, &build, arguments, input, block_signals(), status);
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
    static DaemonArguments arguments;
    Status status = {0};
    if (arguments_parse(&TABLE, argc, argv, &arguments, &status))
        run(&arguments, &status);
    fflush(stdout);
    if (status.code != STATUS_OK)
        fputs(log_priority(LOG_ERROR), stderr);
    return arguments_exit(&status);
}
