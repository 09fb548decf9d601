// SPDX-License-Identifier: MIT
// Writes a gnuplot script that contains its own data, and runs it.
#include "study/report.h"

#include "study/study.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PATH = 4096, SERIES_MAX = 64, SERIES_NAME = 64 };

// Points of one kind, connected or not. Costs and errors are those of runs.
typedef struct Series {
    char name[SERIES_NAME];
    int count;
    const StudyRun *run[STUDY_CASES];
} Series;

// The content of one picture.
typedef struct Picture {
    const StudyResult *result;
    bool total;           // else in time
    double error;         // limit
    const Advice *advice; // of the total error
    int series_count;
    Series *series;         // [SERIES_MAX]
    double low[2], high[2]; // of cost and error
} Picture;

static double error_of(const Picture *picture, const StudyRun *run)
{
    return study_error(picture->total ? &run->total : &run->time);
}

// True if the value has a logarithm.
static bool can_show(double value)
{
    return isfinite(value) && value > 0.0;
}

// --- choice of points ----------------------------------------------------------------------------

static void name_in_time(const StudyCase *what, char *name)
{
    snprintf(name, SERIES_NAME, "%s%s, %s", integrator_name(what->integrator),
             what->step_doubling ? " step doubling" : "", study_precision_name(what->precision));
}

static bool on_scene_mesh(const StudyResult *result, const StudyCase *what)
{
    const StudyRun *scene = study_scene_run(result);
    return scene != NULL ? study_same_mesh(&scene->what, what) : what->detail == DETAIL_SCENE;
}

static void add_point(Picture *picture, const char *name, const StudyRun *run)
{
    // Find the curve, or begin one.
    int s = 0;
    while (s < picture->series_count && strcmp(picture->series[s].name, name) != 0)
        s++;
    if (s == SERIES_MAX)
        return;
    Series *series = &picture->series[s];
    if (s == picture->series_count) {
        picture->series_count++;
        memcpy(series->name, name, SERIES_NAME);
        series->count = 0;
    }
    series->run[series->count++] = run;
}

static int by_cost(const void *a, const void *b)
{
    const StudyRun *first = *(const StudyRun *const *)a, *second = *(const StudyRun *const *)b;
    return (first->cpu_median > second->cpu_median) - (first->cpu_median < second->cpu_median);
}

// Orders by step, short to long: the order in which a curve connects its points.
static int by_step(const void *a, const void *b)
{
    const StudyRun *first = *(const StudyRun *const *)a, *second = *(const StudyRun *const *)b;
    double x = first->what.step_doubling ? first->what.tolerance : first->time_step;
    double y = second->what.step_doubling ? second->what.tolerance : second->time_step;
    return x != y ? (x > y) - (x < y) : by_cost(a, b);
}

static void widen(Picture *picture, double cost, double error)
{
    picture->low[0] = fmin(picture->low[0], cost);
    picture->high[0] = fmax(picture->high[0], cost);
    picture->low[1] = fmin(picture->low[1], error);
    picture->high[1] = fmax(picture->high[1], error);
}

static void collect(Picture *picture)
{
    const StudyResult *result = picture->result;
    // The limits are always inside the picture.
    picture->low[0] = picture->high[0] = 1.0;
    picture->low[1] = picture->high[1] = picture->error;
    // Each run that has a cost and an error becomes a point.
    for (int i = 0; i < result->run_count; i++) {
        const StudyRun *run = &result->run[i];
        char name[SERIES_NAME];
        double error = error_of(picture, run);
        if (run->verdict != STUDY_OK || !can_show(run->cpu_median) || !can_show(error))
            continue;
        if (!picture->total && !on_scene_mesh(result, &run->what))
            continue;
        // Runs of one mesh, or of one integrator, make one curve.
        memset(name, 0, sizeof name);
        if (picture->total)
            snprintf(name, sizeof name, "%.60s", study_mesh_words(result, &run->what));
        else
            name_in_time(&run->what, name);
        add_point(picture, name, run);
        widen(picture, run->cpu_median, error);
    }
    // In the order in which a line connects them.
    for (int s = 0; s < picture->series_count; s++)
        qsort(picture->series[s].run, (size_t)picture->series[s].count,
              sizeof picture->series[s].run[0], picture->total ? by_cost : by_step);
}

// --- the script ----------------------------------------------------------------------------------

static const char *const COLOR[] = {"#1f5fa8", "#b03030", "#3a8f3a", "#d08a20", "#7d4fa0",
                                    "#20a0a0", "#805030", "#d060a0", "#606060", "#909a20"};
enum { COLOR_COUNT = sizeof COLOR / sizeof COLOR[0] };
static const int POINT[] = {7, 5, 9, 11, 13, 6, 4, 8, 10, 12};

