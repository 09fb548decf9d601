// SPDX-License-Identifier: MIT
// For one source file of a test that runs no programs: `scratch_space`, a folder that lasts from
// its first TEST to its last, by AROUND_ALL(scratch_begin, scratch_end).
#ifndef PLIANT_TESTS_SCRATCH_FOLDER_H
#define PLIANT_TESTS_SCRATCH_FOLDER_H

#include "scratch.h"

static Scratch scratch_space;

static inline int scratch_begin(void **unused)
{
    (void)unused;
    return scratch_create(&scratch_space);
}

static inline int scratch_end(void **unused)
{
    (void)unused;
    scratch_destroy(&scratch_space);
    return 0;
}

// A path in it, valid for the next 15 calls.
static inline const char *scratch_at(const char *name)
{
    static char paths[16][SCRATCH_PATH];
    static int next;
    return scratch_path(&scratch_space, name, paths[next++ % 16]);
}

static inline void scratch_write_text(const char *name, const char *text)
{
    scratch_write(&scratch_space, name, text, strlen(text));
}

#endif
