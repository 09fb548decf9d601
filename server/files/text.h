// A text file being read word by word, with the line of each word for error texts. Files thread or
// load time; private to the files room.
#ifndef PLIANT_FILES_TEXT_H
#define PLIANT_FILES_TEXT_H

#include "base/status.h"

#include <stddef.h>

// A whole file in memory, at most INT_MAX bytes, so that lines and elements count in an int.
typedef struct FileBytes {
    const char *path;
    char *bytes; // [size + 1], a 0 behind the last
    size_t size;
} FileBytes;

typedef struct Text {
    const char *path;
    const char *at;  // next character
    const char *end; // *end is 0
    int line;        // of `at`, from 1
} Text;

// A word: characters without blanks. size 0: there is none.
typedef struct Word {
    const char *at;
    int size;
    int line;
} Word;

// A cursor at the start of a file, which must outlive it.
Text text_start(const FileBytes *file);
// The next word of the present line; size 0 at the line's end, where a '#' ends it too. A backslash
// before the end of a line joins the next line to it.
Word text_word(Text *text);
// Leaves the present line, whatever is left in it.
void text_next_line(Text *text);
// The next word on this line or a later one; size 0 at the end of the file.
Word text_word_anywhere(Text *text);

// Whether a word is `name`, capitals or not.
bool word_is(Word word, const char *name);
// Reads a whole word as a number, nan and inf included; false for anything else.
bool word_number(Word word, double *value);

// A word as an error text may show it: printable, at most 30 characters.
typedef struct Shown {
    char text[40];
} Shown;
Shown word_show(Word word);

#endif
