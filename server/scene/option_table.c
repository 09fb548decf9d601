// SPDX-License-Identifier: MIT
#include "scene/option_table.h"

#include "base/arguments.h"
#include "base/check.h"

#include <ctype.h>
#include <stdarg.h>
#include <string.h>
#include <strings.h>

enum { VALUE_TEXT = 96, KEY_TEXT = 136, SENTENCE = 400, LONGEST_KEY = 64 };

// A value of any type.
typedef union OptionValue {
    double real;
    int whole;
    bool truth;
    const char *text;
    Vec3 vector;
    const config_setting_t *setting;
} OptionValue;

static bool is_number(const config_setting_t *setting)
{
    int type = config_setting_type(setting);
    return type == CONFIG_TYPE_INT || type == CONFIG_TYPE_INT64 || type == CONFIG_TYPE_FLOAT;
}

static double number_of(const config_setting_t *setting)
{
    switch (config_setting_type(setting)) {
    case CONFIG_TYPE_INT:
        return config_setting_get_int(setting);
    case CONFIG_TYPE_INT64:
        return (double)config_setting_get_int64(setting);
    default:
        return config_setting_get_float(setting);
    }
}

const char *option_number_text(char text[OPTION_NUMBER_TEXT], double value)
{
    static const int digits[] = {6, 10, 15, 16};
    // As few digits as read back to the same number.
    for (size_t i = 0; i < sizeof digits / sizeof digits[0]; i++) {
        snprintf(text, OPTION_NUMBER_TEXT, "%.*g", digits[i], value);
        double again = 0.0;
        if (sscanf(text, "%lf", &again) == 1 && again >= value && again <= value)
            return text;
    }
    snprintf(text, OPTION_NUMBER_TEXT, "%.17g", value);
    return text;
}

// Writes a real so that it reads back as the same real.
static size_t real_text(double value, char *text, size_t size)
{
    char number[OPTION_NUMBER_TEXT];
    option_number_text(number, value);
    return (size_t)snprintf(text, size, "%s%s", number, strpbrk(number, ".e") == NULL ? ".0" : "");
}

static size_t word_text(const Option *option, int value, char *text, size_t size)
{
    for (const OptionWord *word = option->words; word->word != NULL; word++)
        if (word->value == value)
            return (size_t)snprintf(text, size, "\"%s\"", word->word);
    return 0;
}

static bool is_inside(const Option *option, double value)
{
    // The form of the comparison makes NaN fail.
    return (option->open ? value > option->low : value >= option->low) && value <= option->high;
}

size_t option_value_text(const Option *option, const void *member, char *text, size_t size)
{
    text[0] = '\0';
    // Only values that a scene could give have a text.
    switch (option->type) {
    case OPTION_REAL: {
        const double value = *(const double *)member;
        return is_inside(option, value) ? real_text(value, text, size) : 0;
    }
    case OPTION_INT: {
        const int value = *(const int *)member;
        return is_inside(option, value) ? (size_t)snprintf(text, size, "%d", value) : 0;
    }
    case OPTION_BOOL:
        return (size_t)snprintf(text, size, "%s", *(const bool *)member ? "true" : "false");
    case OPTION_WORD:
        return word_text(option, *(const int *)member, text, size);
    default:
        return 0;
    }
}

// Quotes a string for an error, truncated and without control characters: an error stays one line.
static const char *quoted_text(char text[VALUE_TEXT], const char *string)
{
    size_t length = 0;
    text[length++] = '"';
    for (; *string != '\0' && length < VALUE_TEXT - 6; string++)
        text[length++] = (unsigned char)*string < ' ' || *string == 127 ? '?' : *string;
    snprintf(text + length, VALUE_TEXT - length, "%s\"", *string != '\0' ? "..." : "");
    return text;
}

