// SPDX-License-Identifier: MIT
// Pulls a strip of what was fitted, prints the material group, writes the table and the picture.
#include "fit/fit.h"

#include "fit/results.h"
#include "fit/strip.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { KEYS = 160, MATERIAL = 320, SUBJECT = 64 };
// A strip's waves travel at 10 m/s, so that a second is long, whatever the stiffness.
static const double WAVE_SPEED = 10.0, DENSITY_MOST = 1e6, PULL_S = 1.0;
// Tissue that is softer or stiffer is hardly meant; nor is a table whose stress begins so high.
static const double MODULUS_LOW = 10.0, MODULUS_HIGH = 1e10, STRAIN_HIGH = 2.0, START_HIGH = 0.05;
static const double RMS_HIGH = 0.03; // of the peak: where a fit is called poor

#define FIT_MARK "strain\tmeasured\t"

static const ResultNames NAMES = {
    .kind = "fit",
    .mark = FIT_MARK,
    .file = {"fit.tsv", "fit.gp", "fit.png", "fit.svg", "strip.cfg", "strip.off"}};

typedef struct Output {
    const FitOptions *options;
    FitTable table;
    Fit fit;
    StripCurve strip; // count 0: not simulated
    double strip_rms; // [Pa]
    double thickness; // [m] of a surface; 1 of a solid
    char keys[KEYS];  // of the material group
    char folder[RESULTS_PATH];
} Output;

static bool is_surface(const Output *output)
{
    return strcmp(output->options->model, "surface") == 0;
}

static const FitLaw *chosen(const Fit *fit)
{
    return fit->shape == FIT_STIFFENS ? &fit->stiff : &fit->linear;
}

static double percent(const Output *output, double rms)
{
    return 100.0 * rms / fabs(output->table.peak);
}

// --- the strip -----------------------------------------------------------------------------------

// Formats a number as a real one of a scene file: 12 would be an integer.
static const char *real_text(double value, char text[32])
{
    snprintf(text, 32, "%.4g", value);
    if (strpbrk(text, ".e") == NULL)
        strcat(text, ".0");
    return text;
}

static void write_keys(Output *output)
{
    const FitLaw *law = chosen(&output->fit);
    char modulus[32], strain[32], cap[32];
    const int length =
        snprintf(output->keys, KEYS, "youngs_modulus%s = %s;", is_surface(output) ? "_2d" : "",
                 real_text(law->modulus * output->thickness, modulus));
    if (output->fit.shape == FIT_STIFFENS)
        snprintf(output->keys + length, KEYS - (size_t)length,
                 "  stiffening = { strain = %s;  cap = %s; };", real_text(law->strain, strain),
                 real_text(law->cap, cap));
}

// Returns the rms difference of the simulated curve from the table [Pa].
static double compare(const Output *output)
{
    double squares = 0.0;
    for (int i = 0; i < output->table.count; i++) {
        const double off =
            strip_stress_at(&output->strip, output->table.strain[i]) / output->thickness -
            output->table.stress[i];
        squares += off * off;
    }
    return sqrt(squares / output->table.count);
}

// What cannot be simulated is still fitted.
static bool simulate(Output *output, Status *status)
{
    const double strain = output->table.strain[output->table.count - 1];
    const double stiffness = chosen(&output->fit)->modulus * output->thickness;
    char material[MATERIAL], density[32], path[RESULTS_PATH];
    Status why = {0};
    real_text(fmin(stiffness / (WAVE_SPEED * WAVE_SPEED), DENSITY_MOST), density);
    // Pulled further, a strip of this Poisson's ratio would hardly have a section left.
    snprintf(material, sizeof material, "%s  %s = %s;%s", output->keys,
             is_surface(output) ? "areal_density" : "density", density,
             is_surface(output) || strain > 1.0 ? "" : "  poisson_ratio = 0.3;");
    if (!strip_write(output->folder, "strip", is_surface(output) ? MODEL_SURFACE : MODEL_VOXEL,
                     material, "# Density makes waves as fast at any stiffness; it is no tissue's.",
                     status))
        return false;
    snprintf(path, sizeof path, "%.*s/strip.cfg", RESULTS_PATH - SUBJECT, output->folder);
    if (strip_pull(path, strain, strain / PULL_S, &output->strip, &why))
        output->strip_rms = compare(output);
    else
        printf("not simulated: %s\n", why.text);
    return true;
}

// --- words ---------------------------------------------------------------------------------------

static void print_row(const Output *output, const char *name, const FitLaw *law)
{
    printf("%-24s  %9.4g", name, law->modulus);
    if (law->cap > 1.0)
        printf("  %9.4g  %7.4g", law->strain, law->cap);
    else
        printf("  %9s  %7s", "-", "-");
    printf("  %9.2f\n", percent(output, law->rms));
}

