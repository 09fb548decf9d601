// pliant-study: runs a scene offline in many ways, reports the cost of each and its error relative
// to the converged motion; then advises a choice. With --fit, fits a material to a measured curve.
#include "base/arguments.h"

#include "base/log.h"
#include "fit/fit.h"
#include "run/realtime.h"
#include "study/study.h"
#include "study/run.h"
#include "study/report.h"

#include <stdlib.h>
#include <string.h>

typedef struct StudyArguments {
    StudyOptions study;
    FitOptions fit;
    const char *prefix;
    bool list;
} StudyArguments;

// --- options -------------------------------------------------------------------------------------

// Parses "1%", "1 %" or "0.01".
static bool take_error(void *target, const char *text, Status *why)
{
    char *end;
    double value = strtod(text, &end);
    // A fraction, or a percentage with or without a blank.
    bool read = end != text;
    while (*end == ' ')
        end++;
    if (*end == '%') {
        value *= 0.01;
        end++;
    }
    ((StudyArguments *)target)->study.error = value;
    return (read && *end == '\0' && value > 0.0 && value < 1.0) ||
           status_fail(why, STATUS_INVALID,
                       "is neither a percentage like 1%% nor a fraction in (0, 1)");
}

#define AT(member) offsetof(StudyArguments, member)

static const ArgumentRow ROWS[] = {
    {.type = ARGUMENT_ROWS, .rows = ARGUMENTS_SCENE, .offset = AT(study.scene_path)},
    {.type = ARGUMENT_HEADING, .help = "What to choose for:"},
    {"error", 0, ARGUMENT_OTHER, "PCT", .preset_text = "1%", .handler = take_error,
     .help = "Largest error that the recommended choice may have, as 1% or 0.01"},
    {"rate", 0, ARGUMENT_NUMBER, "HZ", AT(study.rate_hz), 1.0, 10000.0,
     .help = "Rate that the choice must sustain, instead of the scene's"},
    {.type = ARGUMENT_HEADING, .help = "What to run:"},
    {"duration", 0, ARGUMENT_NUMBER, "S", AT(study.duration_s), 1e-2, 1e4,
     .help = "Simulated seconds per run; by default until the inputs end and the body is at rest "
             "again"},
    {"input", 0, ARGUMENT_TEXT, "LOG", AT(study.input_log),
     .help = "Drive the scene with the inputs of an LCM event log, instead of its loads or a "
             "press"},
    {"only", 0, ARGUMENT_TEXT, "TEXT", AT(study.only),
     .help = "Only the scene itself and cases whose name contains TEXT"},
    {"quick", 0, ARGUMENT_FLAG, NULL, AT(study.quick), .help = "A coarse grid of cases"},
    {"list", 0, ARGUMENT_FLAG, NULL, AT(list), .help = "Print the cases, exit"},
    {.type = ARGUMENT_HEADING, .help = "How:"},
    {"jobs", 0, ARGUMENT_INTEGER, "N", AT(study.jobs), 1, 256, .preset = 1,
     .help = "Cases to run in parallel; more than there are idle cores distorts the times"},
    {"repeat", 0, ARGUMENT_INTEGER, "N", AT(study.repeats), 1, STUDY_REPEATS, .preset = 3,
     .help = "Runs per case, for the spread of its cost"},
    {.type = ARGUMENT_ROWS, .rows = ARGUMENTS_ISA, .offset = AT(study.isa)},
    {"out", 0, ARGUMENT_TEXT, "FOLDER", AT(study.out_folder),
     .help = "Folder for tables and pictures, instead of study-NAME or fit-NAME"},
    {"lcm-url", 'l', ARGUMENT_TEXT, "URL", .idle = true,
     .help = "a study sends and receives nothing"},
    {"prefix", 0, ARGUMENT_NAME, "NAME", AT(prefix),
     .help = "Prefix of the channels in LOG, instead of the scene's"},
    {.type = ARGUMENT_ROWS, .rows = ARGUMENTS_LOG_LEVEL},
    {.type = ARGUMENT_HEADING, .help = "A material from a measured curve, instead of a study:"},
    {"fit", 0, ARGUMENT_TEXT, "CURVE.csv", AT(fit.table_path),
     .help =
         "What pliant-fit CURVE.csv does: columns are nominal strain [-] and nominal stress [Pa]"},
    {.type = ARGUMENT_ROWS, .rows = FIT_ARGUMENTS, .offset = AT(fit)},
    {0}};

// Checks the options of a fit; `other`: one of a study was given.
static bool check_fit(const FitOptions *fit, const char *scene_path, bool other, Status *why)
{
    if (scene_path != NULL)
        return status_fail(why, STATUS_INVALID, "--fit takes a table and no scene, got '%s'",
                           scene_path);
    if (other)
        return status_fail(why, STATUS_INVALID,
                           "--fit goes with --model, --thickness and --out alone");
    return fit_check(fit, why);
}

static bool check(void *target, Status *why)
{
    StudyArguments *arguments = target;
    const StudyOptions *study = &arguments->study;
    FitOptions *fit = &arguments->fit;
    fit->out_folder = study->out_folder;
    if (fit->table_path != NULL)
        return check_fit(fit, study->scene_path,
                         study->input_log != NULL || study->only != NULL || study->quick ||
                             arguments->list || study->duration_s > 0.0 || study->rate_hz > 0.0 ||
                             arguments->prefix != NULL,
                         why);
    if (strcmp(fit->model, "solid") != 0 || fit->thickness > 0.0)
        return status_fail(why, STATUS_INVALID,
                           "--model and --thickness belong to --fit CURVE.csv");
    return study->scene_path != NULL || status_fail(why, STATUS_INVALID, "no scene given");
}

static const ArgumentTable TABLE = {
    .program = "pliant-study",
    .usage = "SCENE.cfg\n--fit CURVE.csv",
    .about = "Runs a scene in many variants (time step, integrator, precision, level of detail), "
             "compares each with a converged run, prints the cost and error of each, and "
             "recommends one. With --fit, does what pliant-fit does.",
    .end = "Exit code 0: done; 1: failed while running; 2: bad usage, scene, mesh or file.",
    .rows = ROWS,
    .check = check};

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
    // References first: every case is compared with one.
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
    if (ok && ranks_is_first())
        result->nudged = study_nudge(context, &cases[0]);
    return ok;
}

static bool run_study(const Scene *scene, const StudyArguments *arguments, Status *status)
{
    // The cases; with --list that is all.
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
    // Only the first rank writes.
    char folder[RESULTS_PATH];
    bool ok = study_prepare(&context, scene, &arguments->study, status);
    if (ok && ranks_is_first())
        ok = results_make_folder(&REPORT_STUDY, scene->name, arguments->study.out_folder, folder,
                                 status);
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
    if (arguments->fit.table_path != NULL) {
        if (ranks_is_first())
            fit_run(&arguments->fit, status);
        return;
    }
    if (scene_read(arguments->study.scene_path, &scene, status) &&
        scene_override(&scene, arguments->study.rate_hz, arguments->prefix, status))
        run_study(&scene, arguments, status);
    scene_destroy(&scene);
}

int main(int argc, char **argv)
{
    log_set_program("pliant-study");
    log_set_level(LOG_ERROR); // pliantd reports what is clamped or repaired
    ranks_begin(&argc, &argv);
    static StudyArguments arguments = {.study.isa = "auto"};
    Status status = {0};
    if (arguments_parse(&TABLE, argc, argv, &arguments, &status))
        run(&arguments, &status);
    if (ranks_is_first())
        arguments_exit(&status);
    ranks_end(status.code);
    return (int)status.code;
}