// Formats a value for an error.
static const char *value_text(char text[VALUE_TEXT], const config_setting_t *setting)
{
    switch (config_setting_type(setting)) {
    case CONFIG_TYPE_STRING:
        return quoted_text(text, config_setting_get_string(setting));
    case CONFIG_TYPE_BOOL:
        return config_setting_get_bool(setting) ? "true" : "false";
    case CONFIG_TYPE_GROUP:
        return "{ ... }";
    case CONFIG_TYPE_LIST:
        return "( ... )";
    case CONFIG_TYPE_ARRAY:
        return "[ ... ]";
    default:
        return option_number_text(text, number_of(setting));
    }
}

bool option_fail(const OptionSource *source, const config_setting_t *at, const char *format, ...)
{
    char text[SENTENCE];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);

    // The root group has no line; an included file has the name that the scene gives it.
    const char *file = at != NULL ? config_setting_source_file(at) : NULL;
    int line = at != NULL ? (int)config_setting_source_line(at) : 0;
    if (file == NULL)
        file = source->path;
    if (line == 0)
        return status_fail(source->status, STATUS_INVALID, "%s: %s", source->path, text);
    return status_fail(source->status, STATUS_INVALID, "%s:%d: %s", file, line, text);
}

// Names a key for an error, with the group in which it is: "material.density".
static const char *key_text(char text[KEY_TEXT], const Option *option,
                            const config_setting_t *setting)
{
    // An entry of an array has no name.
    if (config_setting_name(setting) == NULL)
        setting = config_setting_parent(setting);
    const config_setting_t *group = setting != NULL ? config_setting_parent(setting) : NULL;
    const char *name = group != NULL ? config_setting_name(group) : NULL;
    snprintf(text, KEY_TEXT, "%.64s%s%s", name != NULL ? name : "", name != NULL ? "." : "",
             option->key);
    return text;
}

static bool fail_type(const Option *option, const config_setting_t *setting,
                      const OptionSource *source, const char *wanted)
{
    char text[VALUE_TEXT], key[KEY_TEXT];
    return option_fail(source, setting, "%s %s must be %s", key_text(key, option, setting),
                       value_text(text, setting), wanted);
}

// `noun` is "" or the property that is checked: " length".
static bool check_range(const Option *option, const config_setting_t *setting,
                        const OptionSource *source, double value, const char *noun)
{
    if (is_inside(option, value))
        return true;
    char text[OPTION_NUMBER_TEXT], low[OPTION_NUMBER_TEXT], high[OPTION_NUMBER_TEXT];
    char key[KEY_TEXT];
    return option_fail(source, setting, "%s%s %s outside %c%s, %s]", key_text(key, option, setting),
                       noun, option_number_text(text, value), option->open ? '(' : '[',
                       option_number_text(low, option->low),
                       option_number_text(high, option->high));
}

static bool read_real(const config_setting_t *setting, const Option *option,
                      const OptionSource *source, double *value)
{
    if (!is_number(setting))
        return fail_type(option, setting, source, "a number");
    *value = number_of(setting);
    return check_range(option, setting, source, *value, "");
}

bool option_read_int(const config_setting_t *setting, const Option *option,
                     const OptionSource *source, int *value)
{
    if (!is_number(setting))
        return fail_type(option, setting, source,
                         option->grouped ? "a whole number or a group" : "a whole number");
    if (config_setting_type(setting) == CONFIG_TYPE_FLOAT)
        return fail_type(option, setting, source, "a whole number, written without a point");
    if (!check_range(option, setting, source, number_of(setting), ""))
        return false;
    *value = (int)number_of(setting);
    return true;
}

static bool is_list(const config_setting_t *setting)
{
    int type = config_setting_type(setting);
    return type == CONFIG_TYPE_ARRAY || type == CONFIG_TYPE_LIST;
}

