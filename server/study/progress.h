// How far a study is, on stderr: on a terminal one line that is rewritten, else a line every tenth.
#ifndef PLIANT_STUDY_PROGRESS_H
#define PLIANT_STUDY_PROGRESS_H

#include <stdbool.h>
#include <stdio.h>

typedef struct Progress {
    FILE *out;
    bool terminal;
    int columns;    // of the terminal
    double begin_s; // clock at the start
    int told;       // last tenth that was told; -1: none
    int width;      // of the line that stands on the terminal
} Progress;

// `now_s`: a clock that only goes forward [s].
void progress_begin(Progress *progress, FILE *out, bool terminal, int columns, double now_s);
// `done` of `count` cases are finished, `name` is the one at work.
void progress_tell(Progress *progress, int done, int count, const char *name, double now_s);
// Takes the line away, before something else is printed.
void progress_end(Progress *progress);

// Seconds that the rest takes if every case takes as long as those done so far; negative: unknown.
double progress_left(double elapsed_s, int done, int count);
// "1:02:03", "2:03"; of a negative time "?". `text` of 32 characters.
const char *progress_clock(double seconds, char *text);

#endif
