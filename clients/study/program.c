// pliant-study: runs a scene offline in many ways, reports the cost of each and its error relative
// to the converged motion; then advises a choice.
#include "base/arguments.h"

#include "base/log.h"
#include "run/realtime.h"
#include "study/study.h"
#include "study/ranks.h"
#include "study/report.h"

#include <stdlib.h>
#include <string.h>

enum {
    OPTION_ERROR = ARGUMENT_OWN,
    OPTION_RATE,
    OPTION_DURATION,
    OPTION_INPUT,
    OPTION_JOBS,
    OPTION_REPEAT,
    OPTION_OUT,
    OPTION_ONLY,
    OPTION_QUICK,
    OPTION_LIST,
    OPTION_ISA,
    OPTION_LOG_LEVEL,
    OPTION_PREFIX,
};

typedef struct StudyArguments {
    Arguments common;
    StudyOptions study;
    const char *prefix;
    bool list;
} StudyArguments;

static const struct argp_option options[] = {
    {"error", OPTION_ERROR, "PCT", 0,
     "Largest error that the recommended choice may have, as 1% or 0.01 (1%)", 1},
    {"rate", OPTION_RATE, "HZ", 0, "Rate that the choice must sustain, instead of the scene's", 1},
    {"duration", OPTION_DURATION, "S", 0,
     "Simulated seconds per run; by default until the inputs end and the body is at rest again", 2},
    {"input", OPTION_INPUT, "LOG", 0,
     "Drive the scene with the inputs of an LCM event log, instead of its loads or a press", 2},
    {"only", OPTION_ONLY, "TEXT", 0, "Only the scene itself and cases whose name contains TEXT", 2},
    {"quick", OPTION_QUICK, 0, 0, "A coarse grid of cases", 2},
    {"list", OPTION_LIST, 0, 0, "Print the cases, exit", 2},
    {"jobs", OPTION_JOBS, "N", 0,
     "Cases to run in parallel; more than there are idle cores distorts the times (1)", 3},
    {"repeat", OPTION_REPEAT, "N", 0, "Runs per case, for the spread of its cost (3)", 3},
    {"isa", OPTION_ISA, "LEVEL", 0, "Instruction-set level of the kernels: auto or a level's name",
     3},
    {"out", OPTION_OUT, "FOLDER", 0, "Folder for tables and pictures, instead of study-NAME", 4},
    {"lcm-url", 'l', "URL", 0, "Accepted; a study sends and receives nothing", 5},
    {"prefix", OPTION_PREFIX, "NAME", 0, "Prefix of the channels in LOG, instead of the scene's",
     5},
    {"log-level", OPTION_LOG_LEVEL, "L", 0, "error, warning, info or debug (error)", 6},
    ARGUMENTS_COMMON(7),
    {0}};

// --- options -------------------------------------------------------------------------------------

// Parses "1%", "1 %" or "0.01".
static double parse_error(Arguments *arguments, const char *text)
{
    char *end;
    double value = strtod(text, &end);
    bool read = end != text;
    while (*end == ' ')
        end++;
    if (*end == '%') {
        value *= 0.01;
        end++;
    }
    if (!read || *end != '\0' || !(value > 0.0 && value < 1.0))
        arguments_refuse(arguments, "--error", text,
                         "is neither a percentage like 1% nor a fraction in "
                         "(0, 1)");
    return value;
}