static bool check_ints(const config_setting_t *setting, const Option *option,
                       const OptionSource *source, const config_setting_t **member)
{
    int value;
    *member = setting;
    // A single number stands for a list of one.
    const bool list = is_list(setting);
    if (!list && !is_number(setting) &&
        !(option->names && config_setting_type(setting) == CONFIG_TYPE_STRING))
        return fail_type(option, setting, source,
                         option->names ? "a whole number, a name or a list of them"
                                       : "a whole number or a list of them");
    const int count = list ? config_setting_length(setting) : 1;
    for (int i = 0; i < count; i++) {
        const config_setting_t *one =
            list ? config_setting_get_elem(setting, (unsigned)i) : setting;
        if (option->names && config_setting_type(one) == CONFIG_TYPE_STRING)
            continue;
        if (!option_read_int(one, option, source, &value))
            return false;
    }
    return count > 0 || option_fail(source, setting, "%s is empty", option->key);
}

int option_read_ints(const config_setting_t *setting, int *value, int capacity)
{
    if (setting == NULL)
        return 0;
    int count = is_list(setting) ? config_setting_length(setting) : 1;
    for (int i = 0; i < count && i < capacity; i++)
        value[i] = (int)number_of(is_list(setting) ? config_setting_get_elem(setting, (unsigned)i)
                                                   : setting);
    return count;
}

bool option_read_vector(const config_setting_t *setting, const Option *option,
                        const OptionSource *source, Vec3 *vector)
{
    if (!is_list(setting))
        return fail_type(option, setting, source, "three numbers [x, y, z]");
    char key[KEY_TEXT];
    double component[3] = {0.0};
    int count = config_setting_length(setting);
    // Three numbers, neither more nor fewer.
    if (count != 3)
        return option_fail(source, setting,
                           "%s has %d entries and must be three numbers [x, y, z]%s",
                           key_text(key, option, setting), count,
                           count > 3 && count <= 6 ? ", with points in decimals, not commas" : "");
    for (unsigned i = 0; i < 3; i++) {
        const config_setting_t *entry = config_setting_get_elem(setting, i);
        if (!is_number(entry))
            return fail_type(option, entry, source, "three numbers [x, y, z]");
        component[i] = number_of(entry);
    }
    // The limits of a vector are those of its length.
    *vector = vec3(component[0], component[1], component[2]);
    return check_range(option, setting, source, vec3_length(*vector), " length");
}

static bool read_word(const config_setting_t *setting, const Option *option,
                      const OptionSource *source, int *value)
{
    char text[VALUE_TEXT], key[KEY_TEXT], allowed[SENTENCE / 2] = "";
    const char *string = "";
    if (config_setting_type(setting) == CONFIG_TYPE_STRING)
        string = config_setting_get_string(setting);
    size_t length = 0;
    // Look for the word, and collect all for the error.
    for (const OptionWord *word = option->words; word->word != NULL; word++) {
        if (strcmp(word->word, string) == 0) {
            *value = word->value;
            return true;
        }
        // As far as there is room.
        if (length < sizeof allowed)
            length += (size_t)snprintf(allowed + length, sizeof allowed - length, "%s\"%s\"",
                                       length > 0 ? ", " : "", word->word);
    }
    return option_fail(source, setting, "%s %s must be %s%s", key_text(key, option, setting),
                       value_text(text, setting), strchr(allowed, ',') != NULL ? "one of " : "",
                       allowed);
}

static bool read_string(const config_setting_t *setting, const Option *option,
                        const OptionSource *source, const char **value)
{
    char text[VALUE_TEXT], key[KEY_TEXT];
    if (config_setting_type(setting) != CONFIG_TYPE_STRING)
        return fail_type(option, setting, source, "a string in quotes");
    // Its length, then its characters: names go into channels, files and commands.
    const char *string = config_setting_get_string(setting);
    size_t length = strlen(string);
    bool name = option->type == OPTION_NAME;
    if ((double)length > option->high || (double)length < option->low)
        return option_fail(source, setting, "%s %s has %zu characters, outside [%.0f, %.0f]",
                           key_text(key, option, setting), quoted_text(text, string), length,
                           option->low, option->high);
    if (name && length > 0 && !argument_is_name(string, length))
        return fail_type(option, setting, source, "made of letters, digits, _ and -");
    for (size_t i = 0; i < length; i++)
        if ((unsigned char)string[i] < ' ' || string[i] == 127)
            return fail_type(option, setting, source, "free of control characters");
    *value = string;
    return true;
}

