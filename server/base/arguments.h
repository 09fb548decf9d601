// SPDX-License-Identifier: MIT
// Command lines of all programs. One table per program drives reading, refusals, defaults and
// --help; rows that several programs have are written once and named by reference.
#ifndef PLIANT_BASE_ARGUMENTS_H
#define PLIANT_BASE_ARGUMENTS_H

#include "base/check.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

typedef enum ArgumentType {
    ARGUMENT_END,     // the last row of each list, {0}
    ARGUMENT_FLAG,    // bool: the opposite of its default
    ARGUMENT_TEXT,    // const char *
    ARGUMENT_NAME,    // const char *: 1 to ARGUMENT_NAME_MOST letters, digits, _ or -
    ARGUMENT_NUMBER,  // double
    ARGUMENT_INTEGER, // int
    ARGUMENT_NUMBERS, // double[]: as many as its value's word "X,Y,Z" names, each in the range
    ARGUMENT_OTHER,   // what the handler makes of it
    ARGUMENT_OPERAND, // words that are no options, for the handler
    ARGUMENT_HEADING, // of the rows that follow
    ARGUMENT_ROWS,    // the rows of another list, whose offsets begin at `offset`
    ARGUMENT_HELP,    // print, instead of running
    ARGUMENT_USAGE,
    ARGUMENT_VERSION,
} ArgumentType;

enum { ARGUMENT_NAME_MOST = 31, ARGUMENT_NUMBERS_MOST = 6 };

// Takes a value after it was read and stored; `target` is what the row's offset counts from. For a
// refusal sets `why` to the words that follow "--option 'value'", of an operand to the sentence.
typedef bool ArgumentHandler(void *target, const char *text, Status *why);

typedef struct ArgumentRow {
    const char *name; // "lcm-url"; NULL for operands and headings
    char letter;      // 'l'; 0: none
    ArgumentType type;
    const char *value; // what stands for it in --help: "URL", with its unit; NULL: takes none
    size_t offset;     // of the member of `target` that receives the value
    double low, high;  // allowed range, both included
    bool open;         // `low` itself is excluded
    double factor;     // from the argument's unit to the member's; 0: 1
    double preset;     // default, in the argument's unit; --help shows it if it is in the range
    const char *preset_text; // default, for what is not one number
    bool idle;               // accepted and without effect
    ArgumentHandler *handler;
    const struct ArgumentRow *rows;
    const char *help;
} ArgumentRow;

typedef struct ArgumentTable {
    const char *program;     // "pliantd"
    const char *usage;       // what follows the options, one form a line; NULL: nothing
    const char *about, *end; // sentences before and after the list of --help
    const ArgumentRow *rows;
    // Completes the values and refuses those that do not go together, in a sentence; may be NULL.
    bool (*check)(void *target, Status *why);
} ArgumentTable;

// Stores defaults, then values in their order. Returns true if the program must run. Else what was
// asked for is printed, or the status has what was refused: "PROGRAM: --option 'value' why (see
// PROGRAM --help)". Not for several threads.
bool arguments_parse(const ArgumentTable *table, int argc, char **argv, void *target,
                     Status *status);
// For a program that does not run: prints the refusal, if there is one; returns the exit code.
int arguments_exit(const Status *status);

// --- rows of several programs; the offset is that of a const char * ---

extern const ArgumentRow ARGUMENTS_SCENE[];     // the operand SCENE.cfg, one
extern const ArgumentRow ARGUMENTS_ISA[];       // --isa: "auto" or a level that this machine has
extern const ArgumentRow ARGUMENTS_LOG_LEVEL[]; // --log-level, which sets the level; no member

// --- values ---

// True for letters, digits, _ and -.
static inline bool is_name_character(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
}

// True for 1 to `most` letters, digits, _ and -: what may be part of a channel's name, since
// subscriptions are patterns.
bool argument_is_name(const char *text, size_t most);
// Read the whole text, numbers separated by commas; false if one is not finite or outside.
bool argument_read_numbers(const char *text, int count, double low, double high, double *number);
bool argument_read_integer(const char *text, double low, double high, long long *number);

#endif