static void print_fits(const Output *output)
{
    const FitTable *table = &output->table;
    const Fit *fit = &output->fit;
    printf("%s: %d points, strain up to %g, stress up to %.4g Pa\n\n", output->options->table_path,
           table->count, table->strain[table->count - 1], table->peak);
    printf("%-24s  %9s  %9s  %7s  %9s\n", "law", "E [Pa]", "strain", "cap", "rms [%]");
    print_row(output, "linear", &fit->linear);
    if (fit->shape == FIT_STIFFENS)
        print_row(output, "stiffening", &fit->stiff);
    if (output->strip.count > 0)
        printf("%-24s  %9s  %9s  %7s  %9.2f\n", "  a strip of it, pulled", "", "", "",
               percent(output, output->strip_rms));
    printf("rms: of the difference from the table, in %% of its largest stress\n\n");
}

static void print_shape(const Output *output)
{
    const Fit *fit = &output->fit;
    const double strain = output->table.strain[output->table.count - 1];
    switch (fit->shape) {
    case FIT_STRAIGHT:
        printf("The table determines no stiffening (little of it, few points or another shape): "
               "the group is the linear law's.\n");
        break;
    case FIT_FLATTENS:
        printf("The slope falls along the pull, which no law here has: the line misses the table "
               "by %.2f %% rms.\n",
               percent(output, fit->linear.rms));
        return;
    case FIT_STIFFENS:
        printf("The slope grows %.3g times, from %.4g to %.4g Pa.\n", fit->slope[1] / fit->slope[0],
               fit->slope[0], fit->slope[1]);
        printf(fit->cap_unmet
                   ? "The table ends before any cap: this is the least without effect on it. "
                     "Beyond a strain of %.3g the stress goes on straight.\n"
                   : "The cap is reached within the table, which ends at a strain of %.3g.\n",
               strain);
        printf("It may shorten the time step by sqrt(cap), %.2g times.\n", sqrt(fit->stiff.cap));
        break;
    }
    if (percent(output, chosen(fit)->rms) > 100.0 * RMS_HIGH)
        printf("The law follows this table only to %.2f %% rms: see the picture.\n",
               percent(output, chosen(fit)->rms));
}

// What is possible, but hardly meant.
static void print_notes(const Output *output)
{
    const FitTable *table = &output->table;
    const double modulus = chosen(&output->fit)->modulus;
    if (modulus < MODULUS_LOW)
        printf("note: %.4g Pa is softer than any tissue: is stress in kPa or MPa? Column 2 is in "
               "Pa\n",
               modulus);
    if (modulus > MODULUS_HIGH)
        printf("note: %.4g Pa is stiffer than bone: column 1 is strain as a fraction, column 2 "
               "stress in Pa\n",
               modulus);
    if (table->strain[table->count - 1] > STRAIN_HIGH)
        printf("note: a strain of %g is %g %%: column 1 is a fraction\n",
               table->strain[table->count - 1], 100.0 * table->strain[table->count - 1]);
    if (fabs(table->stress[0]) > START_HIGH * fabs(table->peak) && table->strain[0] == 0.0)
        printf("note: the stress at strain 0 is %.2g %% of the largest: the law begins at 0; "
               "subtract a preload\n",
               100.0 * fabs(table->stress[0] / table->peak));
    if (table->has_time)
        printf("note: column 3, time, is not used: the fit is of the elastic law alone\n");
}

static double rms_across(const Output *output)
{
    double squares = 0.0;
    for (int i = 0; i < output->table.count; i++) {
        const double off = fit_stress_across(chosen(&output->fit), output->table.strain[i]) -
                           output->table.stress[i];
        squares += off * off;
    }
    return sqrt(squares / output->table.count);
}

static void print_material(const Output *output)
{
    printf("\nmaterial = { %s };\n", output->keys);
    if (is_surface(output))
        printf("# of a wall of %g m that is pulled along edges of its triangles; across them it "
               "misses the table by %.2f %% rms, other meshes lie between\n\n",
               output->thickness, percent(output, rms_across(output)));
    else
        printf("# Poisson's ratio, density and damping are yours\n\n");
}

// --- files ---------------------------------------------------------------------------------------

// Columns: strain; stresses [Pa], "-" where there is none.
static bool save_table(const Output *output, Status *status)
{
    char path[RESULTS_PATH];
    FILE *out = results_create(output->folder, "fit.tsv", path, status);
    if (out == NULL)
        return false;
    fprintf(out, FIT_MARK "linear\tstiffening\tsimulated\n");
    for (int i = 0; i < output->table.count; i++) {
        const double strain = output->table.strain[i];
        fprintf(out, "%.9g\t%.9g\t%.9g\t", strain, output->table.stress[i],
                fit_stress(&output->fit.linear, strain));
        if (output->fit.shape == FIT_STIFFENS)
            fprintf(out, "%.9g\t", fit_stress(&output->fit.stiff, strain));
        else
            fprintf(out, "-\t");
        if (output->strip.count > 0)
            fprintf(out, "%.9g\n", strip_stress_at(&output->strip, strain) / output->thickness);
        else
            fprintf(out, "-\n");
    }
    return results_close(out, path, status);
}

