// SPDX-License-Identifier: MIT
// The reader of option tables, on a table made for the purpose.
#include "test.h"

#include "scene/option_table.h"

#include <limits.h>

typedef struct Target {
    double real;
    int whole, word;
    bool flag;
    Vec3 vector;
    const char *name, *string;
    const config_setting_t *group, *list, *labels;
} Target;

static const OptionWord WORDS[] = {{"one", 1}, {"two", 2}, {NULL, 0}};

#define AT(member) offsetof(Target, member)
static const Option OPTIONS[] = {
    {"rate_hz", OPTION_REAL, AT(real), "Hz", 1.0, 10000.0, .preset = 1000.0, .about = "Rate."},
    {"count", OPTION_INT, AT(whole), "", 0.0, INT_MAX, .preset = 7.0, .about = "Count."},
    {"kind", OPTION_WORD, AT(word), "", .words = WORDS, .preset = 2.0, .about = "Kind."},
    {"flag", OPTION_BOOL, AT(flag), "", .preset = 1.0, .about = "Flag."},
    {"gravity", OPTION_VECTOR, AT(vector), "m/s2", 0.0, 100.0, .about = "Gravity."},
    {"name", OPTION_NAME, AT(name), "", .low = 1, .high = 8, .preset_text = "nobody",
     .about = "Name."},
    {"file", OPTION_STRING, AT(string), "", .low = 1, .high = 20, .preset_text = "none",
     .about = "File."},
    {"inner", OPTION_GROUP, AT(group), "", .about = "Group."},
    {"items", OPTION_LIST, AT(list), "", .about = "List."},
    {"labels", OPTION_INTS, AT(labels), "", 1.0, 9.0, .about = "Labels."},
};
#undef AT
static const OptionTable TABLE = {.path = "things",
                                  .about = "Things.",
                                  .option = OPTIONS,
                                  .count = sizeof OPTIONS / sizeof OPTIONS[0]};

// Reads text; returns what was wrong, "" if nothing.
static const char *read_text(const char *text, Target *target)
{
    static config_t config;
    static bool used = false;
    static Status status;
    if (used)
        config_destroy(&config);
    used = true;
    config_init(&config);
    status = (Status){0};
    if (config_read_string(&config, text) != CONFIG_TRUE)
        return config_error_text(&config);
    OptionSource source = {.path = "press.cfg", .status = &status};
    *target = (Target){0};
    bool ok = option_read(&TABLE, config_root_setting(&config), &source, target);
    assert_int_equal(ok, status.code == STATUS_OK);
    return status.text;
}

static void read_well(const char *text, Target *target)
{
    assert_string_equal(read_text(text, target), "");
}

TEST(omitted_keys_take_their_defaults)
{
    Target t;
    read_well("", &t);
    expect_near(t.real, 1000.0, 0.0);
    assert_int_equal(t.whole, 7);
    assert_int_equal(t.word, 2);
    assert_true(t.flag);
    assert_string_equal(t.name, "nobody");
    assert_null(t.group);
    assert_null(t.list);
    // An omitted group reads like an empty one.
    Target absent = {0};
    Status status = {0};
    OptionSource source = {.path = "press.cfg", .status = &status};
    assert_true(option_read(&TABLE, NULL, &source, &absent));
    expect_near(absent.real, 1000.0, 0.0);
}

TEST(given_values_are_stored)
{
    Target t;
    assert_string_equal(read_text("rate_hz = 0.5e2; count = 3; kind = \"one\"; flag = false;\n"
                                  "gravity = (0, 1.5, -2L); name = \"a_b-9\"; file = \"x y.h5\";\n"
                                  "inner = { }; items = ( 1, 2 );",
                                  &t),
                        "");
    expect_near(t.real, 50.0, 0.0);
    assert_int_equal(t.whole, 3);
    assert_int_equal(t.word, 1);
    assert_false(t.flag);
    expect_near(t.vector.x, 0.0, 0.0);
    expect_near(t.vector.y, 1.5, 0.0);
    expect_near(t.vector.z, -2.0, 0.0);
    assert_string_equal(t.name, "a_b-9");
    assert_string_equal(t.string, "x y.h5");
    assert_non_null(t.group);
    assert_int_equal(option_length(t.list), 2);
}

