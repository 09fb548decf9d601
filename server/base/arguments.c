// SPDX-License-Identifier: MIT
#include "base/arguments.h"

#include "base/check.h"
#include "base/isa.h"
#include "base/log.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    ROWS_MOST = 64,
    FIRST_KEY = 256, // of long options for getopt_long; beyond all letters
    WIDTH = 79,      // of --help
    HELP_COLUMN = 29,
    HELP_TEXT = 768,
    VALUE_TEXT = 96
};

// The rows of a table in the order of --help, those of other lists in their place.
typedef struct ArgumentList {
    struct {
        const ArgumentRow *row;
        char *target;
    } entry[ROWS_MOST];
    int count;
} ArgumentList;

// The last rows of every program.
static const ArgumentRow COMMON[] = {
    {"help", '?', ARGUMENT_HELP, .help = "Print this list, exit"},
    {"usage", 0, ARGUMENT_USAGE, .help = "Print the options in short, exit"},
    {"version", 'V', ARGUMENT_VERSION, .help = "Print the version, exit"},
    {0}};

// --- values ---

bool argument_is_name(const char *text, size_t most)
{
    size_t length = 0;
    while (length <= most && is_name_character(text[length]))
        length++;
    return length >= 1 && length <= most && text[length] == '\0';
}

bool argument_read_numbers(const char *text, int count, double low, double high, double *number)
{
    for (int k = 0; k < count; k++) {
        char *end;
        number[k] = strtod(text, &end);
        if (end == text || *end != (k + 1 < count ? ',' : '\0') || !isfinite(number[k]) ||
            number[k] < low || number[k] > high)
            return false;
        text = end + 1;
    }
    return true;
}

bool argument_read_integer(const char *text, double low, double high, long long *number)
{
    char *end;
    errno = 0;
    *number = strtoll(text, &end, 10);
    return end != text && *end == '\0' && errno == 0 && (double)*number >= low &&
           (double)*number <= high;
}

static bool is_inside(const ArgumentRow *row, double value)
{
    return (row->open ? value > row->low : value >= row->low) && value <= row->high;
}

static bool read_number(const ArgumentRow *row, const char *text, double *member, Status *why)
{
    double value;
    if (!argument_read_numbers(text, 1, row->low, row->high, &value) || !is_inside(row, value))
        return status_fail(why, STATUS_INVALID, "is not a number in %c%g, %g]",
                           row->open ? '(' : '[', row->low, row->high);
    *member = row->factor > 0.0 ? value * row->factor : value;
    return true;
}

static bool read_integer(const ArgumentRow *row, const char *text, int *member, Status *why)
{
    long long value;
    if (!argument_read_integer(text, row->low, row->high, &value))
        return isinf(row->high)
                   ? status_fail(why, STATUS_INVALID, "is not an integer")
                   : status_fail(why, STATUS_INVALID, "is not an integer in [%.0f, %.0f]", row->low,
                                 row->high);
    *member = (int)value;
    return true;
}

static bool read_numbers(const ArgumentRow *row, const char *text, double *member, Status *why)
{
    int count = 1;
    for (const char *c = row->value; *c != '\0'; c++)
        count += *c == ',';
    ASSERT(count <= ARGUMENT_NUMBERS_MOST);
    return argument_read_numbers(text, count, row->low, row->high, member) ||
           status_fail(why, STATUS_INVALID, "is not %s, each in [%g, %g]", row->value, row->low,
                       row->high);
}

// Reads a value into the member; "" of a flag means nothing.
static bool read_value(const ArgumentRow *row, const char *text, void *member, Status *why)
{
    switch (row->type) {
    case ARGUMENT_FLAG:
        // Naming a flag turns its default round.
        *(bool *)member = !(row->preset > 0.0);
        return true;
    case ARGUMENT_NAME:
        // Names become parts of channels.
        if (!argument_is_name(text, ARGUMENT_NAME_MOST))
            return status_fail(why, STATUS_INVALID, "is not 1 to %d letters, digits, _ or -",
                               ARGUMENT_NAME_MOST);
        *(const char **)member = text;
        return true;
    case ARGUMENT_TEXT:
        *(const char **)member = text;
        return true;
    case ARGUMENT_NUMBER:
        return read_number(row, text, member, why);
    case ARGUMENT_INTEGER:
        return read_integer(row, text, member, why);
    case ARGUMENT_NUMBERS:
        return read_numbers(row, text, member, why);
    default:
        return true;
    }
}

