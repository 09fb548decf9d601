// SPDX-License-Identifier: MIT
// Writes the results of a study.
#include "study/report.h"

#include "io/data_file.h"
#include "study/run.h"
#include "study/scene_keys.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

enum { COLUMNS = 80 };

// --- progress ------------------------------------------------------------------------------------

static double now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

void report_begin(Progress *progress)
{
    struct winsize size = {0};
    bool terminal = isatty(STDERR_FILENO) == 1;
    int columns = COLUMNS;
    if (terminal && ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0)
        columns = size.ws_col;
    progress_begin(progress, stderr, terminal, columns, now_s());
}

void report_progress(Progress *progress, int done, int count, const char *what)
{
    progress_print(progress, done, count, what, now_s());
}

// --- files ---------------------------------------------------------------------------------------

static const ResultNames NAMES = {.kind = "study",
                                  .mark = STUDY_RUNS_MARK,
                                  .file = {"runs.tsv", "references.tsv", "study.h5", "study.gp",
                                           "advice.cfg", "advice.tsv", "advised.cfg", "time.png",
                                           "time.svg", "total.png", "total.svg"}};

bool report_make_folder(const char *scene, const char *wanted, char folder[RESULTS_PATH],
                        Status *status)
{
    return results_make_folder(&NAMES, scene, wanted, folder, status);
}

void report_ended(const Parts *parts, int count, const char *folder)
{
    char path[RESULTS_PATH];
    Status ignored = {0};
    // One process at a time: another's table has the rows of all, too.
    const int claim = parts_claim(parts, REPORT_CLAIM);
    if (claim < 0)
        return;
    StudyResult *ended = calloc(1, sizeof *ended);
    for (int i = 0; i < count && ended != NULL; i++)
        ended->run_count +=
            parts_load(parts, STUDY_CASE_PART, i, &ended->run[ended->run_count], sizeof(StudyRun));
    // The whole table may be there by now. If this one cannot be written, nor can that, which says
    // so.
    if (ended != NULL && !parts_complete(parts))
        study_save_runs(ended, results_path(path, folder, "runs.tsv"), &ignored);
    free(ended);
    parts_release(claim);
}

static bool save_tables(const StudyResult *result, const Scene *scene, const char *folder,
                        Status *status)
{
    char path[RESULTS_PATH];
    // Texts first, which need no library.
    if (!study_save_runs(result, results_path(path, folder, "runs.tsv"), status) ||
        !study_save_references(result, results_path(path, folder, "references.tsv"), status))
        return false;
    printf("%s/runs.tsv: every run; references.tsv: what it is compared with\n", folder);
    if (!data_file_built()) {
        puts("no study.h5: built without HDF5 (PLIANT_HDF5)");
        return true;
    }
    if (!study_save_hdf(result, scene->text, results_path(path, folder, "study.h5"), status))
        return false;
    printf("%s/study.h5: the same as HDF5\n", folder);
    return true;
}

// Pictures are optional: the study is complete without them.
static bool draw(const StudyResult *result, const char *folder, double error, const Advice *total,
                 Status *status)
{
    Status why = {0};
    // The script is written in any case: others can draw it.
    if (!plot_write(result, folder, error, total, status))
        return false;
    switch (results_draw("gnuplot", folder, "study.gp", &why)) {
    case DRAWN:
        printf("%s/time.png, total.png, and .svg: error against run time\n", folder);
        break;
    case DRAW_NO_GNUPLOT:
        printf("no pictures: gnuplot is not installed; %s/study.gp holds data and script\n",
               folder);
        break;
    case DRAW_FAILED:
        printf("no pictures: %s\n", why.text);
        break;
    }
    return true;
}

static bool write_keys(const SceneKeys *keys, const Scene *scene, const char *folder,
                       Status *status)
{
    char path[RESULTS_PATH], file_path[RESULTS_PATH];
    Status why = {0};
    // The keys on the terminal and as a file.
    scene_keys_print(keys, stdout);
    FILE *file = results_create(folder, "advice.cfg", file_path, status);
    if (file == NULL)
        return false;
    scene_keys_print(keys, file);
    if (!results_close(file, file_path, status))
        return false;
    // This does not work for a scene whose bodies are in an included file.
    if (scene_keys_set(keys, scene->path, results_path(path, folder, "advised.cfg"), &why))
        printf("%s: the scene with these keys\n", path);
    else
        printf("no advised.cfg: %s\n", why.text);
    return true;
}

