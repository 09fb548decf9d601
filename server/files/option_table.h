// Tables of options: one table a group of the scene file drives reading, the texts of errors and
// the printed reference. Called once, at load, by the thread that reads the scene; knows
// libconfig's settings, but no key of any scene.
#ifndef PLIANT_FILES_OPTION_TABLE_H
#define PLIANT_FILES_OPTION_TABLE_H

#include "base/status.h"
#include "base/vec.h"

#include <libconfig.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

typedef enum OptionType {
    OPTION_REAL,   // double; integers are accepted
    OPTION_INT,    // int
    OPTION_INTS,   // const config_setting_t *: one integer or a list of them, NULL when omitted;
                   // the range is that of each (option_read_ints)
    OPTION_BOOL,   // bool
    OPTION_WORD,   // int: the value of one of `words`
    OPTION_NAME,   // const char *: letters, digits, _ and -; the range is that of its length
    OPTION_STRING, // const char *: printable text; the range is that of its length
    OPTION_VECTOR, // Vec3: three numbers in [ ] or ( ); the range is that of its length
    OPTION_GROUP,  // const config_setting_t *: { ... }, NULL when omitted
    OPTION_LIST,   // const config_setting_t *: ( ... ) or [ ... ], NULL when omitted
    OPTION_LATER,  // nothing: a known key of a feature that is not built in (`later`)
} OptionType;

// One allowed word; a list of them ends with a NULL word.
typedef struct OptionWord {
    const char *word;
    int value;
    const char *later; // NULL, or why the word is refused: "voxel bodies are not built into ..."
} OptionWord;

typedef struct Option {
    const char *key;
    OptionType type;
    size_t offset;           // of the member of `target` that receives the value
    const char *unit;        // "" without
    double low, high;        // allowed range, both included
    bool open;               // `low` itself is excluded
    double preset;           // default of numbers, booleans (0 or 1) and words (their value)
    const char *preset_text; // default of names and strings; else how the default reads
    const OptionWord *words;
    bool required;
    const char *later; // not NULL: only the default is accepted, and this says why
    const char *about; // one sentence
} Option;

typedef struct OptionTable {
    const char *path;  // where the group stands: "bodies.mesh"; "" for the scene itself
    const char *about; // a sentence or two for the reference
    const Option *option;
    int count;
    const char *title; // heading in the reference, where the path is not enough; else NULL
} OptionTable;

// Where values come from and complaints go.
typedef struct OptionSource {
    const char *path; // of the scene file
    Status *status;
} OptionSource;

// Reads `group` (NULL: omitted, all defaults; then no option of the table may be required) into the
// members of `target`. Strings and settings stay libconfig's. False with a status for an unknown or
// missing key, a value of the wrong type or outside its range.
bool option_read(const OptionTable *table, const config_setting_t *group,
                 const OptionSource *source, void *target);

// For a key that only some groups of a table need: false with the status of a required key when it
// is missing.
bool option_require(const OptionTable *table, const config_setting_t *group, const char *key,
                    const OptionSource *source);

// Whether the group has the key.
bool option_given(const config_setting_t *group, const char *key);
// The setting of a key or NULL, for complaints about its value.
const config_setting_t *option_find(const config_setting_t *group, const char *key);

// Single values that stand outside a table (the corners of a box, the numbers of a list).
bool option_read_vector(const config_setting_t *setting, const Option *option,
                        const OptionSource *source, Vec3 *vector);
bool option_read_int(const config_setting_t *setting, const Option *option,
                     const OptionSource *source, int *value);
// The integers of an OPTION_INTS that was read: how many, of which at most `capacity` are written;
// 0 for NULL.
int option_read_ints(const config_setting_t *setting, int *value, int capacity);
// Entries of a list; 0 for NULL.
int option_length(const config_setting_t *list);
// Entry `index` of a list of groups, or NULL with a status when it is not a group.
const config_setting_t *option_group_at(const config_setting_t *list, int index,
                                        const OptionSource *source);

// Sets STATUS_INVALID "file:line: text" with the place of `at` and returns false.
bool option_fail(const OptionSource *source, const config_setting_t *at, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

enum { OPTION_NUMBER_TEXT = 32 };
// The shortest text that reads back as the same number.
const char *option_number_text(char text[OPTION_NUMBER_TEXT], double value);
// Whether `word` is so near to `known` that it may be a slip of the pen.
bool option_is_near(const char *word, const char *known);

// Prints the table as a section of Markdown.
void option_print_reference(const OptionTable *table, FILE *out);

#endif
