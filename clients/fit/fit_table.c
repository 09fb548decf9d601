// SPDX-License-Identifier: MIT
// Reads tables of stress against strain, which come from spreadsheets and test rigs.
#include "fit/fit.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LINE = 1024, COLUMNS_MOST = 3, SHOWN = 40 };
// Larger strains are percentages; smaller ones, in all of a table, are no test. The stress of
// anything is below the second; squares of it are finite.
static const double STRAIN_MOST = 10.0, STRAIN_LEAST = 1e-6, STRESS_MOST = 1e13;

typedef struct Reader {
    const char *path;
    int line, capacity;
    bool begun; // a header or a row was read
    FitTable *table;
    Status *status;
} Reader;

static bool refuse(const Reader *reader, const char *why)
{
    return status_fail(reader->status, STATUS_INVALID, "%s:%d: %s", reader->path, reader->line,
                       why);
}

// Refuses with the text at fault, shortened and without what a terminal would act on.
static bool refuse_text(const Reader *reader, const char *text, const char *why)
{
    char shown[SHOWN + 1];
    size_t i = 0;
    for (; i < SHOWN && text[i] != '\0'; i++)
        shown[i] = (char)(text[i] == '\t' ? ' ' : text[i] >= ' ' && text[i] <= '~' ? text[i] : '?');
    shown[i] = '\0';
    return status_fail(reader->status, STATUS_INVALID, "%s:%d: '%s' %s", reader->path, reader->line,
                       shown, why);
}

static char *trim(char *text)
{
    text += strspn(text, " \t");
    size_t length = strlen(text);
    while (length > 0 && strchr(" \t\r\n", text[length - 1]) != NULL)
        text[--length] = '\0';
    return text;
}

static bool is_number(const char *text, double *value)
{
    char *end;
    *value = strtod(text, &end);
    return end != text && *end == '\0' && strpbrk(text, "xX") == NULL;
}

// True if a line has a word that is not part of a longer one, as "psi" of "epsilon".
static bool has_word(const char *line, const char *word)
{
    const size_t length = strlen(word);
    for (const char *at = line; (at = strcasestr(at, word)) != NULL; at++)
        if (!((at > line && isalpha((unsigned char)at[-1])) ||
              (isalpha((unsigned char)word[0]) && isalpha((unsigned char)at[length]))))
            return true;
    return false;
}

// A header may name units; others than ours would be wrong by orders of magnitude.
static bool check_header(const Reader *reader, const char *line)
{
    static const char *const other[][2] = {
        {"kPa", "is in a header: stress must be in Pa (multiply by 1e3)"},
        {"MPa", "is in a header: stress must be in Pa (multiply by 1e6)"},
        {"GPa", "is in a header: stress must be in Pa (multiply by 1e9)"},
        {"N/mm", "is in a header: stress must be in Pa (multiply N/mm2 by 1e6)"},
        {"psi", "is in a header: stress must be in Pa (multiply by 6894.76)"},
        {"mmHg", "is in a header: stress must be in Pa (multiply by 133.322)"},
        {"%", "is in a header: strain must be a fraction (divide by 100)"},
        {"percent", "is in a header: strain must be a fraction (divide by 100)"},
    };
    for (size_t i = 0; i < sizeof other / sizeof other[0]; i++)
        if (has_word(line, other[i][0]))
            return refuse_text(reader, other[i][0], other[i][1]);
    return true;
}

static bool add(Reader *reader, double strain, double stress)
{
    FitTable *table = reader->table;
    if (table->count == FIT_POINTS)
        return refuse(reader, "has more than 100000 points: thin the table out");
    if (table->count == reader->capacity) {
        reader->capacity = reader->capacity > 0 ? 2 * reader->capacity : 256;
        const size_t bytes = (size_t)reader->capacity * sizeof(double);
        double *strains = realloc(table->strain, bytes);
        table->strain = strains != NULL ? strains : table->strain;
        double *stresses = realloc(table->stress, bytes);
        table->stress = stresses != NULL ? stresses : table->stress;
        if (strains == NULL || stresses == NULL)
            return status_fail(reader->status, STATUS_FAILED, "pliant-fit: no memory");
    }
    table->strain[table->count] = strain;
    table->stress[table->count++] = stress;
    table->peak = fabs(stress) > fabs(table->peak) ? stress : table->peak;
    return true;
}