// A row for the advice, one for that of the total error.
static bool save_advice(const StudyResult *result, const Advice *advice, const Advice *total,
                        const char *folder, Status *status)
{
    char path[RESULTS_PATH], text[FIELD_TEXT_MAX];
    FILE *out = results_create(folder, "advice.tsv", path, status);
    if (out == NULL)
        return false;
    fprintf(out, "advice\tmet\terror\tcase\tsentence\n");
    for (int i = 0; i < 2; i++) {
        const Advice *of = i == 0 ? advice : total;
        fprintf(out, "%s\t%d\t%s\t%s\t%s\n", i == 0 ? "asked" : "total", of->met,
                field_print_real(of->run >= 0 ? of->error : (double)NAN, text),
                of->run >= 0 ? result->run[of->run].what.name : "-", of->sentence);
    }
    return results_close(out, path, status);
}

static bool advise(const StudyResult *result, const Scene *scene, const StudyOptions *options,
                   const Advice *advice, const Advice *total, const char *folder, Status *status)
{
    SceneKeys keys;
    printf("\n%s\n", advice->sentence);
    if (advice->time_only)
        printf("%s\n", total->sentence);
    if (advice->run < 0 || !advice->holds)
        return true;
    if (!scene_keys_of_case(scene, &result->run[advice->run].what, options->rate_hz, &keys))
        return status_fail(status, STATUS_FAILED, "pliant-study: no memory");
    putchar('\n');
    return write_keys(&keys, scene, folder, status);
}

bool report_all(const StudyResult *result, const Scene *scene, const StudyOptions *options,
                const char *folder, Status *status)
{
    Advice advice, total;
    advice_make(result, options->error, options->rate_hz, &advice);
    advice_make_total(result, options->error, options->rate_hz, &total);
    table_print(result, stdout);
    if (options->jobs > 1)
        printf("costs were measured with %d cases at a time\n", options->jobs);
    putchar('\n');
    return save_tables(result, scene, folder, status) &&
           save_advice(result, &advice, &total, folder, status) &&
           draw(result, folder, options->error, &total, status) &&
           advise(result, scene, options, &advice, &total, folder, status);
}

// --- progress ------------------------------------------------------------------------------------

// A progress bar.

enum { BAR = 20, LINE = 256 };

void progress_begin(Progress *progress, FILE *out, bool terminal, int columns, double now_s)
{
    *progress = (Progress){
        .out = out, .terminal = terminal, .columns = columns, .begin_s = now_s, .told = -1};
}

double progress_left(double elapsed_s, int done, int count)
{
    return done > 0 ? elapsed_s * (count - done) / done : -1.0;
}

const char *progress_clock(double seconds, char *text)
{
    enum { SIZE = 32 };
    if (!(seconds >= 0.0 && seconds < 1e8)) {
        snprintf(text, SIZE, "?");
        return text;
    }
    long whole = (long)(seconds + 0.5);
    if (whole >= 3600)
        snprintf(text, SIZE, "%ld:%02ld:%02ld", whole / 3600, whole / 60 % 60, whole % 60);
    else
        snprintf(text, SIZE, "%ld:%02ld", whole / 60, whole % 60);
    return text;
}

static void draw_bar(char *bar, int done, int count)
{
    int full = count > 0 ? BAR * done / count : BAR;
    for (int i = 0; i < BAR; i++)
        bar[i] = i < full ? '#' : '.';
    bar[BAR] = '\0';
}

void progress_print(Progress *progress, int done, int count, const char *name, double now_s)
{
    char elapsed[32], left[32], bar[BAR + 1], line[LINE];
    // How far it is, and how long it will take.
    double elapsed_s = now_s - progress->begin_s;
    int percent = count > 0 ? 100 * done / count : 100;
    progress_clock(elapsed_s, elapsed);
    progress_clock(progress_left(elapsed_s, done, count), left);
    // A file gets a line for each tenth.
    if (!progress->terminal) {
        if (percent / 10 == progress->told)
            return;
        progress->told = percent / 10;
        fprintf(progress->out, "%3d %%  %s elapsed, %s left  %s\n", percent, elapsed, left, name);
        fflush(progress->out);
        return;
    }
    // A terminal gets one line that is written over.
    draw_bar(bar, done, count);
    int length = snprintf(line, sizeof line, "[%s] %3d %%  %s elapsed, %s left  %s", bar, percent,
                          elapsed, left, name);
    int most =
        progress->columns > 1 && progress->columns <= LINE ? progress->columns - 1 : LINE - 1;
    length = length < most ? length : most;
    // Overwrite the rest of a longer last line with spaces.
    int more = progress->width > length ? progress->width - length : 0;
    fprintf(progress->out, "\r%.*s%*s", length, line, more, "");
    fflush(progress->out);
    progress->width = length;
}

void progress_end(Progress *progress)
{
    if (progress->terminal && progress->width > 0)
        fprintf(progress->out, "\r%*s\r", progress->width, "");
    progress->width = 0;
    fflush(progress->out);
}