TEST(reals_accept_integers_but_integers_refuse_reals)
{
    Target t;
    assert_string_equal(read_text("rate_hz = 60;", &t), "");
    expect_near(t.real, 60.0, 0.0);
}

TEST(vectors_accept_arrays_and_lists)
{
    Target t;
    assert_string_equal(read_text("gravity = [1, 2, 3];", &t), "");
    expect_near(t.vector.z, 3.0, 0.0);
    assert_string_equal(read_text("gravity = [1.0, 2.0, 4.0];", &t), "");
    expect_near(t.vector.z, 4.0, 0.0);
}

TEST(integers_are_one_number_or_a_list)
{
    Target t;
    int value[4] = {0};
    read_well("", &t);
    assert_int_equal(option_read_ints(t.labels, value, 4), 0);
    assert_string_equal(read_text("labels = 7;", &t), "");
    assert_int_equal(option_read_ints(t.labels, value, 4), 1);
    assert_int_equal(value[0], 7);
    assert_string_equal(read_text("labels = [1, 2];", &t), "");
    assert_int_equal(option_read_ints(t.labels, value, 4), 2);
    assert_string_equal(read_text("labels = (9, 8L, 5);", &t), "");
    // No more are written than there is room for, and all are counted.
    assert_int_equal(option_read_ints(t.labels, value, 2), 3);
    assert_int_equal(value[0], 9);
    assert_int_equal(value[1], 8);
    assert_int_equal(value[2], 0);
}

// A text that is wrong, and what is said of it behind the file's name and a colon.
static const char *const WRONG[][2] = {
    // reals accept integers but integers refuse reals
    {"count = 2.0;", "1: count 2 must be a whole number, written without a point"},
    // vectors accept arrays and lists
    {"gravity = [1, 2];", "1: gravity has 2 entries and must be three numbers [x, y, z]"},
    {"gravity = (1, 2, \"3\");", "1: gravity \"3\" must be three numbers [x, y, z]"},
    {"gravity = (0, 0, -101);", "1: gravity length 101 outside [0, 100]"},
    // integers are one number or a list
    {"labels = 0;", "1: labels 0 outside [1, 9]"},
    {"labels = (1,\n10);", "2: labels 10 outside [1, 9]"},
    {"labels = ();", "1: labels is empty"},
    {"labels = [1.0];", "1: labels 1 must be a whole number, written without a point"},
    {"labels = \"1\";", "1: labels \"1\" must be a whole number or a list of them"},
    {"labels = ((1));", "1: labels ( ... ) must be a whole number"},
    // out of range names line value and range
    {"\n\nrate_hz = 20000;", "3: rate_hz 20000 outside [1, 10000]"},
    {"rate_hz = 0.1;", "1: rate_hz 0.1 outside [1, 10000]"},
    {"count = -1;", "1: count -1 outside [0, 2147483647]"},
    {"count = 2147483648L;", "1: count 2147483648 outside [0, 2147483647]"},
    // numbers that are not finite are out of range
    {"rate_hz = 1e999;", "1: rate_hz inf outside [1, 10000]"},
    {"rate_hz = -1e999;", "1: rate_hz -inf outside [1, 10000]"},
    {"gravity = (1e999, 0, 0);", "1: gravity length inf outside [0, 100]"},
    // wrong types are named
    {"rate_hz = \"fast\";", "1: rate_hz \"fast\" must be a number"},
    {"rate_hz = true;", "1: rate_hz true must be a number"},
    {"count = { };", "1: count { ... } must be a whole number"},
    {"flag = 1;", "1: flag 1 must be true or false"},
    {"name = 5;", "1: name 5 must be a string in quotes"},
    {"inner = (1);", "1: inner ( ... ) must be a group { ... }"},
    {"items = { };", "1: items { ... } must be a list ( ... )"},
    {"gravity = 9.81;", "1: gravity 9.81 must be three numbers [x, y, z]"},
    // names are short and plain
    {"name = \"a b\";", "1: name \"a b\" must be made of letters, digits, _ and -"},
    {"name = \"\";", "1: name \"\" has 0 characters, outside [1, 8]"},
    {"name = \"123456789\";", "1: name \"123456789\" has 9 characters, outside [1, 8]"},
    {"file = \"a\\nb\";", "1: file \"a?b\" must be free of control characters"},
    // words list what is allowed
    {"kind = \"four\";", "1: kind \"four\" must be one of \"one\", \"two\""},
    {"kind = 4;", "1: kind 4 must be one of \"one\", \"two\""},
    // unknown keys suggest the nearest known one
    {"rate_hs = 5;", "1: unknown key rate_hs in things: did you mean rate_hz (Hz: Rate)?"},
    {"rate = 5;", "1: unknown key rate in things: did you mean rate_hz (Hz: Rate)?"},
    {"\ncuont = 5;", "2: unknown key cuont in things: did you mean count?"},
    {"whatever = 5;", "1: unknown key whatever in things, whose keys are rate_hz, count, kind, "
                      "flag, gravity, name, file, inner, items, labels"},
};

