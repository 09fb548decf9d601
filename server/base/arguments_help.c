// --help and --usage, in the form of other GNU programs, of which help2man makes manual pages.
#include "base/arguments.h"

#include <string.h>

enum { WIDTH = 79, HELP_COLUMN = 29, HELP_TEXT = 768, VALUE_TEXT = 96 };

// Prints words, of which the first is in `column` and later lines begin in column `indent`.
static void print_words(const char *text, int column, int indent, FILE *out)
{
    for (bool first = true; *text != '\0'; text += *text != '\0') {
        const int length = (int)strcspn(text, " \n");
        if (!first && column + 1 + length > WIDTH) {
            fprintf(out, "\n%*s", indent, "");
            column = indent;
            first = true;
        }
        column += fprintf(out, "%s%.*s", first ? "" : " ", length, text);
        text += length;
        first = *text == '\n';
        if (first) {
            fprintf(out, "\n%*s", indent, "");
            column = indent;
        }
    }
    fputc('\n', out);
}

// Writes the default as it can be given; "" if there is none.
static void default_text(const ArgumentRow *row, char text[VALUE_TEXT])
{
    text[0] = '\0';
    const bool number = row->type == ARGUMENT_NUMBER || row->type == ARGUMENT_INTEGER;
    if (row->preset_text != NULL && row->preset_text[0] != '\0')
        snprintf(text, VALUE_TEXT, " (default: %s)", row->preset_text);
    else if (number && !row->idle && argument_is_inside(row, row->preset))
        snprintf(text, VALUE_TEXT, " (default: %.10g)", row->preset);
}

static void print_row(const ArgumentRow *row, FILE *out)
{
    char head[VALUE_TEXT], preset[VALUE_TEXT], text[HELP_TEXT];
    int length = snprintf(head, sizeof head, row->letter != 0 ? "  -%c, " : "      ", row->letter);
    length += snprintf(head + length, sizeof head - (size_t)length, "--%s%s%s", row->name,
                       row->value != NULL ? "=" : "", row->value != NULL ? row->value : "");
    default_text(row, preset);
    snprintf(text, sizeof text, "%s%s%s", row->idle ? "Without effect: " : "", row->help, preset);
    if (length > HELP_COLUMN - 2)
        fprintf(out, "%s\n%*s", head, HELP_COLUMN, "");
    else
        fprintf(out, "%-*s", HELP_COLUMN, head);
    print_words(text, HELP_COLUMN, HELP_COLUMN, out);
}

void arguments_print_help(const ArgumentTable *table, const ArgumentList *list, FILE *out)
{
    const char *head = "Usage:";
    const char *form = table->usage != NULL ? table->usage : "";
    do {
        const int length = (int)strcspn(form, "\n");
        fprintf(out, "%s %s [OPTION...]%s%.*s\n", head, table->program, length > 0 ? " " : "",
                length, form);
        form += length;
        head = "  or: ";
    } while (*form++ == '\n');
    print_words(table->about, 0, 0, out);
    for (int i = 0; i < list->count; i++) {
        const ArgumentRow *row = list->entry[i].row;
        if (row->type == ARGUMENT_HEADING)
            fprintf(out, "\n%s\n", row->help);
        else if (row->type == ARGUMENT_HELP)
            fputc('\n', out);
        if (row->name != NULL)
            print_row(row, out);
    }
    if (table->end != NULL) {
        fputc('\n', out);
        print_words(table->end, 0, 0, out);
    }
}

void arguments_print_usage(const ArgumentTable *table, const ArgumentList *list, FILE *out)
{
    char text[ARGUMENT_ROWS_MOST * VALUE_TEXT];
    int length = snprintf(text, sizeof text, "Usage: %s", table->program);
    const int indent = length + 1;
    for (int i = 0; i < list->count; i++) {
        const ArgumentRow *row = list->entry[i].row;
        if (row->name != NULL)
            length +=
                snprintf(text + length, sizeof text - (size_t)length, " [--%s%s%s]", row->name,
                         row->value != NULL ? "=" : "", row->value != NULL ? row->value : "");
    }
    // Only the first form: --help has them all.
    if (table->usage != NULL)
        snprintf(text + length, sizeof text - (size_t)length, " %.*s",
                 (int)strcspn(table->usage, "\n"), table->usage);
    print_words(text, 0, indent, out);
}