static void store_default(const Option *option, void *member)
{
    // The kind of the member follows from the type of the option.
    switch (option->type) {
    case OPTION_REAL:
        *(double *)member = option->preset;
        break;
    case OPTION_INT:
    case OPTION_WORD:
        *(int *)member = (int)option->preset;
        break;
    case OPTION_BOOL:
        *(bool *)member = option->preset > 0.0;
        break;
    case OPTION_NAME:
    case OPTION_STRING:
        *(const char **)member = option->preset_text;
        break;
    case OPTION_VECTOR:
        *(Vec3 *)member = vec3(0.0, 0.0, 0.0);
        break;
    case OPTION_GROUP:
    case OPTION_LIST:
    case OPTION_INTS:
        *(const config_setting_t **)member = NULL;
        break;
    }
}

// Returns the size of what `option_read` stores.
static size_t value_size(OptionType type)
{
    switch (type) {
    case OPTION_REAL:
        return sizeof(double);
    case OPTION_INT:
    case OPTION_WORD:
        return sizeof(int);
    case OPTION_BOOL:
        return sizeof(bool);
    case OPTION_VECTOR:
        return sizeof(Vec3);
    default:
        return sizeof(const void *);
    }
}

bool option_is_default(const Option *option, const void *member)
{
    OptionValue preset;
    store_default(option, &preset);
    return memcmp(&preset, member, value_size(option->type)) == 0;
}

static uint64_t given_in(const OptionTable *table, const void *target)
{
    return table->given != 0 ? *(const uint64_t *)((const char *)target + table->given) : 0;
}

bool option_enables(const OptionTable *table, int row, const void *target)
{
    const Option *option = &table->option[row];
    const void *member = (const char *)target + option->offset;
    switch (option->type) {
    case OPTION_REAL:
        return *(const double *)member != 0.0;
    case OPTION_BOOL:
        return *(const bool *)member;
    case OPTION_GROUP:
    case OPTION_LIST:
        return (given_in(table, target) >> row & 1) != 0;
    default:
        return !option_is_default(option, member);
    }
}

const char *option_idle(const Option *option, const OptionPlace *place)
{
    for (int i = 0; i < OPTION_IDLES && option->idle[i] != NULL; i++)
        if (option->idle[i]->holds(place))
            return option->idle[i]->why;
    return NULL;
}

static bool read_value(const Option *option, const config_setting_t *setting,
                       const OptionSource *source, void *member)
{
    int type = config_setting_type(setting);
    // Each type has its check; groups and lists are read further by who asked for them.
    switch (option->type) {
    case OPTION_REAL:
        return read_real(setting, option, source, member);
    case OPTION_INT:
        if (!option->grouped || type != CONFIG_TYPE_GROUP)
            return option_read_int(setting, option, source, member);
        store_default(option, member);
        return true;
    case OPTION_INTS:
        return check_ints(setting, option, source, member);
    case OPTION_BOOL:
        if (type != CONFIG_TYPE_BOOL)
            return fail_type(option, setting, source, "true or false");
        *(bool *)member = config_setting_get_bool(setting) != CONFIG_FALSE;
        return true;
    case OPTION_WORD:
        return read_word(setting, option, source, member);
    case OPTION_NAME:
    case OPTION_STRING:
        return read_string(setting, option, source, member);
    case OPTION_VECTOR:
        return option_read_vector(setting, option, source, member);
    case OPTION_GROUP:
        if (type != CONFIG_TYPE_GROUP)
            return fail_type(option, setting, source, "a group { ... }");
        *(const config_setting_t **)member = setting;
        return true;
    case OPTION_LIST:
        if (!is_list(setting))
            return fail_type(option, setting, source, "a list ( ... )");
        *(const config_setting_t **)member = setting;
        return true;
    }
    return false;
}