TEST(wrong_values_are_refused_in_these_words)
{
    for (size_t i = 0; i < sizeof WRONG / sizeof *WRONG; i++) {
        Target target;
        const char *said = read_text(WRONG[i][0], &target);
        if (strncmp(said, "press.cfg:", 10) != 0 || strcmp(said + 10, WRONG[i][1]) != 0)
            fail_msg("%s: says '%s', expected 'press.cfg:%s'", WRONG[i][0], said, WRONG[i][1]);
    }
}

TEST(missing_required_keys_are_named_at_their_group)
{
    static const Option NEEDED[] = {
        {"id", OPTION_INT, 0, "", 0.0, 9.0, .required = true, .about = "Number."}};
    static const OptionTable NEEDY = {.path = "tools", .about = "", .option = NEEDED, .count = 1};
    SCOPED(config_destroy) config_t config;
    config_init(&config);
    assert_int_equal(config_read_string(&config, "\na = {\n};\nb = { id = 3; };"), CONFIG_TRUE);
    Status status = {0};
    OptionSource source = {.path = "press.cfg", .status = &status};
    int id = 0;
    assert_false(option_read(&NEEDY, config_lookup(&config, "a"), &source, &id));
    assert_string_equal(status.text, "press.cfg:2: tools.id is missing (Number.)");
    // The same sentence where only some groups need the key.
    status = (Status){0};
    assert_false(option_require(&NEEDY, config_lookup(&config, "a"), "id", &source));
    assert_string_equal(status.text, "press.cfg:2: tools.id is missing (Number.)");
    status = (Status){0};
    assert_true(option_require(&NEEDY, config_lookup(&config, "b"), "id", &source));
}

TEST(numbers_print_as_written)
{
    char text[OPTION_NUMBER_TEXT];
    assert_string_equal(option_number_text(text, 0.1), "0.1");
    assert_string_equal(option_number_text(text, 20000.0), "20000");
    assert_string_equal(option_number_text(text, 2147483648.0), "2147483648");
    // Nothing that differs from the bound may print like the bound.
    assert_string_not_equal(option_number_text(text, nextafter(10000.0, 20000.0)), "10000");
}

TEST(reference_lists_every_key)
{
    FREED char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    option_print_reference(&TABLE, out);
    fclose(out);
    for (int i = 0; i < TABLE.count; i++) {
        char row[64];
        snprintf(row, sizeof row, "\n| `%s` | ", OPTIONS[i].key);
        expect_in(text, row);
    }
    expect_in(text, "| `rate_hz` | real | Hz | [1, 10000] | 1000 | Rate. |");
}
