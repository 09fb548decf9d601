// Reads a text file word by word, with the line of each word for error texts. Files thread or load
// time; private to the module files.
#ifndef PLIANT_IO_TEXT_H
#define PLIANT_IO_TEXT_H

#include "base/status.h"

#include <stddef.h>

// A whole file in memory, at most INT_MAX bytes, so that lines and elements count in an int.
typedef struct FileBytes {
    const char *path;
    char *bytes; // [size + 1], followed by a 0
    size_t size;
} FileBytes;

typedef struct Text {
    const char *path;
    const char *at;  // next character
    const char *end; // *end is 0
    int line;        // of `at`, from 1
} Text;

// A word: characters without blanks. size 0: no word.
typedef struct Word {
    const char *at;
    int size;
    int line;
} Word;

// Returns a cursor at the start of a file, which must outlive it.
Text text_start(const FileBytes *file);
// Returns the next word of the current line; size 0 at the line's end, which a '#' marks too. A
// backslash before the end of a line joins it to the next.
Word text_word(Text *text);
// Skips the rest of the current line.
void text_next_line(Text *text);
// Returns the next word on this line or a later one; size 0 at the end of the file.
Word text_word_anywhere(Text *text);

// True if a word is `name`, in either case.
bool word_is(Word word, const char *name);
// Reads a whole word as a number, nan and inf included; returns false for anything else.
bool word_number(Word word, double *value);

// A word for an error text: printable, at most 30 characters.
typedef struct Shown {
    char text[40];
} Shown;
Shown word_show(Word word);

#endif