static void write_data(const Picture *picture, const char *prefix, FILE *out)
{
    // A block of data for each curve; a number stands at the first point of each step.
    for (int s = 0; s < picture->series_count; s++) {
        const Series *series = &picture->series[s];
        fprintf(out, "$%s%d << EOD\n", prefix, s);
        for (int i = 0; i < series->count; i++) {
            const StudyRun *run = series->run[i];
            bool again = i > 0 && series->run[i - 1]->time_step == run->time_step;
            fprintf(out, "%.6g %.6g %.6g %.6g %.3g\n", run->cpu_median,
                    100.0 * error_of(picture, run), run->cpu_least, run->cpu_most,
                    again ? 0.0 : 1e3 * run->time_step);
        }
        fprintf(out, "EOD\n");
    }
}

// Writes the Pareto front, from the cheapest on, as gnuplot's "steps" expect it.
static int write_front(const Picture *picture, FILE *out)
{
    bool front[STUDY_CASES];
    const StudyRun *on[STUDY_CASES];
    int count = 0;
    // The points that no other beats, in the order of their cost.
    study_front_total(picture->result, front);
    for (int i = 0; i < picture->result->run_count; i++)
        if (front[i] && can_show(picture->result->run[i].cpu_median) &&
            can_show(study_error(&picture->result->run[i].total)))
            on[count++] = &picture->result->run[i];
    qsort(on, (size_t)count, sizeof on[0], by_cost);
    fputs("$front << EOD\n", out);
    for (int i = 0; i < count; i++)
        fprintf(out, "%.6g %.6g\n", on[i]->cpu_median, 100.0 * study_error(&on[i]->total));
    fputs("EOD\n", out);
    return count;
}

static void write_line(double x0, double y0, double x1, double y1, const char *color, FILE *out)
{
    fprintf(out, "set arrow from %g,%g to %g,%g nohead dt 2 lw 1 lc rgb '%s' back\n", x0, y0, x1,
            y1, color);
}

// Writes the band in which nothing can be told: up to the reference's own error, which is at least
// what the last refinement changed (report.h).
static void write_band(const StudyReference *finest, double left, double bottom, double right,
                       FILE *out)
{
    const double own = 100.0 * fmax(finest->own_error, finest->difference[1]);
    if (!finest->known || !can_show(own) || own <= bottom)
        return;
    fprintf(out,
            "set object 1 rectangle from %g,%g to %g,%g fc rgb '#e4e4e4' fs solid noborder behind\n"
            "set label \"within the reference's own error\" at %g,%g left offset 0.5,-0.7 "
            "tc rgb '#707070' front\n",
            left, bottom, right, own, left, own);
}

// Writes limits as lines, labelled at their ends; lengths in the units of the axes.
static void write_limits(const Picture *picture, FILE *out)
{
    // Room around the points.
    double left = picture->low[0] / 1.6, right = picture->high[0] * 1.6;
    double bottom = 100.0 * picture->low[1] / 1.8, top = 100.0 * picture->high[1] * 1.8;
    double limit = 100.0 * picture->error;
    fprintf(out, "unset arrow; unset label; unset object\nset xrange [%g:%g]\nset yrange [%g:%g]\n",
            left, right, bottom, top);
    // The wanted error, and real time.
    write_line(left, limit, right, limit, "#b03030", out);
    fprintf(out, "set label '%.3g %%' at %g,%g right offset -0.5,0.6 tc rgb '#b03030' front\n",
            limit, right, limit);
    write_line(1.0, bottom, 1.0, top, "#404040", out);
    fprintf(out,
            "set label 'real time' at 1,%g right rotate by 90 offset -0.9,-0.5 tc rgb '#404040' "
            "front\n",
            top);
    if (picture->total)
        write_band(&picture->result->finest, left, bottom, right, out);
}

// Doubles single quotes; enhanced text of gnuplot stays as it is.
static void write_quoted(const char *text, FILE *out)
{
    fputc('\'', out);
    for (; *text != '\0'; text++) {
        if (*text == '\'')
            fputc('\'', out);
        if (*text != '\n' && *text != '\r')
            fputc(*text, out);
    }
    fputc('\'', out);
}

// Writes the advice below the picture, in lines of about so many characters.
static void write_advice(const Advice *advice, FILE *out)
{
    enum { LINE = 150, LINES = 3 };
    const char *text = advice->sentence;
    fputs("set bmargin 6.5\n", out);
    for (int line = 0; line < LINES && *text != '\0'; line++) {
        size_t length = strlen(text);
        if (length > LINE)
            for (length = LINE; length > 1 && text[length] != ' ';)
                length--;
        char part[LINE + 1];
        snprintf(part, sizeof part, "%.*s", (int)length, text);
        fputs("set label ", out);
        write_quoted(part, out);
        fprintf(out, " at screen 0.02,%.3f left noenhanced font ',9' front\n",
                0.075 - 0.028 * line);
        text += length;
        while (*text == ' ')
            text++;
    }
}