static bool take(const ArgumentRow *row, char *target, const char *text, Status *why)
{
    union {
        double number[ARGUMENT_NUMBERS_MOST];
        const char *text;
    } unused;
    return read_value(row, text, row->idle ? (void *)&unused : target + row->offset, why) &&
           (row->handler == NULL || row->handler(target, text, why));
}

// Defaults may lie outside of the range of what can be given: they mean that nothing is.
static void store_default(const ArgumentRow *row, char *target)
{
    void *member = target + row->offset;
    if (row->idle)
        return;
    // The type of the row decides what its default is: a number, a word, or nothing.
    if (row->type == ARGUMENT_FLAG)
        *(bool *)member = row->preset > 0.0;
    else if (row->type == ARGUMENT_NUMBER)
        *(double *)member = row->factor > 0.0 ? row->preset * row->factor : row->preset;
    else if (row->type == ARGUMENT_INTEGER)
        *(int *)member = (int)row->preset;
    else if (row->preset_text != NULL)
        take(row, target, row->preset_text, NULL);
    else if (row->type == ARGUMENT_TEXT || row->type == ARGUMENT_NAME)
        *(const char **)member = NULL;
}

// --- rows of several programs ---

static bool take_scene(void *target, const char *text, Status *why)
{
    const char **scene = target;
    if (*scene != NULL)
        return status_fail(why, STATUS_INVALID, "one scene at a time, got '%s' and '%s'", *scene,
                           text);
    *scene = text;
    return true;
}

static bool take_isa(void *target, const char *text, Status *why)
{
    char levels[192] = "auto";
    for (const char *const *level = isa_available(); *level != NULL; level++)
        snprintf(levels + strlen(levels), sizeof levels - strlen(levels), ", %s", *level);
    if (isa_find(text) == ISA_COUNT)
        return status_fail(why, STATUS_INVALID, "is not one of %s here", levels);
    *(const char **)target = text;
    return true;
}

static bool take_log_level(void *target, const char *text, Status *why)
{
    (void)target;
    LogLevel level;
    if (!log_parse_level(text, &level))
        return status_fail(why, STATUS_INVALID, "is not error, warning, info or debug");
    log_set_level(level);
    return true;
}

const ArgumentRow ARGUMENTS_SCENE[] = {{NULL, 0, ARGUMENT_OPERAND, .handler = take_scene}, {0}};

const ArgumentRow ARGUMENTS_ISA[] = {
    {"isa", 0, ARGUMENT_OTHER, "LEVEL", .handler = take_isa,
     .help = "Instruction-set level of the kernels: auto or a level's name"},
    {0}};

const ArgumentRow ARGUMENTS_LOG_LEVEL[] = {
    {"log-level", 0, ARGUMENT_OTHER, "L", .handler = take_log_level,
     .help = "What to report on stderr: error, warning, info or debug (default: pliantd info, "
             "pliant-study error)"},
    {0}};

// --- help, in the form of other GNU programs, of which help2man makes manual pages ---

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
    else if (number && !row->idle && is_inside(row, row->preset))
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

static void print_help(const ArgumentTable *table, const ArgumentList *list, FILE *out)
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

