// SPDX-License-Identifier: MIT
// Command lines: what a table stores and what it refuses.
#include "base/arguments.h"
#include "test.h"

#include <math.h>
#include <string.h>
#include <unistd.h>

typedef struct Values {
    bool quiet, smooth;
    double rate, step, at[3];
    int count, words;
    const char *file, *name, *scene;
} Values;

#define AT(member) offsetof(Values, member)

static bool take_word(void *target, const char *text, Status *why)
{
    ((Values *)target)->words++;
    return strcmp(text, "bad") != 0 || status_fail(why, STATUS_INVALID, "is bad");
}

static const ArgumentRow SHARED[] = {
    {"name", 0, ARGUMENT_NAME, "NAME", 0, .preset_text = "PLIANT", .help = "a name"}, {0}};

static const ArgumentRow ROWS[] = {
    {.type = ARGUMENT_ROWS, .rows = ARGUMENTS_SCENE, .offset = AT(scene)},
    {.type = ARGUMENT_HEADING, .help = "All of them:"},
    {"quiet", 'q', ARGUMENT_FLAG, NULL, AT(quiet), .help = "a flag"},
    {"no-smooth", 0, ARGUMENT_FLAG, NULL, AT(smooth), .preset = 1, .help = "a flag that is set"},
    {"rate", 'r', ARGUMENT_NUMBER, "HZ", AT(rate), 0.0, 10.0, .open = true, .help = "a number"},
    {"step", 0, ARGUMENT_NUMBER, "MM", AT(step), 0.0, 100.0, .factor = 1e-3, .preset = 2.0,
     .help = "a number in another unit"},
    {"at", 0, ARGUMENT_NUMBERS, "X,Y,Z", AT(at), -10.0, 10.0, .preset_text = "0,0,-1",
     .help = "three numbers"},
    {"count", 'n', ARGUMENT_INTEGER, "N", AT(count), 1, 5, .preset = -1, .help = "an integer"},
    {"seed", 0, ARGUMENT_INTEGER, "N", .low = -HUGE_VAL, .high = HUGE_VAL, .idle = true,
     .help = "an integer that nobody reads"},
    {"file", 'f', ARGUMENT_TEXT, "FILE", AT(file), .help = "a text"},
    {"word", 'w', ARGUMENT_OTHER, "W", .handler = take_word, .help = "what only its handler knows"},
    {.type = ARGUMENT_ROWS, .rows = SHARED, .offset = AT(name)},
    {0}};

static bool check(void *target, Status *why)
{
    const Values *values = target;
    return !values->quiet || values->file == NULL ||
           status_fail(why, STATUS_INVALID, "--quiet goes without --file");
}

static const ArgumentTable TABLE = {
    .program = "try", .about = "Tries.", .rows = ROWS, .check = check};

// Reads words separated by one space.
static bool read_line(const char *line, Values *values, Status *status)
{
    static char text[256];
    char *word[32] = {"try"};
    int count = 1;
    snprintf(text, sizeof text, "%s", line);
    for (char *at = strtok(text, " "); at != NULL; at = strtok(NULL, " "))
        word[count++] = at;
    *values = (Values){0};
    *status = (Status){0};
    return arguments_parse(&TABLE, count, word, values, status);
}

TEST(defaults_are_those_of_the_rows)
{
    Values values;
    Status status;
    assert_true(read_line("", &values, &status));
    assert_true(!values.quiet && values.smooth && values.count == -1);
    expect_near(values.step, 2e-3, 0.0);
    expect_near(values.at[2], -1.0, 0.0);
    assert_string_equal(values.name, "PLIANT");
    assert_null(values.file);
    assert_null(values.scene);
}

TEST(values_are_stored_where_their_rows_say)
{
    Values values;
    Status status;
    assert_true(read_line("-r 2.5e0 a.cfg --no-smooth --step=10 --at 0.5,-1e-3,10 -n5 --seed -7 "
                          "-w x --wor y --name left_kidney-2 --file --quiet",
                          &values, &status));
    assert_true(!values.quiet && !values.smooth && values.count == 5 && values.words == 2);
    expect_near(values.rate, 2.5, 0.0);
    expect_near(values.step, 1e-2, 0.0);
    expect_near(values.at[1], -1e-3, 0.0);
    assert_string_equal(values.name, "left_kidney-2");
    assert_string_equal(values.file, "--quiet");
    assert_string_equal(values.scene, "a.cfg");
    assert_true(read_line("-qn 2 -- --rate", &values, &status));
    assert_true(values.quiet && values.count == 2);
    assert_string_equal(values.scene, "--rate");
}