static bool write_script(const Output *output, Status *status)
{
    char path[RESULTS_PATH];
    FILE *out = results_create(output->folder, "fit.gp", path, status);
    if (out == NULL)
        return false;
    // Of many points some are drawn.
    const int every = output->table.count / 400 + 1;
    fprintf(out, "# Written by pliant-fit: gnuplot fit.gp, in this folder, draws fit.tsv.\n"
                 "set encoding utf8\nset datafile missing '-'\nset datafile separator '\\t'\n"
                 "set grid back lc rgb '#c8c8c8' lw 0.8 dt 3\nset key left top Left reverse\n"
                 "set xlabel 'nominal strain'\nset ylabel 'nominal stress [Pa]'\n"
                 "set yrange [0:*]\nset format y '%%.3g'\n");
    for (int svg = 0; svg < 2; svg++) {
        fprintf(out, "set terminal %s\nset output 'fit.%s'\nplot \\\n",
                svg ? "svg size 700,460 dynamic font 'DejaVu Sans,12' background '#ffffff'"
                    : "pngcairo size 700,460 font 'DejaVu Sans,11'",
                svg ? "svg" : "png");
        fprintf(out,
                "  'fit.tsv' every %d::1 using 1:2 with points pt 7 ps 0.6 lc rgb '#b03030' title "
                "'table', \\\n"
                "  '' every ::1 using 1:3 with lines dt 2 lc rgb '#909090' title 'linear'",
                every);
        if (output->fit.shape == FIT_STIFFENS)
            fprintf(out, ", \\\n  '' every ::1 using 1:4 with lines lw 2 lc rgb '#1f5fa8' title "
                         "'stiffening'");
        if (output->strip.count > 0)
            fprintf(out,
                    ", \\\n  '' every %d::1 using 1:5 with points pt 6 ps 0.9 lc rgb '#3a8f3a' "
                    "title 'a strip of it, pulled'",
                    output->table.count / 20 + 1);
        fprintf(out, "\nunset output\n");
    }
    return results_close(out, path, status);
}

static bool save(const Output *output, Status *status)
{
    Status why = {0};
    if (!save_table(output, status) || !write_script(output, status))
        return false;
    printf("%s/fit.tsv: strain and stresses; strip.cfg: the strip as a scene\n", output->folder);
    if (results_draw("gnuplot", output->folder, "fit.gp", &why) == DRAWN)
        printf("%s/fit.png and .svg: the curves\n", output->folder);
    else
        printf("no picture: %s; %s/fit.gp is the script\n", why.text, output->folder);
    return true;
}

// --- the whole -----------------------------------------------------------------------------------

// Returns the table's name without folder and extension.
static void name_subject(const char *path, char subject[SUBJECT])
{
    const char *slash = strrchr(path, '/');
    snprintf(subject, SUBJECT, "%s", slash != NULL ? slash + 1 : path);
    char *dot = strrchr(subject, '.');
    if (dot != NULL && dot != subject)
        *dot = '\0';
}

static bool take_model(void *target, const char *text, Status *why)
{
    ((FitOptions *)target)->model = text;
    return strcmp(text, "solid") == 0 || strcmp(text, "surface") == 0 ||
           status_fail(why, STATUS_INVALID, "is neither solid nor surface");
}

const ArgumentRow FIT_ARGUMENTS[] = {
    {"model", 0, ARGUMENT_OTHER, "MODEL", .preset_text = "solid", .handler = take_model,
     .help = "Body that the group is for: solid or surface"},
    {"thickness", 0, ARGUMENT_NUMBER, "M", offsetof(FitOptions, thickness), 1e-6, 1.0,
     .help = "Of the wall of a surface [m], for youngs_modulus_2d = E times thickness [N/m]"},
    {0}};

bool fit_check(const FitOptions *options, Status *why)
{
    const bool surface = strcmp(options->model, "surface") == 0;
    return surface == (options->thickness > 0.0) ||
           status_fail(why, STATUS_INVALID,
                       surface ? "--model surface needs the --thickness of the wall"
                               : "--thickness is of --model surface");
}

bool fit_run(const FitOptions *options, Status *status)
{
    char subject[SUBJECT];
    Output *output = calloc(1, sizeof *output);
    if (output == NULL)
        return status_fail(status, STATUS_FAILED, "pliant-fit: no memory");
    output->options = options;
    output->thickness = is_surface(output) ? options->thickness : 1.0;
    name_subject(options->table_path, subject);
    bool ok = fit_table_read(options->table_path, &output->table, status) &&
              fit_make(&output->table, options->table_path, &output->fit, status) &&
              results_make_folder(&NAMES, subject, options->out_folder, output->folder, status);
    if (ok) {
        write_keys(output);
        ok = simulate(output, status);
    }
    if (ok) {
        print_fits(output);
        print_shape(output);
        print_notes(output);
        print_material(output);
        ok = save(output, status);
    }
    strip_destroy(&output->strip);
    fit_table_destroy(&output->table);
    free(output);
    return ok;
}
