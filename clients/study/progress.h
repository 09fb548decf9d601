// Progress of a study on stderr: on a terminal one line that is rewritten, else a line per tenth.
#ifndef PLIANT_STUDY_PROGRESS_H
#define PLIANT_STUDY_PROGRESS_H

#include <stdbool.h>
#include <stdio.h>

typedef struct Progress {
    FILE *out;
    bool terminal;
    int columns;    // of the terminal
    double begin_s; // clock at the start
    int told;       // last tenth that was printed; -1: none
    int width;      // of the line on the terminal
} Progress;

// `now_s`: a monotonic clock [s].
void progress_begin(Progress *progress, FILE *out, bool terminal, int columns, double now_s);
// `done` of `count` cases are finished; `name` is being computed.
void progress_tell(Progress *progress, int done, int count, const char *name, double now_s);
// Removes the line before other output.
void progress_end(Progress *progress);

// Estimates the remaining seconds from the mean of the cases done; negative: unknown.
double progress_left(double elapsed_s, int done, int count);
// Formats "1:02:03" or "2:03"; "?" for a negative time. `text` of 32 characters.
const char *progress_clock(double seconds, char *text);

#endif
