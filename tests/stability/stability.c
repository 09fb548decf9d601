// SPDX-License-Identifier: MIT
// pliant-stability: every model with every integrator and precision through cases that break
// simulations. Prints or writes the matrix of verdicts; exit code 1 when one has failed or is
// explained by nobody.
#include "children.h"
#include "scoped.h"
#include "matrix.h"
#include "trial.h"

#include "base/arguments.h"
#include "base/check.h"
#include "base/log.h"
#include "effort.h"
#include "scene/scene_parts.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>

enum { INTEGRATORS_MOST = 8, CPU_S = 300 };

typedef struct Arguments {
    bool quick, verbose;
    int jobs;
    const char *write, *compare, *model, *at_case;
} Arguments;

typedef struct Session {
    Matrix matrix;
    char folder[64];
    int ended;
    bool verbose;
} Session;

// All words that scenes accept for an integrator of one model or the other.
static int find_integrators(const char *name[INTEGRATORS_MOST])
{
    int count = 0;
    for (int i = 0; i < BODY_TABLE.count; i++)
        if (strcmp(BODY_TABLE.option[i].key, "integrator") == 0)
            for (const OptionWord *word = BODY_TABLE.option[i].words;
                 word->word != NULL && count < INTEGRATORS_MOST; word++)
                name[count++] = word->word;
    return count;
}

static bool matches(const char *text, const char *begin)
{
    return begin == NULL || strncmp(text, begin, strlen(begin)) == 0;
}

// The test's share: of quick cases one in sixteen, every model, integrator and precision among
// them.
static bool is_quick(int model, int at_case, int integrator, int precision)
{
    const int sum = model + at_case + integrator + 2 * precision;
    const bool fewer = EFFORT(16) < 16; // under sanitizers
    return CASES[at_case].quick && sum % 16 == 0 && (!fewer || (sum / 16 + model) % 4 == 0);
}

// The cells that are asked for, those of a model together, case by case.
static void list_cells(Matrix *matrix, const Arguments *arguments)
{
    const size_t most = (size_t)MODEL_COUNT * (size_t)CASE_COUNT * INTEGRATORS_MOST * 2;
    matrix->cell = children_memory(most * sizeof *matrix->cell);
    for (int m = 0; m < MODEL_COUNT; m++)
        for (int c = 0; c < CASE_COUNT; c++)
            for (int i = 0; i < matrix->integrator_count; i++)
                for (int precision = 0; precision < 2; precision++)
                    if (case_concerns(&CASES[c], &MODELS[m]) &&
                        (is_quick(m, c, i, precision) || !arguments->quick) &&
                        matches(MODELS[m].name, arguments->model) &&
                        matches(CASES[c].name, arguments->at_case))
                        matrix->cell[matrix->cell_count++] = (Cell){
                            .model = m, .at_case = c, .integrator = i, .is_double = precision == 1};
}

static void run_cell(int index, void *context)
{
    const Session *session = context;
    Cell *cell = &session->matrix.cell[index];
    char prefix[32];
    snprintf(prefix, sizeof prefix, "cell%d", index);
    log_set_level(LOG_ERROR); // what warnings say is not asked here
    trial_run(cell, session->matrix.integrator[cell->integrator], session->folder, prefix);
}

static void end_cell(int index, int signal, void *context)
{
    Session *session = context;
    Cell *cell = &session->matrix.cell[index];
    if (!cell->done) {
        cell->verdict = VERDICT_FAILED;
        if (signal == SIGXCPU)
            snprintf(cell->reason, REASON_TEXT, "no end in %d s", CPU_S);
        else
            snprintf(cell->reason, REASON_TEXT, "ended by signal %d", signal);
    }
    session->ended++;
    if (session->verbose)
        fprintf(stderr,
                "%d/%d %s, %s, %s %s: %s %s; %d resets, %.3g s, at %.2g, speed %.2g, energy x "
                "%.3g, held %.3g N +- %.3g N, moved %.2g depths, %.2f s\n",
                session->ended, session->matrix.cell_count, MODELS[cell->model].name,
                CASES[cell->at_case].name, session->matrix.integrator[cell->integrator],
                cell->is_double ? "double" : "single", verdict_word(cell->verdict), cell->reason,
                cell->resets, cell->simulated, cell->displacement, cell->speed, cell->growth,
                cell->held_force, cell->held_swing, cell->held_farthest, cell->cpu_s);
    else if (session->ended % 50 == 0 || session->ended == session->matrix.cell_count)
        fprintf(stderr, "\r%d of %d cells%s", session->ended, session->matrix.cell_count,
                session->ended == session->matrix.cell_count ? "\n" : "");
}

static char *read_text(const char *path)
{
    CLOSED FILE *file = fopen(path, "rb");
    if (file == NULL) {
        perror(path);
        exit(EXIT_FAILURE);
    }
    enum { TEXT_MOST = 1 << 20 };
    char *text = zeroed(1, TEXT_MOST);
    size_t size = fread(text, 1, TEXT_MOST - 1, file);
    ASSERT(size < TEXT_MOST - 1);
    return text;
}