static bool take_row(Reader *reader, char *column[], const double *value)
{
    const FitTable *table = reader->table;
    if (value[0] < 0.0)
        return refuse_text(reader, column[0], "is a negative strain: a table is of tension");
    if (value[0] > STRAIN_MOST)
        return refuse_text(reader, column[0],
                           "is a strain beyond 10: is it in percent? (divide by 100)");
    if (table->count > 0 && value[0] < table->strain[table->count - 1])
        return refuse_text(reader, column[0],
                           "is a strain below the one before: a table is of one pull, sorted");
    if (fabs(value[1]) > STRESS_MOST)
        return refuse_text(reader, column[1], "is a stress beyond 1e13 Pa");
    return add(reader, value[0], value[1]);
}

// Splits at commas; returns the number of columns, COLUMNS_MOST + 1 for more.
static int split(char *line, char *column[COLUMNS_MOST])
{
    int count = 0;
    for (char *next = line; next != NULL; count++) {
        char *comma = strchr(next, ',');
        if (comma != NULL)
            *comma = '\0';
        if (count == COLUMNS_MOST)
            return count + 1;
        column[count] = trim(next);
        next = comma != NULL ? comma + 1 : NULL;
    }
    return count;
}

static bool take_line(Reader *reader, char *line)
{
    char *column[COLUMNS_MOST];
    double value[COLUMNS_MOST];
    char whole[LINE];
    line = trim(line);
    if (*line == '\0' || *line == '#')
        return true;
    if (strchr(line, ';') != NULL)
        return refuse(reader, "has a semicolon: columns are separated by commas, and decimals "
                              "begin with a point");
    memcpy(whole, line, strlen(line) + 1);
    const int count = split(line, column);
    // The first line may be a header.
    const bool first = !reader->begun;
    reader->begun = true;
    if (first && !is_number(column[0], &value[0]) && strpbrk(column[0], "0123456789") != column[0])
        return check_header(reader, whole);
    if (count < 2 || count > COLUMNS_MOST)
        return refuse_text(reader, whole,
                           count == 1 ? "is one column: strain and stress, separated by a comma"
                                      : "has more columns than strain, stress and time");
    for (int c = 0; c < count; c++) {
        if (!is_number(column[c], &value[c]))
            return refuse_text(reader, column[c], "is not a number");
        if (!isfinite(value[c]))
            return refuse_text(reader, column[c], "is not finite");
    }
    reader->table->has_time |= count == COLUMNS_MOST;
    return take_row(reader, column, value);
}

static bool read_lines(Reader *reader, FILE *file)
{
    char line[LINE];
    while (fgets(line, sizeof line, file) != NULL) {
        reader->line++;
        if (strchr(line, '\n') == NULL && (!feof(file) || strlen(line) + 1 == sizeof line))
            return refuse(reader, "is longer than 1022 characters, or no text");
        char *text = line;
        if (reader->line == 1 && strncmp(text, "\xEF\xBB\xBF", 3) == 0)
            text += 3; // the mark that some programs begin a text with
        if (!take_line(reader, text))
            return false;
    }
    return !ferror(file) ||
           status_fail(reader->status, STATUS_INVALID, "%s: %s", reader->path, strerror(errno));
}

static bool check_table(const Reader *reader)
{
    const FitTable *table = reader->table;
    if (table->count < FIT_POINTS_LEAST)
        return status_fail(reader->status, STATUS_INVALID,
                           "%s: has %d points of strain and stress, fewer than %d", reader->path,
                           table->count, FIT_POINTS_LEAST);
    if (table->strain[table->count - 1] < STRAIN_LEAST)
        return status_fail(reader->status, STATUS_INVALID,
                           "%s: its strain stays below %g: column 1 is strain, column 2 stress",
                           reader->path, STRAIN_LEAST);
    return true;
}

bool fit_table_read(const char *path, FitTable *table, Status *status)
{
    *table = (FitTable){0};
    Reader reader = {.path = path, .table = table, .status = status};
    FILE *file = fopen(path, "r");
    if (file == NULL)
        return status_fail(status, STATUS_INVALID, "%s: %s", path, strerror(errno));
    const bool ok = read_lines(&reader, file) && check_table(&reader);
    fclose(file);
    if (!ok)
        fit_table_destroy(table);
    return ok;
}

void fit_table_destroy(FitTable *table)
{
    free(table->strain);
    free(table->stress);
    *table = (FitTable){0};
}
