// SPDX-License-Identifier: MIT
// Prints the table of a study. Columns are as wide as their content.
#include "study/report.h"

#include <math.h>
#include <string.h>

enum { COLUMN_COUNT = 11, CELL = STUDY_NAME + 16, PERCENT = 24 };

static const char *const TITLE[COLUMN_COUNT][2] = {{"case", ""},
                                                   {"nodes", ""},
                                                   {"step", "[ms]"},
                                                   {"substeps", "a tick"},
                                                   {"cost of a", "simulated s [ms]"},
                                                   {"least..most", "[ms]"},
                                                   {"p99 of a", "tick [us]"},
                                                   {"error", "in time [%]"},
                                                   {"error", "in all [%]"},
                                                   {"force: in time", "in all [%]"},
                                                   {"estimated:", "space  force [%]"}};

typedef struct Row {
    char cell[COLUMN_COUNT][CELL];
} Row;

const char *table_percent(double fraction, char *text)
{
    if (isnan(fraction))
        return strcpy(text, "-");
    snprintf(text, PERCENT, "%.3g %%", 100.0 * fraction);
    return text;
}

// Formats three digits, without a power of ten for readable numbers.
static const char *three_digits(double value, char *text)
{
    if (isnan(value))
        snprintf(text, CELL, "-");
    else
        snprintf(text, CELL, fabs(value) >= 1e3 && fabs(value) < 1e7 ? "%.0f" : "%.3g", value);
    return text;
}

static void put_number(char *cell, double value, double scale)
{
    three_digits(scale * value, cell);
}

static void fill_row(const StudyRun *run, Row *row)
{
    char least[CELL], most[CELL];
    // Who it is, how large, how fine,
    snprintf(row->cell[0], CELL, "%s%s", run->what.name, run->what.is_scene ? " (the scene)" : "");
    if (run->nodes_least == run->nodes_most)
        snprintf(row->cell[1], CELL, "%d", run->nodes_most);
    else
        snprintf(row->cell[1], CELL, "%d..%d", run->nodes_least, run->nodes_most);
    put_number(row->cell[2], run->time_step, 1e3);
    snprintf(row->cell[3], CELL, "%d", run->substeps);
    // what it costs,
    put_number(row->cell[4], run->cpu_median, 1e3);
    snprintf(row->cell[5], CELL, "%.20s..%.20s", three_digits(1e3 * run->cpu_least, least),
             three_digits(1e3 * run->cpu_most, most));
    put_number(row->cell[6], run->tick_p99, 1e6);
    // and how far it is off.
    put_number(row->cell[7], study_error(&run->time), 100.0);
    put_number(row->cell[8], study_error(&run->total), 100.0);
    snprintf(row->cell[9], CELL, "%.20s  %.20s", three_digits(100.0 * run->time.force, least),
             three_digits(100.0 * run->total.force, most));
    // and says that it is.
    snprintf(row->cell[10], CELL, "%.20s  %.20s", three_digits(100.0 * run->estimated, least),
             three_digits(100.0 * run->estimated_force, most));
}

// Counts bytes that a terminal shows as one character once.
static int shown(const char *text)
{
    int count = 0;
    for (; *text != '\0'; text++)
        count += ((unsigned char)*text & 0xc0) != 0x80;
    return count;
}

static void widen(int *width, const Row *row)
{
    for (int c = 0; c < COLUMN_COUNT; c++)
        width[c] = shown(row->cell[c]) > width[c] ? shown(row->cell[c]) : width[c];
}

static void print_row(const int *width, const Row *row, const char *mark, FILE *out)
{
    fprintf(out, "%s %s%*s", mark, row->cell[0], width[0] - shown(row->cell[0]), "");
    for (int c = 1; c < COLUMN_COUNT; c++)
        fprintf(out, "  %*s%s", width[c] - shown(row->cell[c]), "", row->cell[c]);
    fputc('\n', out);
}

static void fill_titles(Row *title)
{
    for (int line = 0; line < 2; line++)
        for (int c = 0; c < COLUMN_COUNT; c++)
            snprintf(title[line].cell[c], CELL, "%s", TITLE[c][line]);
}