static bool parse_own(int key, char *text, void *arguments)
{
    StudyArguments *a = arguments;
    Arguments *common = &a->common;
    StudyOptions *study = &a->study;
    switch (key) {
    case OPTION_ERROR:
        study->error = parse_error(common, text);
        break;
    case OPTION_RATE:
        study->rate_hz = arguments_number(common, "--rate", text, 1.0, 10000.0);
        break;
    case OPTION_DURATION:
        study->duration_s = arguments_number(common, "--duration", text, 1e-2, 1e4);
        break;
    case OPTION_INPUT:
        study->input_log = text;
        break;
    case OPTION_JOBS:
        study->jobs = arguments_count(common, "--jobs", text, 256);
        break;
    case OPTION_REPEAT:
        study->repeats = arguments_count(common, "--repeat", text, STUDY_REPEATS);
        break;
    case OPTION_OUT:
        study->out_folder = text;
        break;
    case OPTION_ONLY:
        study->only = text;
        break;
    case OPTION_QUICK:
        study->quick = true;
        break;
    case OPTION_LIST:
        a->list = true;
        break;
    case OPTION_ISA:
        study->isa = arguments_isa(common, text);
        break;
    case 'l':
        break;
    case OPTION_PREFIX:
        a->prefix = arguments_prefix(common, text);
        break;
    case OPTION_LOG_LEVEL:
        arguments_log_level(common, text);
        break;
    case ARGP_KEY_ARG:
        arguments_scene(common, &study->scene_path, text);
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

static void parse_arguments(int argc, char **argv, StudyArguments *arguments)
{
    static const struct argp argp = {
        options,
        parse_option,
        "SCENE.cfg",
        "Runs a scene in many variants (time step, integrator, precision, level of detail), "
        "compares "
        "each with a converged run, prints the cost and error of each, and recommends one.\v"
        "Exit code 0: done; 1: failed while running; 2: bad usage, scene, mesh or file.",
        NULL,
        NULL,
        NULL};
    if (arguments_parse(&arguments->common, &argp, argc, argv) &&
        arguments->study.scene_path == NULL)
        status_fail(&arguments->common.status, STATUS_INVALID,
                    "pliant-study: no scene given (see pliant-study --help)");
}

// --- the study -----------------------------------------------------------------------------------

static void print_reference(void *user, int done, int count, const char *what)
{
    char words[128];
    snprintf(words, sizeof words, "reference: %.110s", what);
    report_progress(user, done, count, words);
}

static void print_case(void *user, int done, int count, const StudyRun *run)
{
    report_progress(user, done, count, run->what.name);
}

// Makes the references, then runs the cases; the first rank gets the complete result.
static bool measure(StudyContext *context, const StudyCase *cases, int count, StudyResult *result,
                    Status *status)
{
    Progress progress;
    report_begin(&progress);
    bool ok =
        ranks_make_references(context, cases, count, ranks_is_first() ? print_reference : NULL,
                              &progress, result, status);
    progress_end(&progress);
    if (!ok)
        return false;
    report_begin(&progress);
    ok = ranks_run_all(context, cases, count, context->options.jobs,
                       ranks_is_first() ? print_case : NULL, &progress, result, status);
    progress_end(&progress);
    return ok;
}

static bool study(const Scene *scene, const StudyArguments *arguments, Status *status)
{
    static StudyCase cases[STUDY_CASES];
    static StudyContext context;
    int count = study_make_cases(scene, &arguments->study, cases);
    if (arguments->list) {
        table_print_cases(cases, count, stdout);
        return true;
    }
    StudyResult *result = calloc(1, sizeof *result);
    if (result == NULL)
        return status_fail(status, STATUS_FAILED, "pliant-study: no memory");
    char folder[REPORT_PATH];
    bool ok = study_prepare(&context, scene, &arguments->study, status);
    if (ok && ranks_is_first())
        ok = report_make_folder(scene, arguments->study.out_folder, folder, status);
    if (ok) {
        study_describe(&context, result);
        ok = measure(&context, cases, count, result, status);
    }
    if (ok && ranks_is_first())
        ok = report_all(result, scene, &context.options, folder, status);
    study_destroy(&context);
    free(result);
    return ok;
}

static void run(const StudyArguments *arguments, Status *status)
{
    Scene scene = {0};
    realtime_flush_denormals();
    if (scene_read(arguments->study.scene_path, &scene, status) &&
        scene_override(&scene, arguments->study.rate_hz, arguments->prefix, status))
        study(&scene, arguments, status);
    scene_destroy(&scene);
}

int main(int argc, char **argv)
{
    log_set_program("pliant-study");
    log_set_level(LOG_ERROR); // pliantd reports what is clamped or repaired
    ranks_begin(&argc, &argv);
    static StudyArguments arguments = {
        .common.program = "pliant-study",
        .study = {.error = 0.01, .jobs = 1, .repeats = 3, .isa = "auto"}};
    parse_arguments(argc, argv, &arguments);
    Status *status = &arguments.common.status;
    if (status->code == STATUS_OK && !arguments_only_print(&arguments.common))
        run(&arguments, status);
    fflush(stdout);
    if (status->code != STATUS_OK && ranks_is_first())
        fprintf(stderr, "%s\n", status->text);
    ranks_end(status->code);
    return (int)status->code;
}