static void print_usage(const ArgumentTable *table, const ArgumentList *list, FILE *out)
{
    char text[ROWS_MOST * VALUE_TEXT];
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

// --- the line ---

static void list_rows(ArgumentList *list, const ArgumentRow *row, char *target)
{
    for (; row->type != ARGUMENT_END; row++) {
        if (row->type == ARGUMENT_ROWS) {
            list_rows(list, row->rows, target + row->offset);
            continue;
        }
        ASSERT(list->count < ROWS_MOST);
        list->entry[list->count].row = row;
        list->entry[list->count++].target = target;
        store_default(row, target);
    }
}

// What getopt_long reads: options in their order among other words, which come as key 1.
typedef struct Syntax {
    struct option option[ROWS_MOST + 1];
    char letters[2 * ROWS_MOST + 4];
} Syntax;

static void describe(const ArgumentList *list, Syntax *syntax)
{
    struct option *option = syntax->option;
    char *letter = syntax->letters;
    memset(syntax, 0, sizeof *syntax);
    letter += sprintf(letter, "-:");
    for (int i = 0; i < list->count; i++) {
        const ArgumentRow *row = list->entry[i].row;
        if (row->name == NULL)
            continue;
        const int has = row->value != NULL ? required_argument : no_argument;
        *option++ = (struct option){row->name, has, NULL, FIRST_KEY + i};
        if (row->letter != 0 && row->letter != '?') // getopt's own mark of an error
            letter += sprintf(letter, "%c%s", row->letter, row->value != NULL ? ":" : "");
    }
}

// Returns the entry of what getopt_long found; -1: none.
static int find_entry(const ArgumentList *list, int key)
{
    if (key >= FIRST_KEY)
        return key - FIRST_KEY;
    if (key == ':' || (key == '?' && optopt != '?'))
        return -1;
    for (int i = 0; i < list->count; i++)
        if (key == 1 ? list->entry[i].row->type == ARGUMENT_OPERAND
                     : list->entry[i].row->letter == key)
            return i;
    return -1;
}

static bool refuse(const ArgumentTable *table, const ArgumentRow *row, const char *text,
                   const Status *why, Status *status)
{
    if (row != NULL && row->name != NULL)
        return status_fail(status, STATUS_INVALID, "%s: --%s '%s' %s (see %s --help)",
                           table->program, row->name, text, why->text, table->program);
    return status_fail(status, STATUS_INVALID, "%s: %s (see %s --help)", table->program, why->text,
                       table->program);
}

static void print(const ArgumentTable *table, const ArgumentList *list, ArgumentType what)
{
    if (what == ARGUMENT_HELP)
        print_help(table, list, stdout);
    else if (what == ARGUMENT_USAGE)
        print_usage(table, list, stdout);
    else
        printf("%s %s\n", table->program, PLIANT_VERSION);
}

// Takes one word or option. `word` is where getopt_long found it. Returns true to go on.
static bool take_one(const ArgumentTable *table, const ArgumentList *list, int key,
                     const char *word, Status *status)
{
    // A word without a place, an unknown option, or one without its value.
    Status why = {0};
    const int i = find_entry(list, key);
    if (i < 0) {
        status_fail(&why, STATUS_INVALID,
                    key == 1 ? "'%s' is not an option" : "'%s' is no option or lacks its value",
                    word);
        return refuse(table, NULL, word, &why, status);
    }
    const ArgumentRow *row = list->entry[i].row;
    // Help and version print and end the program.
    if (row->type >= ARGUMENT_HELP) {
        print(table, list, row->type);
        return false;
    }
    // Words stand for themselves, options have their value behind them.
    const char *text = key == 1 ? word : optarg;
    return take(row, list->entry[i].target, text, &why) || refuse(table, row, text, &why, status);
}

bool arguments_parse(const ArgumentTable *table, int argc, char **argv, void *target,
                     Status *status)
{
    ArgumentList list = {.count = 0};
    Syntax syntax;
    Status why = {0};
    list_rows(&list, table->rows, target);
    list_rows(&list, COMMON, target);
    describe(&list, &syntax);
    optind = 0; // from the beginning
    for (int key, at = 1;
         (key = getopt_long(argc, argv, syntax.letters, syntax.option, NULL)) != -1; at = optind)
        if (!take_one(table, &list, key, argv[at], status))
            return false;
    for (int i = optind; i < argc; i++) // after "--"
        if (!take_one(table, &list, 1, argv[i], status))
            return false;
    return table->check == NULL || table->check(target, &why) ||
           refuse(table, NULL, NULL, &why, status);
}

int arguments_exit(const Status *status)
{
    fflush(stdout);
    if (status->code != STATUS_OK)
        fprintf(stderr, "%s\n", status->text);
    return (int)status->code;
}