static void write_title(const Picture *picture, FILE *out)
{
    char title[STUDY_WHY + SCENE_NAME_MAX];
    snprintf(title, sizeof title, "%s: %s against run time", picture->result->scene,
             picture->total ? "total error" : "error of the steps in time");
    fputs("set title ", out);
    write_quoted(title, out);
    fputs(" noenhanced\n", out);
}

static void write_series(const Picture *picture, const char *prefix, FILE *out)
{
    for (int s = 0; s < picture->series_count; s++) {
        const char *color = COLOR[s % COLOR_COUNT];
        int point = POINT[(s + s / COLOR_COUNT) % COLOR_COUNT];
        fprintf(out,
                "%s$%s%d using 1:2:3:4 with xerrorbars lc rgb '%s' pt 0 lw 0.7 notitle, \\\n  ",
                s > 0 ? ", \\\n  " : "", prefix, s, color);
        fprintf(out, "$%s%d using 1:2 with %s lc rgb '%s' pt %d ps 1 title ", prefix, s,
                picture->total ? "points" : "linespoints", color, point);
        write_quoted(picture->series[s].name, out);
    }
}

// Writes the step [ms] at each point of a curve in time.
static void write_steps(const Picture *picture, const char *prefix, FILE *out)
{
    for (int s = 0; s < picture->series_count; s++)
        fprintf(out,
                ", \\\n  $%s%d using 1:2:($5 > 0 ? sprintf('%%.3g', $5) : '') with labels left "
                "offset 0.7,0.4 "
                "font ',8' tc rgb '%s' notitle",
                prefix, s, COLOR[s % COLOR_COUNT]);
}

// Circles the case that is advised.
static void write_circle(const StudyRun *run, FILE *out)
{
    fprintf(out,
            ", \\\n  '+' using (%.6g):(%.6g) every ::0::0 with points pt 6 ps 3.5 lw 2 "
            "lc rgb '#000000' title 'advised'",
            run->cpu_median, 100.0 * study_error(&run->total));
}

static void write_picture(const Picture *picture, FILE *out)
{
    const char *name = picture->total ? "total" : "time";
    if (picture->series_count == 0) {
        fprintf(out, "# No case has a %s error: no picture of it.\n", name);
        return;
    }
    // The data stand in the script, so that it can be drawn again elsewhere.
    write_data(picture, name, out);
    int front = picture->total ? write_front(picture, out) : 0;
    write_title(picture, out);
    fprintf(out, "set ylabel '%s [%%]'\n",
            picture->total ? "error, everything together" : "error, of the steps in time alone");
    fprintf(out, "set key title '%s'\n", picture->total ? "" : "numbers: time step [ms]");
    write_limits(picture, out);
    if (picture->total)
        write_advice(picture->advice, out);
    // The same picture twice: for a page and for a text.
    for (int svg = 0; svg < 2; svg++) {
        fprintf(out, "set terminal %s\nset output '%s.%s'\nplot \\\n  ",
                svg ? "svg size 1000,560 dynamic font 'DejaVu Sans,12' background '#ffffff'"
                    : "pngcairo size 1000,560 font 'DejaVu Sans,11'",
                name, svg ? "svg" : "png");
        write_series(picture, name, out);
        if (front > 0)
            fputs(
                ", \\\n  $front using 1:2 with steps lc rgb '#000000' lw 1.5 title 'Pareto front'",
                out);
        if (!picture->total)
            write_steps(picture, name, out);
        else if (picture->advice->run >= 0)
            write_circle(&picture->result->run[picture->advice->run], out);
        fputs("\nunset output\n", out);
    }
}

bool plot_write(const StudyResult *result, const char *folder, double error, const Advice *total,
                Status *status)
{
    char path[PATH];
    snprintf(path, sizeof path, "%s/study.gp", folder);
    Series *series = calloc(SERIES_MAX, sizeof *series);
    FILE *out = series != NULL ? fopen(path, "w") : NULL;
    if (out == NULL) {
        free(series);
        return status_fail(status, STATUS_FAILED, "%s: %s", path, strerror(errno));
    }
    // What both pictures have.
    fputs("# Written by pliant-study: gnuplot study.gp, in this folder.\n"
          "set encoding utf8\nset logscale xy\nset grid back lc rgb '#c8c8c8' lw 0.8 dt 3\n"
          "set key outside right top Left reverse noenhanced samplen 1.5\n"
          "set xlabel 'processor time for a simulated second [s]'\n"
          "set format xy '%g'\n",
          out);
    // The error of the steps alone, then of everything.
    for (int all = 0; all < 2; all++) {
        Picture picture = {
            .result = result, .total = all != 0, .error = error, .advice = total, .series = series};
        collect(&picture);
        write_picture(&picture, out);
    }
    free(series);
    return fclose(out) == 0 || status_fail(status, STATUS_FAILED, "%s: %s", path, strerror(errno));
}
