// SPDX-License-Identifier: MIT
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
    bool list, resume;
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
    {"continue", 0, ARGUMENT_FLAG, NULL, AT(resume),
     .help = "Continue a study in its folder that was interrupted, or take part in it: any number "
             "of processes that see the folder share its cases"},
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
                             arguments->list || arguments->resume || study->duration_s > 0.0 ||
                             study->rate_hz > 0.0 || arguments->prefix != NULL,
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

// What is shown and written while a study runs.
typedef struct Follow {
    Progress progress;
    const StudyContext *context;
    const char *folder;
    int count; // of cases
} Follow;

static void print_reference(void *user, int done, int count, const char *what)
{
    Follow *follow = user;
    char words[128];
    snprintf(words, sizeof words, "reference: %.110s", what);
    report_progress(&follow->progress, done, count, words);
}

static void print_case(void *user, int done, int count, const StudyRun *run)
{
    Follow *follow = user;
    report_progress(&follow->progress, done, count, run->what.name);
    report_ended(follow->context->parts, follow->count, follow->folder);
}

// Makes the references, then runs the cases.
static bool measure(StudyContext *context, const StudyCase *cases, int count, const char *folder,
                    StudyResult *result, Status *status)
{
    Follow follow = {.context = context, .folder = folder, .count = count};
    // References first: every case is compared with one.
    report_begin(&follow.progress);
    bool ok =
        study_make_references(context, cases, count, print_reference, &follow, result, status);
    progress_end(&follow.progress);
    if (!ok)
        return false;
    report_begin(&follow.progress);
    ok = study_run_all(context, cases, count, context->options.jobs, print_case, &follow, result,
                       status);
    progress_end(&follow.progress);
    return ok && study_nudge(context, &cases[0], &result->nudged, status);
}

// Of several processes one writes the report: the first that claims it, or the next if that dies.
static bool report_once(const Parts *parts, const StudyResult *result, const Scene *scene,
                        const StudyOptions *options, const char *folder, Status *status)
{
    while (!parts_complete(parts)) {
        const int claim = parts_claim(parts, REPORT_CLAIM);
        if (claim < 0) {
            parts_wait();
            continue;
        }
        const bool ok = parts_complete(parts) || report_all(result, scene, options, folder, status);
        if (ok)
            parts_finish(parts);
        parts_release(claim);
        return ok;
    }
    return true;
}

// The study of this process, alone or with others.
typedef struct Share {
    StudyContext context;
    StudyCase cases[STUDY_CASES];
    int count;
    char folder[RESULTS_PATH];
    Parts parts;
} Share;

static bool open_parts(Share *share, const StudyArguments *arguments, bool fresh, Status *status)
{
    const uint64_t key = study_key(&share->context, share->cases, share->count);
    return report_make_folder(share->context.given->name, arguments->study.out_folder,
                              share->folder, status) &&
           parts_open(&share->parts, share->folder, key, fresh, status);
}

static bool run_share(Share *share, Status *status)
{
    StudyContext *context = &share->context;
    if (parts_complete(&share->parts)) {
        printf("%s: complete, nothing is left to run\n", share->folder);
        return true;
    }
    StudyResult *result = calloc(1, sizeof *result);
    if (result == NULL)
        return status_fail(status, STATUS_FAILED, "pliant-study: no memory");
    context->parts = &share->parts;
    study_describe(context, result);
    const bool ok = measure(context, share->cases, share->count, share->folder, result, status) &&
                    report_once(&share->parts, result, context->given, &context->options,
                                share->folder, status);
    free(result);
    return ok;
}

// Reads the scene; with --list that is all. Else prepares the study, whose parts the first rank
// opens before the others.
static bool prepare(const StudyArguments *arguments, int rank, Scene *scene, Share *share,
                    Status *status)
{
    if (!scene_read(arguments->study.scene_path, scene, status) ||
        !scene_override(scene, arguments->study.rate_hz, arguments->prefix, status))
        return false;
    share->count = study_make_cases(scene, &arguments->study, share->cases);
    if (arguments->list) {
        if (rank == 0)
            table_print_cases(share->cases, share->count, stdout);
        return false;
    }
    return study_prepare(&share->context, scene, &arguments->study, status) &&
           (rank > 0 || open_parts(share, arguments, !arguments->resume, status));
}

static void run(const StudyArguments *arguments, int rank, Status *status)
{
    static Scene scene;
    static Share share = {.parts.study = -1};
    const bool prepared = prepare(arguments, rank, &scene, &share, status);
    if (ranks_go(prepared) && (rank == 0 || open_parts(&share, arguments, false, status)))
        run_share(&share, status);
    parts_close(&share.parts);
    study_destroy(&share.context);
    scene_destroy(&scene);
}

int main(int argc, char **argv)
{
    log_set_program("pliant-study");
    log_set_level(LOG_ERROR); // pliantd reports what is clamped or repaired
    realtime_flush_denormals();
    static StudyArguments arguments = {.study.isa = "auto"};
    Status status = {0};
    const int rank = ranks_begin(&argc, &argv);
    const bool runs = arguments_parse(&TABLE, argc, argv, &arguments, &status);
    const bool fits = runs && arguments.fit.table_path != NULL;
    if (runs && !fits)
        run(&arguments, rank, &status);
    else
        ranks_go(false);
    if (fits && rank == 0)
        fit_run(&arguments.fit, &status);
    // What the first rank refuses it says, and fails with: it would be killed before, had another.
    if (rank > 0 && status.code != STATUS_FAILED)
        return 0;
    arguments_exit(&status);
    return (int)status.code;
}