// Edit distance (Wagner and Fischer 1974), one row at a time; case does not count.
static size_t edit_distance(const char *a, const char *b)
{
    size_t row[LONGEST_KEY + 1], columns = strlen(b);
    if (columns > LONGEST_KEY || strlen(a) > LONGEST_KEY)
        return LONGEST_KEY;
    // One row of the table of distances at a time.
    for (size_t j = 0; j <= columns; j++)
        row[j] = j;
    // From the row above and the entry to the left the cheapest way.
    for (size_t i = 1; a[i - 1] != '\0'; i++) {
        size_t diagonal = row[0];
        row[0] = i;
        for (size_t j = 1; j <= columns; j++) {
            size_t best = diagonal + (tolower(a[i - 1]) == tolower(b[j - 1]) ? 0 : 1);
            diagonal = row[j];
            if (row[j] + 1 < best)
                best = row[j] + 1;
            if (row[j - 1] + 1 < best)
                best = row[j - 1] + 1;
            row[j] = best;
        }
    }
    return row[columns];
}

// Ranks what a word may have meant: one edit, a longer word that begins with it, one that begins as
// it does, one that holds it, more edits. FAR: not similar.
enum { CUT = 3, ALIKE = 4, HELD = 5, FAR = 2 * LONGEST_KEY };
static size_t rank_of(const char *word, const char *known)
{
    const size_t length = strlen(word), distance = edit_distance(word, known);
    if (distance <= 1)
        return 2 * distance;
    if (length >= 3 && strncmp(word, known, length) == 0)
        return CUT;
    if (length >= 3 && distance <= 3 && strncasecmp(word, known, 3) == 0)
        return ALIKE; // body, bodies
    if (length >= 6 && strstr(known, word) != NULL)
        return HELD; // density, areal_density
    const size_t limit = length / 2 < 3 ? length / 2 : 3;
    return distance <= limit ? HELD + distance : FAR;
}

bool option_is_near(const char *word, const char *known)
{
    return rank_of(word, known) < FAR;
}

// Lists the other groups that have the key.
static const char *list_elsewhere(const OptionTable *table, const char *key,
                                  const OptionSource *source, char text[SENTENCE])
{
    size_t used = 0;
    text[0] = '\0';
    for (int i = 0; i < source->table_count; i++) {
        const OptionTable *other = source->table(i);
        const char *path = other->path[0] != '\0' ? other->path : "the scene";
        // Two groups of one path are those of the two models.
        const bool twin = other != table && strcmp(other->path, table->path) == 0;
        const bool has = twin || (other != table && strstr(text, path) == NULL);
        for (int k = 0; has && k < other->count; k++)
            if (strcmp(other->option[k].key, key) == 0 && used < SENTENCE / 3)
                used += (size_t)snprintf(text + used, SENTENCE - used, "%s%s%s",
                                         used > 0 ? " and " : "", path,
                                         twin ? " of the other model" : "");
    }
    return text;
}

// Lists the keys of a table, as far as there is room.
static const char *list_keys(const OptionTable *table, char text[SENTENCE])
{
    size_t used = 0;
    text[0] = '\0';
    for (int i = 0; i < table->count; i++) {
        const char *key = table->option[i].key;
        if (used + strlen(key) + 8 > SENTENCE / 2)
            return strcat(text, " ...");
        used += (size_t)snprintf(text + used, SENTENCE - used, "%s%s", i > 0 ? ", " : "", key);
    }
    return text;
}

