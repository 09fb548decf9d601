// SPDX-License-Identifier: MIT
// Output files. A program replaces only files that it wrote itself, and never follows a link at a
// temporary's name. Any thread but the step thread.
#ifndef PLIANT_BASE_OUTPUT_H
#define PLIANT_BASE_OUTPUT_H

#include "base/check.h"

#include <stdio.h>

// True if PATH may be replaced: it is absent, an empty file, a device such as /dev/null, or a
// regular file that begins with `mark`, as ours do. Otherwise (other files, links, folders, pipes)
// false with `status` (STATUS_INVALID). `mark` "": only an absent or empty file.
bool output_check(const char *path, const char *mark, Status *status);

// Returns the file name for the next of several runs, to be freed by the caller: PATH if neither it
// nor a numbered one has content yet, else PATH with the next number before its extension: run.h5,
// run-2.h5, run-3.h5. A device keeps its name.
char *output_next(const char *path);

// Returns the name of the file that was at PATH before, PATH.1, to be freed by the caller.
char *output_former(const char *path);

// A file name that one program writes again and again as long as it runs. The claim is a lock on
// the file, or on PATH.tmp while there is no file; it moves on to each file that replaces it.
typedef struct OutputClaim {
    const char *path, *mark; // owned by the caller
    int fd;                  // the locked file; -1: none
    bool waits;              // `fd` is PATH.tmp, because there is no file yet
    bool device;             // any number of programs may write to it
    bool keeps;              // the file that is replaced stays, under the name output_former
} OutputClaim;

// Claims PATH after output_check. False with `status` (STATUS_INVALID) also if another running
// program has claimed it; the claim of a killed program has ended. On file systems without locks
// every claim succeeds.
bool output_claim(OutputClaim *claim, const char *path, const char *mark, Status *status);
// Ends a claim; one that was never made ({0}) is allowed. Removes PATH.tmp if nothing was written.
void output_release(OutputClaim *claim);

// A file that is written completely under a temporary name, PATH.tmp, and then renamed.
typedef struct Output {
    int fd; // open for writing
    char *path, *temporary;
    bool device;        // written in place, without a temporary
    OutputClaim *claim; // or NULL
} Output;

// Opens PATH.tmp, empty and locked until it is closed, after output_check of PATH. A temporary that
// a killed program left behind is reused if it begins with `mark`; any other file of that name is
// not touched. False with `status`.
bool output_begin(Output *output, const char *path, const char *mark, Status *status);
// The same for a claimed name; claims it again if the locked file was removed or replaced. The
// claim outlives the output.
bool output_begin_claimed(Output *output, OutputClaim *claim, Status *status);
// Renames the temporary to PATH; with `durable` after flushing file and folder to the disk. On
// failure closes and removes the temporary. False with `status`.
bool output_commit(Output *output, bool durable, Status *status);
// Closes and removes the temporary.
void output_abandon(Output *output);

// Writes all bytes, restarting after interrupts; false with errno.
bool output_write(const Output *output, const void *data, size_t size);
// The same for a text stream. `whole`: the caller printed everything without error; otherwise the
// file is discarded. NULL or false with `status`.
FILE *output_begin_text(Output *output, const char *path, const char *mark, Status *status);
bool output_end_text(Output *output, FILE *text, bool whole, bool durable, Status *status);

// Locks a whole file for writing by fcntl with these commands (F_SETLK and F_GETLK, or of OFD).
// Returns false if another has locked it; true also where there are no locks.
bool output_lock(int fd, int set, int get);

#endif