static void print_rows(const StudyResult *result, FILE *out)
{
    int width[COLUMN_COUNT] = {0};
    bool front[STUDY_CASES];
    Row row, title[2];
    // Columns are as wide as their widest entry, so fill all rows once.
    fill_titles(title);
    widen(width, &title[0]);
    widen(width, &title[1]);
    study_front_total(result, front);
    for (int i = 0; i < result->run_count; i++)
        if (result->run[i].verdict == STUDY_OK) {
            fill_row(&result->run[i], &row);
            widen(width, &row);
        }
    // Then print them.
    print_row(width, &title[0], " ", out);
    print_row(width, &title[1], " ", out);
    for (int i = 0; i < result->run_count; i++)
        if (result->run[i].verdict == STUDY_OK) {
            fill_row(&result->run[i], &row);
            print_row(width, &row, front[i] ? "*" : " ", out);
        }
    fputs("* none is both cheaper and nearer to the reference of the total error (Pareto front)\n",
          out);
}

// Prints why cases have no row, one line each.
static void print_missing(const StudyResult *result, FILE *out)
{
    for (int i = 0; i < result->run_count; i++) {
        const StudyRun *run = &result->run[i];
        if (run->verdict != STUDY_OK)
            fprintf(out, "  %s: %s: %s\n", study_verdict_name(run->verdict), run->what.name,
                    run->why);
    }
}

static void print_reference(const char *of, const StudyReference *reference, FILE *out)
{
    char own[PERCENT], coarse[PERCENT], fine[PERCENT];
    // Without three runs there is nothing to estimate from.
    if (!reference->known) {
        bool none = strncmp(reference->what, "none", 4) == 0 || reference->what[0] == '\0';
        fprintf(out, "  %s: %s%s\n", of, reference->what[0] != '\0' ? reference->what : "none",
                none ? "" : "; a single run, own error unknown");
        return;
    }
    // How the three runs approach each other.
    fprintf(out, "  %s: %s; coarse to middle %s, middle to fine %s, ", of, reference->what,
            table_percent(reference->difference[0], coarse),
            table_percent(reference->difference[1], fine));
    if (isnan(reference->order))
        fputs("not monotone: no order observed, ", out);
    else
        fprintf(out, "observed order %.2f, ", reference->order);
    fprintf(out, "own error %s%s\n",
            isnan(reference->own_error) ? "unknown" : table_percent(reference->own_error, own),
            isnan(reference->order) && !isnan(reference->own_error) ? ", the larger of both" : "");
}

void table_print(const StudyResult *result, FILE *out)
{
    char of[STUDY_NAME];
    // What was studied,
    fprintf(out, "%s, body %s: %s; %g s simulated in ticks of %g Hz\n%s\n\n", result->scene,
            result->body, result->inputs, result->duration_s, result->rate_hz, result->machine);
    fputs("references, three runs each, every one twice as fine as the one before\n", out);
    // what it is compared with,
    print_reference("in all", &result->finest, out);
    for (int i = 0; i < result->mesh_count; i++) {
        const StudyMesh *mesh = &result->mesh[i];
        const StudyCase like = {
            .level = mesh->level, .threshold = mesh->threshold, .paper_rule = mesh->paper_rule};
        snprintf(of, sizeof of, "in time, %.60s", study_mesh_words(result, &like));
        print_reference(of, &mesh->reference, out);
    }
    // how well the motion is defined at all,
    if (study_error(&result->nudged) > 0.0) {
        char patch[PERCENT], force[PERCENT];
        fprintf(out, "inputs larger by %g %% change the patch's displacement by %s%s%s\n",
                100.0 * STUDY_NUDGE, table_percent(study_error(&result->nudged), patch),
                isnan(result->nudged.force) ? "" : ", the force on the tool by ",
                isnan(result->nudged.force) ? "" : table_percent(result->nudged.force, force));
    }
    // and the cases.
    fputs(
        "\nerrors: of the pressed patch's displacement and of the force on the tool, L2 over time, "
        "relative to the reference's\n",
        out);
    print_rows(result, out);
    print_missing(result, out);
}

void table_print_cases(const StudyCase *cases, int count, FILE *out)
{
    for (int i = 0; i < count; i++)
        fprintf(out, "%s%s\n", cases[i].name, cases[i].is_scene ? " (the scene)" : "");
    fprintf(out, "%d cases\n", count);
}