// " (unit: what it is, as far as that is short)", as who misses a key often takes another quantity.
static const char *meaning_of(const Option *option, char text[SENTENCE])
{
    const int length = (int)strcspn(option->about, ";.(");
    const bool brief = length > 0 && length <= 40;
    text[0] = '\0';
    if (option->unit[0] != '\0')
        snprintf(text, SENTENCE, " (%s%s%.*s)", option->unit, brief ? ": " : "", brief ? length : 0,
                 option->about);
    return text;
}

static bool fail_unknown(const OptionTable *table, const config_setting_t *setting,
                         const Option *nearest, size_t rank, const OptionSource *source)
{
    char keys[SENTENCE], elsewhere[SENTENCE];
    const char *key = config_setting_name(setting);
    const char *place = table->path[0] != '\0' ? table->path : "the scene";
    const bool misplaced = *list_elsewhere(table, key, source, elsewhere) != '\0';
    // A typing error is likelier than a wrong place, and that than a word that is somewhat similar.
    if (nearest != NULL && (rank <= HELD || !misplaced)) {
        char meaning[SENTENCE];
        return option_fail(source, setting, "unknown key %.64s in %s: did you mean %s%s?", key,
                           place, nearest->key, meaning_of(nearest, meaning));
    }
    if (misplaced)
        return option_fail(source, setting, "unknown key %.64s in %s: it is a key of %s", key,
                           place, elsewhere);
    return option_fail(source, setting, "unknown key %.64s in %s, whose keys are %s", key, place,
                       list_keys(table, keys));
}

static bool check_key(const OptionTable *table, const config_setting_t *setting,
                      const OptionSource *source)
{
    const char *key = config_setting_name(setting);
    const Option *nearest = NULL;
    size_t least = FAR;
    // A key that is known, or the nearest one for the error.
    for (int i = 0; i < table->count; i++) {
        const Option *known = &table->option[i];
        if (strcmp(known->key, key) == 0)
            return true;
        const size_t rank = rank_of(key, known->key);
        if (rank < least) {
            nearest = known;
            least = rank;
        }
    }
    return fail_unknown(table, setting, nearest, least, source);
}

static bool fail_missing(const OptionTable *table, const config_setting_t *group,
                         const Option *option, const OptionSource *source)
{
    return option_fail(source, group, "%s%s%s is missing (%s)", table->path,
                       table->path[0] != '\0' ? "." : "", option->key, option->about);
}

bool option_require(const OptionTable *table, const config_setting_t *group, const char *key,
                    const OptionSource *source)
{
    for (int i = 0; i < table->count && !option_given(group, key); i++)
        if (strcmp(table->option[i].key, key) == 0)
            return fail_missing(table, group, &table->option[i], source);
    return true;
}

bool option_is_used(const Option *option, int variant)
{
    return option->only == 0 || (option->only & 1u << variant) != 0;
}

bool option_refuse_unused(const OptionTable *table, const config_setting_t *group,
                          const OptionSource *source, int variant, const char *owner)
{
    for (int i = 0; i < table->count; i++) {
        const Option *option = &table->option[i];
        if (!option_is_used(option, variant) && option_given(group, option->key))
            return option_fail(source, option_find(group, option->key), "%s means nothing for %s",
                               option->key, owner);
    }
    return true;
}

// Returns the member that receives the value; that of a key of another variant is only checked.
static void *member_of(const OptionTable *table, const Option *option, void *target,
                       OptionValue *unused)
{
    const int *variant = (const int *)((char *)target + table->variant);
    if (table->variant == 0 || option_is_used(option, *variant))
        return (char *)target + option->offset;
    return unused;
}

// Returns the first of the given rows of a way; NULL: none.
static const Option *first_of_way(const OptionTable *table, uint64_t given, int way)
{
    for (int i = 0; i < table->count; i++)
        if (table->option[i].way == way && (given >> i & 1) != 0)
            return &table->option[i];
    return NULL;
}

static bool fail_mixed(const config_setting_t *group, const OptionSource *source, const char *key,
                       const char *other)
{
    return option_fail(source, option_find(group, key), "%s cannot be mixed with %s", key, other);
}

