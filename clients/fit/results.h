// SPDX-License-Identifier: MIT
// The folder of results that a study or a fit leaves: made, never over what is not ours; its files;
// its pictures, drawn by gnuplot if that is installed.
#ifndef PLIANT_FIT_RESULTS_H
#define PLIANT_FIT_RESULTS_H

#include "base/check.h"

#include <stdbool.h>
#include <stdio.h>

enum { RESULTS_PATH = 4096 };

// The files that one kind of output leaves in its folder.
typedef struct ResultNames {
    const char *kind;     // "study": folders are called study-SUBJECT
    const char *mark;     // what the first file, a table, begins with
    const char *file[16]; // up to NULL
} ResultNames;

// Makes the folder `wanted`, or KIND-SUBJECT for NULL, unless it exists. Refuses a folder that has
// files of these names but no table with the mark, since they are not ours.
bool results_make_folder(const ResultNames *names, const char *subject, const char *wanted,
                         char folder[RESULTS_PATH], Status *status);

// Writes folder/name, and returns it.
const char *results_path(char path[RESULTS_PATH], const char *folder, const char *name);
// Creates folder/name, and closes it; NULL or false with `status`, with its path.
FILE *results_create(const char *folder, const char *name, char path[RESULTS_PATH], Status *status);
bool results_close(FILE *out, const char *path, Status *status);

typedef enum DrawResult { DRAWN, DRAW_NO_GNUPLOT, DRAW_FAILED } DrawResult;

// Runs `program` (found by name, "gnuplot") on a script in the folder. A failed picture is no
// failure of the whole; `status` has the reason.
DrawResult results_draw(const char *program, const char *folder, const char *script,
                        Status *status);

#endif
