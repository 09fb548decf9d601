// SPDX-License-Identifier: MIT
// Tables of options. One table per group of the scene file drives reading, error texts and the
// printed reference. Called once, at load time, by the thread that reads the scene; knows
// libconfig's settings, but no key of any scene.
#ifndef PLIANT_SCENE_OPTION_TABLE_H
#define PLIANT_SCENE_OPTION_TABLE_H

#include "base/check.h"
#include "base/vec.h"

#include <libconfig.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
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
} OptionType;

// One allowed word; a list of them ends with a NULL word.
typedef struct OptionWord {
    const char *word;
    int value;
} OptionWord;

// A condition in which a key has no effect.
typedef struct OptionPlace OptionPlace; // where a group is, for those who know the scene
typedef struct OptionIdle {
    bool (*holds)(const OptionPlace *place);
    const char *why;
} OptionIdle;

enum { OPTION_IDLES = 3 };

// What a key enables, in the list of --explain.
typedef struct OptionFeature {
    const char *name;                     // NULL: nothing that is listed
    bool (*on)(const OptionPlace *place); // NULL: its value does (option_enables), where not idle
    const char *how;                      // NULL: the key, with the values that enable it
    unsigned only;                        // variants that can have it; 0: all that use the key
} OptionFeature;

typedef struct Option {
    const char *key;
    OptionType type;
    size_t offset;           // offset of the member of `target` that receives the value
    const char *unit;        // "" without
    double low, high;        // allowed range, both included
    bool open;               // `low` itself is excluded
    bool names;              // OPTION_INTS: a name in quotation marks in place of any of them
    bool grouped;            // OPTION_INT: or a group, read by who asked for it; then the default
    double preset;           // default of numbers, booleans (0 or 1) and words (their value)
    const char *preset_text; // default of names and strings; else the text shown for the default
    const OptionWord *words;
    bool required;
    int way;     // 1 or 2: of the two ways to say what a group says, which cannot be mixed; 0: of
                 // neither
    bool needed; // by a group that uses the second way
    const char *apart; // key of the same group with which it cannot be mixed; NULL: none
    bool follows;      // at most OptionSource.most: refused where given, else lowered to it
    unsigned only;     // bit set of the variants of the group that use the key; 0: all
    bool physics;      // the motion depends on it: part of what a checkpoint is known by
    const OptionIdle *idle[OPTION_IDLES]; // the first that holds is reported; NULL: no more
    const char *live; // key by which SET changes it while the scene runs; NULL: it cannot
    OptionFeature feature;
    const char *about; // one sentence
} Option;

typedef struct OptionTable {
    const char *path;  // path of the group: "bodies.mesh"; "" for the scene itself
    const char *about; // a sentence or two for the reference
    const Option *option;
    int count;
    const char *title; // heading in the reference, where the path is not enough; else NULL
    size_t variant;    // offset of the int in `target` that numbers the variant of the group, set
                       // before the rows that name variants are read; 0: none
    size_t given;      // offset of a uint64_t in `target`, the rows that the scene gives as a bit
                       // set; an empty list counts as none; 0: none
    size_t second;     // offset of the bool in `target`, whether the second way is used, where
                       // rows have one
} OptionTable;

// Source of the values and destination of errors.
typedef struct OptionSource {
    const char *path; // of the scene file
    Status *status;
    double most;          // of rows that follow it,
    const char *most_key; // the value of this key
    // All tables, to say where a misplaced key belongs.
    const OptionTable *(*table)(int index);
    int table_count;
} OptionSource;

// Reads `group` (NULL: omitted, all defaults; no option of the table may be required then) into the
// members of `target`; leaves those of other variants alone, which may share memory. libconfig owns
// strings and settings. Returns false with a status for an unknown or missing key, or a value of
// the wrong type or outside its range.
bool option_read(const OptionTable *table, const config_setting_t *group,
                 const OptionSource *source, void *target);

// Lowers the values of rows that follow another to `most`.
void option_lower(const OptionTable *table, void *target, double most);

// True if the member has the value that it gets where the key is omitted.
bool option_is_default(const Option *option, const void *member);
// True if the value of a row is one that enables something: any but 0, true, any other than the
// default, a group or list that was given.
bool option_enables(const OptionTable *table, int row, const void *target);
// Returns why the key has no effect there, or NULL.
const char *option_idle(const Option *option, const OptionPlace *place);
// True if groups of this variant use the key.
bool option_is_used(const Option *option, int variant);
// Returns false with the status "<key> means nothing for <owner>" if the group has a key of other
// variants.
bool option_refuse_unused(const OptionTable *table, const config_setting_t *group,
                          const OptionSource *source, int variant, const char *owner);

// For a key that only some groups of a table require: returns false with the status of a required
// key if it is missing.
bool option_require(const OptionTable *table, const config_setting_t *group, const char *key,
                    const OptionSource *source);

// True if the group has the key.
bool option_given(const config_setting_t *group, const char *key);
// Returns the setting of a key, for errors about its value; or NULL.
const config_setting_t *option_find(const config_setting_t *group, const char *key);

// Read single values that are not in a table (the corners of a box, the numbers of a list).
bool option_read_vector(const config_setting_t *setting, const Option *option,
                        const OptionSource *source, Vec3 *vector);
bool option_read_int(const config_setting_t *setting, const Option *option,
                     const OptionSource *source, int *value);
// Writes the integers of an OPTION_INTS, at most `capacity`; returns how many there are, 0 for
// NULL.
int option_read_ints(const config_setting_t *setting, int *value, int capacity);
// Returns the number of entries of a list; 0 for NULL.
int option_length(const config_setting_t *list);
// Returns entry `index` of a list of groups, or NULL with a status if it is not a group.
const config_setting_t *option_group_at(const config_setting_t *list, int index,
                                        const OptionSource *source);

// Sets STATUS_INVALID "file:line: text" with the location of `at` and returns false.
bool option_fail(const OptionSource *source, const config_setting_t *at, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

enum { OPTION_NUMBER_TEXT = 32 };
// Writes the shortest text that reads back as the same number.
const char *option_number_text(char text[OPTION_NUMBER_TEXT], double value);
// Writes the value of a number, truth or word as text of a scene file; "" for one outside of the
// range, which only an omitted key has. Returns its length.
size_t option_value_text(const Option *option, const void *member, char *text, size_t size);
// True if `word` is so similar to `known` that it may be a typing error.
bool option_is_near(const char *word, const char *known);

// Prints the table as a section of Markdown.
void option_print_reference(const OptionTable *table, FILE *out);

#endif
