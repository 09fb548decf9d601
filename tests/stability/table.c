// The matrix as Markdown, and its words read back.
#include "matrix.h"

#include <stdlib.h>
#include <string.h>

enum { NOTES_MOST = 400 };

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
    fprintf(out, " %s", verdict_word(cell->verdict));
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
    fprintf(out, " |");
}

// The cells of a model lie together, case by case, column by column.
static int print_model(const Matrix *matrix, int first, FILE *out)
{
    static Notes notes;
    notes.count = 0;
    const int model = matrix->cell[first].model, columns = 2 * matrix->integrator_count;
    fprintf(out, "\n## %s\n\n%s\n\n| case |", MODELS[model].name, MODELS[model].about);
    for (int c = 0; c < columns; c++) {
        char name[64];
        const Cell *cell = &matrix->cell[first + c];
        table_column(cell, matrix->integrator[cell->integrator], name);
        fprintf(out, " %s |", name);
    }
    fprintf(out, "\n|---|");
    for (int c = 0; c < columns; c++)
        fprintf(out, "---|");
    fprintf(out, "\n");
    int i = first;
    while (i < matrix->cell_count && matrix->cell[i].model == model) {
        fprintf(out, "| %s |", CASES[matrix->cell[i].at_case].name);
        for (int c = 0; c < columns; c++, i++) {
            const Cell *cell = &matrix->cell[i];
            print_cell(cell, matrix->integrator[cell->integrator], &notes, out);
        }
        fprintf(out, "\n");
    }
    fprintf(out, "\n");
    for (int n = 0; n < notes.count; n++)
        fprintf(out, "%d. %s\n", n + 1, notes.text[n]);
    return i;
}

static const char INTRODUCTION[] =
    "# Stability matrix\n"
    "\n"
    "Written by `./dev stability`; a test repeats a part of it and fails when a verdict changes.\n"
    "Every cell is a scene that is read, built and run like any other, in a process of its own.\n"
    "\n"
    "- **rest**: every number that left the body was finite, its energy stayed bounded, and at\n"
    "  the end every node was within 1/1000 of the body's size of where it belongs.\n"
    "- **bounded**: finite and bounded likewise, but not at rest where it began: the note below\n"
    "  the table says why.\n"
    "- **reset N**: the check of numbers took the body back to its last good state N times; then\n"
    "  how it ended.\n"
    "- **swelled X**: for a while it had X times the energy that it was left with, more than its\n"
    "  scheme is known to swing by; then how it ended.\n"
    "- **trembles F of G N**: under a tool that is held still for two seconds the force does not\n"
    "  settle: in the last second it is up to F off its mean G, more than a tenth; or a node is\n"
    "  three times as far from its place as the tool was pressed; then how it ended.\n"
    "- **sinks**: such a tool lies deeper in the body than its radius: it has gone in rather than\n"
    "  moved the body; then how it ended.\n"
    "- **refused**: the scene is refused at load; the note is the error in full.\n"
    "- **FAILED**: a crash, a hang, a number that is none, or energy out of nothing.\n"
    "\n"
    "Bounded energy: left alone, a body never has more than it was left with but for what the\n"
    "scheme is known to swing by (times 1.05 for rk4, 19 for symplectic Euler at the bound, 5.3\n"
    "for the others; twice that where levels come and go); and a load of F newtons for t seconds\n"
    "has never brought more than (F t)^2 sum(s_i^2 / m_i) / 2, s_i being the nodes' shares.\n"
    "\n"
    "The bound of a time step is the one that refusals name; where a scene has none, as implicit\n"
    "steps do not, 10 ms stand for it.\n";

void table_print(const Matrix *matrix, FILE *out)
{
    fputs(INTRODUCTION, out);
    for (int i = 0; i < matrix->cell_count;)
        i = print_model(matrix, i, out);
}

// ---------------------------------------------------------------------------------------------

// Field `index` of a row "| a | b |", without spaces around it; false: there is none.
static bool field(const char *line, int index, char *text, size_t size)
{
    const char *end = strchr(line, '\n');
    for (; *line == '|' && line[1] != '\n' && line[1] != '\0'; index--) {
        const char *next = strchr(line + 1, '|');
        if (next == NULL || (end != NULL && next > end))
            return false;
        if (index == 0) {
            const char *from = line + 1 + strspn(line + 1, " ");
            while (next > from && next[-1] == ' ')
                next--;
            snprintf(text, size, "%.*s", (int)(next - from), from);
            return true;
        }
        line = next;
    }
    return false;
}

bool table_find(const char *text, const char *model, const char *row, const char *column,
                char word[16])
{
    char heading[128], found[256];
    snprintf(heading, sizeof heading, "\n## %s\n", model);
    const char *line = strstr(text, heading);
    int at = 0;
    for (line = line != NULL ? strchr(line + 1, '\n') : NULL; line != NULL && line[1] != '\0';
         line = strchr(line + 1, '\n')) {
        if (strncmp(line + 1, "## ", 3) == 0)
            return false;
        if (line[1] != '|' || !field(line + 1, 0, found, sizeof found))
            continue;
        for (int c = 1; at == 0 && field(line + 1, c, found, sizeof found); c++)
            if (strcmp(found, column) == 0)
                at = c;
        if (at == 0)
            return false;
        field(line + 1, 0, found, sizeof found);
        if (strcmp(found, row) == 0 && field(line + 1, at, found, sizeof found)) {
            found[strcspn(found, " ")] = '\0';
            snprintf(word, 16, "%.15s", found);
            return true;
        }
    }
    return false;
}