static void tell(const Matrix *matrix, const Cell *cell, const char *what)
{
    printf("%s, %s, %s %s: %s%s%s: %s\n", MODELS[cell->model].name, CASES[cell->at_case].name,
           matrix->integrator[cell->integrator], cell->is_double ? "double" : "single",
           verdict_word(cell->verdict), cell->reason[0] != '\0' ? ", " : "", cell->reason, what);
}

static int count_unexplained(const Matrix *matrix)
{
    int count = 0;
    for (int i = 0; i < matrix->cell_count; i++) {
        const Cell *cell = &matrix->cell[i];
        if (cell->verdict == VERDICT_REST || cell->verdict == VERDICT_REFUSED)
            continue;
        if (cell->verdict != VERDICT_FAILED &&
            remark_find(cell, matrix->integrator[cell->integrator]) != NULL)
            continue;
        count++;
        tell(matrix, cell, cell->verdict == VERDICT_FAILED ? "failed" : "explained by no remark");
    }
    return count;
}

static int count_changed(const Matrix *matrix, const char *path)
{
    int count = 0, compared = 0;
    FREED char *text = read_text(path);
    for (int i = 0; i < matrix->cell_count; i++) {
        const Cell *cell = &matrix->cell[i];
        char column[64], word[16], said[48];
        table_column(cell, matrix->integrator[cell->integrator], column);
        if (!table_find(text, MODELS[cell->model].name, CASES[cell->at_case].name, column, word))
            continue;
        compared++;
        if (strcmp(word, verdict_word(cell->verdict)) == 0)
            continue;
        count++;
        snprintf(said, sizeof said, "it was \"%s\"", word);
        tell(matrix, cell, said);
    }
    printf("%d of %d cells compared with %s\n", compared, matrix->cell_count, path);
    // A table that has none of them is not the one that was meant.
    return compared > 0 ? count : 1;
}

static FILE *open_table(const char *folder, const char *name)
{
    char path[1024];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    if (file == NULL) {
        perror(path);
        exit(EXIT_FAILURE);
    }
    return file;
}

static void write_table(const Matrix *matrix, const char *folder)
{
    if (folder == NULL) {
        table_print(matrix, stdout, stdout);
        return;
    }
    CLOSED FILE *table = open_table(folder, "matrix.tsv");
    CLOSED FILE *sentences = open_table(folder, "matrix-notes.tsv");
    table_print(matrix, table, sentences);
}

#define AT(member) offsetof(Arguments, member)

static const ArgumentRow ROWS[] = {
    {.type = ARGUMENT_HEADING, .help = "Names may be cut short:"},
    {"model", 'm', ARGUMENT_TEXT, "NAME", AT(model), .help = "only cells of this model"},
    {"case", 'a', ARGUMENT_TEXT, "NAME", AT(at_case), .help = "only cells of this case"},
    {"quick", 'q', ARGUMENT_FLAG, NULL, AT(quick), .help = "one cell in sixteen of quick cases"},
    {"jobs", 'j', ARGUMENT_INTEGER, "N", AT(jobs), 1, 1024, .preset = 1,
     .help = "cells to run in parallel"},
    {"write", 'w', ARGUMENT_TEXT, "FOLDER", AT(write),
     .help = "write matrix.tsv and matrix-notes.tsv into FOLDER"},
    {"compare", 'c', ARGUMENT_TEXT, "FILE.tsv", AT(compare),
     .help = "report cells whose outcome is not that of FILE.tsv"},
    {"verbose", 'v', ARGUMENT_FLAG, NULL, AT(verbose), .help = "print each cell"},
    {0}};

static const ArgumentTable TABLE = {
    .program = "pliant-stability",
    .about = "Runs bodies of all models through cases that break simulations.",
    .end = "Exit status: 0 all is as expected, 1 some cells are to look at, 2 bad usage.",
    .rows = ROWS};

int main(int argc, char **argv)
{
    Arguments arguments = {0};
    Status status = {0};
    if (!arguments_parse(&TABLE, argc, argv, &arguments, &status))
        return arguments_exit(&status);
    const char *integrator[INTEGRATORS_MOST];
    Session session = {.verbose = arguments.verbose};
    session.matrix.integrator = integrator;
    session.matrix.integrator_count = find_integrators(integrator);
    list_cells(&session.matrix, &arguments);
    snprintf(session.folder, sizeof session.folder, "/tmp/pliant-stability-XXXXXX");
    bool made = mkdtemp(session.folder) != NULL;
    ASSERT(made);
    trial_write_files(session.folder);
    children_run(session.matrix.cell_count, arguments.jobs, CPU_S, run_cell, end_cell, &session);
    char command[128];
    snprintf(command, sizeof command, "rm -rf '%s'", session.folder);
    if (system(command) != 0)
        perror(session.folder);

    if (arguments.write != NULL || arguments.compare == NULL)
        write_table(&session.matrix, arguments.write);
    int bad = count_unexplained(&session.matrix);
    if (arguments.compare != NULL)
        bad += count_changed(&session.matrix, arguments.compare);
    printf("%d cells, %d to look at\n", session.matrix.cell_count, bad);
    return bad > 0 ? EXIT_FAILURE : EXIT_SUCCESS;
}