TEST(refusals_name_option_value_and_range)
{
    static const char *const cases[][2] = {
        {"--rate 0", "try: --rate '0' is not a number in (0, 10] (see try --help)"},
        {"--rate nan", "try: --rate 'nan' is not a number in (0, 10] (see try --help)"},
        {"-r 1x", "try: --rate '1x' is not a number in (0, 10] (see try --help)"},
        {"--count 6", "try: --count '6' is not an integer in [1, 5] (see try --help)"},
        {"--seed many", "try: --seed 'many' is not an integer (see try --help)"},
        {"--at 1,2", "try: --at '1,2' is not X,Y,Z, each in [-10, 10] (see try --help)"},
        {"--name a.b", "try: --name 'a.b' is not 1 to 31 letters, digits, _ or - (see try --help)"},
        {"--word bad", "try: --word 'bad' is bad (see try --help)"},
        {"a b", "try: one scene at a time, got 'a' and 'b' (see try --help)"},
        {"-q -f x", "try: --quiet goes without --file (see try --help)"},
        {"-q --none", "try: '--none' is no option or lacks its value (see try --help)"},
        {"-qx", "try: '-qx' is no option or lacks its value (see try --help)"},
        {"-q --file", "try: '--file' is no option or lacks its value (see try --help)"},
        {"--quiet=1", "try: '--quiet=1' is no option or lacks its value (see try --help)"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        Values values;
        Status status;
        assert_false(read_line(cases[k][0], &values, &status));
        assert_int_equal(status.code, STATUS_INVALID);
        assert_string_equal(status.text, cases[k][1]);
    }
}

TEST(numbers_must_be_whole_finite_and_inside)
{
    static const char *const bad[] = {"", "x", "1x", "nan", "inf", "-1", "11", "1e999", "1 2"};
    static const char *const bad_integers[] = {"", "1.5", "99999999999999999999", "-1", "11", "0x"};
    static const char *const bad_vectors[] = {"",        "1",       "1,2",     "1,2,",
                                              "1,2,3,",  "1,2,3,4", "1,nan,3", "1 2 3",
                                              "1,2,inf", "1,2,99",  ",1,2"};
    double number[3];
    long long integer;
    for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++)
        assert_false(argument_read_numbers(bad[k], 1, 0.0, 10.0, number));
    for (size_t k = 0; k < sizeof bad_integers / sizeof bad_integers[0]; k++)
        assert_false(argument_read_integer(bad_integers[k], 0, 10, &integer));
    for (size_t k = 0; k < sizeof bad_vectors / sizeof bad_vectors[0]; k++)
        assert_false(argument_read_numbers(bad_vectors[k], 3, -10.0, 10.0, number));
    assert_true(argument_read_integer("10", 0, 10, &integer));
    assert_int_equal(integer, 10);
}

TEST(names_hold_nothing_that_a_pattern_would_read)
{
    assert_true(argument_is_name("left_kidney-2", 31));
    static const char *const bad[] = {"",    "a.b", "a*",  "a b",
                                      "a/b", "a\n", "(a)", "0123456789012345678901234567890123"};
    for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++)
        assert_false(argument_is_name(bad[k], 31));
}

// Reads what a line prints.
static void read_printed(const char *line, char *text, size_t size)
{
    Values values;
    Status status;
    FILE *out = tmpfile();
    fflush(stdout);
    const int before = dup(STDOUT_FILENO);
    dup2(fileno(out), STDOUT_FILENO);
    const bool runs = read_line(line, &values, &status);
    fflush(stdout);
    dup2(before, STDOUT_FILENO);
    close(before);
    assert_true(!runs && status.code == STATUS_OK);
    rewind(out);
    text[fread(text, 1, size - 1, out)] = '\0';
    fclose(out);
}

// Each row with its default, if it can be given; lines fit a terminal.
TEST(help_lists_every_row_with_its_default)
{
    char text[4096];
    read_printed("--version", text, sizeof text);
    assert_string_equal(text, "try " PLIANT_VERSION "\n");
    read_printed("-q -? --none", text, sizeof text);
    assert_non_null(strstr(text, "Usage: try [OPTION...]\nTries.\n\nAll of them:\n"));
    assert_non_null(strstr(text, "  -q, --quiet                a flag\n"));
    assert_non_null(strstr(text, "      --step=MM              a number in another unit (default: "
                                 "2)\n"));
    assert_non_null(strstr(text, "three numbers (default: 0,0,-1)\n"));
    assert_non_null(strstr(text, "  -n, --count=N              an integer\n"));
    assert_non_null(strstr(text, "Without effect: an integer that nobody reads\n"));
    for (const char *line = text; line != NULL && *line != '\0'; line = strchr(line, '\n') + 1)
        assert_true(strcspn(line, "\n") <= 79);
    assert_non_null(strstr(text, "  -?, --help "));
    assert_non_null(strstr(text, "      --name=NAME            a name (default: PLIANT)\n"));
}
