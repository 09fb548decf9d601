#include "base/arguments.h"

#include "base/check.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FIRST_KEY = 256 }; // of long options; beyond all letters

// The last rows of every program.
static const ArgumentRow COMMON[] = {
    {"help", '?', ARGUMENT_HELP, .help = "Print this list, exit"},
    {"usage", 0, ARGUMENT_USAGE, .help = "Print the options in short, exit"},
    {"version", 'V', ARGUMENT_VERSION, .help = "Print the version, exit"},
    {0}};

// --- values ---

bool argument_is_name(const char *text, size_t most)
{
    static const char letters[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
    const size_t length = strlen(text);
    return length >= 1 && length <= most && strspn(text, letters) == length;
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

bool argument_is_inside(const ArgumentRow *row, double value)
{
    return (row->open ? value > row->low : value >= row->low) && value <= row->high;
}

static bool read_number(const ArgumentRow *row, const char *text, double *member, Status *why)
{
    double value;
    if (!argument_read_numbers(text, 1, row->low, row->high, &value) ||
        !argument_is_inside(row, value))
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
        *(bool *)member = !(row->preset > 0.0);
        return true;
    case ARGUMENT_NAME:
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

// --- the line ---

static void list_rows(ArgumentList *list, const ArgumentRow *row, char *target)
{
    for (; row->type != ARGUMENT_END; row++) {
        if (row->type == ARGUMENT_ROWS) {
            list_rows(list, row->rows, target + row->offset);
            continue;
        }
        ASSERT(list->count < ARGUMENT_ROWS_MOST);
        list->entry[list->count].row = row;
        list->entry[list->count++].target = target;
        store_default(row, target);
    }
}

// What getopt_long reads: options in their order among other words, which come as key 1.
typedef struct Syntax {
    struct option option[ARGUMENT_ROWS_MOST + 1];
    char letters[2 * ARGUMENT_ROWS_MOST + 4];
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
        arguments_print_help(table, list, stdout);
    else if (what == ARGUMENT_USAGE)
        arguments_print_usage(table, list, stdout);
    else
        printf("%s %s\n", table->program, PLIANT_VERSION);
}

// Takes one word or option. `word` is where getopt_long found it. Returns true to go on.
static bool take_one(const ArgumentTable *table, const ArgumentList *list, int key,
                     const char *word, Status *status)
{
    Status why = {0};
    const int i = find_entry(list, key);
    if (i < 0) {
        status_fail(&why, STATUS_INVALID,
                    key == 1 ? "'%s' is not an option" : "'%s' is no option or lacks its value",
                    word);
        return refuse(table, NULL, word, &why, status);
    }
    const ArgumentRow *row = list->entry[i].row;
    if (row->type >= ARGUMENT_HELP) {
        print(table, list, row->type);
        return false;
    }
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
