// SPDX-License-Identifier: MIT
// The matrix as a table of tabs, the sentences that its cells point to, and its words read back.
#include "matrix.h"

#include <stdlib.h>
#include <string.h>

enum { NOTES_MOST = 1000 };

// Sentences that cells point to, each once.
typedef struct Notes {
    const char *text[NOTES_MOST];
    int count;
} Notes;

static int note(Notes *notes, const char *text)
{
    for (int i = 0; i < notes->count; i++)
        if (strcmp(notes->text[i], text) == 0)
            return i + 1;
    if (notes->count == NOTES_MOST)
        return 0;
    notes->text[notes->count++] = text;
    return notes->count;
}

void table_column(const Cell *cell, const char *integrator, char name[64])
{
    snprintf(name, 64, "%s %s", integrator, cell->is_double ? "double" : "single");
}

static void print_cell(const Cell *cell, const char *integrator, Notes *notes, FILE *out)
{
    fprintf(out, "\t%s", verdict_word(cell->verdict));
    const char *end = verdict_word(cell->came_to_rest ? VERDICT_REST : VERDICT_BOUNDED);
    if (cell->verdict == VERDICT_RESET)
        fprintf(out, " %d, %s", cell->resets, end);
    if (cell->verdict == VERDICT_TREMBLES)
        fprintf(out, " %.2g of %.2g N, %s", cell->held_swing, cell->held_force, end);
    if (cell->verdict == VERDICT_SINKS)
        fprintf(out, ", %s", end);
    if (cell->verdict == VERDICT_SWELLED)
        fprintf(out, " %.1f, %s", cell->growth, end);
    const char *why = cell->verdict == VERDICT_REFUSED || cell->verdict == VERDICT_FAILED
                          ? cell->reason
                          : remark_find(cell, integrator);
    if (why != NULL && why[0] != '\0')
        fprintf(out, " (%d)", note(notes, why));
    else if (cell->verdict != VERDICT_REST)
        fprintf(out, " (?)");
}

// The cells of a model lie together, case by case, column by column. With --quick a case lacks
// some: its row then has only those that were run, each under its own name.
static int print_row(const Matrix *matrix, int first, Notes *notes, FILE *out)
{
    const Cell *cell = &matrix->cell[first];
    fprintf(out, "%s\t%s", MODELS[cell->model].name, CASES[cell->at_case].name);
    int i = first;
    for (int c = 0; c < 2 * matrix->integrator_count; c++) {
        const Cell *at = &matrix->cell[i];
        if (i < matrix->cell_count && at->model == cell->model && at->at_case == cell->at_case &&
            2 * at->integrator + at->is_double == c) {
            print_cell(at, matrix->integrator[at->integrator], notes, out);
            i++;
        } else {
            fprintf(out, "\t-");
        }
    }
    fprintf(out, "\n");
    return i;
}

void table_print(const Matrix *matrix, FILE *out, FILE *sentences)
{
    static Notes notes;
    fprintf(out, "model\tcase");
    for (int c = 0; c < 2 * matrix->integrator_count; c++) {
        char name[64];
        const Cell cell = {.is_double = c % 2 == 1};
        table_column(&cell, matrix->integrator[c / 2], name);
        fprintf(out, "\t%s", name);
    }
    fprintf(out, "\n");
    for (int i = 0; i < matrix->cell_count;)
        i = print_row(matrix, i, &notes, out);
    fprintf(sentences, "note\tsentence\n");
    for (int n = 0; n < notes.count; n++)
        fprintf(sentences, "%d\t%s\n", n + 1, notes.text[n]);
}

// ---------------------------------------------------------------------------------------------

// Field `index` of a line of a table.
static void field(const char *line, int index, char *text, size_t size)
{
    for (; index > 0 && line[strcspn(line, "\t\n")] == '\t'; index--)
        line += strcspn(line, "\t\n") + 1;
    snprintf(text, size, "%.*s", index > 0 ? 0 : (int)strcspn(line, "\t\n"), line);
}

bool table_find(const char *text, const char *model, const char *row, const char *column,
                char word[16])
{
    char found[256];
    int at = 0;
    do
        field(text, ++at, found, sizeof found);
    while (found[0] != '\0' && strcmp(found, column) != 0);
    for (const char *line = text; found[0] != '\0' && *line != '\0';
         line += strcspn(line, "\n") + (line[strcspn(line, "\n")] != '\0')) {
        char name[2][256];
        field(line, 0, name[0], sizeof name[0]);
        field(line, 1, name[1], sizeof name[1]);
        if (strcmp(name[0], model) != 0 || strcmp(name[1], row) != 0)
            continue;
        field(line, at, found, sizeof found);
        found[strcspn(found, " ,")] = '\0';
        snprintf(word, 16, "%.15s", found);
        return strcmp(word, "-") != 0 && word[0] != '\0';
    }
    return false;
}