// Checks what holds between the keys of a group.
static bool check_group(const OptionTable *table, const config_setting_t *group,
                        const OptionSource *source, uint64_t given, void *target)
{
    const Option *first = first_of_way(table, given, 1), *second = first_of_way(table, given, 2);
    if (first != NULL && second != NULL)
        return fail_mixed(group, source, second->key, first->key);
    bool two_ways = false;
    for (int i = 0; i < table->count; i++) {
        const Option *option = &table->option[i];
        two_ways |= option->way == 2;
        const bool is_given = (given >> i & 1) != 0;
        if (is_given && option->apart != NULL && option_given(group, option->apart))
            return fail_mixed(group, source, option->key, option->apart);
        if (!is_given && option->needed && second != NULL)
            return option_fail(source, group, "%s.%s is missing: it goes with %s", table->path,
                               option->key, second->key);
    }
    if (two_ways)
        *(bool *)((char *)target + table->second) = second != NULL;
    return true;
}

// Lowers a default to what it follows, and refuses a larger value.
static bool follow(const Option *option, const config_setting_t *setting,
                   const OptionSource *source, void *member)
{
    char text[OPTION_NUMBER_TEXT], most[OPTION_NUMBER_TEXT];
    double *value = member;
    if (!option->follows || source->most_key == NULL || *value <= source->most)
        return true;
    if (setting == NULL) {
        *value = source->most;
        return true;
    }
    return option_fail(source, setting, "%s %s exceeds %s %s", option->key,
                       option_number_text(text, *value), source->most_key,
                       option_number_text(most, source->most));
}

bool option_read(const OptionTable *table, const config_setting_t *group,
                 const OptionSource *source, void *target)
{
    // A key that the table does not know is an error, never ignored.
    for (int i = 0; i < option_length(group); i++)
        if (!check_key(table, config_setting_get_elem(group, (unsigned)i), source))
            return false;
    // Each row gets its value, its default, or an error.
    uint64_t given = 0;
    ASSERT(table->count <= (int)(8 * sizeof given));
    for (int i = 0; i < table->count; i++) {
        const Option *option = &table->option[i];
        const config_setting_t *setting = option_find(group, option->key);
        OptionValue unused;
        void *member = member_of(table, option, target, &unused);
        if (setting != NULL) {
            if (!read_value(option, setting, source, member))
                return false;
            if (option->type != OPTION_LIST || option_length(setting) > 0)
                given |= (uint64_t)1 << i;
        } else if (option->required) {
            ASSERT(group != NULL);
            return fail_missing(table, group, option, source);
        } else {
            store_default(option, member);
        }
        if (!follow(option, setting, source, member))
            return false;
    }
    if (table->given != 0)
        *(uint64_t *)((char *)target + table->given) = given;
    return check_group(table, group, source, given, target);
}

void option_lower(const OptionTable *table, void *target, double most)
{
    for (int i = 0; i < table->count; i++) {
        double *value = (double *)((char *)target + table->option[i].offset);
        if (table->option[i].follows && *value > most)
            *value = most;
    }
}

const config_setting_t *option_find(const config_setting_t *group, const char *key)
{
    return group != NULL ? config_setting_get_member(group, key) : NULL;
}

bool option_given(const config_setting_t *group, const char *key)
{
    return option_find(group, key) != NULL;
}

int option_length(const config_setting_t *list)
{
    return list != NULL ? config_setting_length(list) : 0;
}

const config_setting_t *option_group_at(const config_setting_t *list, int index,
                                        const OptionSource *source)
{
    const config_setting_t *entry = config_setting_get_elem(list, (unsigned)index);
    if (config_setting_type(entry) == CONFIG_TYPE_GROUP)
        return entry;
    char text[VALUE_TEXT];
    option_fail(source, entry, "%s entry %s must be a group { ... }", config_setting_name(list),
                value_text(text, entry));
    return NULL;
}
